"""More of the noise that a recorded motor angle holds."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from hdfast.checks import Floats


def another(recorded: Floats, motion: Floats, step: float, deviation: float, rng: Generator) -> Floats:
    """One more noise of an angle [rad], shape (n,).

    What an encoder rounds goes with its motion: at a steady speed it is the alias of a few lines, anywhere in the band,
    and may shake the load at its resonance. Rounded at another phase the same motion has the same lines. They are no
    larger than the recording shows, of an encoder that averages for instance.

    Args:
        recorded: angle at equal distances [rad], (n,).
        motion: the same without most of its noise [rad], (n,).
        step: of the encoder [rad], 0 for none.
        deviation: standard deviation of all of the noise [rad]; what is more than steps make is white.
        rng: of the draw.
    """
    if step == 0.0:
        return deviation * rng.standard_normal(len(motion))
    finer = np.sqrt(max(deviation**2 - step**2 / 12.0, 0.0)) * rng.standard_normal(len(motion))
    moved = motion + finer + step * rng.uniform()
    found = finer + step * np.rint(moved / step) - moved
    scale = min(1.0, _roughness(recorded) / max(_roughness(found), 1e-300))
    return np.asarray(scale * found)


def _roughness(values: Floats) -> float:
    """Of noise (n,): rms of its third differences, in which motion is nothing; of coarse steps the median may be 0."""
    return float(np.sqrt(np.mean(np.diff(values, 3) ** 2)))
