"""A rig as it is and as its data sheet says: truth, nominal values, sensors, controller, manoeuvres."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator import manoeuvres
from hdfast.proof.generator.control import NO_NOTCH, Controller, notch
from hdfast.proof.generator.noise import Noise
from hdfast.proof.generator.plant import ABSENT, Array, Plant, empty_field
from hdfast.proof.generator.sensors import Chain
from hdfast.proof.generator.stepping import STEP


@dataclass(frozen=True)
class Run:
    """One recording to be made.

    Attributes:
        kind: manoeuvre.
        closed: True with the controller, False with the torque as input.
        seconds: duration.
        reference: motor speed [rad/s], or torque [N m] where not closed.
        load: torque on the payload [N m].
        temperature: of the gear [degC].
        start: motor angle at the start [rad].
        role: "fit" or "heldout".
        group: day of the bench.
        started_at: [s].
    """

    kind: str
    closed: bool
    seconds: float
    reference: Array
    load: Array
    temperature: Array
    start: float
    role: str
    group: str
    started_at: float


@dataclass(frozen=True)
class Rig:
    """Everything of a case but the effects.

    Attributes:
        plant: the true parameters.
        sigma: relative tolerance of each quantity on the data sheet; its keys are the nominal ones.
        nominal: the data sheet.
        error_sigma: tolerance of a line's cosine and sine [rad].
        chain: the sampling.
        declared_noise: noise and resolution as declared, per channel.
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
    declared_noise: dict[str, dict[str, float]]
    torque_sigma: float
    torque_scale: float
    torque_offset: list[float]
    controller: Controller
    declared: str
    motor_only: bool
    has_output_torque: bool
    runs: list[Run]

    def quieter(self, factor: float) -> Rig:
        """The same rig with its noise and encoder steps reduced by `factor`."""
        chain = self.chain._replace(
            noise=tuple(Noise(n.white * factor, n.pink * factor, n.corner) for n in self.chain.noise),
            resolution=tuple(step * factor for step in self.chain.resolution),
        )
        return replace(self, chain=chain)

    @property
    def windup_range(self) -> float:
        """Windup that no recording leaves [rad]."""
        return 200.0 / self.plant.k1


