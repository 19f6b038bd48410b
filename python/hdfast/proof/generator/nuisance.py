"""Minor effects that every case carries and no label names."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.effects import EFFECTS
from hdfast.proof.generator.linear import Linearisation
from hdfast.proof.generator.sizing import Sized, sketch

MINOR = (
    "minor_friction_field", "minor_phase_drift", "minor_tooth_mesh", "asymmetric_friction", "nonlinear_viscous",
    "position_dependent_friction", "load_dependent_friction", "hysteresis", "soft_windup", "viscoelastic",
    "te_harmonic", "te_load_dependence", "cogging", "torque_ripple", "gravity_unbalance", "encoder_eccentricity",
    "sensor_delay", "clock_skew", "thermal_viscous", "load_compliance", "sensor_offset_drift", "load_side_friction",
)  # fmt: skip
LEAST, MOST, TOGETHER = 0.05, 0.3, 0.6


def draw_sizes(rng: Generator, count: int) -> list[float]:
    """Amplitudes in detectable amplitudes: uniform from 0.05 to 0.3, drawn again until 0.6 in quadrature holds."""
    while True:
        sizes = rng.uniform(LEAST, MOST, count)
        if np.sqrt(np.sum(sizes**2)) <= TOGETHER:
            return [float(x) for x in sizes]


def draw_nuisance(rng: Generator, lin: Linearisation, taken: set[str]) -> list[Sized]:
    """Two to four minor effects; those that would have to be larger than physical to count are drawn again.

    They are small enough for a linear refit.
    """
    able = [n for n in MINOR if n not in taken and not (lin.rig.motor_only and EFFECTS[n].needs_load_side)]
    order = rng.permutation(able)
    count = int(rng.integers(2, 5))
    sizes = draw_sizes(rng, count)
    chosen: list[Sized] = []
    for effect_id in order:
        multiple = sizes[len(chosen)]
        sized = sketch(lin, str(effect_id), multiple, rng, at=multiple)
        if sized.amplitude <= EFFECTS[str(effect_id)].limit:
            chosen.append(sized)
        if len(chosen) == count:
            break
    return chosen
