"""Stretches of constant motor speed and what was measured in them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.health.reference import RPM
from hdfast.health.units import CLOSE, DEGREES, explained
from hdfast.identify.angles import refuse_wrapped
from hdfast.recordings import Recording

SETTLE = 0.2
STILL = 1e-9  # rad/s, of a reference: smaller steps are none, smaller speeds are rest
PIECES = 8
STAYS, SECOND = 0.05, 1.0  # share of a speed by which it may change, and the time [s] in which it may
SCATTER = 15.0  # of the angle about a parabola: three deviations of what 32 samples tell of the change
WANDERS = 0.02  # share of its way by which an angle strays from a parabola, beyond a turn, where its speed has changed
TURN = 2.0 * math.pi
UNITS = {
    DEGREES: "motor_angle looks like degrees: scale = 0.0174533 in [columns] motor_angle",
    DEGREES / RPM: "motor_angle looks like degrees and speed_reference like r/min: "
    "scale = 0.0174533 in [columns] motor_angle",
    1.0 / DEGREES: "speed_reference looks like deg/s: scale = 0.0174533 in [columns] speed_reference",
}


@dataclass(frozen=True, eq=False)
class Plateaus:
    """Means over constant speeds, each (n,).

    Attributes:
        speed: motor speed [rad/s].
        torque: motor torque less the share of the load [N m].
        noise: standard deviation of that mean [N m].
        load: output torque [N m].
        temperature: [degC]; NaN where it is not recorded.
        turns: motor revolutions averaged.
    """

    speed: Floats
    torque: Floats
    noise: Floats
    load: Floats
    temperature: Floats
    turns: Floats


def plateaus(recordings: list[Recording], ratio: float, notes: list[str]) -> Plateaus:
    """Collect the constant speeds of all recordings.

    A recording with speed_reference may hold many speeds, one without it must hold a single one. The first fifth of
    each is left out, and so are rest and, with a note, the stairs of a ramp; whole revolutions are averaged where there
    is one. An optional column that is hardly filled is noted.

    Raises:
        InputError: a column is missing, the motor angle is wrapped or at odds with the reference, or no constant speed
            is found.
    """
    rows: list[tuple[float, ...]] = []
    for recording in recordings:
        rows += _of(recording, ratio, notes)
    if len(rows) < 3:
        names = ", ".join(recording.name for recording in recordings)
        raise InputError(
            f"{names[:400]}: {len(rows) or 'no'} constant speeds found (at least 3 needed): "
            "is it a friction ladder? `hdfast bench friction` makes one"
        )
    return Plateaus(*np.array(rows).T)


def _of(recording: Recording, ratio: float, notes: list[str]) -> list[tuple[float, ...]]:
    names = ["t", "motor_angle", "motor_torque"]
    extra = recording.optional(notes, "speed_reference", "load_torque", "temperature")
    found = dict(zip([*names, *extra], recording.need("a friction ladder", *names, *extra), strict=True))
    refuse_wrapped(recording, "motor_angle", ratio=ratio)
    size = len(found["t"])
    if "speed_reference" in found:
        reference = found["speed_reference"]
        edges = np.flatnonzero(np.abs(np.diff(reference)) > STILL) + 1
        bounds = pairwise(np.concatenate([[0], edges, [size]]))
        stretches = [(a, b) for a, b in bounds if abs(reference[a]) > STILL]
    else:
        stretches = [(0, size)]
    settled = [slice(a + int(SETTLE * (b - a)), b) for a, b in stretches]
    parts = [{name: v[at] for name, v in found.items()} for at in settled if at.stop - at.start >= 4 * PIECES]
    steady = [part for part in parts if _stays(part["t"], part["motor_angle"])]
    ramped = len(parts) - len(steady)
    if ramped:
        if "speed_reference" not in found:
            raise InputError(
                f"{recording.name}: the speed is not constant, and speed_reference, which tells its steps, is missing"
            )
        notes.append(f"{recording.name}: {ramped} steps of speed_reference left out, during which the speed changes")
    pairs = [(part, row) for part in steady if (row := _mean(part, ratio)) is not None]
    rows = [row for _, row in pairs]
    if rows and "speed_reference" in found:
        speed, torque = np.array(rows)[:, :2].T
        _refuse_at_odds(recording, speed, torque, np.array([part["speed_reference"][0] for part, _ in pairs]))
    return rows


def _refuse_at_odds(recording: Recording, speed: Floats, torque: Floats, asked: Floats) -> None:
    """Refuse speeds [rad/s] that run against those asked for, or are in degrees, each (n,).

    A reference in r/min or of the output does no harm: only its steps are used.

    Raises:
        InputError: naming the recording, the column that is wrong and how to mend it.
    """
    factors = speed / asked
    common = float(np.median(factors))
    if np.median(np.abs(factors - common)) > CLOSE * abs(common):
        return
    if common < 0.0:
        taken = speed @ torque < 0.0  # energy from the drive
        wrong, right = ("motor_angle", "speed_reference") if taken else ("speed_reference", "motor_angle")
        raise InputError(
            f"{recording.name}: motor_angle runs against speed_reference, and motor_torque goes with {right}: "
            f"flip the sign of scale in [columns] {wrong}"
        )
    hint = explained(common, UNITS)
    if hint:
        raise InputError(f"{recording.name}: motor_angle turns {common:.4g} times as fast as speed_reference; {hint}")


def _stays(t: Floats, angle: Floats) -> bool:
    """Whether the speed of a stretch (n,) changes by less than a share of it, in less than a second by as much less.

    What the scatter of the angle hides is no change; where it is a part of several turns, it is one of the motion.
    """
    duration = float(t[-1] - t[0])
    x = (t - t[0]) / duration - 0.5
    curve = np.polyfit(x, angle, 2)
    scatter = float(np.std(angle - np.polyval(curve, x)))
    if scatter > max(WANDERS * float(np.ptp(angle)), TURN):
        return False
    allowed = STAYS * abs(curve[1]) * min(duration / SECOND, 1.0)
    return bool(2.0 * abs(curve[0]) <= max(allowed, SCATTER * scatter))


def _mean(part: dict[str, Floats], ratio: float) -> tuple[float, ...] | None:
    travelled = np.abs(part["motor_angle"] - part["motor_angle"][-1])
    whole = math.floor(travelled[0] / TURN)
    if whole:
        begin = int(np.flatnonzero(travelled >= whole * TURN)[-1])
        part = {name: values[begin:] for name, values in part.items()}
    duration = part["t"][-1] - part["t"][0]
    speed = float((part["motor_angle"][-1] - part["motor_angle"][0]) / duration)
    if speed == 0.0:
        return None
    load = part.get("load_torque", np.zeros_like(part["t"]))
    torque = part["motor_torque"] - load / ratio
    steps = np.diff(torque)
    noise = float(np.std(steps) / math.sqrt(2.0) / math.sqrt(len(torque)))
    warm = float(np.mean(part["temperature"])) if "temperature" in part else math.nan
    return speed, float(np.mean(torque)), noise, float(np.mean(load)), warm, abs(speed) * duration / TURN
