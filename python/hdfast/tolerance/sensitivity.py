"""Which parameter matters: rank correlation, shares of the variance from the rows at hand, gradients."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.intervals import CONFIDENCE, Estimate, Groups, student

BLOCKS = 50


def rank_correlation(x: Floats, y: Floats, groups: Groups | None = None, confidence: float = CONFIDENCE) -> Estimate:
    """Spearman's rank correlation of (n,) values.

    Returns:
        The correlation; interval by Fisher's z with the variance of Bonett and Wright (2000), or with groups by the
        jackknife of z over whole groups. Where all ranks agree, one limit is their own, the other that of ranks with
        two neighbours swapped. NaN when a column does not vary; NaN limits with fewer than two groups.

    Raises:
        ValueError: a value is not finite.
    """
    _require_finite(x, y)
    value = _spearman(x, y) if len(x) >= 4 else math.nan
    if math.isnan(value):
        return Estimate(math.nan, math.nan, math.nan)
    if abs(value) >= 1.0 - 1e-14:
        sign, rows = math.copysign(1.0, value), groups.count if groups is not None and groups.alike else len(x)
        ends = sorted([sign, sign * _agreeing(rows, confidence)])
        return Estimate(sign, *(ends if groups is None or groups.count > 1 else (math.nan, math.nan)))
    if groups is None:
        reach = _bonett_wright(value, len(x), confidence)
    else:
        block, blocks = _blocks(len(x), groups)
        reach = _jackknife(lambda k: _fisher(_spearman(x[block != k], y[block != k])), blocks, confidence)
    centre = _fisher(value)
    return Estimate(value, math.tanh(centre - reach), math.tanh(centre + reach))


def _bonett_wright(value: float, rows: int, confidence: float) -> float:
    return float(scipy.stats.norm.ppf(0.5 + confidence / 2.0)) * math.sqrt((1.0 + value**2 / 2.0) / (rows - 3))


def _agreeing(rows: int, confidence: float) -> float:
    """Lower limit of the correlation of rows whose ranks all agree; -1 of fewer than four."""
    if rows < 4:
        return -1.0
    nearest = 1.0 - 12.0 / (rows * (rows**2 - 1.0))
    return math.tanh(_fisher(nearest) - _bonett_wright(nearest, rows, confidence))


def _spearman(x: Floats, y: Floats) -> float:
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return math.nan
    return float(np.corrcoef(scipy.stats.rankdata(x), scipy.stats.rankdata(y))[0, 1])


def _fisher(correlation: float) -> float:
    return math.atanh(min(max(correlation, 1e-15 - 1.0), 1.0 - 1e-15))


def _blocks(rows: int, groups: Groups | None) -> tuple[NDArray[np.intp], int]:
    """(n,) block of every row, and how many blocks a jackknife leaves out in turn: whole groups where there are."""
    index = np.arange(rows) if groups is None else groups.index
    blocks = min(BLOCKS, int(np.max(index)) + 1)
    return index % blocks, blocks


def _jackknife(without: Callable[[int], float], blocks: int, confidence: float) -> float:
    """Half width of an interval, from the estimates without each block in turn; NaN for fewer than two blocks."""
    if blocks < 2:
        return math.nan
    found = np.array([without(k) for k in range(blocks)])
    return student(blocks, confidence) * math.sqrt(blocks - 1) * float(np.std(found))


def _require_finite(*arrays: Floats) -> None:
    if not all(np.all(np.isfinite(values)) for values in arrays):
        raise ValueError("values must be finite: pass them through hdfast.tolerance.policy.gate first")


def variance_share(x: Floats, y: Floats, groups: Groups | None = None, confidence: float = CONFIDENCE) -> Estimate:
    """Share of the variance of y that the parameter x explains alone: the first-order index from rows at hand.

    The rows are cut into classes of x with a straight line in each; the variance of these lines, corrected for what
    chance alone puts there, is compared with the whole. Chance is counted by rows (epsilon squared of Kelley 1935), or
    where rows of a group are alike by what whole groups leave in every class (the middle of the sandwich of Liang and
    Zeger 1986). Correlated parameters share what they explain.

    Args:
        x, y: (n,) finite.
        groups: which rows depend on each other.

    Returns:
        The share with a delete-a-block jackknife interval, over whole groups where there are. NaN when y does not vary,
        n is below 100, or groups are no more than what the lines leave free; NaN limits with fewer than two groups.

    Raises:
        ValueError: a value is not finite.
    """
    _require_finite(x, y)
    if len(x) < 2 * BLOCKS or np.ptp(y) == 0.0:
        return Estimate(math.nan, math.nan, math.nan)
    batches = groups.count if groups is not None and groups.alike else 1
    classes = min(round((batches if batches > 1 else len(x)) ** (1 / 3)), 64)
    label = np.empty(len(x), dtype=np.int64)
    label[np.argsort(x, kind="stable")] = np.arange(len(x)) * classes // len(x)
    place, score = ((values - np.mean(values)) / (np.std(values) or 1.0) for values in (x, y))
    block, blocks = _blocks(len(x), groups)
    cell = block * classes + label
    sums = np.array(
        [
            np.bincount(cell, weights=weight, minlength=blocks * classes).reshape(blocks, classes)
            for weight in (np.ones(len(x)), place, score, place**2, place * score, score**2)
        ]
    )
    value = _explained(sums, batches)
    reach = _jackknife(lambda k: _explained(np.delete(sums, k, axis=1), batches), blocks, confidence)
    return Estimate(value, value - reach, value + reach)


def _explained(sums: Floats, batches: int) -> float:
    """Share explained by one line per class; NaN when y is constant, or all that the lines can follow.

    Args:
        sums: (6, blocks, classes) of 1, x, y, x x, x y, y y.
        batches: whose rows may depend on each other; 1 when all rows are independent.
    """
    own, own_x, own_y, own_xx, own_xy, own_yy = sums[:, :, sums[0].sum(axis=0) > 0.0]
    count = own.sum(axis=0)
    rows, blocks = float(np.sum(count)), len(own)
    x, y = own_x.sum(axis=0) / count, own_y.sum(axis=0) / count
    off_x, off_y = own_x - x * own, own_y - y * own
    off_xx, off_xy = own_xx - x * (own_x + off_x), own_xy - x * own_y - y * off_x
    spread = off_xx.sum(axis=0)
    sloped = spread > 1e-9 * count
    spread = np.where(sloped, spread, np.inf)
    slope = off_xy.sum(axis=0) / spread
    mean = float(np.sum(own_y)) / rows
    whole = float(np.sum(own_yy)) - rows * mean**2
    between = float(np.sum(count * y**2 + slope**2 * np.where(sloped, spread, 0.0))) - rows * mean**2
    freedom = len(count) + int(np.count_nonzero(sloped))
    independent = batches if batches > 1 else rows
    if whole <= 1e-9 * rows or independent <= freedom:
        return math.nan
    if batches == 1:
        return (between - (freedom - 1) * (whole - between) / (rows - freedom)) / whole
    left, tilted = off_y - slope * off_x, off_xy - slope * off_xx
    chance = float(np.sum(left**2 / count + tilted**2 / spread) - np.sum(np.sum(left, axis=1) ** 2) / rows)
    return (between - chance * blocks / (blocks - 1) * batches / (batches - freedom)) / whole


@dataclass(frozen=True)
class Gradient:
    """Linear picture of a metric around the nominal drive.

    Attributes:
        slope: derivative by each parameter, in units of the metric per unit of the parameter; NaN without a spread.
        share: what each contributes to the variance of that picture, (slope times standard deviation) squared.
        deviation: standard deviation of the metric in that picture.
    """

    slope: dict[str, float]
    share: dict[str, float]
    deviation: float


def gradient(
    evaluate: Callable[[dict[str, Floats]], Mapping[str, Floats]],
    tolerances: tuple[Tolerance, ...],
    step: float = 0.1,
) -> dict[str, Gradient]:
    """Derivatives of every metric at the middle of all tolerances, for linear error propagation.

    Differences through one sweep of 2 d + 1 rows, not exact derivatives: the error of central ones falls with step
    squared. Where the middle lies at a bound of the law they are one-sided, and theirs falls with step.

    Args:
        evaluate: columns (m,) to metrics (m,).
        tolerances: the d independent parameters.
        step: in standard deviations of each parameter, see `Tolerance.beside`.
    """
    count = 2 * len(tolerances) + 1
    columns = {item.name: np.full(count, item.middle) for item in tolerances}
    spans = {}
    for j, item in enumerate(tolerances):
        low, high = item.beside(step)
        columns[item.name][1 + 2 * j], columns[item.name][2 + 2 * j] = high, low
        spans[item.name] = high - low
    found = {}
    for metric, values in evaluate(columns).items():
        changes = values[1::2] - values[2::2]
        slopes = {name: float(changes[j]) / span if span else math.nan for j, (name, span) in enumerate(spans.items())}
        parts = {t.name: (slopes[t.name] * t.deviation) ** 2 if spans[t.name] else 0.0 for t in tolerances}
        whole = sum(parts.values())
        shares = {name: part / whole if whole > 0.0 else math.nan for name, part in parts.items()}
        found[metric] = Gradient(slopes, shares, math.sqrt(whole) if whole >= 0.0 else math.nan)
    return found
