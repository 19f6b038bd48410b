"""What each effect depends on and remembers, in the vocabulary of a verdict."""

from __future__ import annotations

from dataclasses import dataclass

MEMORY = ("none", "rate_independent", "fading")


@dataclass(frozen=True)
class Facts:
    """State variables an effect depends on, its memory, and what separates it from its rivals."""

    depends_on: tuple[str, ...]
    memory: str
    manoeuvre: str


FACTS = {
    "coulomb_friction": Facts(("direction",), "none", "ladder"),
    "stribeck_friction": Facts(("direction", "motor_speed"), "none", "slow_ladder"),
    "presliding_friction": Facts(("direction", "motor_speed"), "rate_independent", "micro_oscillation"),
    "asymmetric_friction": Facts(("direction", "motor_speed"), "none", "ladder"),
    "load_dependent_friction": Facts(("abs_transmitted_torque", "direction"), "none", "load_grid"),
    "load_side_friction": Facts(("direction", "load_speed"), "none", "load_grid"),
    "thermal_viscous": Facts(("temperature", "motor_speed"), "fading", "warm_repeat"),
    "nonlinear_viscous": Facts(("motor_speed",), "none", "ladder"),
    "position_dependent_friction": Facts(("motor_phase", "direction"), "none", "slow_turns"),
    "hysteresis": Facts(("torsion",), "rate_independent", "nested_loops"),
    "viscoelastic": Facts(("torsion",), "fading", "nested_loops"),
    "backlash": Facts(("torsion",), "none", "nested_loops"),
    "soft_windup": Facts(("torsion",), "none", "nested_loops"),
    "mesh_stiffness_variation": Facts(("lobe_phase", "transmitted_torque"), "none", "load_grid"),
    "te_harmonic": Facts(("motor_phase",), "none", "slow_turns"),
    "te_load_dependence": Facts(("motor_phase", "transmitted_torque"), "none", "load_grid"),
    "cogging": Facts(("motor_phase",), "none", "slow_turns"),
    "torque_ripple": Facts(("motor_phase", "motor_torque"), "none", "load_grid"),
    "torque_gain": Facts(("motor_torque",), "none", "load_grid"),
    "torque_saturation": Facts(("motor_torque",), "none", "multisine"),
    "actuator_lag": Facts(("motor_torque",), "fading", "multisine"),
    "delay": Facts(("motor_torque",), "fading", "multisine"),
    "gravity_unbalance": Facts(("load_phase",), "none", "slow_turns"),
    "external_periodic_torque": Facts(("time_since_start",), "none", "ladder"),
    "base_compliance": Facts(("transmitted_torque",), "fading", "multisine"),
    "load_compliance": Facts(("transmitted_torque",), "fading", "multisine"),
    "input_compliance": Facts(("motor_torque",), "fading", "multisine"),
    "ratcheting": Facts(("transmitted_torque",), "rate_independent", "load_grid"),
    "encoder_eccentricity": Facts(("load_phase",), "none", "slow_turns"),
    "sensor_lowpass": Facts(("motor_speed",), "fading", "multisine"),
    "sensor_delay": Facts(("motor_speed",), "fading", "multisine"),
    "clock_skew": Facts(("time_since_start", "motor_speed"), "none", "ladder"),
    "ratio_error": Facts(("motor_phase",), "none", "slow_turns"),
    "sensor_offset_drift": Facts(("time_since_start",), "none", "rest"),
}
