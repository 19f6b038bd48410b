"""95 % intervals: Wilson for proportions, bootstrap over cases for the rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

Z = 1.959963984540054
DRAWS = 1000


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Wilson score interval of a proportion; (0, 1) without cases. Wilson 1927."""
    if count == 0:
        return 0.0, 1.0
    p, z2 = hits / count, Z * Z
    middle = (p + z2 / (2 * count)) / (1 + z2 / count)
    half = Z * sqrt(p * (1 - p) / count + z2 / (4 * count * count)) / (1 + z2 / count)
    low = 0.0 if hits == 0 else middle - half
    high = 1.0 if hits == count else middle + half
    return low, high


def bootstrap(cases: Sequence[Any], statistic: Callable[[list[Any]], float], seed: int = 0) -> tuple[float, float]:
    """Percentile interval of a statistic under resampling of whole cases; (nan, nan) where it never exists."""
    if not cases:
        return float("nan"), float("nan")
    rng = np.random.default_rng(seed)
    values = np.array([statistic([cases[k] for k in rng.integers(0, len(cases), len(cases))]) for _ in range(DRAWS)])
    finite = values[np.isfinite(values)]
    if not finite.size:
        return float("nan"), float("nan")
    low, high = np.percentile(finite, [2.5, 97.5])
    return float(low), float(high)


def calibration_error(confidence: NDArray[np.float64], right: NDArray[np.float64], bins: int = 10) -> float:
    """Expected calibration error in bins of equal width."""
    place = np.minimum((confidence * bins).astype(int), bins - 1)
    gaps = [abs(float(np.sum(confidence[place == b] - right[place == b]))) for b in range(bins)]
    return float(sum(gaps) / confidence.size)


def calibration_floor(confidence: NDArray[np.float64], seed: int = 0) -> float:
    """95 % point of the calibration error that perfectly calibrated answers of these confidences would show."""
    rng = np.random.default_rng(seed)
    draws = rng.random((DRAWS, confidence.size)) < confidence
    return float(np.percentile([calibration_error(confidence, d.astype(float)) for d in draws], 95))


def reliability_slope(confidence: NDArray[np.float64], right: NDArray[np.float64]) -> float:
    """Slope of the least-squares line of being right over confidence; nan when all confidences are equal."""
    spread = confidence - confidence.mean()
    power = float(spread @ spread)
    return float(spread @ right / power) if power > 1e-12 else float("nan")
