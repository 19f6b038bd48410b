"""Output-error fit of a structure: Gauss-Newton with priors, robust weights and coloured residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, Weights, limited, weigh
from hdfast.diagnosis.plant import TORQUE, TORQUE_SCALE, Plant, Structure
from hdfast.diagnosis.source import Mask
from hdfast.diagnosis.stir import Stir, information
from hdfast.diagnosis.whiten import Whitener, whiten
from hdfast.scenario_parts import MAX_TORQUE

STEP = 2e-3
#: In a gap the load rattles as chance has it, and so do slopes over small steps. They are taken across so many
#: standard deviations, at most over so much.
RATTLING = frozenset({"backlash"})
ACROSS, WIDEST = 8.0, 0.2
ROUNDS = 8
CHORDS = 2
SHRINK = (1.0, 0.25)
CAREFUL = (*SHRINK, 0.06)
SETTLED = 0.05
NEAR = 1.5
VALLEY = 0.5
SHAKES = 2
#: Squared distance in standard deviations within which slopes are alike.
BESIDE = 1.0
#: By how much a law that is not quite the drive's widens an interval: on 110 opened blind cases those of the covariance
#: alone held 79 % of the effects' sizes and 67 % of the drive's parameters where 90 % are meant.
FORM = 1.5
#: What the noise of the angle adds to the load side [nats] below which it moves no parameter.
LOUD = 2.0
#: The least share that a slope without the noise is taken to have.
LEAST_TOLD = 0.02
ACCELERATED = ("J_m", "J_l", TORQUE_SCALE, "load_dependent_friction_c_drive", "load_dependent_friction_c_back")
#: Where a signal of the load side tells of the resonance, what the torque alone would say of it is noise as well.
SHAKEN = (*ACCELERATED, "k1", "K1", "K2", "K3", "B_sp")


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted structure.

    Attributes:
        structure: what was fitted.
        coordinates: estimate, shape (P,).
        mismatch: measured minus simulated at the estimate, in the channels' units, shape (N,).
        slopes: derivative of the simulated signals with respect to the coordinates, shape (N, P).
        rough: noise of the acceleration in those derivatives, left out of `slopes`, shape (N, P).
        weights: scale and colour of the mismatch.
        white: filter to independent samples of unit variance.
        stir: what the noise of the angle adds on the load side, nothing where that hardly counts.
    """

    structure: Structure
    coordinates: Floats
    mismatch: Floats = field(repr=False)
    slopes: Floats = field(repr=False)
    rough: Floats = field(repr=False)
    weights: Weights
    white: Whitener = field(repr=False)
    stir: Stir = field(repr=False)

    def value(self, name: str) -> float:
        """A parameter's estimate; a fixed parameter's value."""
        if name in self.structure.names:
            return float(self.structure.values(self.coordinates)[name])
        return float(self.structure.fixed[name])

    @property
    def stiffness(self) -> float:
        """Of the mesh at small windup [N m/rad]."""
        return self.value("K1" if self.structure.model.spring == "piecewise" else "k1")

    @property
    def pulls(self) -> Floats:
        """How far each coordinate is from its prior centre, in prior standard deviations, shape (P,)."""
        return np.asarray(np.abs(self.coordinates - self.structure.start) / self.structure.sigma)

    def covariance(self, layout: Layout) -> Floats:
        """Covariance of the coordinates (P, P): block sandwich, never below the Fisher information's."""
        A, r = self.white(layout, self.slopes), self.white(layout, self.mismatch)
        stir = self.stir.whitened(layout, self.white)
        bread = np.linalg.inv(information(self.structure, A, stir))
        scores = layout.sums(A * r[:, None] - stir.slopes * stir.added[:, None])
        correction = layout.blocks / max(1, layout.blocks - 1)
        prior = np.diag(self.structure.sigma**-2)
        sandwich = bread @ (correction * scores.T @ scores + prior) @ bread
        larger = np.sqrt(np.maximum(np.diag(sandwich) / np.diag(bread), 1.0))
        covariance: Floats = bread * np.outer(larger, larger)
        return covariance

    def sigma_of(self, layout: Layout) -> dict[str, float]:
        """Standard deviation of each free parameter in its own unit, for laws that are not quite the drive's.

        Never beyond the prior's, where the fit's own is not.
        """
        names, covariance = self.structure.names, self.covariance(layout)
        found = {}
        for j, free in enumerate(self.structure.free):
            parts = [j] if free.times is None else [j, names.index(free.times)]
            own = float(np.sqrt(covariance[np.ix_(parts, parts)].sum()))
            deviation = min(FORM * own, max(own, float(np.linalg.norm(self.structure.sigma[parts]))))
            found[free.name] = deviation * (self.value(free.name) if free.positive else 1.0)
        return found


