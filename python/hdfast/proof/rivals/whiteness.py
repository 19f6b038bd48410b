"""Residual tests of a textbook: whiteness and independence of the inputs; they say "something" and name nothing.

L. Ljung, System Identification: Theory for the User, 2nd edition, Prentice Hall 1999, section 16.6; the portmanteau
statistic is that of G. M. Ljung and G. E. P. Box, Biometrika 65 (1978) 297.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.session import Setup
from hdfast.proof.rivals.said import Said

LEVEL = 0.01
LAGS = 25


def answer(setup: Setup, calibrated: Fit) -> Said:
    """An alarm where any test of any recording and channel rejects at 99 % over all of them."""
    p = np.array(list(_tests(setup.replay, calibrated.mismatch)))
    alarm = bool(p.size) and bool(p.min() < LEVEL / p.size)
    return Said("undecided" if alarm else "no_evidence", calibrated)


def _tests(replay: Replay, mismatch: Floats) -> Iterator[float]:
    """The p values of every recording and channel: autocorrelation, and correlation with speed and torque."""
    layout = replay.layout
    for index, _, where in layout.pieces:
        unit, sample = replay.plant.units[index], layout.sample[where]
        yield whiteness(mismatch[where])
        for driven in (unit.speed, unit.command):
            yield independence(mismatch[where], driven[sample])


def whiteness(residual: Floats) -> float:
    """The p value of the first `LAGS` autocorrelations of (n,) under white noise."""
    n = len(residual)
    correlation = _correlations(residual, residual)[1:]
    statistic = n * (n + 2) * np.sum(correlation**2 / (n - np.arange(1, len(correlation) + 1)))
    return float(scipy.stats.chi2.sf(statistic, len(correlation)))


def independence(residual: Floats, driven: Floats) -> float:
    """The p value of the correlations of a residual (n,) with the past of an input (n,) under white noise."""
    if np.ptp(driven) == 0.0:
        return 1.0
    cross, own = _correlations(residual, driven), _correlations(driven, driven)
    colour = scipy.linalg.toeplitz(own) + 1e-9 * np.eye(len(own))
    return float(
        scipy.stats.chi2.sf(len(residual) * cross @ scipy.linalg.solve(colour, cross, assume_a="pos"), len(cross))
    )


def _correlations(one: Floats, other: Floats) -> Floats:
    """Correlation of (n,) with the past of (n,) at 0 to `LAGS` samples, at most a quarter of them."""
    a, b = one - one.mean(), other - other.mean()
    size = max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300)
    return np.array([a[lag:] @ b[: len(b) - lag] / size for lag in range(min(LAGS, len(a) // 4) + 1)])
