"""Limits held against rows: yields with confidence, parts per million, verdicts, and the worst rows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.tolerance.intervals import CONFIDENCE, Estimate, Groups, share

if TYPE_CHECKING:
    from hdfast.result import SweepResult
    from hdfast.tolerance.sample import Plan

JOINT = "all together"
MET, NOT_MET, OPEN = "met", "not met", "undecided"


@dataclass(frozen=True)
class Spec:
    """Limits of a metric in its SI unit; met when at least the share `min_yield` (1 unless given) of rows is within."""

    metric: str
    lower: float
    upper: float
    min_yield: float

    def holds(self, values: Floats) -> NDArray[np.bool_]:
        """(n,) True where a value lies within; NaN and infinities never do."""
        return np.isfinite(values) & (values >= self.lower) & (values <= self.upper)

    @property
    def bad_side(self) -> float:
        """Where the worst values lie: -inf when there is only a lower limit."""
        return -math.inf if math.isinf(self.upper) else math.inf


def read_spec(metric: str, entry: Mapping[str, object]) -> Spec:
    """Read one [spec.<metric>] section.

    Raises:
        InputError: a limit is no number, or the limits allow nothing or everything.
    """
    lower = checks.number("lower", entry.get("lower", -math.inf))
    upper = checks.number("upper", entry.get("upper", math.inf))
    if not lower < upper:
        raise InputError(f"[spec.{metric}] lower = {lower:g} is not below upper = {upper:g}")
    if math.isinf(lower) and math.isinf(upper):
        raise InputError(f"[spec.{metric}] needs lower, upper or both")
    return Spec(metric, lower, upper, checks.number("min_yield", entry.get("min_yield", 1.0), 0.0, 1.0))


@dataclass(frozen=True)
class Verdict:
    """A specification held against a run. Rows that failed or lack the metric count as not met.

    Attributes:
        within: number of rows inside the limits, of `rows`.
        interval: two-sided 95 % confidence interval of the yield; NaN where none is known.
        missing: rows left out, which happens under the policy "exclude" only.
        worst_case: the rows are no random sample but extremes, which must all lie within.
    """

    spec: Spec
    within: int
    rows: int
    interval: tuple[float, float]
    missing: int = 0
    worst_case: bool = False

    @property
    def yield_(self) -> float:
        """Share of rows inside the limits."""
        return self.within / self.rows if self.rows else math.nan

    @property
    def met(self) -> bool:
        """True when the yield reaches what the specification asks for."""
        return self.yield_ >= (1.0 if self.worst_case else self.spec.min_yield)

    @property
    def ppm(self) -> Estimate:
        """Parts per million outside the limits, with the interval of the yield."""
        return Estimate(1e6 * (1.0 - self.yield_), 1e6 * (1.0 - self.interval[1]), 1e6 * (1.0 - self.interval[0]))

    @property
    def outcome(self) -> str:
        """Either "met" or "not met" when the whole interval says so, else "undecided".

        Where no interval can say so, a run without a row outside is "met", see `provable`.
        """
        if not self.provable:
            return MET if self.met else NOT_MET
        if self.interval[0] >= self.spec.min_yield:
            return MET
        return NOT_MET if self.interval[1] < self.spec.min_yield else OPEN

    @property
    def provable(self) -> bool:
        """False when no interval can show what is asked for: 100 %, or rows that are no random sample."""
        return self.spec.min_yield < 1.0 and not self.worst_case


def judge_values(
    spec: Spec,
    values: Floats,
    finished: NDArray[np.bool_],
    *,
    policy: str = "worst",
    groups: Groups | None = None,
    confidence: float = CONFIDENCE,
) -> Verdict:
    """One specification against (n,) values; under "exclude" rows without the metric are left out, else they count."""
    held = finished & spec.holds(values)
    used = counted(values, finished, policy)
    found = share(held[used], groups.take(used) if groups is not None else None, confidence)
    return Verdict(
        spec, int(np.count_nonzero(held)), int(np.count_nonzero(used)), (found.low, found.high), int(np.sum(~used))
    )


def counted(values: Floats, finished: NDArray[np.bool_], policy: str) -> NDArray[np.bool_]:
    """(n,) True where a row counts in a yield: under "exclude" where it has the metric, else everywhere."""
    return finished & np.isfinite(values) if policy == "exclude" else np.ones(len(values), dtype=bool)


def judge(specs: Mapping[str, Spec], result: SweepResult, plan: Plan | None = None) -> list[Verdict]:
    """Every specification held against a result, rows that failed counted as not met.

    Args:
        plan: how the rows were drawn; independent random rows when left out.
    """
    groups = None if plan is None else plan.groups(0, len(result))
    found = [judge_values(spec, result[spec.metric][:], result.finished, groups=groups) for spec in specs.values()]
    return found if plan is None or plan.design.random else [as_worst_case(verdict) for verdict in found]


def as_worst_case(verdict: Verdict) -> Verdict:
    """The verdict over rows that are extremes and no random sample."""
    return replace(verdict, worst_case=True, interval=(math.nan, math.nan))


def margin(spec: Spec, values: Floats, deviation: float) -> Floats:
    """Distance to the nearer limit in standard deviations, negative outside, -inf where there is no value."""
    distance = np.minimum(spec.upper - values, values - spec.lower) / (deviation or 1.0)
    return np.where(np.isfinite(values), distance, -np.inf)