@dataclass(frozen=True, eq=False)
class Bench:
    """What a fit needs besides the structure.

    Attributes:
        plant: the recordings.
        layout: their stacking.
        floor: standard deviation of each channel's noise as its highest frequencies show it, shape (C,).
        stated: the same as its sensors state it, shape (C,).
    """

    plant: Plant
    layout: Layout
    floor: Floats
    stated: Floats

    def commanded(self, fitted: Fit) -> Bench:
        """The same with the quiet part of the torque that a fitted model needs in place of the recorded one.

        The rest carries the noise of the angle, which a controller answers to: it would look like a late actuator, or
        like a gain that varies. The recorded one stays where the model needs none that a drive could have.
        """
        needed = self.plant.needed(fitted.structure, fitted.coordinates)
        torques = [self.plant.band.quiet(torque) for torque in needed]
        if not all(np.all(np.abs(torque) < MAX_TORQUE) for torque in torques):
            return self
        units = [unit.commanded(torque) for unit, torque in zip(self.plant.units, torques, strict=True)]
        return replace(self, plant=replace(self.plant, units=units))

    @cached_property
    def shaken(self) -> tuple[Bench, ...]:
        """The same recordings, replayed with more of the noise of the angle that they show, a few times."""
        return tuple(self._shaken(draw) for draw in range(SHAKES))

    def _shaken(self, draw: int) -> Bench:
        units = [
            unit.shaken(self.plant.band, np.random.default_rng([draw, number]))
            for number, unit in enumerate(self.plant.units)
        ]
        return replace(self, plant=replace(self.plant, units=units))

    def mismatch(self, structure: Structure, coordinates: Floats) -> Floats:
        """Stacked mismatches (M, N) at coordinates (M, P)."""
        return self.layout.stack(self.plant.mismatch(structure, coordinates))

    def steady(self, structure: Structure, coordinates: Floats) -> Floats:
        """As `mismatch`, with the slow part of the torque alone.

        An acceleration holds the angle's noise, as the mismatch does: only the slow part of a torque that is made of it
        is motion. A fit that could use the rest would find every inertia too small.
        """
        return self.layout.stack(self._slow(self.plant.mismatch(structure, coordinates)))

    @cached_property
    def load_side(self) -> Mask:
        """Which stacked samples are the load side's, shape (N,)."""
        mask: Mask = self.layout.channel != self.layout.channels.index(TORQUE)
        return mask

    def added(self, structure: Structure, coordinates: Floats, mismatch: Floats) -> Floats:
        """What more noise of the angle adds to mismatches (M, N) of the load side at coordinates (M, P)."""
        return np.where(self.load_side, self.shaken[0].mismatch(structure, coordinates) - mismatch, 0.0)

    def disturbed(self, structure: Structure, coordinates: Floats) -> tuple[Floats, Floats]:
        """Mismatches (M, N) at coordinates (M, P), and what more noise of the angle adds to them, simulated at once."""
        found, units = self._with_noise.mismatch(structure, coordinates), len(self.plant.units)
        still, moved = (self.layout.stack(half) for half in (found[:units], found[units:]))
        return still, moved - still

    @cached_property
    def _with_noise(self) -> Plant:
        return replace(self.plant, units=[*self.plant.units, *self.shaken[0].plant.units])

    def both(self, structure: Structure, coordinates: Floats, rows: Sequence[int]) -> tuple[Floats, Floats]:
        """Mismatches (M, N) at coordinates (M, P), and those of some rows (R, N) as `steady` has them."""
        found = self.plant.mismatch(structure, coordinates)
        some = [{name: own[rows] for name, own in unit.items()} for unit in found]
        return self.layout.stack(found), self.layout.stack(self._slow(some))

    def _slow(self, found: Sequence[Mapping[str, Floats]]) -> list[dict[str, Floats]]:
        slow = self.plant.band.slow
        return [{name: slow(own) if name == TORQUE else own for name, own in unit.items()} for unit in found]


