"""The recordings of one campaign: manoeuvres, loads, temperatures, days."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator import manoeuvres
from hdfast.proof.generator.plant import Array, Plant
from hdfast.proof.generator.recipe import Bench

ONE_KIND = ("sine", "sine", "constant", "multisine", "reversals")
ONE_WAY = ("constant", "start_stop", "ladder")


@dataclass(frozen=True)
class Run:
    """One recording to be made.

    Attributes:
        kind: manoeuvre.
        closed: True with the speed controller, False with the torque as input.
        reference: motor speed [rad/s], or torque [N m] where not closed, on the grid.
        load: torque on the payload [N m].
        temperature: of the gear [degC].
        start: motor angle at the start [rad].
        role: "fit" or "heldout".
        group: day of the bench.
        started_at: [s].
    """

    kind: str
    closed: bool
    reference: Array
    load: Array
    temperature: Array
    start: float
    role: str
    group: str
    started_at: float


def draw_runs(rng: Generator, plant: Plant, bench: Bench) -> list[Run]:
    """The recordings of a campaign, one or two of them held out."""
    count = int(rng.integers(bench.recordings[0], bench.recordings[1] + 1))
    kinds = _kinds(rng, bench, count)
    heldout = set(rng.choice(count, 1 if count < 6 else 2, replace=False).tolist())
    top = float(rng.uniform(900.0, 1500.0) if bench.fast else rng.uniform(100.0, 400.0)) * manoeuvres.RPM
    loaded = not bench.motor_only and bench.load != "none" and (rng.random() < 0.7 or bench.load == "constant")
    size = float(rng.uniform(15.0, 50.0)) if loaded else 0.0
    warm = bench.warm or rng.random() < 0.4
    ambient, heating = float(rng.uniform(18.0, 26.0)), float(rng.uniform(8.0, 20.0))
    days = sorted(rng.integers(0, max(count // 2, 3), count).tolist())
    fraction = rng.uniform(0.7, 1.0)
    clock, runs = 0.0, []
    for k, kind in enumerate(kinds):
        seconds = float(rng.uniform(*bench.seconds))
        t = manoeuvres.time_grid(seconds)
        speed = top * (fraction if bench.programme == "poor" else rng.uniform(0.4, 1.0))
        reference = manoeuvres.SPEEDS[kind](rng, t, speed)
        if bench.programme == "one_way":
            reference = np.abs(reference)
        closed = kind not in manoeuvres.TORQUES
        if not closed:
            reference = reference / speed * (plant.B_m * speed + 1.3 * plant.T_c)
        load = manoeuvres.load_profile(rng, t, size if closed else 0.0, bench.load)
        level = ambient + (k / (count - 1) * heating if warm else 0.0) + rng.normal(0, 0.2)
        role = "heldout" if k in heldout else "fit"
        start = float(rng.uniform(-np.pi, np.pi))
        runs.append(Run(kind, closed, reference, load, level + 0.02 * t, start, role, "ABCDEFGH"[days[k]], clock))
        clock += seconds + float(rng.uniform(30.0, 600.0))
    return runs


def _kinds(rng: Generator, bench: Bench, count: int) -> list[str]:
    if bench.programme == "poor":
        return [str(rng.choice(ONE_KIND))] * count
    if bench.programme == "one_way":
        return [str(k) for k in rng.choice(ONE_WAY, count)]
    if bench.programme == "steady":
        return ["constant"] * count
    usual = [k for k in manoeuvres.SPEEDS if k not in manoeuvres.TORQUES or rng.random() < 0.4]
    kinds = [str(k) for k in rng.permutation(usual)[:count]]
    return kinds + [str(k) for k in rng.choice(usual, count - len(kinds))]
