"""What none of the named effects explains: a torque of some state variable, smooth or with memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.diagnosis.evidence import Index
from hdfast.diagnosis.features import Feature
from hdfast.diagnosis.fit import Bench, Fit
from hdfast.diagnosis.plant import Free
from hdfast.diagnosis.score import Gain, gain
from hdfast.diagnosis.whiten import whiten

SPREAD = 3.0
FALL = 0.30
GAIN_ERRORS = 4.0


@dataclass(frozen=True, eq=False)
class Unknown:
    """The best description of a mismatch by one state variable.

    Attributes:
        feature: the variable and its memory.
        fit: the model with the additional torque, linearised.
        gain: over the model without it.
        ranking: gain in standard errors of every variable tried, best first.
    """

    feature: Feature
    fit: Fit = field(repr=False)
    gain: Gain
    ranking: tuple[tuple[str, str, float], ...]

    @property
    def accepted(self) -> bool:
        """Whether it predicts left-out recordings clearly better."""
        after, before = self.gain.nrmse
        return self.gain.ratio > GAIN_ERRORS and after <= (1.0 - FALL) * before


def describe(bench: Bench, fitted: Fit, found: Sequence[Feature], folds: Index) -> Unknown | None:
    """The state variable that predicts the mismatch best; None without any."""
    tried = []
    for feature in found:
        augmented = _augmented(bench, fitted, feature)
        tried.append((feature, augmented, gain(bench, augmented, fitted, folds)))
    if not tried:
        return None
    tried.sort(key=lambda one: one[2].nrmse[0])
    feature, best, gained = tried[0]
    ranking = tuple((one.name, one.memory, own.ratio) for one, _, own in tried)
    return Unknown(feature, best, gained, ranking)


def _augmented(bench: Bench, fitted: Fit, feature: Feature) -> Fit:
    """The fit with the feature's columns as further parameters, solved in one linear step."""
    width = feature.columns.shape[1]
    index = bench.layout.channels.index("motor_torque")
    sigma = SPREAD * float(fitted.weights.scale[index])
    free = tuple(Free(f"unknown_{j}", 0.0, sigma, False, "N m") for j in range(width))
    structure = replace(fitted.structure, free=(*fitted.structure.free, *free))
    slopes = np.concatenate([fitted.slopes, feature.columns], axis=1)
    start = np.concatenate([fitted.coordinates, np.zeros(width)])
    A = fitted.weights.normalise(bench.layout, slopes.T).T
    r = fitted.weights.normalise(bench.layout, fitted.mismatch)
    precision = structure.sigma**-2
    step = np.linalg.solve(A.T @ A + np.diag(precision), A.T @ r - precision * (start - structure.start))
    mismatch = fitted.mismatch - slopes @ step
    white = whiten(bench.layout, mismatch, bench.floor)
    return Fit(structure, start + step, mismatch, slopes, fitted.weights, white, np.nan)
