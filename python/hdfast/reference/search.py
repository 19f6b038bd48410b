"""Extrema, level crossings and integrals of a function along a trajectory, all located inside the steps."""

import math
from collections.abc import Callable
from functools import cached_property
from itertools import pairwise

from .integrate import Trajectory
from .signals import output_speed, transmission_error, windup
from .stepper import Vector

PARTS = 8
GAUSS_NODES = [-0.9324695142031521, -0.6612093864662645, -0.2386191860831969]
GAUSS_NODES += [-node for node in reversed(GAUSS_NODES)]
GAUSS_WEIGHTS = [0.1713244923791704, 0.3607615730481386, 0.46791393457269104]
GAUSS_WEIGHTS += list(reversed(GAUSS_WEIGHTS))

Function = Callable[[float], float]


class Scan:
    """Both speeds, transmission error and windup looked at `PARTS` times per step: the net for finer searches."""

    def __init__(self, run: Trajectory) -> None:
        self.run = run
        self.functions: dict[str, Function] = {
            "omega_m": lambda t: run.at(t)[0][1],
            "omega_l": lambda t: output_speed(run.drive, run.at(t)[0]),
            "te": lambda t: transmission_error(run.drive, run.at(t)[0]),
            "windup": lambda t: windup(run.drive, run.at(t)[0]),
        }

    @cached_property
    def times(self) -> Vector:
        times = [0.0]
        for step in self.run.steps:
            times += [step.t + step.h * part / PARTS for part in range(1, PARTS)]
            times.append(step.t + step.h)
        return times

    @cached_property
    def columns(self) -> dict[str, Vector]:
        columns: dict[str, Vector] = {name: [] for name in self.functions}
        states = [self.run.start]
        for step in self.run.steps:
            states += [step.at(step.t + step.h * part / PARTS) for part in range(1, PARTS + 1)]
        for y in states:
            columns["omega_m"].append(y[1])
            columns["omega_l"].append(output_speed(self.run.drive, y))
            columns["te"].append(transmission_error(self.run.drive, y))
            columns["windup"].append(windup(self.run.drive, y))
        return columns

    def window(self, a: float, b: float) -> list[int]:
        """Indices of the looks inside [a, b]."""
        slack = 1e-12 * max(1.0, abs(b))
        return [k for k, t in enumerate(self.times) if a - slack <= t <= b + slack]

    def largest(self, name: str, a: float, b: float, sign: float = 1.0) -> float:
        """Largest value of sign * signal in [a, b]; every look that could hide it is refined to its local peak."""
        looks = self.window(a, b)
        if not looks:
            return math.nan
        values = [sign * self.columns[name][k] for k in looks]
        best, spread = max(values), max(values) - min(values)

        def signed(t: float) -> float:
            return sign * self.functions[name](t)

        for j, value in enumerate(values):
            left, right = max(j - 1, 0), min(j + 1, len(values) - 1)
            lower, higher = sorted((values[left], values[right]))
            if value >= best - 0.02 * spread and lower < value >= higher:
                best = max(best, peak(signed, self.times[looks[left]], self.times[looks[right]]))
        return best

    def smallest(self, name: str, a: float, b: float) -> float:
        return -self.largest(name, a, b, sign=-1.0)

    def largest_size(self, name: str, a: float, b: float) -> float:
        return max(self.largest(name, a, b), -self.smallest(name, a, b))

    def crossings(self, name: str, level: float, a: float, b: float, upward: bool) -> Vector:
        """Times in [a, b] at which the signal passes `level` upward (or downward)."""
        looks, column, function = self.window(a, b), self.columns[name], self.functions[name]
        found = []
        for j, k in pairwise(looks):
            low, high = column[j] - level, column[k] - level
            if (low < 0.0 <= high) if upward else (low > 0.0 >= high):
                found.append(root(lambda t: function(t) - level, self.times[j], self.times[k]))
        return found

    def time_above(self, name: str, level: float, a: float, b: float) -> float:
        """Time [s] in [a, b] that the size of the signal exceeds `level`."""
        looks, function = self.window(a, b), self.functions[name]
        total = self.time_between_looks(name, level, looks)
        for j, k in pairwise(looks):
            t0, t1 = self.times[j], self.times[k]
            before, after = abs(self.columns[name][j]) > level, abs(self.columns[name][k]) > level
            if before and after:
                total += t1 - t0
            elif before != after:
                edge = root(lambda t: abs(function(t)) - level, t0, t1)
                total += edge - t0 if before else t1 - edge
        return total

    def time_between_looks(self, name: str, level: float, looks: list[int]) -> float:
        """What excursions beyond `level`, or back, add that begin and end between two looks of one side."""
        column, function = self.columns[name], self.functions[name]
        total = 0.0
        for i, j, k in zip(looks, looks[1:], looks[2:], strict=False):
            sign = 1.0 if abs(column[j]) <= level else -1.0
            before, here, after = (sign * (abs(column[look]) - level) for look in (i, j, k))
            if not (before < here >= after and here <= 0.0):
                continue

            def beyond(t: float, sign: float = sign) -> float:
                return sign * (abs(function(t)) - level)

            t0, t1 = self.times[i], self.times[k]
            top, height = summit(beyond, t0, t1)
            if height > 0.0:
                total += sign * (root(beyond, top, t1) - root(beyond, t0, top))
        return total


def peak(function: Function, a: float, b: float) -> float:
    """Largest value of a function with one maximum in [a, b]."""
    return summit(function, a, b)[1]


def summit(function: Function, a: float, b: float) -> tuple[float, float]:
    """Where a function with one maximum in [a, b] has it, and how high it is (golden section)."""
    shrink = (math.sqrt(5.0) - 1.0) / 2.0
    low, high = b - shrink * (b - a), a + shrink * (b - a)
    f_low, f_high = function(low), function(high)
    for _ in range(40):
        if f_low > f_high:
            b, high, f_high = high, low, f_low
            low = b - shrink * (b - a)
            f_low = function(low)
        else:
            a, low, f_low = low, high, f_high
            high = a + shrink * (b - a)
            f_high = function(high)
    return (low, f_low) if f_low > f_high else (high, f_high)


def root(function: Function, a: float, b: float) -> float:
    """Zero of a function that changes sign in [a, b] (bisection)."""
    rising = function(a) < function(b)
    for _ in range(60):
        middle = 0.5 * (a + b)
        if (function(middle) < 0.0) == rising:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


def integrals(run: Trajectory, integrand: Callable[[float], Vector], a: float, b: float) -> Vector:
    """Integrals over [a, b] of several functions of time, six Gauss points per step."""
    total: Vector = []
    for step in run.steps:
        low, high = max(a, step.t), min(b, step.t + step.h)
        if high <= low:
            continue
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        for node, weight in zip(GAUSS_NODES, GAUSS_WEIGHTS, strict=True):
            values = integrand(middle + half * node)
            total = total or [0.0] * len(values)
            total = [sum_ + half * weight * value for sum_, value in zip(total, values, strict=True)]
    return total
