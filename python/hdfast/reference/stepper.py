"""One step of an explicit Runge-Kutta pair on lists of floats, its error norm and its dense output."""

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass

from .methods import Method, Row

Vector = list[float]
Slope = Callable[[float, Vector], Vector]


def combine(row: Row, slopes: list[Vector], h: float, component: int) -> float:
    """H * sum(weight * slope) of one component."""
    return h * sum(weight * slopes[j][component] for j, weight in row.items())


def moved(y: Vector, row: Row, slopes: list[Vector], h: float) -> Vector:
    return [y_c + combine(row, slopes, h, c) for c, y_c in enumerate(y)]


@dataclass(frozen=True)
class Attempt:
    """A step that may yet be rejected: end state, slopes of all stages (the last is the slope at the end)."""

    t: float
    h: float
    start: Vector
    end: Vector
    slopes: list[Vector]


def attempt(method: Method, slope: Slope, t: float, y: Vector, first: Vector, h: float) -> Attempt:
    slopes = [first]
    for node, row in zip(method.nodes, method.stages, strict=True):
        slopes.append(slope(t + node * h, moved(y, row, slopes, h)))
    end = moved(y, method.weights, slopes, h)
    slopes.append(slope(t + h, end))
    return Attempt(t, h, y, end, slopes)


def error_norm(method: Method, step: Attempt, scales: Vector) -> float:
    """Root mean square of the scaled local error; DOP853 blends its two estimates as its authors do."""
    squares = []
    for row in method.errors:
        scaled = [combine(row, step.slopes, step.h, c) / scale for c, scale in enumerate(scales)]
        squares.append(sum(x * x for x in scaled) / len(scaled))
    if len(squares) == 1:
        return math.sqrt(squares[0])
    fifth, third = squares
    return 0.0 if fifth == 0.0 else fifth / math.sqrt(fifth + 0.01 * third)


@dataclass(frozen=True)
class Dense:
    """An accepted step as a polynomial; `terms` are the nested coefficients F0, F1, ... of every component."""

    t: float
    h: float
    start: Vector
    terms: list[Vector]

    def at(self, t: float) -> Vector:
        x = (t - self.t) / self.h
        factors = [x if k % 2 == 0 else 1.0 - x for k in range(len(self.terms))]
        total = [0.0] * len(self.start)
        for factor, term in zip(reversed(factors), reversed(self.terms), strict=True):
            total = [factor * (f + rest) for f, rest in zip(term, total, strict=True)]
        return [y + rest for y, rest in zip(self.start, total, strict=True)]


def dense_output(method: Method, slope: Slope, step: Attempt) -> Dense:
    h, slopes = step.h, list(step.slopes)
    for node, row in zip(method.dense_nodes, method.dense_stages, strict=True):
        slopes.append(slope(step.t + node * h, moved(step.start, row, slopes, h)))
    first, last = step.slopes[0], step.slopes[-1]
    rise = [b - a for a, b in zip(step.start, step.end, strict=True)]
    terms = [
        rise,
        [h * f - r for f, r in zip(first, rise, strict=True)],
        [2.0 * r - h * (f + g) for r, f, g in zip(rise, first, last, strict=True)],
    ]
    terms += [[combine(row, slopes, h, c) for c in range(len(rise))] for row in method.dense]
    return Dense(step.t, h, step.start, terms)


def position(starts: list[float], t: float) -> int:
    """Index of the step that holds t when step k covers (starts[k], starts[k + 1]]."""
    return max(0, bisect_left(starts, t) - 1)
