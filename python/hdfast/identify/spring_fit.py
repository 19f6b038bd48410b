"""Spring laws through the parallel parts of a loop: odd polynomial, full polynomial, three slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast import spring
from hdfast.checks import Floats
from hdfast.identify.estimate import Estimate, Estimates, estimate
from hdfast.identify.least_squares import LinearFit, fit

UNITS = {1: "N m/rad", 2: "N m/rad^2", 3: "N m/rad^3", 4: "N m/rad^4", 5: "N m/rad^5"}


@dataclass(frozen=True, eq=False)
class SpringFit:
    """A spring law and how well it holds.

    Attributes:
        law: "odd", "full" or "piecewise".
        estimates: coefficients, half the distance of the branches and the position of zero windup.
        residual: torque minus fit [N m], shape (n,), in the order of the crossings given.
        zero: windup reading at which the spring is relaxed [rad].
    """

    law: str
    estimates: Estimates
    residual: Floats
    zero: float

    @property
    def rms(self) -> float:
        """Root mean square of the residual [N m]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    def value(self, name: str) -> float:
        """A coefficient by name."""
        return self.estimates.named(name).value


def odd(windup: Floats, torque: Floats, direction: Floats, centre: float) -> SpringFit:
    """Fit torque = k1 x + k3 x^3 + k5 x^5 + direction T_h with x = windup - zero; the zero is fitted too."""
    powers, zero = (1, 3, 5), centre
    reach = float(np.max(np.abs(windup - centre)))
    slope = np.full_like(windup, float(np.ptp(torque) / np.ptp(windup)))
    for _ in range(4):
        x = (windup - zero) / reach
        found = fit(np.stack([*(x**n for n in powers), direction, -slope], axis=1), torque)
        zero += float(found.coefficients[-1])
        k = {f"k{n}": found.coefficients[j] / reach**n for j, n in enumerate(powers)} | {"phi_max": np.inf}
        slope = spring.polynomial_tangent(k, windup - zero)
    named = _named(found, powers, reach)
    end = estimate("relaxed_at", zero, "rad", found.sigma[-1], found.freedom, "windup reading of the relaxed spring")
    return SpringFit("odd", Estimates([*named, end]), found.residuals, zero)


def full(windup: Floats, torque: Floats, direction: Floats, zero: float) -> SpringFit:
    """Fit torque = c + k1 x + ... + k5 x^5 + direction T_h; the constant is reported, not simulated."""
    powers = (1, 2, 3, 4, 5)
    reach = float(np.max(np.abs(windup - zero)))
    x = (windup - zero) / reach
    found = fit(np.stack([*(x**n for n in powers), direction, np.ones_like(x)], axis=1), torque)
    named = _named(found, powers, reach)
    end = estimate("constant", found.coefficients[-1], "N m", found.sigma[-1], found.freedom, "not simulated")
    return SpringFit("full", Estimates([*named, end]), found.residuals, zero)


def _named(found: LinearFit, powers: tuple[int, ...], reach: float) -> list[Estimate]:
    named = [
        estimate(f"k{n}", found.coefficients[j] / reach**n, UNITS[n], found.sigma[j] / reach**n, found.freedom)
        for j, n in enumerate(powers)
    ]
    half = estimate(
        "hysteresis_torque",
        found.coefficients[-2],
        "N m",
        found.sigma[-2],
        found.freedom,
        "half the distance of the parallel branches",
    )
    return [*named, half]


def piecewise(
    windup: Floats, torque: Floats, direction: Floats, half: float, corners: tuple[float, float], centre: float
) -> SpringFit:
    """Fit windup = zero + sum of torque parts over K1, K2, K3 with given corners, branches 2 T_h apart.

    Linear in the compliances 1/K; T_h enters through the torque on the spring and is found by repetition.
    """
    compliances = np.full(3, np.ptp(windup) / np.ptp(torque))
    scale = float(np.ptp(windup))
    for _ in range(8):
        held = torque - half * direction
        size = np.abs(held)
        active = np.digitize(size, corners)
        parts = [
            np.minimum(size, corners[0]),
            np.clip(size - corners[0], 0.0, corners[1] - corners[0]),
            np.maximum(size - corners[1], 0.0),
        ]
        columns = [np.sign(held) * part for part in parts] + [-direction * compliances[active], np.ones_like(held)]
        found = fit(np.stack(columns, axis=1), (windup - centre) / scale)
        compliances = found.coefficients[:3] * scale
        half += float(found.coefficients[3]) * scale
    sigma = found.sigma * scale
    named = [
        estimate(f"K{j + 1}", 1.0 / c, "N m/rad", sigma[j] / c**2, found.freedom) for j, c in enumerate(compliances)
    ]
    named.append(estimate("hysteresis_torque", half, "N m", sigma[3], found.freedom))
    zero = centre + float(found.coefficients[4]) * scale
    residual = -found.residuals * scale / compliances[active]
    return SpringFit("piecewise", Estimates(named), -residual, zero)
