"""One more recording of a case: the motion that a tool asks for, or one at random within the same limits."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator import manoeuvres
from hdfast.proof.generator.campaign_file import add_recording
from hdfast.proof.generator.case import Built, record, sampled
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.programme import Run
from hdfast.proof.generator.stepping import GRID

SHORTEST, LONGEST, FASTEST, FARTHEST = 0.1, 60.0, 1e3, 1e5  # of a motion that can be run [s, s, rad/s, rad]
PAUSE = 600.0


def runnable(experiment: Any) -> bool:
    """Whether an answer's `next_experiment` tells a motion of the motor, its limits and where it starts."""
    try:
        parts, limits = experiment["manoeuvre"]["segments"], experiment["limits"]
        times = [part[key] for part in parts for key in ("ramp_s", "hold_s")]
        speeds = [*(part["speed_rad_s"] for part in parts), limits["speed_rad_s"]]
        low, high = _range(limits)
        angles = [experiment["manoeuvre"]["start_angle_rad"], low, high]
    except (KeyError, TypeError):
        return False
    if not all(isinstance(value, int | float) for value in (*times, *speeds, *angles)):
        return False
    lasting = all(time >= 0.0 for time in times) and SHORTEST <= sum(times) <= LONGEST
    slow, near = all(abs(v) <= FASTEST for v in speeds), all(abs(x) <= FARTHEST for x in angles)
    return lasting and slow and near and low <= high


def _range(limits: Mapping[str, Any]) -> tuple[float, float]:
    return limits["low_angle_rad"], limits["high_angle_rad"]


def add(case: Path, folder: Path, built: Built, motion: tuple[Array, float], rng: Generator) -> None:
    """A copy of a case with one more recording: a speed to be followed [rad/s] on the grid from an angle [rad].

    The load is left alone, and the gear as warm as it was in the mean.
    """
    reference, start = motion
    rig, last = built.rig, built.rig.runs[-1]
    run = Run(
        kind="further",
        closed=True,
        reference=reference,
        load=np.zeros(reference.size),
        temperature=np.full(reference.size, np.mean([one.temperature.mean() for one in rig.runs])),
        start=start,
        role="fit",
        group="further",
        started_at=last.started_at + PAUSE,
    )
    rig = replace(rig, runs=[*rig.runs, run], torque_offset=[*rig.torque_offset, 0.001 * float(rng.normal())])
    made = record(rig, built.drive, run, len(rig.runs) - 1, rng)
    shutil.copytree(case, folder)
    add_recording(folder, "further", run, sampled(rig, run, made.noisy, rng))


def asked(experiment: Mapping[str, Any]) -> tuple[Array, float]:
    """The motion that is asked for: from one speed to the next on half a cosine, then held."""
    segments = experiment["manoeuvre"]["segments"]
    t = manoeuvres.time_grid(sum(part["ramp_s"] + part["hold_s"] for part in segments))
    reference, begin, before = np.zeros_like(t), 0.0, 0.0
    for part in segments:
        later = t >= begin
        risen = np.clip((t[later] - begin) / max(part["ramp_s"], GRID), 0.0, 1.0)
        reference[later] = before + (part["speed_rad_s"] - before) * 0.5 * (1.0 - np.cos(math.pi * risen))
        begin, before = begin + part["ramp_s"] + part["hold_s"], part["speed_rad_s"]
    return reference, float(experiment["manoeuvre"]["start_angle_rad"])


def drawn(experiment: Mapping[str, Any], rng: Generator) -> tuple[Array, float]:
    """A usual motion of as many seconds, no faster and no farther than the one that is asked for may be."""
    reference, _ = asked(experiment)
    low, high = _range(experiment["limits"])
    kind = str(rng.choice([one for one in manoeuvres.SPEEDS if one not in manoeuvres.TORQUES]))
    top = experiment["limits"]["speed_rad_s"] * rng.uniform(0.4, 1.0)
    speed = manoeuvres.SPEEDS[kind](rng, np.asarray(GRID * np.arange(reference.size)), top)
    angle = GRID * np.cumsum(speed)
    share = min(1.0, (high - low) / max(float(np.ptp(angle)), 1e-9))
    return share * speed, float(0.5 * (low + high) - 0.5 * share * (angle.min() + angle.max()))
