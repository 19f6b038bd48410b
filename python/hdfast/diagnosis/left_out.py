"""Predictions of stretches of the recordings by refits without them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Index, Layout, inner, limited, members
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.stir import told
from hdfast.diagnosis.whiten import Whitener

FOLDS = 6
FEWEST_GROUPS = 3
NEAR_NOISE = 4.0
FARTHEST = 3.0
NEGLIGIBLE = 1e-6


def folds_near(replay: Replay, error: float, floor: float) -> Index:
    """Fold of every stacked sample by how far an nrmse is from that of the noise.

    Near it every block is one: what tells an effect from the parameters that swallow it may stand in two or three of
    them, and a fold that held them all would leave none to learn it from. Far from it whole recordings: what else is
    wrong with a model differs from one to the next.
    """
    if error <= NEAR_NOISE * floor:
        return replay.layout.block
    return groups(replay.plant, replay.layout)


def groups(plant: Plant, layout: Layout) -> Index:
    """Fold of every stacked sample: whole groups, else whole recordings, else stretches of blocks."""
    owners: list[Hashable] = [unit.group for unit in plant.units]
    if len(set(owners)) < FEWEST_GROUPS:
        owners = list(range(len(plant.units)))
    if len(set(owners)) >= FEWEST_GROUPS:
        labels = {owner: number % FOLDS for number, owner in enumerate(dict.fromkeys(owners))}
        return np.array([labels[owner] for owner in owners])[layout.unit]
    return layout.block * FOLDS // max(layout.blocks, 1)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What a linearised refit without each fold predicts of it.

    Attributes:
        mismatch: of the prediction, in the channels' units, shape (N,).
        filtered: the same whitened.
        unsure: whitened directions in which the refits leave a fold uncertain, and by how much, by fold: samples (n,),
            directions (n, r), standard deviations (r,).
    """

    mismatch: Floats = field(repr=False)
    filtered: Floats = field(repr=False)
    unsure: list[tuple[Index, Floats, Floats]] = field(repr=False)

    def surprise(self, filtered: Floats) -> Floats:
        """Half squares of whitened values (N,) in standard deviations of what was predicted, limited."""
        found = filtered.copy()
        for rows, ways, deviation in self.unsure:
            found[rows] -= ways @ ((1.0 - 1.0 / np.sqrt(1.0 + deviation**2)) * inner(ways, found[rows]))
        return limited(found)[0]

    @property
    def vagueness(self) -> Floats:
        """Nats that a wide prediction costs, by sample, shape (N,)."""
        found = np.zeros(len(self.filtered))
        for rows, ways, deviation in self.unsure:
            found[rows] = 0.5 * ways**2 @ np.log1p(deviation**2)
        return found


def left_out(fit: Fit, white: Whitener, layout: Layout, folds: Index) -> LeftOut:
    """Prediction of each fold after a linearised refit without it, through a filter.

    The refit goes no farther than a few standard deviations: beyond, the slopes mean nothing.
    """
    A, r = white(layout, fit.slopes), white(layout, fit.mismatch)
    _, share = limited(r)
    stir = fit.stir.whitened(layout, white)
    pull = stir.firmness * fit.structure.sigma**-2 * (fit.coordinates - fit.structure.start)
    prior = np.diag(stir.firmness * fit.structure.sigma**-2)
    everything, noise = inner(A, A * share[:, None]) + prior, inner(stir.slopes, stir.slopes)
    whole = told(everything, noise)
    score = inner(A, share * r) - pull - inner(stir.slopes, stir.noise)
    found, filtered, unsure = fit.mismatch.copy(), r.copy(), []
    for rows in members(folds):
        own, feigned = A[rows], stir.slopes[rows]
        without = told(everything - own.T @ (own * share[rows, None]), noise - feigned.T @ feigned)
        shift = np.linalg.solve(without, score - own.T @ (share[rows] * r[rows]) + feigned.T @ stir.noise[rows])
        reach = float(np.sqrt(np.maximum(shift @ whole @ shift, 0.0)))
        shift *= min(1.0, FARTHEST * np.sqrt(len(shift)) / max(reach, 1e-300))
        found[rows] -= fit.slopes[rows] @ shift
        filtered[rows] -= own @ shift
        unsure.append((rows, *_unsure(own, without)))
    return LeftOut(found, filtered, unsure)


def _unsure(slopes: Floats, known: Floats) -> tuple[Floats, Floats]:
    """Directions (n, r) and standard deviations (r,) of what coordinates of this information make of slopes (n, P).

    None where a drive cannot be simulated: nothing is predicted there.
    """
    if not np.isfinite(known).all():
        return np.zeros((len(slopes), 0)), np.zeros(0)
    scale = np.sqrt(np.diag(known))
    sharp, axes = np.linalg.eigh(known / np.outer(scale, scale))
    spread = slopes / scale @ (axes / np.sqrt(np.maximum(sharp, NEGLIGIBLE * sharp[-1])))
    squares, ways = np.linalg.eigh(spread.T @ spread)
    kept = squares > NEGLIGIBLE
    deviation = np.sqrt(squares[kept])
    return spread @ ways[:, kept] / deviation, deviation
