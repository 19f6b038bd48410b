"""The benchmark problem as a user of a general solver writes it down.

States: theta_m, omega_m, te = theta_m/i - theta_l, omega_l, z, and for the rms of te the integrals of te and te^2.
te instead of theta_l spares every solver the difference of two large angles.
"""

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import problem

COSINES, SINES = problem.coefficients()
RATIO = problem.NOMINAL["ratio"]
K_P, K_I = problem.K_P, problem.K_I
#: Corners of the reference and ends of the window of the rms [s].
STOPS = (0.5, 1.0, 2.0, 2.5, 3.0)
#: Sizes below which relative accuracy is not asked for; the integrals follow without control.
FLOORS = np.array([0.1, 0.1, 1e-5, 1e-3, 1e-2, 1e30, 1e30])
STATES, ALL_STATES = 5, 7


def start(p: np.ndarray, full: bool) -> np.ndarray:
    """All zero but te, so that the gear is not wound up."""
    y = np.zeros(ALL_STATES if full else STATES)
    y[2] = p[9] * COSINES.sum()
    return y


def slopes(t, y, p, out):
    """Rates of the states into `out`, in plain scalar Python for a compiler to take."""
    c1, s1 = math.cos(y[0]), math.sin(y[0])
    c, s, c_before, s_before = c1, s1, 1.0, 0.0
    error, slope = 0.0, 0.0
    for n in range(15):
        error += COSINES[n] * c + SINES[n] * s
        slope += (n + 1) * (SINES[n] * c - COSINES[n] * s)
        c, c_before = 2 * c1 * c - c_before, c
        s, s_before = 2 * c1 * s - s_before, s
    windup = y[2] - p[9] * error
    upsilon = 1 / RATIO - p[9] * slope
    square = windup * windup
    gear = windup * (p[6] + square * (p[7] + square * p[8])) + p[5] * (upsilon * y[1] - y[3])
    if t < 0.5:
        reference = p[10] * t / 0.5
    elif t < 2.0:
        reference = p[10]
    else:
        reference = p[10] * max(0.0, 1 - (t - 2.0) / 0.5)
    off = reference - y[1]
    slip = p[4] * (y[1] - y[3])
    out[0] = y[1]
    out[1] = (K_P * off + K_I * y[4] - p[2] * y[1] - slip - upsilon * gear) / p[0]
    out[2] = y[1] / RATIO - y[3]
    out[3] = (gear - p[3] * y[3] + slip) / p[1]
    out[4] = off
    if len(out) > 5:
        out[5] = y[2]
        out[6] = y[2] * y[2]


def slopes_numpy(t, y, p):
    """Rates of the states, the orders in one NumPy expression."""
    orders = np.arange(1, 16)
    c, s = np.cos(orders * y[0]), np.sin(orders * y[0])
    windup = y[2] - p[9] * (COSINES @ c + SINES @ s)
    upsilon = 1 / RATIO - p[9] * (orders @ (SINES * c - COSINES * s))
    gear = windup * (p[6] + windup**2 * (p[7] + windup**2 * p[8])) + p[5] * (upsilon * y[1] - y[3])
    off = p[10] * np.interp(t, problem.CORNERS, (0, 1, 1, 0, 0)) - y[1]
    slip = p[4] * (y[1] - y[3])
    alpha_m = (K_P * off + K_I * y[4] - p[2] * y[1] - slip - upsilon * gear) / p[0]
    rates = [y[1], alpha_m, y[1] / RATIO - y[3], (gear - p[3] * y[3] + slip) / p[1], off, y[2], y[2] ** 2]
    return np.array(rates[: len(y)])


def windup(y, p):
    """Windup [rad] of one state, in plain scalar Python for a compiler to take."""
    c1, s1 = math.cos(y[0]), math.sin(y[0])
    c, s, c_before, s_before, error = c1, s1, 1.0, 0.0, 0.0
    for n in range(15):
        error += COSINES[n] * c + SINES[n] * s
        c, c_before = 2 * c1 * c - c_before, c
        s, s_before = 2 * c1 * s - s_before, s
    return y[2] - p[9] * error


def windups(y: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Windup [rad] of states (n, ...)."""
    angles = np.multiply.outer(y[0], np.arange(1, 16))
    return y[2] - p[9] * (np.cos(angles) @ COSINES + np.sin(angles) @ SINES)


def deviation(opening: np.ndarray, closing: np.ndarray) -> np.ndarray:
    """Rms of te about its mean from the integrals (2, ...) at both ends of the window of 1 s."""
    mean, square = closing - opening
    return np.sqrt(square - mean**2)


def row_by_row(integrate, parameters: np.ndarray, full: bool):
    """All rows through `integrate(t0, t1, y, p) -> (state at t1, states (n, points) on the way)`."""
    final = np.empty((len(parameters), STATES))
    peak, rms = np.zeros(len(parameters)), np.zeros(len(parameters))
    for row, p in enumerate(parameters):
        y, t0, opening = start(p, full), 0.0, None
        for t1 in STOPS:
            y, path = integrate(t0, t1, y, p)
            t0 = t1
            if full:
                peak[row] = max(peak[row], np.max(np.abs(windups(path, p))))
                if t1 == 1.0:
                    opening = y[STATES:].copy()
                elif t1 == 2.0:
                    rms[row] = deviation(opening, y[STATES:])
        final[row] = y[:STATES]
    return final, peak, rms
