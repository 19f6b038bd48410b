"""Confidence intervals: exact ones for independent rows, from what groups differ by for rows that are not."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats

CONFIDENCE = 0.95
FEW = 5  # groups, fewer of which agree by chance often enough for limits of no width


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
    def index(self) -> NDArray[np.intp]:
        """(n,) number of the group of every row among the groups that occur, from 0."""
        return np.unique(self.number, return_inverse=True)[1]

    @property
    def members(self) -> list[NDArray[np.intp]]:
        """Rows of each group that occurs."""
        index = self.index
        return np.split(np.argsort(index, kind="stable"), np.cumsum(np.bincount(index))[:-1])

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


def clopper_pearson(hits: float, rows: float, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Exact two-sided interval of a share (Clopper and Pearson 1934); numbers of rows in effect need not be whole."""
    tail = (1.0 - confidence) / 2.0
    low = 0.0 if hits == 0 else float(scipy.special.betaincinv(hits, rows - hits + 1, tail))
    high = 1.0 if hits == rows else float(scipy.special.betaincinv(hits + 1, rows - hits, 1.0 - tail))
    return low, high


def share(hits: NDArray[np.bool_], groups: Groups | None = None, confidence: float = CONFIDENCE) -> Estimate:
    """Share of True with its exact interval; with groups that of `effective_rows`, NaN when there is one group only."""
    rows, count = len(hits), int(np.count_nonzero(hits))
    if rows == 0:
        return Estimate(math.nan, math.nan, math.nan)
    value = count / rows
    if groups is None:
        return Estimate(value, *clopper_pearson(count, rows, confidence))
    if groups.count < 2:
        return Estimate(value, math.nan, math.nan)
    part = effective_rows(hits, groups, confidence) / rows
    return Estimate(value, *clopper_pearson(part * count, part * rows, confidence))


def effective_rows(hits: NDArray[np.bool_], groups: Groups, confidence: float = CONFIDENCE) -> float:
    """How many independent rows tell as much about the share of True (Korn and Graubard 1998), at most all n.

    p (1 - p) / variance, with the variance of p between m groups, times (t_(n-1) / t_(m-1))^2 for their small number.
    Where rows of a group are alike, only the m groups that hold the rarer outcome say how much; with fewer than two of
    these each group counts as one row (n^2 / sum of squared sizes, Kish 1965), which is also the least there can be.
    """
    rows, sizes = len(hits), np.bincount(groups.index).astype(float)
    least = rows**2 / float(np.sum(sizes**2)) if groups.alike else 0.0
    telling = groups_that_tell(hits, groups)
    if telling < 2:
        return least
    spread = mean_spread(hits.astype(float), groups)
    if spread == 0.0:
        return float(rows)
    ratio = student(rows, confidence) / student(telling, confidence) * float(np.std(hits)) / spread
    return min(max(ratio**2, least), float(rows))


def groups_that_tell(hits: NDArray[np.bool_], groups: Groups) -> int:
    """How many groups say how sure the share of True is: where rows are alike, those that hold the rarer outcome."""
    if not groups.alike:
        return groups.count
    return groups.take(hits if 2 * np.count_nonzero(hits) < len(hits) else ~hits).count


def mean(values: Floats, groups: Groups | None = None, confidence: float = CONFIDENCE) -> Estimate:
    """Mean with Student's interval."""
    if len(values) < 2:
        return Estimate(float(np.mean(values)) if len(values) else math.nan, math.nan, math.nan)
    value = float(np.mean(values))
    if groups is None:
        reach = student(len(values), confidence) * float(np.std(values, ddof=1)) / math.sqrt(len(values))
    else:
        reach = student(groups.count, confidence) * mean_spread(values, groups)
    return Estimate(value, value - reach, value + reach)


def mean_spread(values: Floats, groups: Groups) -> float:
    """Standard deviation of the overall mean by the delete-a-group jackknife; NaN with fewer than two groups.

    Deviations are those from the overall mean (Wolter 2007, v2), so that one large group among small ones is no
    certainty; with groups of equal size it is the standard deviation of their means over the root of their number.
    """
    index = groups.index
    sizes = np.bincount(index)
    if len(sizes) < 2:
        return math.nan
    change = np.bincount(index, weights=values - np.mean(values)) / (len(values) - sizes)
    return math.sqrt((len(sizes) - 1) / len(sizes) * float(np.sum(change**2)))


def standard_deviation(values: Floats, ddof: int = 0) -> float:
    """Of values (n,); 0 for equal ones, from which their rounded mean may differ, and for none."""
    return float(np.std(values, ddof=ddof)) if len(values) and np.ptp(values) else 0.0


def student(count: int, confidence: float = CONFIDENCE) -> float:
    """Two-sided quantile of Student's t for a mean of `count` values; NaN for fewer than two."""
    return float(scipy.special.stdtrit(count - 1, 0.5 + confidence / 2.0)) if count > 1 else math.nan


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
        the limits are those percentiles whose share lies at the ends of the interval of the share (Woodruff 1952), with
        as many degrees of freedom as there are groups to tell of it less one; those of fewer than five groups are no
        narrower than the limits of as many independent rows.
    """
    if not len(values):
        return Estimate(math.nan, math.nan, math.nan)
    ordered = values if groups is None else np.sort(values)
    value = _type7(ordered, share_below)
    if groups is None:
        low, high = _order_ranks(len(values), share_below, confidence)
    else:
        if groups.count < 2:
            return Estimate(value, math.nan, math.nan)
        # one of the two has no spread where the value is the largest or smallest of all, as that of failed rows is
        reach = max(_reach(held, groups, confidence) for held in (values <= value, values < value))
        low = math.floor(len(values) * (share_below - reach))
        high = math.ceil(len(values) * (share_below + reach)) + 1
        if groups.count < FEW:
            least = _order_ranks(len(values), share_below, confidence)
            low, high = min(low, least[0]), max(high, least[1])
    return Estimate(
        value,
        float(ordered[low - 1]) if low >= 1 else -math.inf,
        float(ordered[high - 1]) if high <= len(values) else math.inf,
    )


def _reach(hits: NDArray[np.bool_], groups: Groups, confidence: float) -> float:
    """How far the share of True may be off; with fewer than two groups to tell, the wider side of its interval."""
    telling = groups_that_tell(hits, groups)
    if telling < 2:
        found = share(hits, groups, confidence)
        return max(found.value - found.low, found.high - found.value)
    return student(telling, confidence) * mean_spread(hits.astype(float), groups)


def _type7(ordered: Floats, share_below: float) -> float:
    position = share_below * (len(ordered) - 1)
    lower = math.floor(position)
    upper = min(lower + 1, len(ordered) - 1)
    low, high = float(ordered[lower]), float(ordered[upper])
    exact = low == high or position == lower or math.isinf(low)  # -inf stays, where its way to +inf is NaN
    return low if exact else low + (position - lower) * (high - low)


def _order_ranks(count: int, share_below: float, confidence: float) -> tuple[int, int]:
    """Ranks l, u from 1: P(x_l <= quantile <= x_u) >= confidence, half of the rest on either side; 0 and n+1: none."""
    tail = (1.0 - confidence) / 2.0
    law = scipy.stats.binom(count, share_below)
    low = int(law.ppf(tail))
    while low > 0 and law.cdf(low - 1) > tail:
        low -= 1
    high = int(law.ppf(1.0 - tail)) + 1
    return low, high
