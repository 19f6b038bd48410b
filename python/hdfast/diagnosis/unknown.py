"""What none of the named effects explains: a torque of some state variable, smooth or with memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.features import Feature, slowed
from hdfast.diagnosis.fit import Bench, Fit
from hdfast.diagnosis.holdout import Proof, Replay, weigh_up
from hdfast.diagnosis.plant import Free
from hdfast.diagnosis.score import Gain, gain, groups
from hdfast.diagnosis.whiten import whiten

SPREAD = 3.0
FALL = 0.30
GAIN_ERRORS = 5.0


@dataclass(frozen=True, eq=False)
class Unknown:
    """The best description of a mismatch by one state variable.

    Attributes:
        feature: the variable and its memory.
        fit: the model with the additional torque, linearised.
        gain: over the model without it.
        ranking: gain in standard errors of every variable tried, best first.
        proof: on held-out recordings; None without any, or where it does not even predict left-out ones.
    """

    feature: Feature
    fit: Fit = field(repr=False)
    gain: Gain
    ranking: tuple[tuple[str, str, float], ...]
    proof: Proof | None

    @property
    def accepted(self) -> bool:
        """Whether it predicts left-out and held-out recordings clearly better."""
        return self.predicts and (self.proof is None or self.proof.holds)

    @property
    def predicts(self) -> bool:
        """Whether it predicts left-out recordings clearly better."""
        after, before = self.gain.nrmse
        return self.gain.ratio > GAIN_ERRORS and after <= (1.0 - FALL) * before


def describe(bench: Bench, held: Bench | None, fitted: Fit, found: Sequence[Feature], floor: float) -> Unknown | None:
    """The state variable that predicts the mismatch best, None without any; proven on what is held out.

    Args:
        bench: the recordings that are fitted.
        held: the recordings kept for the proof, or None.
        fitted: the model without it.
        found: the variables to try.
        floor: nrmse of the sensor noise on the held-out recordings.
    """
    tried = []
    slow, folds = slowed(bench), groups(bench.plant, bench.layout)
    for feature in found:
        augmented = _augmented(bench, fitted, feature.columns(bench.layout, slow))
        tried.append((feature, augmented, gain(bench, augmented, fitted, folds)))
    if not tried:
        return None
    tried.sort(key=lambda one: one[2].nrmse[0])
    feature, best, gained = tried[0]
    ranking = tuple((one.name, one.memory, own.ratio) for one, _, own in tried)
    unproven = Unknown(feature, best, gained, ranking, None)
    return replace(unproven, proof=_proven(held, fitted, unproven, floor)) if held and unproven.predicts else unproven


def _proven(held: Bench, fitted: Fit, unknown: Unknown, floor: float) -> Proof:
    """Both models, frozen, on the held-out recordings."""
    known = len(fitted.coordinates)
    bench = held.commanded(fitted)
    before, after = bench.mismatch(fitted.structure, np.stack([fitted.coordinates, unknown.fit.coordinates[:known]]))
    columns = unknown.feature.columns(held.layout, slowed(held))
    after = after - columns @ unknown.fit.coordinates[known:]
    return weigh_up(held.layout, unknown.fit.white, Replay(before, before), Replay(after, after), floor)


def _augmented(bench: Bench, fitted: Fit, columns: Floats) -> Fit:
    """The fit with columns (N, d) as further parameters, solved in one linear step."""
    width = columns.shape[1]
    index = bench.layout.channels.index("motor_torque")
    sigma = SPREAD * float(fitted.weights.scale[index])
    free = tuple(Free(f"unknown_{j}", 0.0, sigma, False, "N m") for j in range(width))
    structure = replace(fitted.structure, free=(*fitted.structure.free, *free))
    slopes = np.concatenate([fitted.slopes, columns], axis=1)
    start = np.concatenate([fitted.coordinates, np.zeros(width)])
    A = fitted.weights.normalise(bench.layout, slopes.T).T
    r = fitted.weights.normalise(bench.layout, fitted.mismatch)
    precision = structure.sigma**-2
    step = np.linalg.solve(A.T @ A + np.diag(precision), A.T @ r - precision * (start - structure.start))
    mismatch = fitted.mismatch - slopes @ step
    white = whiten(bench.layout, mismatch, bench.floor)
    rough = np.concatenate([fitted.rough, np.zeros_like(columns)], axis=1)
    return Fit(structure, start + step, mismatch, slopes, rough, fitted.weights, white, np.nan)
