"""Piecewise inputs as the core takes them: a table of segments, one row per piece (21 columns)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np

from hdfast.checks import Floats

WIDTH = 21
KIND, BUMPLESS = 1, 2
TORQUE, SPEED, MOTION = 0.0, 1.0, 2.0
COLUMN = {"torque": 3, "sustain": 5, "hold": 7, "reference": 9, "set_speed": 11, "load": 13, "set_load": 15}
MOTION_COLUMN = 17


@dataclass(frozen=True)
class Track:
    """One signal: from t[j] on it is value[j] + slope[j] (time - t[j]); t[0] = 0."""

    t: Floats
    value: Floats
    slope: Floats

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Value and slope just after each time."""
        j = np.searchsorted(self.t, t, side="right") - 1
        return self.value[j] + self.slope[j] * (t - self.t[j]), self.slope[j]


def constant(value: float) -> Track:
    """The same value for ever."""
    return Track(np.zeros(1), np.array([float(value)]), np.zeros(1))


def held(t: Floats, value: Floats) -> Track:
    """Each sample holds until the next one; the first also before its time."""
    start = np.array(t, dtype=np.float64)
    start[0] = 0.0
    return Track(start, np.array(value, dtype=np.float64), np.zeros(len(start)))


def linear(t: Floats, value: Floats) -> Track:
    """Straight lines between samples; the first and last values hold outside. Two samples at one time make a jump."""
    if t[0] > 0.0:
        t, value = np.concatenate([[0.0], t]), np.concatenate([value[:1], value])
    step = np.diff(t)
    slope = np.append(np.divide(np.diff(value), step, out=np.zeros_like(step), where=step > 0.0), 0.0)
    last_of_time = np.append(step > 0.0, True)
    return Track(t[last_of_time], np.asarray(value, dtype=np.float64)[last_of_time], slope[last_of_time])


def assemble(
    t_end: float, phases: Sequence[tuple[float, float, bool]], tracks: dict[str, Track], motion: Any = None
) -> Floats:
    """Merge all breakpoints before t_end into the segment table.

    Args:
        t_end: end of the run [s].
        phases: (start time, kind, bumpless) of each control phase; the first starts at 0.
        tracks: signals by the names in `COLUMN`.
        motion: `scipy.interpolate.PPoly` of theta_m for segments of kind motion.
    """
    knots = [np.array([phase[0] for phase in phases]), *(track.t for track in tracks.values())]
    if motion is not None:
        knots.append(motion.x[motion.x > 0.0])
    t = np.unique(np.concatenate(knots))
    t = t[t < t_end]
    table = np.zeros((len(t), WIDTH))
    table[:, 0] = t
    for start, kind, bumpless in phases:
        table[t >= start, KIND] = kind
        table[t == start, BUMPLESS] = float(bumpless)
    for name, track in tracks.items():
        table[:, COLUMN[name]], table[:, COLUMN[name] + 1] = track.at(t)
    if motion is not None:
        for power in range(4):
            table[:, MOTION_COLUMN + power] = motion(t, nu=power) / factorial(power)
    table.flags.writeable = False
    return table
