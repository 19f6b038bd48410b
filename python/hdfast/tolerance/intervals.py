"""Confidence intervals: exact ones for independent rows, from group means for rows that depend on each other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Groups:
    """Which rows depend on each other.

    Attributes:
        number: (n,) group of every row; rows of different groups are independent.
        alike: True when rows of a group resemble each other (batches), False when they keep apart (strata).
    """

    number: NDArray[np.int64]
    alike: bool

    def take(self, index: Any) -> Groups:
        """The groups of some of the rows."""
        return Groups(self.number[index], self.alike)

    @property
    def count(self) -> int:
        """How many groups there are."""
        return len(np.unique(self.number))


@dataclass(frozen=True)
class Estimate:
    """A number with its confidence interval; NaN limits where none is known."""

    value: float
    low: float
    high: float

    def covers(self, truth: float) -> bool:
        """True when the interval holds a value."""
        return self.low <= truth <= self.high


def clopper_pearson(hits: int, rows: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Exact two-sided interval of a share (Clopper and Pearson 1934)."""
    from scipy.special import betaincinv

    tail = (1.0 - confidence) / 2.0
    low = 0.0 if hits == 0 else float(betaincinv(hits, rows - hits + 1, tail))
    high = 1.0 if hits == rows else float(betaincinv(hits + 1, rows - hits, 1.0 - tail))
    return low, high


def share(hits: NDArray[np.bool_], groups: Groups | None = None, confidence: float = CONFIDENCE) -> Estimate:
    """Share of True with its interval.

    With groups the interval comes from the group shares. When those do not differ, as at 100 %, it is the exact one
    for independent rows, or for one row per group where the rows of a group are alike.
    """
    rows, count = len(hits), int(np.count_nonzero(hits))
    if rows == 0:
        return Estimate(math.nan, math.nan, math.nan)
    value = count / rows
    if groups is not None:
        spread = mean_spread(hits.astype(float), groups)
        if math.isnan(spread):
            return Estimate(value, math.nan, math.nan)
        if spread > 0.0:
            reach = _student(groups.count, confidence) * spread
            return Estimate(value, max(0.0, value - reach), min(1.0, value + reach))
        if groups.alike:
            return Estimate(value, *clopper_pearson(round(value * groups.count), groups.count, confidence))
    return Estimate(value, *clopper_pearson(count, rows, confidence))


def mean(values: Floats, groups: Groups | None = None, confidence: float = CONFIDENCE) -> Estimate:
    """Mean with Student's interval."""
    if len(values) < 2:
        return Estimate(float(np.mean(values)) if len(values) else math.nan, math.nan, math.nan)
    value = float(np.mean(values))
    if groups is None:
        reach = _student(len(values), confidence) * float(np.std(values, ddof=1)) / math.sqrt(len(values))
    else:
        reach = _student(groups.count, confidence) * mean_spread(values, groups)
    return Estimate(value, value - reach, value + reach)


def mean_spread(values: Floats, groups: Groups) -> float:
    """Standard deviation of the overall mean, from the sums of the groups; NaN with fewer than two groups."""
    _, inverse = np.unique(groups.number, return_inverse=True)
    sizes = np.bincount(inverse)
    if len(sizes) < 2:
        return math.nan
    residual = np.bincount(inverse, weights=values - np.mean(values))
    return float(np.sqrt(len(sizes) / (len(sizes) - 1) * np.sum(residual**2)) / len(values))


def _student(count: int, confidence: float) -> float:
    from scipy.special import stdtrit

    return float(stdtrit(count - 1, 0.5 + confidence / 2.0)) if count > 1 else math.nan


def percentile(
    values: Floats, share_below: float, groups: Groups | None = None, confidence: float = CONFIDENCE
) -> Estimate:
    """Percentile with limits that are order statistics and assume no distribution.

    Args:
        values: (n,) sorted in rising order when `groups` is None, else in row order.
        share_below: 0 to 1.
        groups: (n,) group of each value when rows depend on each other.

    Returns:
        The percentile (Hyndman and Fan type 7, as NumPy); a limit is infinite when n is too small for it. With groups
        the limits are those percentiles whose share lies at the ends of the interval of the share (Woodruff 1952).
    """
    if not len(values):
        return Estimate(math.nan, math.nan, math.nan)
    ordered = values if groups is None else np.sort(values)
    value = _type7(ordered, share_below)
    if groups is None:
        low, high = _order_ranks(len(values), share_below, confidence)
    else:
        spread = mean_spread((values <= value).astype(float), groups)
        if math.isnan(spread):
            return Estimate(value, math.nan, math.nan)
        reach = _student(groups.count, confidence) * spread
        low = math.floor(len(values) * (share_below - reach))
        high = math.ceil(len(values) * (share_below + reach)) + 1
    return Estimate(
        value,
        float(ordered[low - 1]) if low >= 1 else -math.inf,
        float(ordered[high - 1]) if high <= len(values) else math.inf,
    )


def _type7(ordered: Floats, share_below: float) -> float:
    position = share_below * (len(ordered) - 1)
    lower = math.floor(position)
    upper = min(lower + 1, len(ordered) - 1)
    low, high = float(ordered[lower]), float(ordered[upper])
    return low if low == high or position == lower else low + (position - lower) * (high - low)


def _order_ranks(count: int, share_below: float, confidence: float) -> tuple[int, int]:
    """Ranks l, u from 1: P(x_l <= quantile <= x_u) >= confidence, half of the rest on either side; 0 and n+1: none."""
    from scipy.stats import binom

    tail = (1.0 - confidence) / 2.0
    law = binom(count, share_below)
    low = int(law.ppf(tail))
    while low > 0 and law.cdf(low - 1) > tail:
        low -= 1
    high = int(law.ppf(1.0 - tail)) + 1
    return low, high
