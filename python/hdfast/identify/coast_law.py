"""Angle of a drive that coasts to rest."""

from __future__ import annotations

import math

import numpy as np
import scipy

from hdfast.checks import Floats

STEPS = 400


def coast(t: Floats, speed: float, law: tuple[float, float, float]) -> Floats:
    """Angle [rad] after coasting for t [s] from a speed [rad/s] > 0 to rest; law = (a, b, c)."""
    a, b, c = law
    speed = max(speed, 1e-9)
    if c == 0.0 and b > 0.0:
        rest = math.log1p(b * speed / a) / b if a > 1e-9 * b * speed else math.inf
        moving = np.minimum(t, rest)
        return np.asarray((speed + a / b) / b * -np.expm1(-b * moving) - a / b * moving)
    return _integrated(t, speed, law)


def _integrated(t: Floats, speed: float, law: tuple[float, float, float]) -> Floats:
    """Runge-Kutta of fourth order on STEPS steps, held at rest."""
    a, b, c = law
    h = float(t[-1]) / STEPS

    def rate(w: float) -> float:
        return -(a + b * w + c * w**3) if w > 0.0 else 0.0

    angle, w, angles, speeds = 0.0, speed, [0.0], [speed]
    for _ in range(STEPS):
        k1 = rate(w)
        k2 = rate(w + 0.5 * h * k1)
        k3 = rate(w + 0.5 * h * k2)
        k4 = rate(w + h * k3)
        angle += h * w + h * h * (k1 + k2 + k3) / 6.0
        w = max(w + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0, 0.0)
        angles.append(angle)
        speeds.append(w)

    return np.asarray(
        scipy.interpolate.CubicHermiteSpline(np.linspace(0.0, float(t[-1]), STEPS + 1), angles, speeds)(t)
    )
