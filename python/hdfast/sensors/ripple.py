"""What the lines of a scale add to its reading between the samples of its motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.sensors.curve import Course, Curve
from hdfast.sensors.dual import Number, along, select, take, value

STRAIGHT = 1e-8  # square of half a phase [rad^2] up to which sin(v)/v is 1 - v^2/6 to the last bit


class Ripple(Course):
    """A sine along a curve, which may turn many times from knot to knot.

    A single look finds it at the phase of the curve. For integrals the phase runs evenly from knot to knot, which is
    exact at constant speed; where a phase accelerates by a, it is off by at most a step^2 / 8 between the knots.

    Args:
        curve: what the scale turns by, moving on before and after its samples.
        line: amplitude (M, 1) and phase [rad] of the sine at a quantity.

    Attributes:
        begins: where the pieces of even phase begin [s], one before the first knot, shape (T+1,).
        lengths: how long they are [s]; the first and the last go on for ever.
        amplitude: shape (M, 1).
        phase: at the ends of the pieces [rad], shape (M, T+2).
        rate: in each piece [rad/s], shape (M, T+1).
    """

    def __init__(self, curve: Curve, line: Callable[[Number], tuple[Number, Number]]) -> None:
        self._curve, self._line = curve, line
        ends = np.concatenate([curve.t[:1] - 1.0, curve.t, curve.t[-1:] + 1.0])
        self.begins, self.lengths = ends[:-1], np.diff(ends)
        self.amplitude, self.phase = line(curve.at(ends))
        self.rate = along(np.diff, self.phase) / self.lengths
        self._before = along(_sums, self._piece(self.lengths, self.phase[..., :-1], self.rate))

    def at(self, s: Number) -> Number:
        """Values at the times s [s], shape (M, K)."""
        amplitude, phase = self._line(self._curve.at(s))
        return amplitude * np.sin(phase)

    def area(self, s: Number) -> Number:
        """Integrals up to the times s from one time that all share."""
        place, since = self.find(s)
        return take(self._before, place) + self._piece(since, take(self.phase, place), take(self.rate, place))

    def find(self, s: Number) -> tuple[NDArray[np.int64], Number]:
        """The pieces in which the times s (M, K) lie, and the time since these began [s]."""
        place = np.searchsorted(self._curve.t, value(s))  # a knot ends the piece before: a row may end with it
        return place, s - self.begins[place]

    def _piece(self, since: Number, phase: Number, rate: Number) -> Number:
        """Integral over the time `since` a piece began at a phase."""
        half = 0.5 * rate * since
        straight = half * half < STRAIGHT
        gain = select(straight, 1.0 - half * half / 6.0, np.sin(half) / select(straight, 1.0, half))
        return self.amplitude * since * gain * np.sin(phase + half)


def _sums(x: Floats) -> Floats:
    return np.concatenate([np.zeros((*x.shape[:-1], 1)), np.cumsum(x, axis=-1)], axis=-1)
