"""Designs for sensitivity: Sobol indices by the points of Saltelli, screening by the walks of Morris."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.tolerance.designs import interleaved_sobol
from hdfast.tolerance.intervals import CONFIDENCE, Estimate, student

RESAMPLES = 200
SCRAMBLINGS = 16


@dataclass(frozen=True)
class Indices:
    """Shares of the variance of one metric.

    Attributes:
        first: what a parameter explains alone.
        total: what is left when all other parameters are known.
    """

    first: dict[str, Estimate]
    total: dict[str, Estimate]


def saltelli_points(dimensions: int, count: int, seed: int, start: int = 0) -> Floats:
    """Probabilities of the points A, AB_1 ... AB_d, B for base rows start to start + count.

    Returns:
        (count * (d + 2), d), the rows of one base point together, in the order SALib takes them (without second
        order). More rows of the same seed continue the first.
    """
    base = interleaved_sobol(2 * dimensions, seed, SCRAMBLINGS, start, start + count)
    a, b = base[:, :dimensions], base[:, dimensions:]
    points = np.repeat(a[:, None, :], dimensions + 2, axis=1)
    for j in range(dimensions):
        points[:, 1 + j, j] = b[:, j]
    points[:, -1] = b
    return points.reshape(-1, dimensions)


def sobol_indices(
    values: Floats, names: Sequence[str], *, seed: int = 1, confidence: float = CONFIDENCE, resamples: int = RESAMPLES
) -> Indices:
    """Indices from the values at `saltelli_points`.

    First order by Saltelli et al. (2010), total order by Jansen (1999); intervals by bootstrap of the scramblings, the
    only independent parts of the design, with Student's t.

    Args:
        values: (N (d + 2),) finite.
        names: the d parameters, independent of each other.

    Raises:
        ValueError: a value is not finite, or their number does not fit.
    """
    dimensions = len(names)
    if len(values) % (dimensions + 2) or not np.all(np.isfinite(values)):
        raise ValueError(f"values must be finite and a multiple of {dimensions + 2} in number")
    if np.ptp(values) == 0.0:
        nothing = Estimate(math.nan, math.nan, math.nan)
        return Indices(dict.fromkeys(names, nothing), dict.fromkeys(names, nothing))
    table = ((values - np.mean(values)) / np.std(values)).reshape(-1, dimensions + 2)
    count = len(table)
    parts = min(SCRAMBLINGS, count)
    generator = np.random.default_rng(seed)
    picked = generator.multinomial(parts, np.full(parts, 1.0 / parts), size=resamples).astype(float)
    weights = picked[:, np.arange(count) % parts]
    weights /= weights.sum(axis=1, keepdims=True)
    first, total = _indices(table, np.full((1, count), 1.0 / count))
    firsts, totals = _indices(table, weights)
    wide = math.sqrt(parts / max(parts - 1, 1)) * student(parts, confidence)
    return Indices(_estimates(names, first[0], firsts, wide), _estimates(names, total[0], totals, wide))


def _indices(table: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """(resamples, d) indices of (N, d + 2) values; weights (resamples, N) sum to 1."""
    a, mixed, b = table[:, :1], table[:, 1:-1], table[:, -1:]
    mean = weights @ (a + b) / 2.0
    variance = weights @ (a**2 + b**2) / 2.0 - mean**2
    return weights @ (b * (mixed - a)) / variance, 0.5 * (weights @ (a - mixed) ** 2) / variance


def _estimates(names: Sequence[str], value: Floats, resampled: Floats, widening: float) -> dict[str, Estimate]:
    reach = widening * np.std(resampled, axis=0, ddof=1)
    return {
        name: Estimate(float(value[j]), float(value[j] - reach[j]), float(value[j] + reach[j]))
        for j, name in enumerate(names)
    }


@dataclass(frozen=True)
class Screening:
    """Elementary effects of one metric: its change over the whole range of a parameter, from one step.

    Attributes:
        mean: average of the effects; near 0 although `mean_size` is not: not monotonic.
        mean_size: average of their absolute values, with its interval.
        deviation: their standard deviation; large: interactions or curvature.
    """

    mean: dict[str, float]
    mean_size: dict[str, Estimate]
    deviation: dict[str, float]


def morris_points(dimensions: int, trajectories: int, seed: int, levels: int = 4) -> Floats:
    """(trajectories * (d + 1), d) probabilities: walks that move one parameter at a time (Morris 1991).

    More trajectories of the same seed continue the first.
    """
    step = levels / (2.0 * (levels - 1))
    low = np.arange(levels // 2) / (levels - 1)
    walks = []
    for walk in range(trajectories):
        generator = np.random.default_rng([seed, 3, walk])
        signs = generator.choice((-1.0, 1.0), dimensions)
        start = generator.choice(low, dimensions)
        start = np.where(signs > 0, start, start + step)
        points = np.tile(start, (dimensions + 1, 1))
        for k, j in enumerate(generator.permutation(dimensions)):
            points[k + 1 :, j] += signs[j] * step
        walks.append(points)
    return np.concatenate(walks)


def morris_effects(points: Floats, values: Floats, names: Sequence[str], confidence: float = CONFIDENCE) -> Screening:
    """Elementary effects from walks in the unit cube.

    Args:
        points: (r (d + 1), d) as from `morris_points`.
        values: (r (d + 1),) finite.

    Raises:
        ValueError: a value is not finite.
    """
    if not np.all(np.isfinite(values)):
        raise ValueError("values must be finite")
    dimensions = len(names)
    steps = np.diff(points.reshape(-1, dimensions + 1, dimensions), axis=1)
    changes = np.diff(values.reshape(-1, dimensions + 1), axis=1)
    moved = np.argmax(np.abs(steps), axis=2)
    effects = np.empty(moved.shape)
    slopes = changes / np.take_along_axis(steps, moved[:, :, None], axis=2)[:, :, 0]
    np.put_along_axis(effects, moved, slopes, axis=1)
    walks = len(effects)
    size = np.mean(np.abs(effects), axis=0)
    if walks > 1:
        spread = np.std(np.abs(effects), axis=0, ddof=1) / math.sqrt(walks)
        reach = student(walks, confidence) * spread
        deviation = np.std(effects, axis=0, ddof=1)
    else:
        reach = deviation = np.full(dimensions, np.nan)
    low, high = size - reach, size + reach
    return Screening(
        dict(zip(names, np.mean(effects, axis=0).tolist(), strict=True)),
        {name: Estimate(float(size[j]), float(low[j]), float(high[j])) for j, name in enumerate(names)},
        dict(zip(names, deviation.tolist(), strict=True)),
    )
