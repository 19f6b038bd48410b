"""Coverage: what the recordings of a group went through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import REJECT
from hdfast.health.stretches import stretches
from hdfast.health.subject import Subject
from hdfast.sensors.facts import SensorFacts

NAME = "coverage"
FEWEST_STEPS = 5.0
STANDSTILL = 0.02
SHORTEST_PAUSE = 0.1
Range = tuple[float, float]


@dataclass(frozen=True)
class Coverage:
    """What one group of recordings shows.

    Attributes:
        group: its name.
        recordings: how many.
        seconds: together, gaps left out.
        speed: slowest and fastest motor speed [rad/s], signed.
        directions: directions of motion, of "forward" and "backward".
        reversals: changes of direction.
        starts: beginnings of a motion from standstill.
        torque: smallest and largest motor torque [N m].
        load: smallest and largest torque at the output or of the load [N m], or None.
        revolutions: of the motor, together.
        temperature: lowest and highest [degC], or None.
    """

    group: str
    recordings: int
    seconds: float
    speed: Range
    directions: tuple[str, ...]
    reversals: int
    starts: int
    torque: Range
    load: Range | None
    revolutions: float
    temperature: Range | None


def check(subject: Subject) -> None:
    """Reject a recording in which the motor does not move."""
    angle = subject.checked["motor_angle"]
    travel = float(np.nanmax(angle) - np.nanmin(angle)) if np.isfinite(angle).any() else 0.0
    stated = subject.campaign.sensors.get("motor_angle", SensorFacts())
    sizes = {"resolution": subject.facts.resolution.get("motor_angle", 0.0), "noise": stated.noise or 0.0}
    name = max(sizes, key=sizes.__getitem__)
    least = FEWEST_STEPS * sizes[name]
    if travel > least:
        return
    sentence = f"the motor does not move: motor_angle changes by {travel:.3g} rad"
    if travel > 0.0 and getattr(stated, name) == sizes[name]:
        sentence += f", at most {FEWEST_STEPS:g} times its {name} of {sizes[name]:.3g} rad; correct [sensors], or"
    else:
        sentence += ";"
    subject.find(NAME, REJECT, f"{sentence} leave the recording out", value=travel, limit=least)


def coverage(subjects: Sequence[Subject]) -> list[Coverage]:
    """One row per group, over the recordings that are not rejected."""
    usable = [subject for subject in subjects if not subject.rejected]
    groups = dict.fromkeys(subject.recording.group for subject in usable)
    return [_row(group, [item for item in usable if item.recording.group == group]) for group in groups]


def _row(group: str, members: list[Subject]) -> Coverage:
    speeds = [item.motion.speed[item.motion.valid] for item in members]
    signs = [_directions(speed) for speed in speeds]
    pauses = [round(SHORTEST_PAUSE / item.motion.step) for item in members]
    low, high = _range(speeds) or (0.0, 0.0)
    still = STANDSTILL * max(abs(low), abs(high))
    names = [name for name, seen in (("forward", high > still), ("backward", low < -still)) if seen]
    loads = [
        item.checked[name] for item in members for name in ("output_torque", "load_torque") if name in item.checked
    ]
    gaps = sum(end - begin for item in members for begin, end in item.facts.gaps)
    return Coverage(
        group,
        len(members),
        sum(float(item.motion.t[-1] - item.motion.t[0]) for item in members) - gaps,
        (low, high),
        tuple(names),
        sum(_reversals(sign) for sign in signs),
        sum(_starts(sign, pause) for sign, pause in zip(signs, pauses, strict=True)),
        _range([item.checked["motor_torque"] for item in members]) or (0.0, 0.0),
        _range(loads),
        sum(float(np.sum(np.abs(np.diff(item.motion.angle[item.motion.valid])))) for item in members) / (2.0 * np.pi),
        _range([item.checked["temperature"] for item in members if "temperature" in item.checked]),
    )


def _range(arrays: list[Floats]) -> Range | None:
    joined = np.concatenate(arrays) if arrays else np.zeros(0)
    known = joined[np.isfinite(joined)]
    return (float(known.min()), float(known.max())) if known.size else None


def _directions(speed: Floats) -> Floats:
    """-1, 0 or 1; a direction holds until the speed passes the band of standstill."""
    largest = float(np.max(np.abs(speed), initial=0.0))
    return np.where(np.abs(speed) > STANDSTILL * largest, np.sign(speed), 0.0)


def _reversals(sign: Floats) -> int:
    moving = sign[sign != 0.0]
    return int(np.sum(moving[1:] != moving[:-1]))


def _starts(sign: Floats, pause: int) -> int:
    """Departures from a standstill of at least so many samples."""
    begins, ends = stretches(sign == 0.0)
    return int(np.sum((ends - begins >= pause) & (ends < len(sign))))