@dataclass(frozen=True, eq=False)
class Metric:
    """What a fit makes small: the bulk of the mismatch in independent samples, and near the noise its fine structure.

    The bulk alone overlooks what stands out only between the frequencies of the noise; but far from the noise a
    whitened fit would leave the slow mismatch as it is, since that predicts itself, and would lower the inertia to
    quieten the acceleration.

    Attributes:
        weights: scale and colour.
        white: filter to independent samples of unit variance.
        fine: share of the whitened mismatch of each channel, 0 to a half, shape (C,).
    """

    weights: Weights
    white: Whitener
    fine: Floats

    @classmethod
    def of(cls, bench: Bench, mismatch: Floats) -> Metric:
        """For the noise that a mismatch (N,) shows."""
        layout = bench.layout
        weights = weigh(layout, mismatch, bench.floor)
        fine = 0.5 * near(bench, weights.scale)
        return cls(weights, whiten(layout, mismatch, bench.floor), fine)

    def of_columns(self, layout: Layout, stacked: Floats) -> Floats:
        """Both parts of (N,) or (N, P), one after the other: (2N,) or (2N, P)."""
        fine = self.fine[layout.channel]
        bulk = self.weights.normalise(layout, np.sqrt(1.0 - fine) * stacked.T).T
        return np.asarray(np.concatenate([bulk, (np.sqrt(fine) * self.white(layout, stacked).T).T]))

    def cost(
        self, layout: Layout, structure: Structure, x: Floats, mismatch: Floats, stir: Stir | None = None
    ) -> float:
        """Half the weighted sum of squares plus the prior's, less that of what the noise of the angle adds."""
        half, _ = limited(self.of_columns(layout, mismatch))
        pull = (x - structure.start) / structure.sigma
        if stir is None or not stir.loud:
            return float(np.sum(half) + 0.5 * pull @ pull)
        noise = 0.5 * float(np.sum(self.of_columns(layout, stir.added) ** 2))
        return float(np.sum(half) + 0.5 * stir.firmness @ pull**2) - noise


def near(bench: Bench, scale: Floats) -> Floats:
    """How far mismatches of this scale are noise, by channel, 0 to 1, shape (C,)."""
    return np.asarray(np.minimum(1.0, NEAR * bench.stated / scale) ** 4)


