"""A low-pass of first order behind a replayed motion, and the motion before it."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solve_banded

from hdfast.checks import Floats


def before(t: Floats, values: Floats, lag: float) -> Floats:
    """Values (n,) at equally spaced times (n,) [s] before a low-pass with time constant `lag` [s]."""
    return np.asarray(values + lag * CubicSpline(t, values)(t, 1))


def behind(t: Floats, values: Floats, lag: Floats) -> Floats:
    """Values (M, n) at equally spaced times (n,) [s] behind low-passes with time constants `lag` (M,) [s].

    Undoes `before` exactly, the slopes of a spline included: what that raised of a recording's noise must be brought
    back to where it was, neither more nor less, or a low-pass would seem right wherever a recording is noisy.
    """
    found = values.copy()
    for own in np.unique(lag[lag != 0.0]):
        rows = lag == own
        u = values[rows].T
        shift = 3.0 * own / (t[1] - t[0])
        bands = np.tile([[1.0 + shift], [4.0], [1.0 - shift]], len(t))
        bands[1, [0, -1]], bands[0, 1], bands[2, -2] = 1.0, 0.0, 0.0
        right = np.concatenate([u[:1], u[:-2] + 4.0 * u[1:-1] + u[2:], u[-1:]])
        found[rows] = solve_banded((1, 1), bands, right).T
    return found
