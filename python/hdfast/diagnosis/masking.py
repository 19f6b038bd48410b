"""Parameters that had swallowed a missing effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.structure import NUISANCE

FAR = 3.0
MOVED_SIGMAS = 2.0
MOVED_SHARE = 0.02


@dataclass(frozen=True)
class Masked:
    """A parameter before and after the missing physics was added."""

    parameter: str
    baseline: float
    extended: float
    prior: float
    unit: str


def masked(before: Fit, after: Fit, layout: Layout) -> list[Masked]:
    """Parameters that moved by more than their uncertainty when the effects were added."""
    sigma = np.sqrt(np.diag(after.covariance(layout)))
    found = []
    for j, free in enumerate(after.structure.free):
        if free.name not in before.structure.names or free.name in NUISANCE:
            continue
        i = before.structure.names.index(free.name)
        shift = abs(float(before.coordinates[i] - after.coordinates[j]))
        size = free.sigma if not free.positive else 1.0
        if shift > MOVED_SIGMAS * sigma[j] and shift > MOVED_SHARE * size:
            found.append(Masked(free.name, before.value(free.name), after.value(free.name), free.value, free.unit))
    return found


def pulled(fitted: Fit) -> list[str]:
    """Parameters of the drive that the recordings drag away from their priors."""
    far = dict(zip(fitted.structure.names, fitted.pulls > FAR, strict=True))
    return [name for name, own in far.items() if own and name not in NUISANCE]
