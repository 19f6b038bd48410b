"""Which parameter matters: rank correlation, shares of the variance from the rows at hand, gradients."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.intervals import CONFIDENCE, Estimate

BLOCKS = 50


def rank_correlation(x: Floats, y: Floats, confidence: float = CONFIDENCE) -> Estimate:
    """Spearman's rank correlation of (n,) values; interval by Fisher's z with the variance of Bonett and Wright (2000).

    Raises:
        ValueError: a value is not finite.
    """
    from scipy.stats import norm, rankdata

    _require_finite(x, y)
    ranks = [rankdata(values) for values in (x, y)]
    if len(x) < 4 or any(np.ptp(values) == 0.0 for values in ranks):
        return Estimate(math.nan, math.nan, math.nan)
    value = float(np.corrcoef(*ranks)[0, 1])
    if abs(value) >= 1.0 - 1e-15:
        return Estimate(math.copysign(1.0, value), value, value)
    reach = float(norm.ppf(0.5 + confidence / 2.0)) * math.sqrt((1.0 + value**2 / 2.0) / (len(x) - 3))
    centre = math.atanh(value)
    return Estimate(value, math.tanh(centre - reach), math.tanh(centre + reach))


def partial_rank_correlation(columns: Mapping[str, Floats], y: Floats) -> dict[str, float]:
    """Rank correlation of each column with y after the linear part of all other columns' ranks is taken out of both."""
    from scipy.stats import rankdata

    _require_finite(*columns.values(), y)
    ranks = np.column_stack([rankdata(values) for values in (*columns.values(), y)])
    constant = np.ptp(ranks, axis=0) == 0.0
    found = dict.fromkeys(columns, math.nan)
    kept = [j for j in range(ranks.shape[1]) if not constant[j]]
    if constant[-1] or len(kept) < 2:
        return found
    precision = np.linalg.pinv(np.corrcoef(ranks[:, kept], rowvar=False))
    for position, j in enumerate(kept[:-1]):
        value = -precision[position, -1] / math.sqrt(precision[position, position] * precision[-1, -1])
        found[list(columns)[j]] = float(value)
    return found


def _require_finite(*arrays: Floats) -> None:
    if not all(np.all(np.isfinite(values)) for values in arrays):
        raise ValueError("values must be finite: pass them through hdfast.tolerance.policy.gate first")


def variance_share(x: Floats, y: Floats, confidence: float = CONFIDENCE) -> Estimate:
    """Share of the variance of y that the parameter x explains alone: the first-order index from rows at hand.

    The rows are cut into classes of x with a straight line in each; the variance of these lines, corrected for what
    chance alone puts there (epsilon squared of Kelley 1935), is compared with the whole. Correlated parameters share
    what they explain.

    Args:
        x, y: (n,) independent rows, finite.

    Returns:
        The share with a delete-a-block jackknife interval; NaN when y does not vary or n is below 100.

    Raises:
        ValueError: a value is not finite.
    """
    from scipy.special import stdtrit

    _require_finite(x, y)
    if len(x) < 2 * BLOCKS or np.ptp(y) == 0.0:
        return Estimate(math.nan, math.nan, math.nan)
    classes = int(np.clip(round(len(x) ** (1 / 3)), 4, 64))
    label = np.empty(len(x), dtype=np.int64)
    label[np.argsort(x, kind="stable")] = np.arange(len(x)) * classes // len(x)
    place, score = ((values - np.mean(values)) / (np.std(values) or 1.0) for values in (x, y))
    cell = np.arange(len(x)) % BLOCKS * classes + label
    sums = np.array(
        [
            np.bincount(cell, weights=weight, minlength=BLOCKS * classes).reshape(BLOCKS, classes)
            for weight in (np.ones(len(x)), place, score, place**2, place * score, score**2)
        ]
    )
    totals = sums.sum(axis=1)
    value = _explained(totals)
    without = np.array([_explained(totals - sums[:, block]) for block in range(BLOCKS)])
    error = math.sqrt((BLOCKS - 1) / BLOCKS * float(np.sum((without - np.mean(without)) ** 2)))
    reach = float(stdtrit(BLOCKS - 1, 0.5 + confidence / 2.0)) * error
    return Estimate(value, value - reach, value + reach)


def _explained(sums: Floats) -> float:
    """Share explained by one line per class; (6, classes) sums of 1, x, y, x x, x y, y y."""
    sums = sums[:, sums[0] > 0.0]
    count, x, y, xx, xy, yy = sums
    rows = float(np.sum(count))
    whole = float(np.sum(yy)) - float(np.sum(y)) ** 2 / rows
    spread = xx - x**2 / count
    sloped = spread > 1e-9 * count
    slope_part = np.where(sloped, (xy - x * y / count) ** 2 / np.where(sloped, spread, 1.0), 0.0)
    between = float(np.sum(y**2 / count + slope_part)) - float(np.sum(y)) ** 2 / rows
    freedom = len(count) + int(np.count_nonzero(sloped))
    within = (whole - between) / (rows - freedom)
    return (between - (freedom - 1) * within) / whole


@dataclass(frozen=True)
class Gradient:
    """Linear picture of a metric around the nominal drive.

    Attributes:
        slope: derivative by each parameter, in units of the metric per unit of the parameter.
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

    Central differences through one sweep of 2 d + 1 rows, not exact derivatives: their error falls with step squared.

    Args:
        evaluate: columns (m,) to metrics (m,).
        tolerances: the d independent parameters.
        step: in standard deviations of each parameter.
    """
    middles = {item.name: item.middle for item in tolerances}
    steps = {item.name: step * item.deviation for item in tolerances}
    count = 2 * len(tolerances) + 1
    columns = {name: np.full(count, value) for name, value in middles.items()}
    for j, name in enumerate(middles):
        columns[name][1 + 2 * j] += steps[name]
        columns[name][2 + 2 * j] -= steps[name]
    found = {}
    for metric, values in evaluate(columns).items():
        changes = (values[1::2] - values[2::2]) / 2.0
        slopes = {name: float(changes[j]) / steps[name] for j, name in enumerate(middles)}
        parts = {item.name: (slopes[item.name] * item.deviation) ** 2 for item in tolerances}
        whole = sum(parts.values())
        shares = {name: part / whole if whole > 0.0 else math.nan for name, part in parts.items()}
        found[metric] = Gradient(slopes, shares, math.sqrt(whole) if whole >= 0.0 else math.nan)
    return found
