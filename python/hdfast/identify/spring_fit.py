"""Spring laws through the parallel parts of loops: odd polynomial, full polynomial, three slopes.

Every loop has its own zero and its own hysteresis torque; the spring is common to all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdfast import spring
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.estimate import CONFIDENCE, Estimate, Estimates, estimate
from hdfast.identify.least_squares import LinearFit, fit

UNITS = {1: "N m/rad", 2: "N m/rad^2", 3: "N m/rad^3", 4: "N m/rad^4", 5: "N m/rad^5"}
LEAST_POINTS = 8  # on each part of the piecewise law


@dataclass(frozen=True, eq=False)
class Points:
    """Level crossings that a law is fitted to, each (n,).

    Attributes:
        windup: level [rad], from a zero of its own in every loop.
        torque: torque there [N m].
        direction: +1 while the torque rises, -1 while it falls.
        loop: number of the loop, from 0.
        weight: inverse of the loop's noise, up to a factor.
        alike: points that an error may have in common.
    """

    windup: Floats
    torque: Floats
    direction: Floats
    loop: NDArray[np.int64]
    weight: Floats
    alike: float = 1.0

    def by_loop(self, column: Floats) -> Floats:
        """A column (n,) spread over one column for each loop (n, loops)."""
        return np.asarray((self.loop[:, None] == np.arange(self.loop.max() + 1)) * column[:, None])

    def fit(self, columns: Floats, data: Floats) -> LinearFit:
        """Weighted least squares; the residuals are those of `data`."""
        found = fit(columns * self.weight[:, None], data * self.weight)
        return replace(found, covariance=self.alike * found.covariance, residuals=found.residuals / self.weight)


@dataclass(frozen=True, eq=False)
class SpringFit:
    """A spring law and how well it holds.

    Attributes:
        law: "odd", "full" or "piecewise".
        estimates: coefficients, and of the first loop half the distance of the branches and the relaxed reading.
        residual: torque minus fit [N m], shape (n,), in the order of the points given.
        zeros: windup readings at which the spring is relaxed [rad], (loops,).
        halves: half the distance of the branches [N m], (loops,).
    """

    law: str
    estimates: Estimates
    residual: Floats
    zeros: Floats
    halves: Floats

    @property
    def rms(self) -> float:
        """Root mean square of the residual [N m]."""
        return float(np.sqrt(np.mean(self.residual**2)))


def odd(points: Points, centres: Floats) -> SpringFit:
    """Fit torque = k1 x + k3 x^3 + k5 x^5 + direction T_h with x = windup - zero, from centres (loops,) on."""
    powers, zeros = (1, 3, 5), centres
    loops = len(centres)
    reach = float(np.max(np.abs(points.windup - centres[points.loop])))
    slope = np.full_like(points.windup, float(np.ptp(points.torque)) / (2.0 * reach))
    hysteresis = points.by_loop(points.direction)
    for _ in range(4):
        x = (points.windup - zeros[points.loop]) / reach
        columns = np.hstack([np.stack([x**n for n in powers], axis=1), hysteresis, points.by_loop(-slope)])
        found = points.fit(columns, points.torque)
        zeros = zeros + found.coefficients[-loops:]
        k = {f"k{n}": found.coefficients[j] / reach**n for j, n in enumerate(powers)} | {"phi_max": np.inf}
        slope = spring.polynomial_tangent(k, points.windup - zeros[points.loop])
    meaning = "windup reading of the relaxed spring"
    end = estimate("relaxed_at", zeros[0], "rad", found.sigma[-loops], found.freedom, meaning)
    halves = found.coefficients[len(powers) : -loops]
    return SpringFit("odd", Estimates([*_named(found, powers, reach), end]), found.residuals, zeros, halves)


def full(points: Points, zeros: Floats) -> SpringFit:
    """Fit torque = c + k1 x + ... + k5 x^5 + direction T_h; the constant is reported, not simulated."""
    powers = (1, 2, 3, 4, 5)
    x = points.windup - zeros[points.loop]
    reach = float(np.max(np.abs(x)))
    series = np.stack([(x / reach) ** n for n in powers], axis=1)
    found = points.fit(np.hstack([series, points.by_loop(points.direction), np.ones((len(x), 1))]), points.torque)
    end = estimate("constant", found.coefficients[-1], "N m", found.sigma[-1], found.freedom, "not simulated")
    halves = found.coefficients[len(powers) : -1]
    return SpringFit("full", Estimates([*_named(found, powers, reach), end]), found.residuals, zeros, halves)


def _named(found: LinearFit, powers: tuple[int, ...], reach: float) -> list[Estimate]:
    named = [
        estimate(f"k{n}", found.coefficients[j] / reach**n, UNITS[n], found.sigma[j] / reach**n, found.freedom)
        for j, n in enumerate(powers)
    ]
    half, sigma = found.coefficients[len(powers)], found.sigma[len(powers)]
    meaning = "half the distance of the parallel branches"
    return [*named, estimate("hysteresis_torque", half, "N m", sigma, found.freedom, meaning)]


def piecewise(points: Points, start: SpringFit, corners: tuple[float, float]) -> SpringFit:
    """Fit windup = zero + sum of torque parts over K1, K2, K3 with given corners, branches 2 T_h apart.

    Linear in the compliances 1/K; T_h enters through the torque on the spring and is found by repetition from another
    law's T_h and zeros on.

    Raises:
        InputError: a part of the law has too few points, or its slope is not surely positive.
    """
    loops, direction, halves = len(start.zeros), points.direction, start.halves
    windup = points.windup - start.zeros[points.loop]
    scale = float(np.ptp(windup))
    compliances = np.full(3, scale / np.ptp(points.torque))
    for _ in range(8):
        held = points.torque - halves[points.loop] * direction
        size = np.abs(held)
        active = np.digitize(size, corners)
        _check_parts(np.bincount(active, minlength=3), corners)
        parts = [
            np.minimum(size, corners[0]),
            np.clip(size - corners[0], 0.0, corners[1] - corners[0]),
            np.maximum(size - corners[1], 0.0),
        ]
        slopes = np.stack([np.sign(held) * part for part in parts], axis=1)
        branches = points.by_loop(-direction * compliances[active])
        found = points.fit(np.hstack([slopes, branches, points.by_loop(np.ones_like(held))]), windup / scale)
        compliances = found.coefficients[:3] * scale
        halves = halves + found.coefficients[3:-loops] * scale
    sigma = found.sigma * scale
    named = [
        estimate(f"K{j + 1}", 1.0 / c, "N m/rad", sigma[j] / c**2, found.freedom) for j, c in enumerate(compliances)
    ]
    unsure = [item.name for item in named if not item.low > 0.0]
    if unsure:
        raise InputError(
            f"{_told(corners)}: {', '.join(unsure)} may be 0 or less at {100.0 * CONFIDENCE:.0f} % "
            "(allowed: corners between which the torque tells each slope)"
        )
    named.append(estimate("hysteresis_torque", halves[0], "N m", sigma[3], found.freedom))
    zeros = start.zeros + found.coefficients[-loops:] * scale
    return SpringFit("piecewise", Estimates(named), -found.residuals * scale / compliances[active], zeros, halves)


def _check_parts(points: NDArray[np.int64], corners: tuple[float, float]) -> None:
    if np.min(points) < LEAST_POINTS:
        below, between, above = points
        raise InputError(
            f"{_told(corners)}: the torque less its hysteresis has {below} points below, {between} between and "
            f"{above} above them (allowed: at least {LEAST_POINTS} each)"
        )


def _told(corners: tuple[float, float]) -> str:
    return f"corners = {corners[0]:g}, {corners[1]:g} N m"
