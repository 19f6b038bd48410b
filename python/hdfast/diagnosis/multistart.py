"""The nominal model of a campaign, fitted from more than one start."""

from __future__ import annotations

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.metric import Metric
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.structure import Structure
from hdfast.spring import COEFFICIENTS

DRAWS = 64
#: What makes the resonance of the load, which a fit may follow into a valley of its own.
RESONANT = ("J_l", "B_l", "B_sp", *(name for names in COEFFICIENTS.values() for name in names))


def multistart(replay: Replay, structure: Structure) -> Fit:
    """The better of the fit from the centre of the priors and of that from the best of many draws of them.

    A resonance that is stated beside the true one leaves a fit in a valley of its own: the vibration that is recorded
    and the one that is simulated have nothing in common there, and damping makes them alike. A rigid drive has no
    resonance, and one valley.

    Args:
        replay: recordings.
        structure: the nominal model.
    """
    first = fit(replay, structure)
    drawn = [j for j, name in enumerate(structure.names) if name in RESONANT]
    if structure.model.base == "one_inertia" or not drawn:
        return first
    metric = Metric.about(replay, first)
    starts = np.tile(first.coordinates, (DRAWS, 1))
    starts[:, drawn] = structure.start[drawn] + structure.sigma[drawn] * _normal(len(drawn))
    best = metric.best_start(replay, structure, starts)
    if best is None:
        return first
    return metric.best_fit(replay.layout, [first, fit(replay, structure, best, ahead=first)])


def _normal(dimensions: int) -> Floats:
    """Standard normal points (DRAWS, dimensions), evenly spread and always the same."""
    return np.asarray(scipy.stats.norm.ppf(scipy.stats.qmc.Sobol(dimensions, seed=0).random(DRAWS)))
