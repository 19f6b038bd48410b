"""Frequency and decay of the ring after a brake, from samples.

The engine's fit of the mode expects a free decay; under a speed controller other modes run along. A matrix pencil
(Hua and Sarkar 1990) takes them all and keeps the strongest one near the mode.
"""

from __future__ import annotations

import math

import numpy as np

from hdfast.checks import Floats

MODES = 8
LONGEST = 100
OVERDAMPED = 0.5  # decay over angular frequency beyond which no ring is seen


def ring(t: Floats, signal: Floats, guess: float) -> tuple[float, float, float]:
    """(frequency [Hz], decay [1/s], amplitude at t[0]) of the strongest oscillation near a guess [Hz], factor 1.8.

    NaN when there is none: less than a period of the guess, or a run that ended early. Samples (n,) must be evenly
    spaced.
    """
    if guess * (t[-1] - t[0]) < 1.0 or not np.all(np.isfinite(signal)):
        return math.nan, math.nan, math.nan
    stride = max(1, int(1.0 / (8.0 * guess * (t[1] - t[0]))))
    step = float(stride * (t[1] - t[0]))
    t, y = t[::stride][:LONGEST], signal[::stride][:LONGEST]
    length = len(y) // 2
    hankel = np.lib.stride_tricks.sliding_window_view(y, length + 1)
    _, size, right = np.linalg.svd(hankel, full_matrices=False)
    keep = min(MODES, int(np.sum(size > 1e-9 * size[0])))
    basis = right[:keep].T
    poles = np.linalg.eigvals(np.linalg.pinv(basis[:-1]) @ basis[1:])
    rates = np.log(poles.astype(complex)) / step
    shape = np.exp(np.outer(t - t[0], rates))
    weights = np.linalg.lstsq(shape, y.astype(complex), rcond=None)[0]
    frequency = rates.imag / (2.0 * math.pi)
    near = (frequency > guess / 1.8) & (frequency < 1.8 * guess)
    near &= (rates.real < 0.0) & (-rates.real < OVERDAMPED * np.abs(rates.imag))
    if not near.any():
        return math.nan, math.nan, math.nan
    best = int(np.flatnonzero(near)[np.argmax(np.abs(weights[near]))])
    return float(frequency[best]), float(-rates[best].real), float(2.0 * abs(weights[best]))
