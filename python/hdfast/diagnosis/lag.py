"""A low-pass of first order behind a motion that was replayed from before it."""

from __future__ import annotations

import numpy as np
import scipy

from hdfast.checks import Floats


def behind(t: Floats, values: Floats, lag: Floats) -> Floats:
    """Values (M, n) at equally spaced times (n,) [s] behind low-passes with time constants `lag` (M,) [s].

    Undoes exactly what a lag times the slopes of a cubic spline adds to a motion: what that raised of a recording's
    noise must be brought back to where it was, neither more nor less, or a low-pass would seem right wherever a
    recording is noisy.
    """
    found = values.copy()
    for own in np.unique(lag[lag != 0.0]):
        rows = lag == own
        u = values[rows].T
        shift = 3.0 * own / (t[1] - t[0])
        bands = np.tile([[1.0 + shift], [4.0], [1.0 - shift]], len(t))
        bands[1, [0, -1]], bands[0, 1], bands[2, -2] = 1.0, 0.0, 0.0
        right = np.concatenate([u[:1], u[:-2] + 4.0 * u[1:-1] + u[2:], u[-1:]])
        found[rows] = scipy.linalg.solve_banded((1, 1), bands, right).T
    return found
