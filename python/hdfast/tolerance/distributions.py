"""The distribution of one parameter: what is drawn, what a change of its spread means, how a report words it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.tolerance.intervals import standard_deviation
from hdfast.tolerance.laws import LAWS
from hdfast.tolerance.streams import stream


@dataclass(frozen=True)
class Tolerance:
    """Distribution of one parameter.

    Attributes:
        name: the parameter.
        distribution: a key of `LAWS`.
        centre: mean, mode or median; unused for "uniform", "beta", "discrete" and "empirical".
        width: standard deviation, of the logarithm for "lognormal".
        lower, upper: bounds; nothing outside is ever drawn.
        shape: exponents of "beta", probabilities of "discrete".
        points: values of "discrete", sorted measurements of "empirical".
        spread: factor on the distance of every value from the middle; 1 is the distribution as given.
        batch_share: share of the variance (of the normal score) that a whole batch has in common.
        cost: cost of the tolerance as it is, in any unit; halving the spread multiplies it by 2^exponent.
    """

    name: str
    distribution: str
    centre: float
    width: float
    lower: float
    upper: float
    shape: tuple[float, ...] = ()
    points: tuple[float, ...] = ()
    spread: float = 1.0
    batch_share: float = 0.0
    cost: float = 1.0

    def sample(self, rows: int, seed: int, start: int = 0) -> Floats:
        """Draw (rows,) independent values from row `start` on. The stream depends on seed and name only."""
        return self.quantile(stream(seed, self.name, start, rows))

    def quantile(self, u: Floats) -> Floats:
        """Inverse distribution function of (n,) probabilities."""
        values = self._as_given(np.asarray(u, dtype=float))
        if self.spread == 1.0:
            return values
        middle = self.middle
        if self.distribution == "lognormal":
            return np.asarray(middle * (values / middle) ** self.spread)
        return np.asarray(middle + self.spread * (values - middle))

    def _as_given(self, u: Floats) -> Floats:
        return np.clip(LAWS[self.distribution].quantile(self, u), self.lower, self.upper)

    @property
    def middle(self) -> float:
        """The value all others contract to when the spread goes to 0: a centre within the bounds, else the median."""
        if LAWS[self.distribution].centre and self.lower <= self.centre <= self.upper:
            return self.centre
        return float(self._as_given(np.array([0.5]))[0])

    def scaled(self, factor: float) -> Tolerance:
        """The same tolerance with its spread multiplied; bounds move along. Lognormal laws scale in the logarithm."""
        return replace(self, spread=self.spread * factor)

    def widest(self, allowed: tuple[float, float]) -> float:
        """Largest factor on the spread that leaves the worst-case values within `allowed`; 1 where none does."""
        ends, limits, middle = np.array(self.extremes()), np.array(allowed), self.middle
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.distribution == "lognormal":
                room, distance = np.log(np.maximum(limits, 0.0) / middle), np.log(ends / middle)
            else:
                room, distance = limits - middle, ends - middle
            factors = np.where(distance == 0.0, np.inf, room / distance)
        return max(1.0, (1.0 - 1e-9) * float(np.min(factors)))

    @property
    def deviation(self) -> float:
        """Standard deviation of the values."""
        if self.distribution == "lognormal" and (self.lower, self.upper) == (0.0, math.inf):
            variance = (self.spread * self.width) ** 2
            return self.centre * math.exp(variance / 2.0) * math.sqrt(math.expm1(variance))
        u = (np.arange(4096) + 0.5) / 4096
        return standard_deviation(self.quantile(u))

    def beside(self, step: float) -> tuple[float, float]:
        """Values below and above the middle by `step` standard deviations, of the logarithm where the law is lognormal.

        Neither leaves the law: at its bound one of them is the middle.
        """
        steps = np.array([-step, step])
        if self.distribution == "lognormal":
            values = self.middle * np.exp(steps * self.spread * self.width)
        else:
            values = self.middle + steps * self.deviation
        low, high = np.clip(values, *self.quantile(np.array([0.0, 1.0]))).tolist()
        return low, high

    def nearest(self, values: Floats) -> Floats:
        """Those (n,) values that can occur nearest to these: of a discrete law its own, the lower of two as near."""
        if self.distribution != "discrete":
            return values
        own = np.unique(self.quantile(np.cumsum(self.shape) - np.array(self.shape) / 2.0))
        return np.asarray(own[np.argmin(np.abs(own - values[:, None]), axis=1)])

    @property
    def ties(self) -> Floats:
        """(k, 2) probabilities between which one and the same value is drawn; none of a continuous law."""
        if not self.points:
            return np.empty((0, 2))
        if self.distribution == "discrete":
            edges = np.append(0.0, np.cumsum(self.shape))
            starts, stops = edges[:-1], edges[1:]
        else:
            starts = (np.arange(len(self.points)) + 0.5) / len(self.points)
            stops = np.append(starts[:-1], 1.0)
            starts[0] = 0.0
        _, first, count = np.unique(self.points, return_index=True, return_counts=True)
        found = np.column_stack([starts[first], stops[first + count - 1]])
        return found[found[:, 0] < found[:, 1]]

    def extremes(self) -> tuple[float, float]:
        """Worst-case values: the bounds where finite, else the quantiles at -3 and +3 standard deviations (0.135 %)."""
        low, high = self.quantile(np.array([0.0013498980316301, 0.9986501019683699])).tolist()
        if self.spread == 1.0:
            bounded = self.lower > 0.0 if self.distribution == "lognormal" else math.isfinite(self.lower)
            low = self.lower if bounded else low
            high = self.upper if math.isfinite(self.upper) else high
        return low, high

    def describe(self) -> str:
        """One line for reports."""
        text = self._describe_law()
        if self.batch_share:
            text += f", {100 * self.batch_share:g} % of the variance between batches"
        return text + (f", spread times {self.spread:g}" if self.spread != 1.0 else "")

    def _describe_law(self) -> str:
        name = self.distribution.replace("_", " ")
        span = f"{self.lower:.6g} to {self.upper:.6g}"
        if self.distribution == "uniform":
            return f"uniform {span}"
        if self.distribution == "beta":
            return f"beta, a {self.shape[0]:g}, b {self.shape[1]:g}, {span}"
        if self.distribution == "discrete":
            bins = (f"{value:.6g} ({100 * share:.3g} %)" for value, share in zip(self.points, self.shape, strict=True))
            return "discrete, " + ", ".join(bins)
        if self.distribution == "empirical":
            return f"{len(self.points)} measured values, {span}"
        centre = {"triangular": "mode", "lognormal": "median"}.get(self.distribution, "mean")
        text = f"{name}, {centre} {self.centre:.6g}"
        if self.distribution != "triangular":
            text += f", sigma {self.width:.4g}" + (" of the logarithm" if self.distribution == "lognormal" else "")
        bounds = [b for b in (self.lower, self.upper) if math.isfinite(b)]
        return text + (f", within {span}" if bounds else "")
