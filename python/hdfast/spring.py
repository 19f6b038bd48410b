"""The spring law on arrays: torque, tangent and windup of the polynomial and the piecewise spring."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdfast.checks import Floats

POWERS = (1, 2, 3, 4, 5)
COEFFICIENTS = {
    "polynomial": ("k1", "k2", "k3", "k4", "k5", "phi_max"),
    "piecewise": ("K1", "K2", "K3", "T1", "T2"),
}


def polynomial_torque(k: Mapping[str, float], phi: Floats) -> Floats:
    """Torque [N m] at windup phi [rad]; linear continuation outside +-phi_max."""
    x = np.clip(phi, -k["phi_max"], k["phi_max"])
    return _torque(k, x) + polynomial_tangent(k, x) * (phi - x)


def polynomial_tangent(k: Mapping[str, float], phi: Floats) -> Floats:
    """Slope [N m/rad] at windup phi [rad], constant outside +-phi_max."""
    x = np.clip(phi, -k["phi_max"], k["phi_max"])
    return np.asarray(sum(n * k.get(f"k{n}", 0.0) * x ** (n - 1) for n in POWERS), dtype=np.float64)


def _torque(k: Mapping[str, float], x: Floats) -> Floats:
    return np.asarray(sum(k.get(f"k{n}", 0.0) * x**n for n in POWERS), dtype=np.float64)


def piecewise_torque(k: Mapping[str, float], phi: Floats) -> Floats:
    """Torque [N m] of the piecewise spring at windup phi [rad]."""
    corner1 = k["T1"] / k["K1"]
    corner2 = corner1 + (k["T2"] - k["T1"]) / k["K2"]
    size = np.abs(phi)
    torque = (
        k["K1"] * np.minimum(size, corner1)
        + k["K2"] * np.clip(size - corner1, 0.0, corner2 - corner1)
        + k["K3"] * np.maximum(size - corner2, 0.0)
    )
    return np.sign(phi) * torque


def torque(spring: str, k: Mapping[str, float], phi: Floats) -> Floats:
    """Torque [N m] of either spring law, "polynomial" or "piecewise"."""
    return polynomial_torque(k, phi) if spring == "polynomial" else piecewise_torque(k, phi)
