"""What can be missing: each effect with its place, its amplitude and what it depends on.

Names are those of the published list of effects; laws outside that list carry the prefix `outside_`,
those that occur only as nuisance the prefix `minor_`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.plant import FIELD, Plant
from hdfast.proof.generator.sensors import Faults


class Drive(NamedTuple):
    """The truth behind a case: plant and sensor faults."""

    plant: Plant
    faults: Faults


Shape = Mapping[str, Any]


def _no_shape(_: Generator) -> dict[str, Any]:
    return {}


def _nothing_more(_: Plant) -> dict[str, float]:
    return {}


@dataclass(frozen=True)
class Effect:
    """One effect.

    Attributes:
        id: published name.
        place: where it acts.
        amplitude: field of `Plant` or `Faults` that scales it.
        typical: size of the amplitude where a search for the detectable size starts.
        limit: largest amplitude that is still physical.
        shape: draws the other fields.
        depends_on: state variables it follows.
        memory: "none", "rate_independent" or "fading".
        published: fields whose values are published parameters, with the names they have there.
        derived: further published parameters, from the plant with the effect.
        order: field of the shape that is an order per motor revolution, or a fixed order.
        needs_load_side: True where a motor-only recording cannot show it.
        inverse: True where the field is a stiffness and the amplitude the compliance added to it.
    """

    id: str
    place: str
    amplitude: str
    typical: float
    limit: float
    shape: Callable[[Generator], dict[str, Any]] = _no_shape
    depends_on: tuple[str, ...] = ()
    memory: str = "none"
    published: Mapping[str, str] = field(default_factory=dict)
    derived: Callable[[Plant], dict[str, float]] = _nothing_more
    order: str | float | None = None
    needs_load_side: bool = False
    inverse: bool = False

    def on(self, drive: Drive, amplitude: float, shape: Shape) -> Drive:
        """The drive with this effect at this amplitude."""
        value = amplitude
        if self.inverse:
            before = getattr(drive.plant, self.amplitude)
            value = 1.0 / (amplitude + (1.0 / before if before > 0.0 else 0.0))
        if self.amplitude in Plant._fields:
            return drive._replace(plant=drive.plant._replace(**{self.amplitude: value, **shape}))
        return drive._replace(faults=drive.faults._replace(**{self.amplitude: value, **shape}))

    def parameters(self, drive: Drive) -> dict[str, float]:
        """True parameters, under their published names, of a drive with this effect."""
        values = drive.plant._asdict() | drive.faults._asdict()
        stated = {name: float(values[inner]) for inner, name in self.published.items()}
        return stated | self.derived(drive.plant)


def _phase(rng: Generator) -> float:
    return float(rng.uniform(-np.pi, np.pi))


def _field(rng: Generator) -> dict[str, Any]:
    weight = rng.normal(size=FIELD)
    return {
        "field_weight": weight / np.linalg.norm(weight),
        "field_speed": rng.uniform(0.3, 4.0, FIELD),
        "field_temperature": rng.normal(0.0, 0.05, FIELD),
        "field_phase": rng.uniform(-np.pi, np.pi, FIELD),
    }


EFFECTS: dict[str, Effect] = {
    e.id: e
    for e in (
        Effect("coulomb_friction", "motor", "T_c", 0.003, 0.1, depends_on=("direction", "motor_speed"),
               published={"T_c": "T_c"}),
        Effect("stribeck_friction", "motor", "T_excess", 0.003, 0.035, lambda r: {"omega_s": r.uniform(1.0, 10.0)},
               ("motor_speed", "direction"), published={"omega_s": "omega_s"},
               derived=lambda p: {"breakaway_ratio": 1.0 + p.T_excess / p.T_c} if p.T_c > 0.0 else {}),
        Effect("load_dependent_friction", "mesh", "load_share", 0.02, 0.25,
               depends_on=("abs_transmitted_torque", "direction"),
               published={"load_share": "c_drive"}, needs_load_side=True),
        Effect("load_side_friction", "load", "T_cl", 0.3, 5.0, depends_on=("load_speed", "direction"),
               published={"T_cl": "T_cl"}),
        Effect("thermal_viscous", "motor", "beta", 0.01, 0.06, depends_on=("temperature", "motor_speed"),
               published={"beta": "beta"}),
        Effect("position_dependent_friction", "mesh", "ripple", 0.05, 0.3,
               lambda r: {"ripple_order": float(r.choice([1.0, 2.0, 4.0])), "ripple_phase": _phase(r)},
               ("motor_phase", "direction"),
               published={"ripple": "friction_ripple", "ripple_order": "order"}, order="ripple_order"),
        Effect("hysteresis", "mesh", "T_h", 0.5, 5.0, lambda r: {"phi_h": r.uniform(1e-4, 6e-4)},
               ("torsion",), "rate_independent", {"T_h": "T_h"}, needs_load_side=True),
        Effect("backlash", "mesh", "half_gap", 1e-5, 0.00015, depends_on=("torsion", "transmitted_torque"),
               published={"half_gap": "half_gap"}, needs_load_side=True),
        Effect("mesh_stiffness_variation", "mesh", "eps_2", 0.02, 0.08, lambda r: {"psi_2": _phase(r)},
               ("lobe_phase", "motor_phase", "transmitted_torque"), published={"eps_2": "eps_2"}, order=2.0,
               needs_load_side=True),
        Effect("te_harmonic", "mesh", "te_extra", 5e-6, 0.00015,
               lambda r: {"te_extra_order": float(r.choice([3.0, 5.0, 6.0, 8.0])), "te_extra_phase": _phase(r)},
               ("motor_phase",), published={"te_extra_order": "order"}, order="te_extra_order"),
        Effect("torque_ripple", "actuator", "r_2", 0.01, 0.05,
               lambda r: {"pole_pairs": float(r.choice([4.0, 5.0])), "psi_r": _phase(r)},
               ("motor_phase", "motor_torque"), published={"r_2": "r_2", "pole_pairs": "pole_pairs"},
               order="pole_pairs"),
        Effect("load_compliance", "load", "k_c", 1e-5, 0.0001, lambda r: {"c_c": r.uniform(5.0, 30.0)},
               ("transmitted_torque",), "fading", {"k_c": "K_c"}, needs_load_side=True, inverse=True),
        Effect("asymmetric_friction", "motor", "asymmetry", 0.05, 0.2, depends_on=("direction",),
               published={"asymmetry": "eps_c"}),
        Effect("nonlinear_viscous", "motor", "b_power", 1e-6, 1e-4, lambda _: {"power": 3.0}, ("motor_speed",)),
        Effect("presliding_friction", "motor", "bristle", 0.2, 1.0,
               depends_on=("direction", "motor_speed"), memory="rate_independent", inverse=True),
        Effect("viscoelastic", "mesh", "K_v", 1500.0, 8000.0, lambda r: {"tau_v": r.uniform(0.15, 1.5)},
               ("torsion",), "fading", {"tau_v": "tau_short"}, lambda p: {"K_v": 2.0 * p.K_v},
               needs_load_side=True),  # the published stiffness is that of two equal branches
        Effect("soft_windup", "mesh", "delta_K", 5000.0, 1.6e4, lambda r: {"phi_0": r.uniform(3e-5, 6.5e-5)},
               ("torsion", "transmitted_torque"), published={"delta_K": "delta_K", "phi_0": "phi_0"},
               needs_load_side=True),
        Effect("te_load_dependence", "mesh", "te_load", 2e-7, 1e-06, lambda r: {"te_load_phase": _phase(r)},
               ("motor_phase", "transmitted_torque"), order=2.0, needs_load_side=True),
        Effect("cogging", "motor", "T_cog", 0.003, 0.035,
               lambda r: {"cog_order": float(r.choice([12.0, 24.0])), "psi_cog": _phase(r)},
               ("motor_phase",), published={"T_cog": "T_cog", "cog_order": "order"}, order="cog_order"),
        Effect("gravity_unbalance", "load", "T_gravity", 0.5, 12.0, lambda r: {"psi_gravity": _phase(r)},
               ("load_phase",), published={"T_gravity": "T_gravity"}),
        Effect("external_periodic_torque", "load", "T_external", 0.5, 10.0,
               lambda r: {"f_external": r.uniform(3.0, 60.0)}, ("time_since_start",),
               published={"T_external": "T_external", "f_external": "f_external"}),
        Effect("torque_gain", "actuator", "gain_error", 0.03, 0.12, depends_on=("motor_torque",),
               published={"gain_error": "gain_error"}),
        Effect("actuator_lag", "actuator", "tau_e", 5e-4, 0.006, depends_on=("motor_torque",), memory="fading",
               published={"tau_e": "tau_e"}),
        Effect("delay", "actuator", "torque_delay", 5e-4, 0.005, depends_on=("motor_torque",), memory="fading",
               published={"torque_delay": "tau_d"}),
        Effect("encoder_eccentricity", "sensor", "eccentricity", 1e-5, 1e-3,
               lambda r: {"eccentricity_phase": _phase(r)}, ("load_phase",), needs_load_side=True),
        Effect("sensor_lowpass", "sensor", "lowpass", 1e-3, 3e-2, depends_on=("load_speed",), memory="fading",
               needs_load_side=True),
        Effect("sensor_delay", "sensor", "delay", 2e-4, 1e-2, depends_on=("load_speed",), memory="fading",
               needs_load_side=True),
        Effect("clock_skew", "sensor", "skew", 5e-5, 3e-3, depends_on=("time_since_start", "load_speed"),
               needs_load_side=True),
        Effect("ratio_error", "sensor", "scale", 1e-4, 1e-2, depends_on=("load_phase",), needs_load_side=True),
        Effect("sensor_offset_drift", "sensor", "drift", 1e-3, 0.02, depends_on=("time_since_start",)),
        Effect("outside_detent", "load", "detent", 0.5, 12.0,
               lambda r: {"detent_width": r.uniform(0.008, 0.03), "detent_angle": r.uniform(-0.03, 0.03)},
               ("load_phase",)),
        Effect("outside_thixotropy", "motor", "thixotropy", 0.2, 3.0,
               lambda r: {"thixotropy_time": r.uniform(0.3, 2.0)},
               ("time_since_start", "direction"), "fading"),
        Effect("outside_slosh", "load", "slosh_inertia", 0.05, 1.5,
               lambda r: {"slosh_frequency": r.uniform(1.0, 4.0), "slosh_damping": r.uniform(0.02, 0.1)},
               ("motor_acceleration", "load_speed"), "fading"),
        Effect("outside_end_spring", "load", "stop_stiffness", 50.0, 5000.0,
               lambda r: {"stop_angle": r.uniform(0.005, 0.03)}, ("load_phase",)),
        Effect("minor_friction_field", "motor", "field", 0.002, 0.02, _field),
        Effect("minor_phase_drift", "mesh", "te_wander", 0.02, 0.5,
               lambda r: {"te_drift": r.normal(size=FIELD)}, needs_load_side=True),
        Effect("minor_tooth_mesh", "mesh", "tooth", 5e-7, 8e-6, lambda r: {"tooth_phase": _phase(r)},
               needs_load_side=True),
    )
}  # fmt: skip

TWELVE = (
    "coulomb_friction", "stribeck_friction", "load_dependent_friction", "load_side_friction", "thermal_viscous",
    "position_dependent_friction", "hysteresis", "backlash", "mesh_stiffness_variation", "te_harmonic",
    "torque_ripple", "load_compliance",
)  # fmt: skip
