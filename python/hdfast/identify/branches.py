"""The two branches of a loop: where they run parallel and how wide they stand apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify import sparse
from hdfast.identify.crossings import Crossings
from hdfast.identify.estimate import Estimate, estimate
from hdfast.identify.least_squares import fit

LOST_MOTION_SHARE = 0.04
CLOSING_SHARE = 0.15  # of the range of windup: within it the branches have to reach their distance
CUT_MARGIN = 1.3
LEAST_LEVELS = 8  # that both branches pass
UNSEEN = 2.0  # distances of sparse samples within which an approach cannot be seen
QUIET = 1e-12  # of the range of torque: noise that cannot be less


@dataclass(frozen=True, eq=False)
class Branches:
    """Torques of both branches at common levels, averaged over the passes.

    Attributes:
        windup: common levels [rad], ascending, (n,).
        rising, falling: torque on each branch [N m], (n,).
        noise: standard deviation of one averaged torque [N m].
        cut: windup after a reversal within which the branches still approach their distance [rad].
        plateau: their distance beyond [N m].
        settled: False when they still approach it where they should be parallel.
    """

    windup: Floats
    rising: Floats
    falling: Floats
    noise: float
    cut: float
    plateau: float
    settled: bool


def branches(found: Crossings) -> Branches:
    """Pair the branches and find where they run parallel.

    Raises:
        InputError: the steps of the windup are too coarse for the loop.
    """
    rising, falling = ((sparse.on_levels if found.sparse else _means)(found, s) for s in (1.0, -1.0))
    shared = sorted(rising.keys() & falling.keys())
    if len(shared) < LEAST_LEVELS:
        raise InputError(
            f"the branches share {len(shared)} levels of the windup, {found.spacing:.3g} rad apart, in a loop of "
            f"{np.ptp(found.reach):.3g} rad (allowed: at least {LEAST_LEVELS}; take a finer load_angle without "
            "jumps, more torque or a slower one)"
        )
    windup = np.array(shared) * found.spacing / 2.0
    up, down = np.array([rising[k] for k in shared]), np.array([falling[k] for k in shared])
    width = up - down
    noise = float(np.median(np.abs(np.diff(width, 2)))) / 0.6745 / np.sqrt(6.0)
    noise = max(noise, QUIET * float(np.ptp(found.top)))
    middle = np.abs(windup - np.mean(found.reach)) < 0.25 * np.ptp(found.reach)
    plateau = float(np.median(width[middle]))
    cut = 0.0
    if plateau >= 4.0 * noise:
        cut = max(_cut(windup, width, found.reach, plateau, noise), UNSEEN * found.spacing * found.sparse)
    settled = cut < CUT_MARGIN * CLOSING_SHARE * float(np.ptp(found.reach)) - 2.0 * found.spacing
    return Branches(windup, up, down, noise / np.sqrt(2.0), cut, plateau, settled)


def _means(found: Crossings, direction: float) -> dict[int, float]:
    chosen = found.direction == direction
    key = np.round(found.windup[chosen] / found.spacing * 2.0).astype(np.int64)
    keys, inverse = np.unique(key, return_inverse=True)
    sums = np.bincount(inverse, found.torque[chosen]) / np.bincount(inverse)
    return dict(zip(keys.tolist(), sums.tolist(), strict=True))


def _cut(windup: Floats, width: Floats, reach: tuple[float, float], plateau: float, noise: float) -> float:
    after = np.minimum(reach[1] - windup, windup - reach[0])
    order = np.argsort(after)
    smooth = np.convolve(width[order], np.full(4, 0.25), mode="same")[2:-2]
    near = np.abs(smooth - plateau) > max(2.0 * noise, 0.03 * plateau)
    far = after[order][2:-2]
    reachable = far < CLOSING_SHARE * np.ptp(reach)
    late = np.flatnonzero(near & reachable)
    return float(CUT_MARGIN * far[late[-1]]) if late.size else 0.0


def parallel(found: Crossings, cut: float) -> NDArray[np.bool_]:
    """Crossings farther than `cut` from the reversal they come from and averaged over half a level or more, (n,)."""
    since = np.where(found.direction > 0, found.windup - found.reach[0], found.reach[1] - found.windup)
    return np.asarray((since > cut) & (found.share >= 0.5))


def hysteresis_loss(found: Crossings) -> Estimate:
    """Distance of the branches at zero torque [rad]; NaN where a branch does not pass it."""
    at_zero = _at(found, 0.0)
    up, down = at_zero[1.0], at_zero[-1.0]
    sigma = float(np.hypot(up[1], down[1]))
    return estimate(
        "hysteresis_loss", down[0] - up[0], "rad", sigma, up[2] + down[2], "distance of the branches at zero torque"
    )


def lost_motion(found: Crossings, rated: float) -> Estimate:
    """Windup between -4 % and +4 % of the rated torque, amid the branches [rad]; NaN where one does not pass both."""
    torque = LOST_MOTION_SHARE * rated
    sides = [_at(found, sign * torque) for sign in (1.0, -1.0)]
    middle = [0.5 * (side[1.0][0] + side[-1.0][0]) for side in sides]
    sigma = 0.5 * float(np.sqrt(sum(branch[1] ** 2 for side in sides for branch in side.values())))
    freedom = sum(branch[2] for side in sides for branch in side.values())
    meaning = f"windup from -{torque:.3g} to +{torque:.3g} N m on the middle of the branches"
    return estimate("lost_motion", middle[0] - middle[1], "rad", sigma, freedom, meaning)


def _at(found: Crossings, torque: float) -> dict[float, tuple[float, float, int]]:
    """(windup, its standard deviation, degrees of freedom) of each branch at a torque, from a parabola around it.

    NaN, not extrapolated, where the branch does not pass the torque.
    """
    result = {}
    window = 0.06 * float(np.ptp(found.top))
    for direction in (1.0, -1.0):
        chosen = found.direction == direction
        x, y = found.torque[chosen] - torque, found.windup[chosen]
        if not np.min(x) <= 0.0 <= np.max(x):
            result[direction] = (np.nan, np.nan, 0)
            continue
        while np.sum(np.abs(x) < window) < 8 and window < np.ptp(found.top):
            window *= 1.5
        near = np.abs(x) < window
        line = fit(np.stack([np.ones(near.sum()), x[near], x[near] ** 2], axis=1), y[near])
        result[direction] = (float(line.coefficients[0]), float(line.sigma[0]), line.freedom)
    return result