def draw_rig(rng: Generator, effect: str | None, *, motor_only: bool, hidden: set[str]) -> Rig:
    """Draw a rig.

    Args:
        rng: random stream.
        effect: the effect that the recordings should be able to show, or None.
        motor_only: without a load side.
        hidden: effects that must not be declared, because they are to be found.
    """
    ratio = float(rng.choice([81, 101, 121, 121, 121, 161])) if not motor_only else float(rng.choice([51, 81, 101, 121]))
    common = rng.normal(0, 0.2)
    J = 3.0e-4 * np.exp(common + rng.normal(0, 0.25))
    rotor = rng.uniform(0.5, 0.7)
    J_l = J * ratio**2 * np.exp(rng.normal(np.log(0.15), 0.7)) if not motor_only else J * ratio**2 * rng.uniform(0.1, 0.6)
    stiff = 3.1e4 * np.exp(common + rng.normal(0, 0.2)) * (ratio / 121.0) ** 0.3
    drag = 1.2e-3 * np.exp(0.6 * common + rng.normal(0, 0.35))
    ring = min(0.06 * J_l, 0.03)
    damping = 2 * rng.uniform(0.05, 0.12) * np.sqrt(stiff / J_l) * J_l * 0.6
    lines = _lines(rng, ratio)
    friction = float(rng.uniform(0.015, 0.05))
    dry = not ({"coulomb_friction"} & hidden) and (rng.random() < 0.8 or effect in ("position_dependent_friction", "asymmetric_friction"))
    if "stribeck_friction" in hidden:
        dry = True
    if effect in ("position_dependent_friction", "asymmetric_friction", "presliding_friction", "outside_thixotropy"):
        dry = True
    plant = Plant(
        ratio=ratio, J_r=J * rotor, J_w=J * (1 - rotor), J_f=ring, J_p=J_l - ring, k_i=rng.uniform(4e3, 9e3), c_i=0.02,
        k_c=rng.uniform(2e6, 5e6), c_c=60.0, B_m=drag, B_l=0.3 * np.exp(rng.normal(0, 0.5)), B_sp=damping,
        k1=stiff, k3=stiff * rng.uniform(2e5, 6e5), **lines,
        **empty_field(), **{**ABSENT, "T_c": friction if dry else 0.0},
    )  # fmt: skip
    sigma = {"J_m": 0.08, "J_l": 0.10, "B_m": 0.35, "B_l": 0.5, "B_sp": 0.4, "k1": 0.06, "k3": 0.25}
    sigma = {name: value * rng.uniform(0.6, 1.4) for name, value in sigma.items()}
    if dry:
        sigma["T_c"] = 0.25
    true = {"J_m": J, "J_l": J_l, "B_m": drag, "B_l": plant.B_l, "B_sp": damping, "k1": stiff, "k3": plant.k3, "T_c": friction}
    shared = rng.normal()
    nominal = {
        name: true[name] / np.exp(sigma[name] * np.clip(0.4 * shared + 0.9 * rng.normal(), -2, 2)) for name in sigma
    }
    error_sigma = 2e-6 * np.exp(rng.normal(0, 0.5))
    declared = plant.te_order.size
    shift = error_sigma * np.clip(rng.normal(size=(2, declared)), -2, 2)
    nominal_error = {
        "orders": plant.te_order.tolist(),
        "cos": (plant.te_amplitude * np.cos(plant.te_phase) + shift[0]).tolist(),
        "sin": (-plant.te_amplitude * np.sin(plant.te_phase) + shift[1]).tolist(),
    }
    chain = _chain(rng, motor_only)
    controller = _controller(rng, J + J_l / ratio**2, plant, chain)
    plain = controller.stiffness == controller.friction == 0.0 and controller.notch[1] == 0.0
    declared_as = str(rng.choice(["correct", "incomplete", "absent"] if plain else ["incomplete", "absent"]))
    runs = _runs(rng, plant, controller, effect, motor_only)
    torque_sigma = float(rng.uniform(0.01, 0.04))
    return Rig(
        plant, sigma, {k: float(v) for k, v in nominal.items()}, nominal_error, float(error_sigma), chain, {},
        torque_sigma, float(torque_sigma * np.clip(rng.normal(), -2, 2)),
        [float(0.001 * rng.normal()) for _ in runs], controller, declared_as,
        motor_only, bool(not motor_only and rng.random() < 0.5), runs,
    )  # fmt: skip


def _lines(rng: Generator, ratio: float) -> dict[str, Array]:
    """Kinematic error of three eccentric parts and two lobes: wave generator, flexspline, circular spline."""
    scale = np.exp(rng.normal(0, 0.3))
    orders = [1.0, 2.0, 4.0]
    sizes = [2.0e-5, 7.0e-5, 1.6e-5]
    if rng.random() < 0.5:
        orders += [2.0 - 2.0 / ratio]
        sizes += [2.5e-5]
    amplitude = scale * np.array(sizes) * np.exp(rng.normal(0, 0.35, len(sizes)))
    phase = rng.uniform(-np.pi, np.pi, len(sizes))
    return {"te_order": np.array(orders), "te_amplitude": amplitude, "te_phase": phase, "te_drift": np.zeros(len(sizes))}


