"""The generator's own statistics: what an effect leaves after the baseline has been refitted.

All signatures are differences of `imposed.impose` on the true motion, whitened by the noise of their channel.
A refit is that of the moved plant: a stiffness that follows a resonance takes up more than its derivative says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import NamedTuple

import numpy as np
import scipy
from numpy.random import Generator

from hdfast.proof.generator.effects import Drive
from hdfast.proof.generator.plant import Array, Plant
from hdfast.proof.generator.responses import Motion, channels, noises, responses
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.whitening import Channels, fit_filters, whiten

REALISATIONS = 8
SMALL, UNKNOWN = 0.01, 10.0
STEPS, SHARES, SETTLED = 16, (1.0, 0.5, 0.25, 0.06), 0.02
FIELDS = {"J_m": ("J_r", "J_w"), "J_l": ("J_f", "J_p")}


class Refit(NamedTuple):
    """A refit of the baseline to a drive it cannot describe.

    Attributes:
        left: what it leaves, whitened (rows,).
        raw: the same in the units of the channels.
        shift: of the baseline quantities, in prior sigma (P,).
        whole: norm of the whitened signature before the refit.
        slopes: linearisation of the plant at which slopes were last taken.
    """

    left: Array
    raw: Array
    shift: Array
    whole: float
    slopes: Linearisation

    @property
    def cost(self) -> float:
        """Square of what is left, and of the shift in prior sigma."""
        return float(self.left @ self.left + self.shift @ self.shift)

    @property
    def visibility(self) -> float:
        """Share of the signature's energy that is left."""
        return float(self.left @ self.left / self.whole**2)


@dataclass(frozen=True)
class Linearisation:
    """Whitened statistics of one campaign.

    Attributes:
        rig: its rig.
        drive: the truth without the effect.
        motions: of the recordings used.
        filters: whitening filter and noise level per channel.
        columns: whitened baseline columns, scaled to their prior (rows, P).
        names: of the columns; those of the plant are `moved`'s, the others are linear.
        raw: the same columns unwhitened.
        noise: whitened noise realisations (rows, R).
        level: raw noise rms per channel.
        basis: Cholesky factor of columns' columns + 1, the prior being 1 in these units.
        base: channels of each recording without the effect.
    """

    rig: Rig
    drive: Drive
    motions: list[Motion]
    filters: list[tuple[Array, float]]
    columns: Array
    names: list[str]
    raw: Array
    noise: Array
    level: list[float]
    basis: Array
    base: Channels

    def signature(self, drive: Drive) -> tuple[Array, Array]:
        """Whitened and raw difference that `drive` makes against the truth without the effect."""
        raw = [
            [a - b for a, b in zip(new, old, strict=True)]
            for new, old in zip(responses(self.rig, drive, self.motions), self.base, strict=True)
        ]
        return whiten(self.rig, self.motions, self.filters, raw), np.concatenate(
            [x for recording in raw for x in recording]
        )

    def left(self, whitened: Array) -> Array:
        """What a refit of the baseline, linear and held by its priors, leaves."""
        return np.asarray(whitened - self.columns @ self.shift(whitened))

    def shift(self, whitened: Array) -> Array:
        """Shift of the baseline parameters in such a refit, in prior sigma."""
        return np.asarray(scipy.linalg.cho_solve((self.basis, True), self.columns.T @ whitened))

    def refit(self, drive: Drive, starts: Sequence[Array] = (), slopes: Linearisation | None = None) -> Refit:
        """Refit of the baseline to `drive` with the plant itself moved: damped Gauss-Newton steps.

        Slopes are kept as long as they keep half of what they promise.

        Args:
            drive: the truth with its effects.
            starts: shifts (P,) in prior sigma, of which the best is the first one where it is better than none.
            slopes: linearisation whose slopes come first there; those at the start where none is given.
        """
        signature = self.signature(drive)
        none = Refit(*signature, np.zeros(len(self.names)), float(np.linalg.norm(signature[0])), self)
        best = min([none, *(self._refitted(signature, none, start) for start in starts)], key=lambda tried: tried.cost)
        if best is not none:
            best = best._replace(slopes=slopes or self.sloped(best.shift))
        fresh = False
        for _ in range(STEPS):
            here = best.slopes
            pull = here.columns.T @ best.left - best.shift
            step = scipy.linalg.cho_solve((here.basis, True), pull)
            promised, last = float(pull @ step), best
            tries = (self._refitted(signature, last, share * step) for share in SHARES)
            best = next((tried for tried in tries if tried.cost < last.cost), last)
            kept = last.cost - best.cost
            if min(promised, kept if fresh else promised) <= SETTLED * best.cost:
                break
            fresh = kept < 0.5 * promised
            best = best._replace(slopes=self.sloped(best.shift) if fresh else here.turned(last, best))
        return best

    def turned(self, last: Refit, best: Refit) -> Linearisation:
        """Broyden's update: the same with slopes that say what the step between two refits has changed."""
        step = best.shift - last.shift
        columns = self.columns + np.outer(last.left - best.left - self.columns @ step, step / (step @ step))
        return replace(self, columns=columns, basis=_basis(columns))

    def _refitted(self, signature: tuple[Array, Array], last: Refit, step: Array) -> Refit:
        """One step further, with the channels of the plant that it gives."""
        shift = last.shift + step
        plant = moved(self.rig, self.drive.plant, shift)
        white, raw = self.signature(self.drive._replace(plant=plant))
        linear = slice(len(self.rig.sigma) + 2 * plant.te_order.size, None)
        white, raw = (x + columns[:, linear] @ shift[linear] for x, columns in ((white, self.columns), (raw, self.raw)))
        return last._replace(left=signature[0] - white, raw=signature[1] - raw, shift=shift)

    def sloped(self, shift: Array) -> Linearisation:
        """The same at a shifted plant (P,) [prior sigma]: its columns and its channels."""
        drive = self.drive._replace(plant=moved(self.rig, self.drive.plant, shift))
        there = replace(self, drive=drive, base=list(responses(self.rig, drive, self.motions)))
        columns = self.columns.copy()
        for k, (_, change) in enumerate(_plant_columns(there)):
            columns[:, k] = whiten(self.rig, self.motions, self.filters, change)
        return replace(there, columns=columns, basis=_basis(columns))

    def inflation(self, left: Array) -> float:
        """Variance of the noise along a direction, in units of white noise."""
        along = self.noise.T @ left / np.linalg.norm(left)
        return float(max(np.mean(along**2), 0.5))


