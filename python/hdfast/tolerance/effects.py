"""What a tolerance does: the same rows again with one spread made narrower or wider."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import choose
from hdfast.tolerance.intervals import CONFIDENCE, Estimate, Groups, share, student
from hdfast.tolerance.limits import JOINT, Spec, counted
from hdfast.tolerance.sample import MAX_ROWS, Plan

FACTORS = (0.0, 0.5, 1.5)
PERCENTAGE = 99.0
RESAMPLES = 100

Run = tuple[Mapping[str, Floats], NDArray[np.bool_]]
Evaluate = Callable[[Plan, int], Run]


@dataclass(frozen=True)
class Effect:
    """What happens when the spread of one parameter is multiplied by `factor`, all else the same.

    Attributes:
        parameter, factor: what was changed; 0 holds the parameter at its middle.
        used: the factor in fact, less than `factor` where the worst-case values would not be allowed; 1: no change.
        yields: change of each yield, JOINT among them, as a share (0.01 is one more drive in a hundred).
        percentiles: change of the percentile of each metric in its unit.
        variances: change of each variance relative to what it was.
        missing: rows that lack one of the metrics before or after.
    """

    parameter: str
    factor: float
    yields: dict[str, Estimate]
    percentiles: dict[str, Estimate]
    variances: dict[str, float]
    missing: int
    used: float


def followed(spec: Spec | None, percentage: float = PERCENTAGE) -> float:
    """Which percentile of a metric is followed; where it has a lower limit only, that of the opposite tail."""
    return percentage if spec is None or math.isfinite(spec.upper) else 100.0 - percentage


def effects(
    evaluate: Evaluate,
    plan: Plan,
    specs: Mapping[str, Spec],
    metrics: Sequence[str],
    *,
    rows: int,
    percentage: float = PERCENTAGE,
    factors: Sequence[float] = FACTORS,
    names: Sequence[str] | None = None,
    policy: str = "worst",
    allowed: Mapping[str, tuple[float, float]] | None = None,
) -> list[Effect]:
    """Effects of every tolerance at every factor.

    Args:
        evaluate: (plan, rows) to metrics (rows,) and which rows finished.
        plan: what is drawn as it is, but every drive from a batch of its own, so that what batches have in common
            varies whatever their size; by "monte_carlo" where its sampling shows no interval (extremes, one group).
        specs: limits by metric.
        metrics: metrics whose percentiles are followed; for one with a lower limit only, the opposite tail.
        rows: per variant; every variant draws the same probabilities, so differences are not blurred by chance.
        percentage: which percentile.
        factors: on the spread, 0 to 100.
        names: parameters to change, default all.
        policy: under "exclude" a row that lacks a metric in either run is left out of the yields too, else it counts
            as outside.
        allowed: range of each parameter, which no spread is widened beyond; without end for those left out.

    Returns:
        One per parameter and factor; a row that lacks a metric in either run is left out of its percentile and
        variance.

    Raises:
        InputError: naming argument, value and allowed range.
    """
    checks.whole("rows", rows, 1, MAX_ROWS)
    checks.number("percentage", percentage, 0.0, 100.0)
    for factor in checks.listed("factors", factors, "numbers from 0 to 100"):
        checks.number("factors", factor, 0.0, 100.0)
    for name in names or ():
        choose("names", name, plan.names)
    plan = replace(plan, batch_size=1)
    groups = plan.groups(0, rows)
    if groups is not None and groups.count < 2:
        plan = replace(plan, sampling="monte_carlo")
        groups = plan.groups(0, rows)
    before = evaluate(plan, rows)
    widest = plan.widest(allowed or {})
    found = []
    for name in plan.names if names is None else names:
        for factor in factors:
            used = min(factor, widest[name])
            after = before if used == 1.0 else evaluate(plan.scaled({name: used}), rows)
            found.append(_compare((name, factor, used), before, after, specs, metrics, percentage, groups, policy))
    return found


def _compare(
    change: tuple[str, float, float], before: Run, after: Run, specs: Mapping[str, Spec], metrics: Sequence[str],
    percentage: float, groups: Groups | None, policy: str,
) -> Effect:  # fmt: skip
    old_held, new_held = _held(before, specs), _held(after, specs)
    used = {
        metric: counted(before[0][metric], before[1], policy) & counted(after[0][metric], after[1], policy)
        for metric in specs
    }
    used[JOINT] = np.logical_and.reduce(list(used.values()))
    yields = {
        key: _yield_change(old_held[key][used[key]], new_held[key][used[key]], groups and groups.take(used[key]))
        for key in old_held
    }
    percentiles, variances = {}, {}
    complete = before[1] & after[1]
    for metric in metrics:
        both = before[1] & after[1] & np.isfinite(before[0][metric]) & np.isfinite(after[0][metric])
        complete &= both
        old, new = before[0][metric][both], after[0][metric][both]
        share_below = followed(specs.get(metric), percentage) / 100.0
        percentiles[metric] = _percentile_change(old, new, share_below, groups and groups.take(both))
        varies = len(old) > 0 and np.ptp(old) > 0.0
        variances[metric] = float(np.var(new) / np.var(old)) - 1.0 if varies else math.nan
    name, factor, applied = change
    return Effect(name, factor, yields, percentiles, variances, int(np.sum(~complete)), applied)


def _held(run: Run, specs: Mapping[str, Spec]) -> dict[str, NDArray[np.bool_]]:
    values, finished = run
    held = {metric: finished & spec.holds(values[metric]) for metric, spec in specs.items()}
    return {**held, JOINT: np.logical_and.reduce(list(held.values()))} if held else {}


def _yield_change(old: NDArray[np.bool_], new: NDArray[np.bool_], groups: Groups | None) -> Estimate:
    """Change of a share, with the limits of what is gained and of what is lost put together (Zou and Donner 2008).

    Each has an exact interval, so that a change that rests on one row, or on none, is as open as it is. That no row is
    both gained and lost is left out: it counts where each is a tenth of the rows or more.
    """
    gained, lost = share(new & ~old, groups), share(old & ~new, groups)
    value = gained.value - lost.value
    return Estimate(
        value,
        value - math.hypot(gained.value - gained.low, lost.high - lost.value),
        value + math.hypot(gained.high - gained.value, lost.value - lost.low),
    )


def _percentile_change(
    old: Floats, new: Floats, share_below: float, groups: Groups | None, confidence: float = CONFIDENCE
) -> Estimate:
    """Change of a percentile; interval by the bootstrap of rows, or of whole groups where rows depend on each other."""
    if len(old) < 2:
        return Estimate(math.nan, math.nan, math.nan)
    value = float(np.quantile(new, share_below) - np.quantile(old, share_below))
    units = len(old) if groups is None else groups.count
    if units < 2:
        return Estimate(value, math.nan, math.nan)
    picks = np.random.default_rng(1).integers(0, units, (RESAMPLES, units))
    members = None if groups is None else groups.members
    rows: Iterable[Any] = picks if members is None else [np.concatenate([members[k] for k in pick]) for pick in picks]
    changes = [float(np.quantile(new[chosen], share_below) - np.quantile(old[chosen], share_below)) for chosen in rows]
    reach = student(units, confidence) * math.sqrt(units / (units - 1)) * float(np.std(changes, ddof=1))
    return Estimate(value, value - reach, value + reach)
