"""Loops of sparse samples: few or none within a step of the windup.

Neighbouring levels would share samples, and means over several would bend with the spring. Every sample is then a point
of its own; the distance of the branches and the area of the loop are read from what a smooth curve through all samples
leaves, on which straight lines from one to the next are good.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial

from hdfast.identify.crossings import ROUNDING, Crossings
from hdfast.identify.estimate import Estimate, estimate

DEGREE = 5
BETWEEN = 0.3  # standard deviation of what lies between samples, per difference of the areas of all and of half of them


def told(found: Crossings) -> str:
    """That the samples are sparse, and what would say more."""
    rate = found.spacing * float(np.ptp(found.top) / np.ptp(found.reach))
    return (
        f"sparse samples, {rate:.2g} N m from one to the next, are fitted themselves, without levels of the windup; "
        "a slower torque or a higher rate says more"
    )


def on_levels(found: Crossings, direction: float) -> dict[int, float]:
    """Torque of a branch [N m] by half spacings of the windup, averaged over the passes, where all of them reach."""
    smooth = _smooth(found)
    parts = [found.passes == index for index in np.unique(found.passes[found.direction == direction])]
    low = max(float(np.min(found.windup[part])) for part in parts)
    high = min(float(np.max(found.windup[part])) for part in parts)
    numbers = np.arange(np.ceil(low / found.spacing), np.floor(high / found.spacing) + 1.0)
    levels = numbers * found.spacing
    left = np.zeros_like(levels)
    for part in parts:
        order = np.argsort(found.windup[part])
        windup, torque = found.windup[part][order], found.torque[part][order]
        left += np.interp(levels, windup, torque - smooth(windup)) / len(parts)
    return dict(zip((2 * numbers.astype(np.int64)).tolist(), (smooth(levels) + left).tolist(), strict=True))


def energy(found: Crossings) -> Estimate:
    """Energy of a cycle [J]: area of the polygon through the samples, extrapolated to samples without distance.

    What lies between polygon and loop falls with the square of the distance, as far as the samples resolve the ends.
    """
    left = found.torque - _smooth(found)(found.windup)
    every, half, cycles = np.zeros_like(left), np.zeros_like(left), 0
    bounds = [*np.flatnonzero(np.diff(found.passes, prepend=-1)), len(left)]
    for begin, middle, end in zip(bounds, bounds[1:], bounds[2:], strict=False):
        if found.direction[begin] != found.direction[middle]:
            windup = found.windup[begin:end]
            every[begin:end] += (np.roll(windup, -1) - np.roll(windup, 1)) / 2.0
            half[begin:end] += (np.roll(windup, -2) - np.roll(windup, 2)) / 4.0
            cycles += 1
    lost = float((every - half) @ left) / cycles
    weights = (every + (every - half) / 3.0) / cycles
    bends = np.concatenate([np.diff(left[a:b], 2) for a, b in pairwise(bounds)])
    rounding = found.step / ROUNDING * float(np.ptp(found.top) / np.ptp(found.reach))
    scatter = max(float(np.median(np.abs(bends))) / 0.6745 / np.sqrt(6.0), rounding)
    noise = scatter * np.linalg.norm(weights) * np.sqrt((len(bounds) - 1) / 2.0)
    sigma = float(np.hypot(noise, BETWEEN * lost))
    return estimate(
        "loop_energy", float(weights @ left), "J", sigma, meaning="energy lost in a cycle: area of the loop"
    )


def _smooth(found: Crossings) -> Polynomial:
    return Polynomial.fit(found.windup, found.torque, DEGREE)
