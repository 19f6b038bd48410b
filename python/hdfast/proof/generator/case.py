"""Build one case: rig, motion, nuisance, effects at a stated multiple of what is detectable, recordings, label."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator import sensors, stepping
from hdfast.proof.generator.campaign_file import recordings_channels, write_case
from hdfast.proof.generator.effects import EFFECTS, Drive, Shape
from hdfast.proof.generator.linear import Linearisation, Motion, detectable, linearise
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.rig import Rig, Run, draw_rig

VERSION = "1"


class Unfit(Exception):
    """These draws cannot make the case that the recipe asks for."""


NUISANCE = (
    "asymmetric_friction", "nonlinear_viscous", "position_dependent_friction", "load_dependent_friction", "hysteresis",
    "soft_windup", "viscoelastic", "te_harmonic", "te_load_dependence", "cogging", "torque_ripple",
    "gravity_unbalance", "encoder_eccentricity", "sensor_delay", "clock_skew", "thermal_viscous", "load_compliance",
    "sensor_offset_drift", "load_side_friction",
)  # fmt: skip


@dataclass(frozen=True)
class Recipe:
    """What a case is to hold.

    Attributes:
        kind: stratum.
        effects: effect id -> amplitude in detectable amplitudes.
        motor_only: without a load side.
        seed: of every draw.
    """

    kind: str
    effects: dict[str, float]
    motor_only: bool
    seed: int


def simulate(rig: Rig, drive: Drive, run: Run, noise: Generator) -> Array:
    """Traces of one recording on the grid."""
    p = drive.plant
    start = stepping.start_at_rest(p, run.start, float(run.load[0]))
    jitter = 1e-5 * noise.standard_normal(run.reference.size)
    controller = rig.controller if run.closed else rig.controller._replace(closed=0)
    return np.asarray(stepping.run(p, controller, run.reference, run.load, run.temperature, jitter, start))


def motion(traces: Array, run: Run) -> Motion:
    """The motion of one recording, for the linear statistics."""
    named = dict(zip(stepping.TRACES, traces, strict=True))
    speed = named["motor_speed"]
    ring = named["load_angle"][0]
    return Motion(
        named["motor_angle"], speed, np.gradient(speed, stepping.GRID), run.load, run.temperature,
        np.array([ring, ring - run.load[0] / 3e6]),
    )  # fmt: skip


def record(rig: Rig, drive: Drive, run: Run, index: int, rng: Generator) -> dict[str, Array]:
    """The columns of one recording."""
    traces = simulate(rig, drive, run, rng)
    grid = sensors.disturb(sensors.clean(traces, drive.faults), rig.chain, rng)
    grid["motor_torque"] = grid["motor_torque"] * (1.0 + rig.torque_scale) + rig.torque_offset[index]
    shown = {name: grid[name] for name in recordings_channels(rig)}
    if run.load.any() and not rig.motor_only:
        shown["load_torque"] = run.load
    if run.closed:
        shown["speed_reference"] = run.reference
    shown["temperature"] = run.temperature + 0.05 * rng.standard_normal(run.temperature.size)
    return sensors.sample(shown, rig.chain, rng)


@dataclass(frozen=True)
class Named:
    """An effect of a case with its detectable size."""

    id: str
    amplitude: float
    detectable: float
    visibility: float
    shape: Shape


def choose(lin: Linearisation, ids: dict[str, float], rng: Generator) -> list[Named]:
    """Size effects, each at its multiple of the detectable amplitude, whatever its physical limit."""
    named = []
    for effect_id, multiple in ids.items():
        shape = EFFECTS[effect_id].shape(rng)
        least, visibility = detectable(lin, EFFECTS[effect_id], shape)
        named.append(Named(effect_id, float(multiple * least), float(least), visibility, shape))
    return named


def plausible(
    rig: Rig, drive: Drive, motions: list[Motion], recipe: Recipe, rng: Generator
) -> tuple[Rig, Linearisation, list[Named]]:
    """Size the effects; where one passes its physical limit, the bench gets quieter sensors.

    Raises:
        Unfit: the limit is passed even so.
    """
    for _ in range(3):
        lin = linearise(rig, drive, motions, rng)
        named = choose(lin, recipe.effects, rng)
        excess = max((n.amplitude / EFFECTS[n.id].limit for n in named), default=0.0)
        if excess <= 1.0:
            return rig, lin, named
        rig = rig.quieter(max(0.9 / excess, 0.15))
    raise Unfit(f"{recipe}: {excess:.2g} times the physical limit")


def nuisance(rng: Generator, taken: set[str], *, motor_only: bool) -> dict[str, float]:
    """Two to four unlabelled minor effects, 0.05 to 0.3 detectable amplitudes, at most 0.6 in quadrature."""
    able = [n for n in NUISANCE if n not in taken and not (motor_only and EFFECTS[n].needs_load_side)]
    chosen = rng.choice(able, int(rng.integers(2, 5)), replace=False)
    sizes = rng.uniform(0.05, 0.3, chosen.size)
    total = float(np.sqrt(np.sum(sizes**2)))
    return dict(zip(chosen.tolist(), (sizes * min(1.0, 0.6 / total)).tolist(), strict=True))


def build(recipe: Recipe, folder: Path) -> dict[str, Any]:
    """Write one case and return its label."""
    rng = np.random.default_rng(recipe.seed)
    first = next(iter(recipe.effects), None)
    rig = draw_rig(rng, first, motor_only=recipe.motor_only, hidden=set(recipe.effects))
    bare = Drive(rig.plant, sensors.SOUND)
    fit = [run for run in rig.runs if run.role == "fit"]
    motions = [motion(simulate(rig, bare, run, rng), run) for run in fit]
    rig, lin, named = plausible(rig, bare, motions, recipe, rng)
    full = bare
    for n in named:
        full = EFFECTS[n.id].on(full, n.amplitude, n.shape)
    minor = [
        n
        for n in choose(lin, nuisance(rng, set(recipe.effects), motor_only=rig.motor_only), rng)
        if n.amplitude <= EFFECTS[n.id].limit
    ]
    for n in minor:
        full = EFFECTS[n.id].on(full, n.amplitude, n.shape)
    recordings = [record(rig, full, run, k, rng) for k, run in enumerate(rig.runs)]
    write_case(folder, rig, recordings, sensors.recorded_noise(rig.chain, rng), rng)
    return {
        "kind": [recipe.kind],
        "effects": [
            {
                "id": n.id,
                "place": EFFECTS[n.id].place,
                "amplitude": n.amplitude,
                "amplitude_over_mda": n.amplitude / n.detectable,
                "visibility": n.visibility,
                "true_parameters": EFFECTS[n.id].parameters(n.amplitude, n.shape),
            }
            for n in named
        ],
        "nuisance": [{"id": n.id, "amplitude_over_mda": n.amplitude / n.detectable} for n in minor],
        "motor_only": rig.motor_only,
        "generator": {"version": VERSION, "seed": recipe.seed},
    }
