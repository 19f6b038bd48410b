"""What each effect depends on and remembers, in the vocabulary of a verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace

#: Of an order, by which it is that of a turn: the ratio may have been refitted.
SAME_TURN = 1e-3


@dataclass(frozen=True)
class Facts:
    """State variables an effect depends on, and its memory: "none", "rate_independent" or "fading"."""

    depends_on: tuple[str, ...]
    memory: str


FACTS = {
    "coulomb_friction": Facts(("direction",), "none"),
    "stribeck_friction": Facts(("direction", "motor_speed"), "none"),
    "presliding_friction": Facts(("direction", "motor_speed"), "rate_independent"),
    "asymmetric_friction": Facts(("direction", "motor_speed"), "none"),
    "load_dependent_friction": Facts(("abs_transmitted_torque", "direction"), "none"),
    "load_side_friction": Facts(("direction", "load_speed"), "none"),
    "thermal_viscous": Facts(("temperature", "motor_speed"), "fading"),
    "nonlinear_viscous": Facts(("motor_speed",), "none"),
    "position_dependent_friction": Facts(("motor_phase", "direction"), "none"),
    "hysteresis": Facts(("torsion",), "rate_independent"),
    "viscoelastic": Facts(("torsion",), "fading"),
    "backlash": Facts(("torsion",), "none"),
    "soft_windup": Facts(("torsion",), "none"),
    "mesh_stiffness_variation": Facts(("lobe_phase", "transmitted_torque"), "none"),
    "te_harmonic": Facts(("motor_phase",), "none"),
    "te_load_dependence": Facts(("motor_phase", "transmitted_torque"), "none"),
    "cogging": Facts(("motor_phase",), "none"),
    "torque_ripple": Facts(("motor_phase", "motor_torque"), "none"),
    "actuator_lag": Facts(("motor_torque",), "fading"),
    "delay": Facts(("motor_torque",), "fading"),
    "gravity_unbalance": Facts(("load_phase",), "none"),
    "external_periodic_torque": Facts(("time_since_start",), "none"),
    "base_compliance": Facts(("transmitted_torque",), "fading"),
    "load_compliance": Facts(("transmitted_torque",), "fading"),
    "encoder_eccentricity": Facts(("load_phase",), "none"),
    "sensor_lowpass": Facts(("motor_speed",), "fading"),
    "sensor_delay": Facts(("motor_speed",), "fading"),
    "clock_skew": Facts(("time_since_start", "motor_speed"), "none"),
    "ratio_error": Facts(("motor_phase",), "none"),
    "sensor_offset_drift": Facts(("time_since_start",), "none"),
}


def facts_of(effect: str, order: float | None, ratio: float) -> Facts:
    """Those of an effect; of one that acts at an order per motor revolution, on the phase of the turn it repeats with.

    Args:
        effect: its id.
        order: where it acts, None for an effect without one.
        ratio: reduction ratio.
    """
    known = FACTS[effect]
    if order is None:
        return known
    named = turn_of(order, ratio)
    depends_on = tuple(named if named and name.endswith("_phase") else name for name in known.depends_on)
    return replace(known, depends_on=depends_on)


def turn_of(order: float, ratio: float) -> str | None:
    """The phase of which an order is a whole multiple: of the motor, of the lobe past the flexspline, of the load.

    Where motor and load turn together, no lobe passes.
    """
    if order < 0.5:
        turns = {"load_phase": 1.0 / abs(ratio)}
    else:
        turns = {"motor_phase": 1.0, "lobe_phase": abs(1.0 - 1.0 / ratio)}
    away = {name: abs(order / (turn * max(round(order / turn), 1)) - 1.0) for name, turn in turns.items() if turn > 0.0}
    near = min(away, key=lambda name: away[name])
    return near if away[near] < SAME_TURN else None
