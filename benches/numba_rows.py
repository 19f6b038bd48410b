"""What a user would write instead: Dormand-Prince 5(4), compiled by Numba, threads over rows."""

import math

import numpy as np
import problem
from numba import njit, prange

STATES = 6  # theta_m, omega_m, te, omega_l, z, integral of te^2
A = np.array(
    [
        [0, 0, 0, 0, 0, 0],
        [1 / 5, 0, 0, 0, 0, 0],
        [3 / 40, 9 / 40, 0, 0, 0, 0],
        [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
C = np.array([0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1])
E = np.array([71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
FLOORS = np.array([0.1, 0.1, 1e-5, 1e-3, 1e-2, 1e30])
STOPS = np.array([0.5, 1.0, 2.0, 2.5, 3.0])
COSINES, SINES = problem.coefficients()
RATIO = problem.NOMINAL["ratio"]
K_P, K_I = problem.K_P, problem.K_I


@njit(fastmath=False)
def rates(t, y, p, out):
    j_m, j_l, b_m, b_l, b_ml, b_sp, k1, k3, k5, scale, speed = p
    c1, s1 = math.cos(y[0]), math.sin(y[0])
    c, s, c_before, s_before = c1, s1, 1.0, 0.0
    error, slope = 0.0, 0.0
    for n in range(15):
        error += COSINES[n] * c + SINES[n] * s
        slope += (n + 1) * (SINES[n] * c - COSINES[n] * s)
        c, c_before = 2 * c1 * c - c_before, c
        s, s_before = 2 * c1 * s - s_before, s
    windup = y[2] - scale * error
    upsilon = 1 / RATIO - scale * slope
    square = windup * windup
    gear = windup * (k1 + square * (k3 + square * k5)) + b_sp * (upsilon * y[1] - y[3])
    if t < 0.5:
        reference = speed * t / 0.5
    elif t < 2.0:
        reference = speed
    else:
        reference = speed * max(0.0, 1 - (t - 2.0) / 0.5)
    off = reference - y[1]
    slip = b_ml * (y[1] - y[3])
    out[0] = y[1]
    out[1] = (K_P * off + K_I * y[4] - b_m * y[1] - slip - upsilon * gear) / j_m
    out[2] = y[1] / RATIO - y[3]
    out[3] = (gear - b_l * y[3] + slip) / j_l
    out[4] = off
    out[5] = y[2] * y[2]
    return windup


@njit
def solve_row(p, rtol, y):
    """Integrates one row; returns peak windup at step ends and rms of te over 1..2 s."""
    k = np.zeros((7, STATES))
    trial = np.zeros(STATES)
    t, step, peak, before = 0.0, 1e-4, 0.0, 1.0
    te_window, square_start, mean_start = 0.0, 0.0, 0.0
    mean = 0.0
    rates(t, y, p, k[0])
    for stop_index in range(STOPS.size):
        stop = STOPS[stop_index]
        while t < stop:
            landing = t + 1.01 * step >= stop
            h = stop - t if landing else step
            windup = 0.0
            for stage in range(1, 7):
                for i in range(STATES):
                    total = 0.0
                    for j in range(stage):
                        total += A[stage, j] * k[j, i]
                    trial[i] = y[i] + h * total
                windup = rates(t + C[stage] * h, trial, p, k[stage])
            norm = 0.0
            for i in range(STATES - 1):
                error = 0.0
                for j in range(7):
                    error += E[j] * k[j, i]
                size = 0.0 if i == 0 else max(abs(y[i]), abs(trial[i]))
                ratio = h * error / (rtol * (FLOORS[i] + size))
                norm += ratio * ratio
            norm = max(math.sqrt(norm / (STATES - 1)), 1e-10)
            if norm <= 1.0:
                mean += 0.5 * h * (y[2] + trial[2]) + h * h / 12 * (k[0, 2] - k[6, 2])
                t = stop if landing else t + h
                for i in range(STATES):
                    y[i] = trial[i]
                    k[0, i] = k[6, i]
                peak = max(peak, abs(windup))
                factor = 0.9 * norm**-0.14 * before**0.04
                before = norm
                step = max(step, h * min(factor, 6.0)) if landing else h * min(factor, 6.0)
            else:
                step = h * max(0.2, 0.9 * norm**-0.2)
        if stop == 1.0:
            square_start, mean_start = y[5], mean
        elif stop == 2.0:
            average = mean - mean_start
            te_window = math.sqrt(y[5] - square_start - average * average)
    return peak, te_window


@njit(parallel=True)
def solve(parameters, rtol, start):
    """All rows: final states (M, 6), peak windup (M,), rms of te (M,)."""
    rows = parameters.shape[0]
    final = np.zeros((rows, STATES))
    peaks, deviations = np.zeros(rows), np.zeros(rows)
    for row in prange(rows):
        final[row, 2] = start[row]
        peaks[row], deviations[row] = solve_row(parameters[row], rtol, final[row])
    return final, peaks, deviations


def sweep(drawn: dict[str, np.ndarray], rtol: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows through the compiled loop."""
    parameters = np.column_stack([drawn[name] for name in problem.COLUMNS])
    return solve(parameters, rtol, drawn["te_scale"] * COSINES.sum())
