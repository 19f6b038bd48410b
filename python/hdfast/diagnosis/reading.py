"""Simulated signals as a recorder takes them: at its own times, then brought to the working rate."""

from __future__ import annotations

import numpy as np
import scipy

from hdfast.checks import Floats

NODES = np.arange(-1, 3)
POINTS = 4


def reading(fine: Floats, clock: Floats, t: Floats, window: float = 0.0) -> scipy.sparse.csr_array:
    """Matrix (n, m) from equally spaced dense times (m,) by way of a recorder's (k,) to those that are judged (n,).

    What moves faster than half of the recorder's rate is seen at another frequency, and at no single one where the
    clock shakes, so that only values at the very times at which they were taken can be compared. Between the dense
    times lies a cubic, between two samples a straight line, as between the recorded ones. Where a recorder takes means
    over a window [s], so are these, about its times: what all channels are late by is no delay.
    """
    if window == 0.0:
        return _lines(clock, t) @ _cubics(fine, clock)
    places, shares = np.polynomial.legendre.leggauss(POINTS)
    parts = [
        0.5 * share * _cubics(fine, clock + 0.5 * window * place) for place, share in zip(places, shares, strict=True)
    ]
    return _lines(clock, t) @ sum(parts[1:], parts[0])


def _cubics(fine: Floats, at: Floats) -> scipy.sparse.csr_array:
    place = (np.clip(at, fine[0], fine[-1]) - fine[0]) / (fine[1] - fine[0])
    first = np.clip(np.floor(place).astype(np.int64), 1, len(fine) - 3)
    u = place - first
    weights = np.stack(
        [
            -u * (u - 1.0) * (u - 2.0) / 6.0,
            (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
            -(u + 1.0) * u * (u - 2.0) / 2.0,
            (u + 1.0) * u * (u - 1.0) / 6.0,
        ],
        axis=1,
    )
    return _sparse(weights, first[:, None] + NODES, len(fine))


def _lines(clock: Floats, t: Floats) -> scipy.sparse.csr_array:
    first = np.clip(np.searchsorted(clock, t, side="right") - 1, 0, len(clock) - 2)
    u = np.clip((t - clock[first]) / (clock[first + 1] - clock[first]), 0.0, 1.0)
    return _sparse(np.stack([1.0 - u, u], axis=1), first[:, None] + NODES[1:3], len(clock))


def _sparse(weights: Floats, places: np.ndarray, width: int) -> scipy.sparse.csr_array:
    rows, each = weights.shape
    starts = np.arange(0, rows * each + 1, each)
    return scipy.sparse.csr_array((weights.ravel(), places.ravel(), starts), shape=(rows, width))