def fit(
    bench: Bench,
    structure: Structure,
    start: Floats | None = None,
    known: Fit | None = None,
    ahead: Fit | None = None,
) -> Fit:
    """Fit a structure.

    Args:
        bench: recordings.
        structure: equations and free parameters.
        start: first coordinates (P,); default the prior centre.
        known: an earlier fit whose parameters come first in `structure`; its slopes are kept, and those of the added
            parameters computed alone, until no step with them finds better, and beyond where the fit ends beside it.
        ahead: a fit of the same structure from elsewhere; once in its valley, this one goes on from there.
    """
    layout = bench.layout
    x = structure.start if start is None else np.array(start, dtype=np.float64)
    kept = 0 if known is None else known.slopes.shape[1]
    rattling = rattles(structure)
    steps = WIDEST * _units(structure) if rattling else None
    mismatch, slopes, rough = linearise(bench, structure, x, kept, steps)
    if known is not None:
        slopes[:, :kept], rough[:, :kept] = known.slopes, known.rough
    stir = Stir.none(slopes) if rattling else stirred(bench, structure, x, mismatch, slopes, known)
    for turn in range(ROUNDS):
        metric = Metric.of(bench, mismatch)
        seen = partial(metric.of_columns, layout)
        A = seen(slopes)
        moved = False
        for _ in range(CHORDS):
            step = _step(structure, x, A, seen(mismatch), stir.through(seen))
            trials = x + np.multiply.outer(CAREFUL if rattling else SHRINK, step)
            if stir.loud:
                found, added = bench.disturbed(structure, trials)
                stirs = [replace(stir, added=np.where(bench.load_side, own, 0.0)) for own in added]
            else:
                found, stirs = bench.mismatch(structure, trials), [stir] * len(trials)
            alike = found + (trials - x) @ rough.T
            costs = [metric.cost(layout, structure, *row) for row in zip(trials, alike, stirs, strict=True)]
            here = metric.cost(layout, structure, x, mismatch, stir)
            best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
            if not costs[best] < here - SETTLED:
                break
            moved = True
            x, mismatch = trials[best], found[best]
            stir = stirs[best]
        if turn == ROUNDS - 1 or not (moved or kept):
            break
        if not moved and known is not None and _beside(known, x, information(structure, A, stir.through(seen))):
            break
        if not moved:
            kept = 0
        if ahead is not None and _in_valley(bench, ahead, x, mismatch):
            x, mismatch, stir, ahead = ahead.coordinates, ahead.mismatch, ahead.stir, None
        if steps is not None:
            deviations = np.sqrt(np.diag(np.linalg.inv(information(structure, A))))
            steps = np.minimum(WIDEST * _units(structure), ACROSS * deviations)
        _, fresh, rougher = linearise(bench, structure, x, kept, steps)
        slopes[:, kept:], rough[:, kept:] = fresh[:, kept:], rougher[:, kept:]
        if not (rattling or kept):
            stir = stirred(bench, structure, x, mismatch, slopes)
    metric = Metric.of(bench, mismatch)
    return Fit(structure, x, mismatch, slopes, rough, metric.weights, metric.white, stir)


def rattles(structure: Structure) -> bool:
    """Whether a load moves in a gap, as chance has it: what noise adds there cannot be told."""
    return bool(RATTLING & set(structure.model.terms))


def stirred(
    bench: Bench, structure: Structure, x: Floats, mismatch: Floats, slopes: Floats, known: Fit | None = None
) -> Stir:
    """What one more noise of the angle adds on the load side, and its slopes; nothing where it hardly counts.

    The recorded motion holds such noise, which shakes the simulated load and not the real one. A fit that takes what it
    adds for a mismatch would find every damping too large.

    Args:
        bench: recordings.
        structure: equations and free parameters.
        x: coordinates (P,).
        mismatch, slopes: there, (N,) and (N, P).
        known: an earlier fit whose parameters come first; theirs are kept.
    """
    if not bench.plant.load_side or (known is not None and not known.stir.loud):
        return Stir.none(slopes)
    added = bench.added(structure, x[None], mismatch[None])[0]
    white = Metric.of(bench, mismatch).white
    if not np.sum(white(bench.layout, added) ** 2) > 2.0 * LOUD:
        return Stir.none(slopes)
    kept = 0 if known is None else known.slopes.shape[1]
    felt = np.any(slopes[bench.load_side] != 0.0, axis=0)
    own = [j for j, one in enumerate(structure.free) if j >= kept and felt[j] and not one.name.startswith("te_")]
    found = np.zeros_like(slopes)
    if known is not None:
        found[:, :kept] = known.stir.slopes
    if own:
        steps = (STEP * _units(structure))[own]
        moved = x + np.eye(len(x))[own] * steps[:, None]
        still = mismatch - slopes[:, own].T * steps[:, None]
        found[:, own] = np.nan_to_num((added - bench.added(structure, moved, still)) / steps[:, None]).T
    whole, noise = (np.sum(white(bench.layout, one) ** 2, axis=0) for one in (slopes, found))
    told = np.maximum(whole - noise, LEAST_TOLD * (whole + noise))
    return Stir(added, found, np.where(noise > 0.0, (whole + noise) / np.maximum(told, 1e-300), 1.0))


