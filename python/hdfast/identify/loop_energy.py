"""The energy of a cycle: the area between the branches of a loop, and what closes it at the two ends.

Between two levels nothing is known of the loop. A sum over levels is right in the mean over their chance position, but
one recording has one position: at 17 bit its error at the ends, where the branches close, exceeds that of the torque
many times. The tips are therefore located by extrapolating the arriving branch to the torque of the turning point, and
both ends, which close alike after a reversal (Masing 1926), are read together as one curve of distance from the tip.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.branches import Branches
from hdfast.identify.crossings import Crossings
from hdfast.identify.estimate import Estimate, estimate

ARRIVING, ARRIVING_SHARE = 6, 0.08  # levels of the branch that lead to a tip: at least, and as a share of all
CLOSING = 4  # levels from the tip that belong to its end at least
NEAR = 0.02  # share of a level below which two distances from a tip are one
LIMIT = 1.1  # of the plateau
FINE = 2001
BETWEEN = 0.25  # standard deviation of what lies between levels, per difference of chords and curve


def energy(loop: Branches, found: Crossings) -> Estimate:
    """Energy of a cycle [J].

    Raises:
        InputError: the branches do not lead to the turning points of the torque.
    """
    near = max(ARRIVING, int(ARRIVING_SHARE * len(loop.windup)))
    low, low_sigma = _tip(loop.windup[:near], loop.falling[:near], found.turns[0], loop.noise)
    high, high_sigma = _tip(loop.windup[-near:], loop.rising[-near:], found.turns[1], loop.noise)
    width = loop.rising - loop.falling
    zone = min(max(loop.cut, CLOSING * found.spacing), 0.3 * (high - low))
    inside = np.flatnonzero((loop.windup - low >= zone) & (high - loop.windup >= zone))
    if not inside.size:
        raise InputError(
            f"the branches end at windups of {low:.3g} and {high:.3g} rad, with no level between them "
            "(allowed: torque that rises with the windup at both ends)"
        )
    first, last = int(inside[0]), int(inside[-1])
    ends = [(loop.windup[: first + 1] - low, width[: first + 1]), (high - loop.windup[last:], width[last:])]
    curve, chords = _closing(ends, found.spacing, max(loop.plateau, loop.noise))
    middle = float(np.trapezoid(width[first : last + 1], loop.windup[first : last + 1]))
    reach = [float(np.max(u)) for u, _ in ends]
    area = middle + sum(curve(u) for u in reach)
    between = sum(abs(curve(u) - _chord_area(chords, u)) for u in reach)
    noise = np.sqrt(2.0) * loop.noise * found.spacing
    variance = len(width) * noise**2 + (BETWEEN * between) ** 2
    variance += (width[first] * low_sigma) ** 2 + (width[last] * high_sigma) ** 2
    meaning = "energy lost in a cycle: area of the loop"
    return estimate("loop_energy", area, "J", float(np.sqrt(variance)), meaning=meaning)


def _tip(windup: Floats, torque: Floats, turn: tuple[float, float], noise: float) -> tuple[float, float]:
    """Windup [rad] where the branch through these levels reaches the turning torque, and its standard deviation."""
    scale = float(np.ptp(torque))
    columns = ((torque - turn[0]) / scale)[:, None] ** np.arange(3)
    found = np.linalg.lstsq(columns, windup, rcond=None)[0]
    compliance = abs(float(found[1])) / scale
    spread = float(np.linalg.pinv(columns.T @ columns)[0, 0])
    return float(found[0]), compliance * float(np.sqrt(spread * noise**2 + turn[1] ** 2))


def _closing(
    ends: list[tuple[Floats, Floats]], spacing: float, plateau: float
) -> tuple[Callable[[float], float], tuple[Floats, Floats]]:
    """Area under the distance of the branches, counted from a tip, and the points of that distance.

    The distance saturates, so that -log(1 - distance/limit) bends little and is what gets interpolated.
    """
    u = np.concatenate([part for part, _ in ends])
    width = np.concatenate([part for _, part in ends])
    place = np.maximum(np.round(u / (NEAR * spacing)).astype(np.int64), 1)
    _, inverse = np.unique(place, return_inverse=True)
    count = np.bincount(inverse)
    points = (
        np.concatenate([[0.0], np.bincount(inverse, np.maximum(u, NEAR * spacing)) / count]),
        np.concatenate([[0.0], np.bincount(inverse, width) / count]),
    )
    limit = LIMIT * max(plateau, float(np.max(points[1])))
    bent = scipy.interpolate.PchipInterpolator(points[0], -np.log1p(-points[1] / limit))

    def area(end: float) -> float:
        fine = np.linspace(0.0, end, FINE)
        return float(np.trapezoid(-limit * np.expm1(-bent(fine)), fine))

    return area, points


def _chord_area(points: tuple[Floats, Floats], end: float) -> float:
    u = np.append(points[0][points[0] < end], end)
    return float(np.trapezoid(np.interp(u, *points), u))
