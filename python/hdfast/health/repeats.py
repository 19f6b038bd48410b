"""Repeats: recordings with equal input, and how far their outputs differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hdfast.checks import Floats
from hdfast.health.subject import Subject

EQUAL = 0.05
SAME_LENGTH = 0.02


@dataclass(frozen=True)
class Repeat:
    """Two recordings with equal input.

    Attributes:
        recordings: their positions in the campaign.
        names: their names.
        input: the column that is equal.
        variance: by output channel, half the variance of the difference, in the squared unit of the channel:
            "motor_speed", "motor_torque", "transmission_error", "output_torque".
    """

    recordings: tuple[int, int]
    names: tuple[str, str]
    input: str
    variance: Mapping[str, float]


def repeats(subjects: Sequence[Subject]) -> list[Repeat]:
    """Every pair of usable recordings whose speed reference, or else motor torque, is equal within 5 %."""
    usable = [(position, subject) for position, subject in enumerate(subjects) if not subject.rejected]
    found = []
    for (i, one), (j, other) in combinations(usable, 2):
        column = next((name for name in ("speed_reference", "motor_torque") if _both(name, one, other)), None)
        if column is not None and _equal(one, other, column):
            names = one.recording.name, other.recording.name
            found.append(Repeat((i, j), names, column, _variance(one, other)))
    return found


def _both(name: str, one: Subject, other: Subject) -> bool:
    return name in one.checked and name in other.checked


def _series(subject: Subject, column: str, grid: Floats) -> Floats:
    """The samples of a column nearest to times since the begin of the recording, as they are: no noise averaged."""
    known = np.isfinite(subject.checked[column])
    t = subject.checked["t"]
    moments = (t - t[0])[known]
    nearest = np.searchsorted(0.5 * (moments[1:] + moments[:-1]), grid)
    return np.asarray(subject.checked[column][known][nearest], dtype=np.float64)


def _equal(one: Subject, other: Subject, column: str) -> bool:
    spans = [float(np.ptp(item.checked["t"])) for item in (one, other)]
    if abs(spans[0] - spans[1]) > SAME_LENGTH * max(spans):
        return False
    grid = _grid(one, other)
    first, second = _series(one, column, grid), _series(other, column, grid)
    return bool(np.std(first) > 0.0 and np.std(first - second) < EQUAL * np.std(first))


def _grid(one: Subject, other: Subject) -> Floats:
    span = min(float(np.ptp(item.checked["t"])) for item in (one, other))
    return np.linspace(0.0, span, max(8, int(span * min(one.facts.rate_hz, other.facts.rate_hz))))


def _variance(one: Subject, other: Subject) -> dict[str, float]:
    grid = _grid(one, other)
    found = {}
    for name, series in (("motor_speed", _speed), ("transmission_error", _error)):
        first, second = series(one, grid), series(other, grid)
        if first is not None and second is not None:
            found[name] = 0.5 * float(np.var(first - second))
    for name in ("motor_torque", "output_torque"):
        if _both(name, one, other):
            found[name] = 0.5 * float(np.var(_series(one, name, grid) - _series(other, name, grid)))
    return found


def _speed(subject: Subject, grid: Floats) -> Floats:
    motion = subject.motion
    return np.interp(grid, motion.t - motion.t[0], motion.speed)


def _error(subject: Subject, grid: Floats) -> Floats | None:
    motion = subject.motion
    if motion.load_angle is None or subject.ratio is None:
        return None
    return np.interp(grid, motion.t - motion.t[0], motion.angle / subject.ratio - motion.load_angle)