def _beside(known: Fit, x: Floats, precision: Floats) -> bool:
    """Whether coordinates (P,), of this precision (P, P), are so near an earlier fit's that its slopes are theirs."""
    kept = len(known.coordinates)
    away = x[:kept] - known.coordinates
    return bool(away @ precision[:kept, :kept] @ away < BESIDE)


def _in_valley(bench: Bench, ahead: Fit, x: Floats, mismatch: Floats) -> bool:
    """Whether coordinates (P,) with a mismatch (N,) cost what another fit's slopes say that they do."""
    metric = Metric.of(bench, ahead.mismatch)
    predicted = ahead.mismatch - (ahead.slopes + ahead.rough) @ (x - ahead.coordinates)
    best, here, told = (
        metric.cost(bench.layout, ahead.structure, *pair)
        for pair in ((ahead.coordinates, ahead.mismatch), (x, mismatch), (x, predicted))
    )
    return abs(here - told) <= VALLEY * abs(here - best) + 1.0


def linearise(
    bench: Bench, structure: Structure, x: Floats, kept: int = 0, wide: Floats | None = None
) -> tuple[Floats, Floats, Floats]:
    """Mismatch and slopes of the simulated signals by differences; those of the first `kept` stay 0.

    Args:
        bench: recordings.
        structure: equations and free parameters.
        x: coordinates (P,).
        kept: how many parameters, from the first on, are left out.
        wide: steps (P,) to both sides; default small ones to one side.

    Returns:
        Mismatch (N,), slopes (N, P), and the noise of the acceleration that was taken from them (N, P).
    """
    steps = (STEP * _units(structure) if wide is None else wide)[kept:]
    shaken = SHAKEN if bench.plant.load_side else ACCELERATED
    noisy = [j for j, name in enumerate(structure.names) if name in shaken and j >= kept]
    moves = np.zeros((len(steps), len(x)))
    moves[:, kept:] = np.diag(steps)
    higher = 1 + np.arange(len(steps))
    lower = 0 * higher if wide is None else higher + len(steps)
    moved = np.concatenate([x[None], x + moves, *([] if wide is None else [x - moves])])
    own = np.array(noisy, dtype=int) - kept
    stacked, slow = bench.both(structure, moved, [*higher[own], *lower[own]])
    spans = (steps if wide is None else 2.0 * steps)[:, None]
    slopes, rough = np.zeros((bench.layout.size, len(x))), np.zeros((bench.layout.size, len(x)))
    slopes[:, kept:] = -((stacked[higher] - stacked[lower]) / spans).T
    rough[:, noisy] = slopes[:, noisy] + ((slow[: len(own)] - slow[len(own) :]) / spans[own]).T
    return stacked[0], np.nan_to_num(slopes - rough), np.nan_to_num(rough)


def _units(structure: Structure) -> Floats:
    """What steps of the coordinates are multiples of, shape (P,)."""
    return np.array([1.0 if free.positive else free.sigma for free in structure.free])


def _step(structure: Structure, x: Floats, A: Floats, r: Floats, stir: Stir) -> Floats:
    """Gauss-Newton step of the coordinates from weighted slopes (2N, P) and mismatch (2N,), and from the noise's."""
    _, share = limited(r)
    pull = stir.firmness * structure.sigma**-2 * (x - structure.start)
    score = A.T @ (share * r) - pull
    if stir.loud:
        score -= stir.slopes.T @ stir.added
    whole = information(structure, A * np.sqrt(share)[:, None], stir)
    return np.asarray(np.linalg.solve(whole, score), dtype=np.float64)
