"""What none of the named effects explains: a torque of some state variable, smooth or with memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.accept import FALL, RISE, SPARED, USELESS
from hdfast.diagnosis.changes import attentive
from hdfast.diagnosis.evidence import limited
from hdfast.diagnosis.features import Feature, features, slowed
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.holdout import Proof, replayed, weigh_up
from hdfast.diagnosis.left_out import FOLDS
from hdfast.diagnosis.prepare import Unit
from hdfast.diagnosis.projector import Projector
from hdfast.diagnosis.regressors import TURN
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.rivals import UNKNOWN_FLOOR
from hdfast.diagnosis.score import CONVINCING, Gain, gain, noise_floor, weights_of
from hdfast.diagnosis.statistics import statistics
from hdfast.diagnosis.stir import Stir, information
from hdfast.diagnosis.structure import Free

SPREAD = 3.0
ROUNDS = 3
MANY = 6
CLEAR, CLOSE = 1.3, 0.7
ALONE, ERRORS = 1.6, 5.0
APART = 1e-3
POINTS = 24

Shape = tuple[Feature, Fit, Gain]


@dataclass(frozen=True, eq=False)
class Unknown:
    """The best description of a mismatch by one state variable.

    Attributes:
        feature: the variable and its memory.
        statistic: how far the mismatch follows the variable there, in units of the family-wise 1 % point,
            at least `CLEAR`.
        fit: the model with the additional torque, linearised.
        gain: over the model without it.
        probability: of the variable and its memory against the others that stand out nearly as far.
        ranking: name, memory and statistic of every variable tried, in units of its family-wise 1 % point, best first.
        curve: variable and torque at its place [N m], each (points,); None for a law with memory.
        proof: on held-out recordings; None without any, or where it does not even predict left-out stretches.
    """

    feature: Feature
    statistic: float
    fit: Fit = field(repr=False)
    gain: Gain
    probability: float
    ranking: tuple[tuple[str, str, float], ...]
    curve: tuple[Floats, Floats] | None = field(repr=False)
    proof: Proof | None

    @property
    def accepted(self) -> bool:
        """Whether it stands out, predicts what was left out, and stands on what was held out."""
        return self.predicts and (self.proof is None or self.proof.holds)

    @property
    def predicts(self) -> bool:
        """Whether it stands out of the noise and predicts left-out stretches better, and at all.

        However sure, what hardly lowers the error is a clock, a hold or a filter of the recorder rather than a torque.
        """
        after, before = self.gain.nrmse
        convincing = self.gain.total >= CONVINCING and self.gain.spared >= SPARED
        surely = self.statistic >= ALONE or self.gain.ratio >= ERRORS
        better = max(self.gain.fall, 1.0 - after / before) >= FALL
        return surely and convincing and better and after <= min((1.0 + RISE) * before, USELESS)

    @property
    def open(self) -> bool:
        """Whether it predicts left-out stretches, and what was held out neither lets it stand nor refutes it."""
        return self.predicts and self.proof is not None and not self.proof.holds and not self.proof.refutes

    @property
    def refused(self) -> bool:
        """Whether it is beyond doubt where it was fitted, and refused by what was held out."""
        return self.predicts and self.gain.certain and self.proof is not None and not self.proof.holds

    @property
    def place(self) -> str | None:
        """Where the torque acts; None where motor and load are one inertia."""
        return self.feature.place if self.fit.structure.model.base == "two_inertia" else None

    @property
    def noted(self) -> dict[str, Any]:
        """What a model file says of it: labels, and the curve of a law without memory with the place it counts at."""
        told: dict[str, Any] = {"depends_on": self.feature.name, "memory": self.feature.memory}
        told |= {"place": self.place} if self.place else {}
        if self.curve is not None:
            told["torque_at"] = self.feature.place
            for index, (x, torque) in enumerate(zip(*(values.tolist() for values in self.curve), strict=True)):
                told |= {f"{self.feature.name}_{index}": x, f"torque_N_m_{index}": torque}
        return told


def describe(replay: Replay, held: Replay | None, fitted: Fit, rng: np.random.Generator) -> Unknown | None:
    """The state variable that explains the mismatch best of those that stand out, proven on what is held out.

    Args:
        replay: the recordings that are fitted.
        held: the recordings kept for the proof, or None.
        fitted: the model without it.
        rng: of the null.

    Returns:
        The description, accepted or not; None where no variable stands out.
    """
    replay, slow = replay.commanded(fitted), slowed(replay)
    every = [(one, one.sketch(replay, slow, fitted)) for one in features(replay, slow, fitted)]
    tried = [(one, columns) for one, columns in every if np.isfinite(columns).all() and columns.any()]
    if not tried:
        return None
    heard = attentive(replay, fitted, [columns for _, columns in tried])
    seen = _standing_out(replay, heard, [columns for _, columns in tried], rng)
    largest, folds = float(np.max(seen)), replay.layout.block % FOLDS
    if largest < CLEAR:
        return None
    ranking: dict[tuple[str, str], float] = {}
    reached: dict[tuple[str, str, str], float] = {}
    for index in np.argsort(-seen).tolist():
        one = tried[index][0]
        ranking.setdefault((one.name, one.memory), float(seen[index]))
        reached.setdefault(one.label, float(seen[index]))
    shapes: list[Shape] = []
    for index in np.argsort(-seen).tolist():
        one = tried[index][0]
        alike = sum(one.label == other.label for other, _, _ in shapes)
        if alike < MANY and seen[index] >= CLOSE * largest and reached[one.label] >= CLEAR:
            columns = one.columns(replay, slow, fitted)
            if not np.isfinite(columns).all():
                continue
            extended = _augmented(replay, heard, columns)
            drive = replace(heard, coordinates=extended.coordinates[: len(heard.coordinates)])
            shapes.append((one, extended, gain(replay, extended, heard, folds, drive)))
    if not shapes:
        return None
    feature, extended, gained = _simplest(shapes)
    shares = weights_of([own for _, _, own in shapes], rng)
    same = [(one.name, one.memory) == (feature.name, feature.memory) for one, _, _ in shapes]
    probability = (1.0 - UNKNOWN_FLOOR) * float(shares[same].sum())
    listed = tuple((*key, value) for key, value in ranking.items())
    unproven = Unknown(
        feature, reached[feature.label], extended, gained, probability, listed, _curve(feature, slow, extended), None
    )
    return replace(unproven, proof=_proven(held, fitted, unproven)) if held and unproven.predicts else unproven


def _simplest(shapes: Sequence[Shape]) -> Shape:
    """Of the shapes that predict as well as the best one but for chance, that of the fewest regressors."""
    best = min(shapes, key=lambda shape: shape[2].nrmse[0])

    def behind(shape: Shape) -> Gain:
        return replace(best[2], by_block=best[2].by_block - shape[2].by_block)

    alike = [
        one for one in shapes if one[0].label == best[0].label and behind(one).limited <= behind(one).limited_error
    ]
    return min([best, *alike], key=lambda shape: (shape[0].width, shape[2].nrmse[0]))


def _standing_out(replay: Replay, heard: Fit, columns: Sequence[Floats], rng: np.random.Generator) -> Floats:
    """Statistic of each group of columns (N, d) in the mismatch, in units of its family-wise 1 % point.

    0 for a group that changes no sample which is judged.
    """
    projector = Projector(heard, replay.layout)
    left = [_independent(projector.left(heard.white(replay.layout, one))) for one in columns]
    told = [index for index, one in enumerate(left) if one.shape[1]]
    reached = np.zeros(len(left))
    if told:
        some = [left[index] for index in told]
        seen = statistics(replay.layout, projector, some, rng, threads=replay.plant.threads)
        reached[told] = seen.observed / (seen.rare * np.quantile(seen.largest, 0.99))
    return reached


def _independent(columns: Floats) -> Floats:
    """Columns (N, d') at right angles that span (N, d) without what a refit all but absorbs."""
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(basis[:, size > APART * size[0]])


def _proven(held: Replay, fitted: Fit, unknown: Unknown) -> Proof:
    """Both models, frozen, on the held-out recordings.

    What these can show is what the torque itself does there, not what a refit of the drive does: recordings that stay
    away from the end of a travel cannot refuse a spring there.
    """
    known = len(fitted.coordinates)
    named = replace(fitted, coordinates=unknown.fit.coordinates[:known])
    before, after = (replayed(held, one, fitted) for one in (fitted, named))
    columns = unknown.feature.columns(held.commanded(named), slowed(held), named)
    added = columns @ unknown.fit.coordinates[known:]
    extended = replace(after, mismatch=after.mismatch - added)
    margin = unknown.gain.limited - 2.0 * unknown.gain.limited_error
    proof = weigh_up(held.layout, unknown.fit.white, before, extended, noise_floor(held), margin)
    own = held.layout.sums(0.5 * unknown.fit.white(held.layout, added) ** 2)
    return replace(proof, expected=replace(proof.expected, by_block=own))


def _curve(feature: Feature, slow: Sequence[Unit], extended: Fit) -> tuple[Floats, Floats] | None:
    """State variable and torque at its place [N m], medians of `POINTS` equal shares of the recordings' samples.

    Angles are within one turn where the recordings make one. The torque is about its mean: levels are not known. None
    for a law with memory.
    """
    of = feature.variable
    if of is None:
        return None
    x = np.concatenate([of(unit) for unit in slow])
    if feature.name.endswith("_phase") and np.ptp(x) > TURN:
        x = np.mod(x, TURN)
    own = extended.coordinates[-feature.width :]
    behind = extended.value("ratio") if feature.place == "load" else 1.0
    torque = behind * np.concatenate([feature.torque(unit, own) for unit in slow])
    torque -= torque.mean()
    parts = [part for part in np.array_split(np.argsort(x, kind="stable"), POINTS) if part.size]
    medians = np.array([(np.median(x[part]), np.median(torque[part])) for part in parts])
    return medians[:, 0], medians[:, 1]


def _augmented(replay: Replay, heard: Fit, columns: Floats) -> Fit:
    """The fit with columns (N, d) as further parameters, solved linearly through the filter of what they leave."""
    layout, width = replay.layout, columns.shape[1]
    sigma = SPREAD * float(heard.weights.scale[layout.channels.index("motor_torque")])
    free = tuple(Free(f"unknown_{j}", 0.0, sigma, False, "N m") for j in range(width))
    structure = replace(heard.structure, free=(*heard.structure.free, *free))
    slopes = np.concatenate([heard.slopes, columns], axis=1)
    rough = np.concatenate([heard.rough, np.zeros_like(columns)], axis=1)
    start = np.concatenate([heard.coordinates, np.zeros(width)])
    stir = Stir(
        heard.stir.noise,
        np.concatenate([heard.stir.slopes, np.zeros_like(columns)], axis=1),
        np.concatenate([heard.stir.firmness, np.ones(width)]),
    )
    seen = stir.whitened(layout, heard.white)
    pull = stir.firmness * structure.sigma**-2 * (start - structure.start)
    A, r = heard.white(layout, slopes), heard.white(layout, heard.mismatch)
    step: Floats = np.zeros(len(start))
    for _ in range(ROUNDS):
        _, share = limited(r - A @ step)
        score = A.T @ (share * r) - pull - seen.slopes.T @ seen.noise
        whole = information(structure, A * np.sqrt(share)[:, None], seen)
        step = np.asarray(np.linalg.solve(whole, score), dtype=np.float64)
    mismatch = heard.mismatch - (slopes + rough) @ step
    stir = replace(stir, noise=stir.noise - stir.slopes @ step)
    return Fit(structure, start + step, mismatch, slopes, rough, heard.weights, heard.white, stir)
