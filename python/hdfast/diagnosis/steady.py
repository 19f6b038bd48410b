"""Stretches of recordings at a steady speed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.prepare import Unit

SPEED = "motor_speed"
AVERAGED_S = 0.5
STEADY = 1.2
SHORTEST_S = 2.0


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of a recording at a steady speed.

    Attributes:
        speed: of the motor [rev/s].
        varied: by which share of it the speed, averaged, leaves it.
        t, turns: time [s] and motor revolutions since its beginning, shape (n,).
        signals: motor speed and what is compared, by channel, shape (n,).
    """

    speed: float
    varied: float
    t: Floats = field(repr=False)
    turns: Floats = field(repr=False)
    signals: Mapping[str, Floats] = field(repr=False)


def stretches(unit: Unit) -> list[Stretch]:
    """The steady stretches of a recording: no motion was asked for in them that could be taken for an oscillation."""
    step = unit.t[1] - unit.t[0]
    half = max(1, round(0.5 * AVERAGED_S / step))
    places = np.arange(len(unit.t))
    before, after = np.maximum(places - half, 0), np.minimum(places + half, len(places) - 1)
    mean = (unit.angle[after] - unit.angle[before]) / (unit.t[after] - unit.t[before])
    signals = {SPEED: unit.speed, **unit.measured}
    found = []
    for first, last in _level(mean):
        begin, end = first + half * (first > 0), last - half * (last < len(places))
        if (end - begin) * step < SHORTEST_S:
            continue
        t, angle = unit.t[begin:end], np.abs(unit.angle[begin:end] - unit.angle[begin])
        turns = np.maximum.accumulate(angle) / (2.0 * math.pi)
        inside = {name: values[begin:end] for name, values in signals.items()}
        speed = float(turns[-1] / (t[-1] - t[0]))
        varied = float(np.max(np.abs(np.abs(mean[begin:end]) / (2.0 * math.pi * speed) - 1.0)))
        found.append(Stretch(speed, varied, t - t[0], turns, inside))
    return found


def _level(speed: Floats) -> list[tuple[int, int]]:
    """Runs (begin, end) of a speed (n,) that keeps its sign and stays within a factor of `STEADY`."""
    found, begin, low, high = [], 0, float(speed[0]), float(speed[0])
    for place, own in enumerate(speed.tolist()):
        low, high = min(low, own), max(high, own)
        if low * high <= 0.0 or max(low / high, high / low) > STEADY:
            found.append((begin, place))
            begin, low, high = place, own, own
    return [*found, (begin, len(speed))]
