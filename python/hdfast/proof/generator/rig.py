"""A rig as it is and as its data sheet says: truth, nominal values, sensors, controller, recordings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.control import Controller
from hdfast.proof.generator.equipment import draw_chain, draw_controller
from hdfast.proof.generator.plant import ABSENT, Plant, empty_arrays
from hdfast.proof.generator.programme import Run, draw_runs
from hdfast.proof.generator.recipe import Recipe
from hdfast.proof.generator.sensors import Chain

NEEDS_DRY = {
    "position_dependent_friction",
    "asymmetric_friction",
    "presliding_friction",
    "outside_thixotropy",
    "stribeck_friction",
}
TOLERANCE = {"J_m": 0.08, "J_l": 0.10, "B_m": 0.35, "B_l": 0.5, "B_sp": 0.4, "k1": 0.06, "k3": 0.25, "T_c": 0.25}


@dataclass(frozen=True)
class Rig:
    """Everything of a case but the effects.

    Attributes:
        plant: the true parameters.
        sigma: relative tolerance of each quantity on the data sheet.
        nominal: the data sheet.
        nominal_error: orders, cosines and sines of the kinematic error on the data sheet [rad].
        error_sigma: tolerance of a cosine or sine [rad].
        chain: the sampling.
        torque_sigma: relative tolerance of the torque reading.
        torque_scale: true relative error of the torque reading.
        torque_offset: of each recording [N m].
        controller: as it works.
        declared: how the campaign tells of it: "correct", "incomplete" or "absent".
        motor_only: True without a load side.
        has_output_torque: True with a torque sensor behind the gear.
        runs: the recordings.
    """

    plant: Plant
    sigma: dict[str, float]
    nominal: dict[str, float]
    nominal_error: dict[str, list[float]]
    error_sigma: float
    chain: Chain
    torque_sigma: float
    torque_scale: float
    torque_offset: list[float]
    controller: Controller
    declared: str
    motor_only: bool
    has_output_torque: bool
    runs: list[Run]

    @property
    def true(self) -> dict[str, float]:
        """True values of the data sheet's quantities."""
        p = self.plant
        values = {"J_m": p.J_r + p.J_w, "J_l": p.J_f + p.J_p}
        return {name: float(values.get(name, getattr(p, name, 0.0))) for name in self.sigma}

    @property
    def windup_range(self) -> float:
        """Windup that no recording leaves, as the data sheet has it [rad]."""
        return 200.0 / self.nominal["k1"]

    def noisier(self, factor: float) -> Rig:
        """The same rig with noise and encoder steps times `factor`."""
        return replace(self, chain=self.chain.noisier(factor))


def draw_rig(rng: Generator, recipe: Recipe) -> Rig:
    """Draw a rig on which the recipe's effects are not declared; its values are correlated as those of one size are."""
    bench, hidden = recipe.bench, set(recipe.effects)
    dry = "coulomb_friction" not in hidden and (rng.random() < 0.65 or bool(NEEDS_DRY & hidden))
    plant = _plant(rng, bench.motor_only, dry)
    loose = 1.6 if bench.programme == "poor" else 1.0
    sigma = {
        name: value * loose * float(rng.uniform(0.6, 1.4)) for name, value in TOLERANCE.items() if dry or name != "T_c"
    }
    chain = draw_chain(rng, bench)
    inertia = plant.J_r + plant.J_w + (plant.J_f + plant.J_p) / plant.ratio**2
    controller, declared = draw_controller(rng, inertia, plant, chain, bench)
    runs = draw_runs(rng, plant, bench)
    error_sigma = float(2e-6 * np.exp(rng.normal(0, 0.5)))
    torque_sigma = float(rng.uniform(0.01, 0.04))
    rig = Rig(
        plant=plant,
        sigma=sigma,
        nominal={},
        nominal_error=_nominal_error(rng, plant, error_sigma),
        error_sigma=error_sigma,
        chain=chain,
        torque_sigma=torque_sigma,
        torque_scale=torque_sigma * float(np.clip(rng.normal(), -2, 2)),
        torque_offset=[float(0.001 * rng.normal()) for _ in runs],
        controller=controller,
        declared=declared,
        motor_only=bench.motor_only,
        has_output_torque=bool(not bench.motor_only and rng.random() < 0.5),
        runs=runs,
    )
    shared = rng.normal()
    wrong = {name: np.clip(0.4 * shared + 0.9 * rng.normal(), -2, 2) * sigma[name] for name in sigma}
    return replace(rig, nominal={name: true / float(np.exp(wrong[name])) for name, true in rig.true.items()})


def _plant(rng: Generator, motor_only: bool, dry: bool) -> Plant:
    ratio = float(rng.choice([51, 81, 101, 121] if motor_only else [81, 101, 121, 121, 121, 161]))
    size = rng.normal(0, 0.2)
    J_m = 3.0e-4 * np.exp(size + rng.normal(0, 0.25))
    rotor = rng.uniform(0.5, 0.7)
    share = rng.uniform(0.1, 0.6) if motor_only else np.exp(rng.normal(np.log(0.15), 0.7))
    J_l = J_m * ratio**2 * share
    ring = min(0.06 * J_l, 0.03)
    k1 = 3.1e4 * np.exp(size + rng.normal(0, 0.2)) * (ratio / 121.0) ** 0.3
    return Plant(
        ratio=ratio,
        J_r=J_m * rotor,
        J_w=J_m * (1 - rotor),
        J_f=ring,
        J_p=J_l - ring,
        k_i=rng.uniform(4e3, 9e3),
        c_i=0.02,
        k_c=rng.uniform(2e6, 5e6),
        c_c=60.0,
        B_m=1.2e-3 * np.exp(0.6 * size + rng.normal(0, 0.35)),
        B_l=0.3 * np.exp(rng.normal(0, 0.5)),
        B_sp=1.2 * rng.uniform(0.05, 0.12) * np.sqrt(k1 * J_l),
        k1=k1,
        k3=k1 * rng.uniform(2e5, 6e5),
        **_lines(rng, ratio),
        **empty_arrays(),
        **{**ABSENT, "T_c": float(rng.uniform(0.015, 0.05)) if dry else 0.0},
    )


def _lines(rng: Generator, ratio: float) -> dict[str, Any]:
    """Kinematic error of eccentric wave generator (order 1), two lobes (2, 4) and circular spline (2 - 2/ratio)."""
    orders, sizes = [1.0, 2.0, 4.0], [2.0e-5, 7.0e-5, 1.6e-5]
    if rng.random() < 0.5:
        orders.append(2.0 - 2.0 / ratio)
        sizes.append(2.5e-5)
    count = len(orders)
    amplitude = np.array(sizes) * np.exp(rng.normal(0, 0.3) + rng.normal(0, 0.35, count))
    phase = rng.uniform(-np.pi, np.pi, count)
    return {"te_order": np.array(orders), "te_amplitude": amplitude, "te_phase": phase}


def _nominal_error(rng: Generator, plant: Plant, sigma: float) -> dict[str, list[float]]:
    shift = sigma * np.clip(rng.normal(size=(2, plant.te_order.size)), -2, 2)
    return {
        "orders": plant.te_order.tolist(),
        "cos": (plant.te_amplitude * np.cos(plant.te_phase) + shift[0]).tolist(),
        "sin": (-plant.te_amplitude * np.sin(plant.te_phase) + shift[1]).tolist(),
    }
