"""What a sampled quantity did between its samples."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from operator import attrgetter, methodcaller

from hdfast.checks import Floats
from hdfast.sensors.dual import Dual, Number, select, slopes, value
from hdfast.sensors.spline import Spline


class Course(ABC):
    """What a quantity does in continuous time."""

    @abstractmethod
    def at(self, s: Number) -> Number:
        """Values at the times s [s], shape (M, K)."""

    @abstractmethod
    def area(self, s: Number) -> Number:
        """Integrals up to the times s from one time that all share."""

    def mean(self, s: Number, window: Number) -> Number:
        """Mean over [s - window, s], exactly, shape (M, K); the value at s where the window is zero."""
        width = select(window > 0.0, window, 1.0)
        area = self.area(s) - self.area(s - width)
        return select(window > 0.0, area / width, self.at(s - window / 2.0))


class Curve(Course):
    """The spline through the samples of M rows, and the splines through their derivatives.

    Args:
        t: knots [s], shape (T,), strictly increasing, T of at least 4.
        x: samples, shape (M, T); times may be dual numbers where they are.
        moving: continue beyond the ends at the speed there; else hold the value.

    Attributes:
        x: the samples; the last one held where a row has ended.
        rates: derivatives by time at the knots, shape (M, T).
        start_rate: derivative by time before the first knot, shape (M, 1).
    """

    def __init__(self, t: Floats, x: Number, *, moving: bool) -> None:
        self.t = t
        self._spline = Spline(t, value(x), moving=moving)
        jumps = self._spline.jumps
        self._tangents = Spline(t, x.slopes, moving=moving, jumps=jumps) if isinstance(x, Dual) else None
        self.x = self._of(attrgetter("x"))
        self.rates = self._of(attrgetter("rates"))
        self.start_rate = self._of(attrgetter("start_rate"))

    def coefficients(self) -> list[Number]:
        """Those of (s - t_k)^0 ... (s - t_k)^3 between the knots, each (M, T-1)."""
        return [self._of(methodcaller("coefficients", power)) for power in range(4)]

    def at(self, s: Number) -> Number:
        """Values at the times s [s], shape (M, K)."""
        return self._along(s, Spline.at, Spline.rate)

    def area(self, s: Number) -> Number:
        """Integrals from the first knot to the times s."""
        return self._along(s, Spline.area, Spline.at)

    def mean(self, s: Number, window: Number) -> Number:
        """Mean over [s - window, s], exactly, shape (M, K); the value at s where the window is zero."""
        return self.until_end(s, super().mean(s, window))

    def until_end(self, s: Number, y: Number) -> Number:
        """What belongs to the times s, NaN where a row has ended."""
        values = self._spline.until_end(value(s), value(y))
        if self._tangents is None:
            return values
        return Dual(values, self._tangents.until_end(value(s), slopes(y)))

    def _of(self, part: Callable[[Spline], Floats]) -> Number:
        values = part(self._spline)
        return values if self._tangents is None else Dual(values, part(self._tangents))

    def _along(
        self, s: Number, function: Callable[[Spline, Floats], Floats], rate: Callable[[Spline, Floats], Floats]
    ) -> Number:
        """A function linear in the samples, with its derivative by time."""
        y = self._of(lambda spline: function(spline, value(s)))
        if not isinstance(s, Dual):
            return y
        return Dual(value(y), slopes(y) + rate(self._spline, value(s)) * s.slopes)
