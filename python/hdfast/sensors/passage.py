"""The way of one channel through its effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.sensors.contract import (
    Clock,
    Counts,
    Draw,
    Filter,
    Geometry,
    Graduation,
    Instants,
    Readout,
    Sampling,
    SensorEffect,
    Values,
)
from hdfast.sensors.curve import Course, Curve
from hdfast.sensors.dual import Number, value
from hdfast.sensors.ripple import Ripple

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
    place = _place(t, at)
    between = place is None or any(isinstance(step.effect, Filter | Clock | Sampling) for step in steps)
    x, ripple, behind = _scaled(steps, t, x, moving, between=between)
    fast: Course | None = ripple
    for step in steps:
        if isinstance(step.effect, Filter):
            curve = _curve(t, x, moving)
            x = curve.until_end(t, step.effect.response(curve, step.values))
            fast = ripple and step.effect.remainder(ripple, step.values)
    instants = _instants(len(value(x)), at)
    for step in steps:
        if isinstance(step.effect, Clock):
            instants = step.effect.instants(instants, step.values, step.draw)
    if place is None or any(isinstance(step.effect, Clock | Sampling) for step in steps):
        y = _sample(steps, _curve(t, x, moving), instants)
    else:
        y = x[..., place]
    if fast is not None:
        y = _shown(behind, y + _sample(steps, fast, instants))
    for step in steps:
        if isinstance(step.effect, Readout):
            y = step.effect.readout(y, instants, step.values, step.draw)
    return y


def _place(t: Floats, at: Floats) -> Counts | None:
    """Where the times `at` are among t; None unless all are."""
    place = np.minimum(np.searchsorted(t, at), len(t) - 1)
    return place if np.array_equal(t[place], at) else None


def _scaled(
    steps: Sequence[Step], t: Floats, x: Number, moving: bool, *, between: bool
) -> tuple[Number, Ripple | None, Sequence[Step]]:
    """What the scale shows; if looked at between the times t, what its lines add is apart, with the effects after it.

    Those that change the scale are factors, which are the same before filter, clock and averaging as behind.
    """
    for k, step in enumerate(steps):
        if between and isinstance(step.effect, Graduation):
            return x, Ripple(_curve(t, x, moving), partial(step.effect.line, p=step.values)), steps[k + 1 :]
        x = _shown([step], x)
    return x, None, []


def _shown(steps: Sequence[Step], x: Number) -> Number:
    for step in steps:
        if isinstance(step.effect, Geometry):
            x = step.effect.reading(x, step.values)
    return x


def _instants(rows: int, at: Floats) -> Instants:
    interval = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
    shape = (rows, len(at))
    index = np.broadcast_to(np.arange(len(at)), shape)
    return Instants(np.broadcast_to(at, shape), index, np.full((rows, 1), interval))


def _sample(steps: Sequence[Step], course: Course, instants: Instants) -> Number:
    for step in steps:
        if isinstance(step.effect, Sampling):
            return step.effect.sample(course, instants, step.values)
    return course.at(instants.s)


def _curve(t: Floats, x: Number, moving: bool) -> Curve:
    if len(t) < FEWEST:
        raise InputError(f"t has {len(t)} times, between which no curve can be drawn (allowed: at least {FEWEST})")
    return Curve(t, x, moving=moving)
