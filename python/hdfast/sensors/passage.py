"""The way of one channel through its effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.sensors.contract import Clock, Draw, Filter, Geometry, Instants, Readout, Sampling, SensorEffect, Values
from hdfast.sensors.curve import Curve
from hdfast.sensors.dual import Number, value

FEWEST = 4


@dataclass(frozen=True)
class Step:
    """One effect with its values (M, 1) by parameter name and its random numbers."""

    effect: SensorEffect
    values: Values
    draw: Draw


def read(steps: Sequence[Step], t: Floats, x: Number, at: Floats, *, moving: bool) -> Number:
    """Readings (M, K) at the times `at` of a quantity (M, T) known at the times t.

    Args:
        steps: effects in the order in which the signal passes them.
        t: times of x [s].
        x: the quantity.
        at: times of the readings [s].
        moving: before the first sample the quantity moves on at its speed; else it holds its value.
    """
    for step in steps:
        if isinstance(step.effect, Geometry):
            x = step.effect.reading(x, step.values)
        elif isinstance(step.effect, Filter):
            curve = _curve(t, x, moving)
            x = curve.until_end(t, step.effect.response(curve, step.values))
    instants = _instants(len(value(x)), at)
    for step in steps:
        if isinstance(step.effect, Clock):
            instants = step.effect.instants(instants, step.values, step.draw)
    y = _sample(steps, t, x, at, instants, moving)
    for step in steps:
        if isinstance(step.effect, Readout):
            y = step.effect.readout(y, instants, step.values, step.draw)
    return y


def _instants(rows: int, at: Floats) -> Instants:
    interval = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
    shape = (rows, len(at))
    index = np.broadcast_to(np.arange(len(at)), shape)
    return Instants(np.broadcast_to(at, shape), index, np.full((rows, 1), interval))


def _sample(steps: Sequence[Step], t: Floats, x: Number, at: Floats, instants: Instants, moving: bool) -> Number:
    for step in steps:
        if isinstance(step.effect, Sampling):
            return step.effect.sample(_curve(t, x, moving), instants, step.values)
    place = np.minimum(np.searchsorted(t, at), len(t) - 1)
    if np.array_equal(t[place], at) and not any(isinstance(step.effect, Clock) for step in steps):
        return x[..., place]
    return _curve(t, x, moving).at(instants.s)


def _curve(t: Floats, x: Number, moving: bool) -> Curve:
    if len(t) < FEWEST:
        raise InputError(f"t has {len(t)} times, between which no curve can be drawn (allowed: at least {FEWEST})")
    return Curve(t, x, moving=moving)
