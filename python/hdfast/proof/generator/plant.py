"""The drive of the generator: rotor, wave generator, output ring and payload, with every law it may carry.

A plant is a flat record of numbers, so that compiled code takes it as it is and a variant is `plant._replace(...)`.
An effect is absent when its amplitude is zero. Angles and torques of the mesh count at the output, those of rotor
and wave generator at the motor; SI throughout.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLIP_ELEMENTS = 10
FIELD = 6


class Plant(NamedTuple):
    """Parameters of one drive (SI; see the equations in `laws`)."""

    ratio: float
    J_r: float  # rotor
    J_w: float  # wave generator
    J_f: float  # output ring, carries the load encoder
    J_p: float  # payload
    k_i: float  # coupling of rotor and wave generator
    c_i: float
    k_c: float  # coupling of ring and payload, where the output torque is measured
    c_c: float
    B_m: float
    B_l: float
    B_sp: float
    k1: float
    k3: float
    # kinematic error: lines over the motor angle with phases that drift
    te_order: Array
    te_amplitude: Array
    te_phase: Array
    te_wander: float  # scale of the drift [rad/s]
    te_drift: Array
    tooth: float  # line of the tooth mesh
    tooth_phase: float
    te_extra: float  # one more line, without drift
    te_extra_order: float
    te_extra_phase: float
    te_load: float  # amplitude of order 2 per load torque
    te_load_phase: float
    # dry friction at the wave generator: level, Stribeck excess, asymmetry, load share, ripple, random field
    T_c: float
    T_excess: float
    omega_s: float
    asymmetry: float
    load_share: float
    ripple: float
    ripple_order: float
    ripple_phase: float
    field: float  # [N m]
    field_weight: Array
    field_speed: Array
    field_temperature: Array
    field_phase: Array
    thixotropy: float
    thixotropy_time: float
    bristle: float  # stiffness; in the linearisation alone
    # viscous: power law and temperature
    b_power: float
    power: float
    beta: float
    # mesh
    half_gap: float
    delta_K: float
    phi_0: float
    eps_2: float
    psi_2: float
    T_h: float
    phi_h: float
    K_v: float
    tau_v: float
    # actuator and motor
    gain_error: float
    pole_pairs: float
    r_2: float
    psi_r: float
    T_cog: float
    cog_order: float
    psi_cog: float
    tau_e: float
    # load side
    T_cl: float
    T_gravity: float
    psi_gravity: float
    T_external: float
    f_external: float
    detent: float
    detent_width: float
    detent_angle: float
    stop_stiffness: float
    stop_angle: float
    slosh_inertia: float
    slosh_frequency: float
    slosh_damping: float


def empty_arrays() -> dict[str, Any]:
    """Friction field and phase drift at rest; their scales are scalars of the plant."""
    names = ("field_weight", "field_speed", "field_temperature", "field_phase", "te_drift")
    return {name: np.zeros(FIELD) for name in names}


ABSENT: dict[str, Any] = {
    "te_wander": 0.0, "tooth": 0.0, "tooth_phase": 0.0, "field": 0.0,
    "te_extra": 0.0, "te_extra_order": 1.0, "te_extra_phase": 0.0, "te_load": 0.0, "te_load_phase": 0.0,
    "T_c": 0.0, "T_excess": 0.0, "omega_s": 3.0, "asymmetry": 0.0, "load_share": 0.0,
    "ripple": 0.0, "ripple_order": 2.0, "ripple_phase": 0.0,
    "thixotropy": 0.0, "thixotropy_time": 1.0, "bristle": 0.0,
    "b_power": 0.0, "power": 3.0, "beta": 0.0,
    "half_gap": 0.0, "delta_K": 0.0, "phi_0": 4.5e-5, "eps_2": 0.0, "psi_2": 0.0,
    "T_h": 0.0, "phi_h": 4e-4, "K_v": 0.0, "tau_v": 0.5,
    "gain_error": 0.0, "pole_pairs": 4.0, "r_2": 0.0, "psi_r": 0.0,
    "T_cog": 0.0, "cog_order": 24.0, "psi_cog": 0.0, "tau_e": 0.0,
    "T_cl": 0.0, "T_gravity": 0.0, "psi_gravity": 0.0, "T_external": 0.0, "f_external": 50.0,
    "detent": 0.0, "detent_width": 0.02, "detent_angle": 0.0, "stop_stiffness": 0.0, "stop_angle": 1e9,
    "slosh_inertia": 0.0, "slosh_frequency": 2.0, "slosh_damping": 0.05,
}  # fmt: skip