def linearise(rig: Rig, drive: Drive, motions: list[Motion], rng: Generator) -> Linearisation:
    """Baseline columns, whitening and noise realisations for one campaign."""
    inertia = drive.plant.J_r + drive.plant.J_w
    realisations = [noises(rig, motions, rng, inertia) for _ in range(REALISATIONS)]
    filters = fit_filters([row for realisation in realisations[:4] for row in realisation])
    level = [
        float(np.sqrt(np.mean(np.concatenate([row[k] for row in realisations[0]]) ** 2))) for k in range(len(filters))
    ]
    empty = np.empty((0, 0))
    base = list(responses(rig, drive, motions))
    lin = Linearisation(rig, drive, motions, filters, empty, [], empty, empty, level, empty, base)
    names, white, raw = [], [], []
    for name, column in chain(_plant_columns(lin), _linear_columns(rig, base)):
        names.append(name)
        white.append(whiten(rig, motions, filters, column))
        raw.append(np.concatenate([x for recording in column for x in recording]))
    columns = np.column_stack(white)
    noise = np.column_stack([whiten(rig, motions, filters, realisation) for realisation in realisations])
    return replace(lin, columns=columns, names=names, raw=np.column_stack(raw), noise=noise, basis=_basis(columns))


def moved(rig: Rig, plant: Plant, shift: Array) -> Plant:
    """The plant with its baseline quantities shifted by so many prior sigma: parameters, then lines of the error."""
    factors = zip(rig.sigma.items(), shift, strict=False)
    scaled = {
        field: getattr(plant, field) * np.exp(sigma * x)
        for (name, sigma), x in factors
        for field in FIELDS.get(name, (name,))
    }
    first, lines = len(rig.sigma), plant.te_order.size
    cos, sin = shift[first : first + 2 * lines].reshape(lines, 2).T
    vector = plant.te_amplitude * np.exp(1j * plant.te_phase) + rig.error_sigma * (cos - 1j * sin)
    return plant._replace(**scaled, te_amplitude=np.abs(vector), te_phase=np.angle(vector))


def _basis(columns: Array) -> Array:
    return np.asarray(scipy.linalg.cholesky(columns.T @ columns + np.eye(columns.shape[1]), lower=True))


def _plant_columns(lin: Linearisation) -> Iterator[tuple[str, Channels]]:
    """Change of the channels by one prior sigma of each quantity of the plant."""
    rig, plant = lin.rig, lin.drive.plant
    names = [*rig.sigma, *(f"te_{part}_{order:g}" for order in plant.te_order for part in ("cos", "sin"))]
    for k, name in enumerate(names):
        shift = np.zeros(len(names))
        shift[k] = SMALL / rig.sigma.get(name, SMALL)
        new = responses(rig, lin.drive._replace(plant=moved(rig, plant, shift)), lin.motions)
        pairs = zip(new, lin.base, strict=True)
        yield name, [[(a - b) / shift[k] for a, b in zip(x, y, strict=True)] for x, y in pairs]


def _linear_columns(rig: Rig, base: Channels) -> Iterator[tuple[str, Channels]]:
    """Change of the channels by one prior sigma of the torque's scale and of each zero, which no campaign states."""
    scaled = [[rig.torque_sigma * x[0]] + [0 * y for y in x[1:]] for x in base]
    yield "torque_scale", scaled
    wide = [UNKNOWN * max(float(np.ptp(x[j])) for x in base) for j in range(len(base[0]))]
    for index, name in enumerate(channels(rig)):
        for k in range(len(base)):
            yield (
                f"offset_{name}_{k}",
                [
                    [np.full_like(y, wide[j]) if j == index and r == k else 0 * y for j, y in enumerate(x)]
                    for r, x in enumerate(base)
                ],
            )