def _chain(rng: Generator, motor_only: bool) -> Chain:
    rate = float(rng.choice([100.0, 250.0, 500.0, 1000.0])) if motor_only else float(rng.choice([500.0, 1000.0]))
    level = np.exp(rng.normal(0, 0.4))
    torque = 0.003 * level
    return Chain(
        rate=rate,
        averaged=bool(rng.random() < 0.5),
        jitter=float(rng.uniform(0.01, 0.05)),
        dropped=float(rng.choice([0.0, 0.0, 0.002, 0.01])),
        skew=float(rng.uniform(-2e-4, 2e-4)),
        resolution=(
            2 * np.pi / 2 ** int(rng.choice([14, 16, 17])),
            2 * np.pi / 2 ** int(rng.choice([18, 19, 20])),
            float(rng.choice([0.0, 5e-4, 2e-3])),
            float(rng.choice([0.0, 0.02])),
        ),
        noise=(
            Noise(1e-5, 0.0, 1.0),
            Noise(3.0e-6 * level, rng.uniform(8e-6, 2.5e-5) * level, rng.uniform(300.0, 1500.0)),
            Noise(torque * rng.uniform(0.5, 1.5), torque * rng.uniform(0.5, 1.5), rng.uniform(200.0, 1500.0)),
            Noise(0.1 * level, 0.25 * level, rng.uniform(300.0, 1500.0)),
        ),
    )


def _controller(rng: Generator, inertia: float, plant: Plant, chain: Chain) -> Controller:
    bandwidth = 2 * np.pi * rng.uniform(6.0, 30.0)
    kp = inertia * bandwidth
    period = float(rng.choice([5e-4, 1e-3]))
    odd = rng.random()
    return Controller(
        closed=1,
        kp=float(kp),
        ki=float(kp * bandwidth * rng.uniform(0.1, 0.35)),
        stiffness=float(rng.uniform(4.0, 15.0)) if rng.random() < 0.25 else 0.0,
        limit=float(rng.uniform(1.0, 3.0)),
        samples=round(period / STEP),
        step=chain.resolution[0],
        smoothing=float(rng.uniform(0.2, 0.6)),
        friction=float(plant.T_c * rng.uniform(0.4, 1.6)) if odd < 0.3 else 0.0,
        viscous=float(plant.B_m * rng.uniform(0.4, 1.6)) if odd < 0.3 else 0.0,
        notch=notch(rng.uniform(40, 90), 0.5, period) if odd > 0.8 else NO_NOTCH.copy(),
    )


def _runs(rng: Generator, plant: Plant, controller: Controller, effect: str | None, motor_only: bool) -> list[Run]:
    count = int(rng.integers(4, 9))
    kinds = list(rng.permutation(list(manoeuvres.SPEEDS)))[:count]
    kinds += list(rng.choice(list(manoeuvres.SPEEDS), max(count - len(kinds), 0)))
    heldout = set(rng.choice(count, 1 if count < 6 else 2, replace=False).tolist())
    top = float(rng.uniform(100.0, 400.0)) * manoeuvres.RPM
    load_bench = not motor_only and (rng.random() < 0.7 or effect in ("load_dependent_friction", "mesh_stiffness_variation", "te_load_dependence"))
    load_size = float(rng.uniform(15.0, 50.0)) if load_bench else 0.0
    warm = rng.random() < 0.5 or effect == "thermal_viscous"
    clock = 0.0
    ambient = float(rng.uniform(18.0, 26.0))
    groups = sorted(rng.integers(0, max(count // 2, 2), count).tolist())
    runs = []
    for k in range(count):
        seconds = float(rng.uniform(3.0, 8.0))
        t = manoeuvres.time_grid(seconds)
        speed = top * rng.uniform(0.4, 1.0)
        reference = manoeuvres.SPEEDS[kinds[k]](rng, t, speed)
        load = manoeuvres.load_profile(rng, t, load_size)
        level = ambient + (k / max(count - 1, 1) * rng.uniform(8.0, 20.0) if warm else 0.0) + rng.normal(0, 0.2)
        runs.append(
            Run(
                str(kinds[k]), True, seconds, np.asarray(reference), load, level + 0.02 * t,
                float(rng.uniform(-np.pi, np.pi)), "heldout" if k in heldout else "fit", "ABCDEFGH"[groups[k]], clock,
            )  # fmt: skip
        )
        clock += seconds + float(rng.uniform(30.0, 600.0))
    return runs
