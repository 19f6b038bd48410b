"""What the rows of a tolerance study say: everything an engineer signs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import catalogue, checks
from hdfast.checks import Floats
from hdfast.config import Config
from hdfast.errors import choose
from hdfast.printing import interval_text, share_text, text_table
from hdfast.tolerance import convergence
from hdfast.tolerance.chunks import Store
from hdfast.tolerance.further import FurtherRuns
from hdfast.tolerance.intervals import Estimate, Groups, share, standard_deviation
from hdfast.tolerance.limits import JOINT, Spec, Verdict, as_worst_case, counted, judge_values, margin
from hdfast.tolerance.policy import FailedRowsError, Usable, gate
from hdfast.tolerance.sample import Plan
from hdfast.tolerance.sensitivity import rank_correlation, variance_share
from hdfast.tolerance.simulation import columns, simulate
from hdfast.tolerance.statistics import Capability, Summary, capability, summarise
from hdfast.tolerance.task import Task

WORST = 5
HEADER = ["specification", "yield", "95 % interval", "asked for", "outcome"]


class Study(FurtherRuns):
    """Rows of a tolerance study and what they say.

    Attributes:
        config, plan: what was asked; `n` rows were run.
        policy: what happens to rows that failed or lack a metric.
        metrics: names of the metrics, those with limits first; `units` has their units.
    """

    def __init__(self, settings: Config, plan: Plan, n: int, store: Store, policy: str, task: Task) -> None:
        self.config, self.plan, self.n, self.store, self.policy, self.task = settings, plan, n, store, policy, task
        self.metrics = task.metrics
        self.units = {name: catalogue.metric(name).unit for name in task.metrics}
        self.groups: Groups | None = plan.groups(0, n)
        self._columns: dict[str, Floats] = {}

    @cached_property
    def finished(self) -> NDArray[np.bool_]:
        """(n,) True where the row finished."""
        return np.asarray(self.store.status() == catalogue.FINISHED)

    @cached_property
    def status_counts(self) -> dict[str, int]:
        """Number of rows per outcome, only those that occur."""
        status = self.store.status()
        counts = {known.name: int(np.count_nonzero(status == known.name)) for known in catalogue.statuses().values()}
        return {name: count for name, count in counts.items() if count}

    def column(self, name: str) -> Floats:
        """(n,) values of a metric or a parameter that varies, in row order; failed rows included."""
        choose("name", name, [*self.metrics, *self.plan.names])
        values: Floats = self.store.column(name)
        return values

    def usable(self, metric: str) -> Usable:
        """Values of a metric after the failure policy.

        Raises:
            FailedRowsError: under "refuse", when rows failed or lack the metric.
        """
        spec = self.specs.get(metric)
        bad_side = spec.bad_side if spec else math.inf
        return gate(self.column(metric), self.finished, self.policy, metric, bad_side, self.reason)

    def _require(self, metric: str, values: Floats) -> None:
        if self.policy == "refuse":
            gate(values, self.finished, self.policy, metric, reason=self.reason)

    def reason(self, row: int) -> str:
        """What became of a row and, when it failed, what to do; it runs again, unless it ended its process."""
        known = dict(self.store.poison)
        if row in known:
            return f"row {row}: {known[row]}"
        drawn = columns(self.config, self.plan, row, row + 1)
        found = simulate(self.config, drawn, metrics=list(self.metrics), threads=1)
        return f"row {row}{found.message(0).removeprefix('row 0')}"

    def held(self, spec: Spec) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(n,) which rows lie within limits, and (n,) which rows count after the failure policy.

        Raises:
            FailedRowsError: under "refuse", when rows failed or lack the metric.
        """
        values = self.column(spec.metric)
        self._require(spec.metric, values)
        return self.finished & spec.holds(values), counted(values, self.finished, self.policy)

    def _groups_of(self, usable: Usable) -> Groups | None:
        return None if self.groups is None else self.groups.take(usable.index)

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """Every specification held against the rows."""
        return [self._verdict(spec, self.column(spec.metric)) for spec in self.specs.values()]

    def _verdict(self, spec: Spec, values: Floats) -> Verdict:
        self._require(spec.metric, values)
        found = judge_values(spec, values, self.finished, policy=self.policy, groups=self.groups)
        return found if self.plan.design.random else as_worst_case(found)

    @cached_property
    def joint(self) -> Verdict | None:
        """All specifications at once; the yield asked for is the smallest of them. None without specifications."""
        if not self.specs:
            return None
        worst = self.worst_margin
        spec = Spec(JOINT, 0.0, math.inf, min(spec.min_yield for spec in self.specs.values()))
        held, used = self.finished & (worst >= 0.0), counted(worst, self.finished, self.policy)
        found = share(held[used], self.groups.take(used) if self.groups is not None else None)
        verdict = Verdict(spec, int(held.sum()), int(used.sum()), (found.low, found.high), int(np.sum(~used)))
        return verdict if self.plan.design.random else as_worst_case(verdict)

    @cached_property
    def worst_margin(self) -> Floats:
        """(n,) distance to the nearest limit of all, in standard deviations; negative outside, -inf where missing."""
        smallest = np.full(self.n, np.inf)
        for spec in self.specs.values():
            values = self.column(spec.metric)
            self._require(spec.metric, values)
            good = self.finished & np.isfinite(values)
            deviation = standard_deviation(values[good]) or 1.0
            smallest = np.minimum(smallest, margin(spec, np.where(good, values, np.nan), deviation))
        return smallest

    @property
    def yields(self) -> dict[str, Verdict]:
        """Yield with interval of every specification, and of all together."""
        found = {verdict.spec.metric: verdict for verdict in self.verdicts}
        return {**found, JOINT: self.joint} if self.joint is not None else found

    @cached_property
    def summaries(self) -> dict[str, Summary]:
        """Statistics of every metric that no row lacks; see `withheld` for the others."""
        found = {}
        for metric in self.metrics:
            try:
                usable = self.usable(metric)
            except FailedRowsError:
                if metric in self.specs or not self.finished.all():
                    raise
                continue
            found[metric] = summarise(metric, self.units[metric], usable, self._groups_of(usable))
        return found

    @property
    def withheld(self) -> dict[str, int]:
        """Metrics without limits that some finished rows lack, with their number; no statistic is made of them."""
        lacking = {m: int(np.sum(~np.isfinite(self.column(m)))) for m in self.metrics if m not in self.summaries}
        return {metric: count for metric, count in lacking.items() if count}

    @property
    def percentiles(self) -> dict[str, dict[float, Estimate]]:
        """Percentiles with their limits by metric and percentage."""
        return {metric: summary.percentiles for metric, summary in self.summaries.items()}

    @cached_property
    def capabilities(self) -> dict[str, Capability]:
        """Capability of every metric with limits."""
        found = {}
        for metric, spec in self.specs.items():
            usable = self.usable(metric)
            found[metric] = capability(usable.values, spec.lower, spec.upper, self._groups_of(usable))
        return found

    def worst(self, count: int = WORST) -> list[dict[str, Any]]:
        """The rows nearest to or furthest beyond their limits, with `row`, `margin` and every column.

        Under "exclude" only rows that count in the yield of all specifications together.

        Raises:
            InputError: `count` is no whole number from 1 to 10^6.
        """
        checks.whole("count", count, 1, 10**6)
        if not self.specs:
            return []
        used = np.flatnonzero(counted(self.worst_margin, self.finished, self.policy))
        order = used[np.argsort(self.worst_margin[used], kind="stable")][:count].tolist()
        rows = self.store.rows(order)
        return [
            {"row": number, "margin": float(self.worst_margin[number]), **row}
            for number, row in zip(order, rows, strict=True)
        ]

    def convergence(self, metric: str, percentage: float | None = None) -> convergence.Course:
        """Running yield of a specification, or running percentile of a metric, over the rows that count."""
        if percentage is None:
            held, used = self.held(self.specs[choose("metric", metric, self.specs)])
            return convergence.running_share(held[used], self.groups and self.groups.take(used))
        share_below = checks.number("percentage", percentage, 0.0, 100.0) / 100.0
        usable = self.usable(metric)
        return convergence.running_percentile(usable.values, share_below, self._groups_of(usable))

    @cached_property
    def contributions(self) -> dict[str, dict[str, Estimate]]:
        """Share of the variance of each metric that each tolerance explains alone, from the rows of the study."""
        inputs = {name: self.column(name) for name in self.plan.names}
        return {metric: self._shares(inputs, self.usable(metric)) for metric in self.summaries}

    def _shares(self, inputs: Mapping[str, Floats], usable: Usable) -> dict[str, Estimate]:
        index, values = usable.index, usable.values
        if usable.missing and usable.policy == "worst":
            keep = np.isfinite(values)
            index, values = index[keep], values[keep]
        groups = self.groups and self.groups.take(index)
        return {name: variance_share(column[index], values, groups) for name, column in inputs.items()}

    @cached_property
    def loss_contributions(self) -> dict[str, dict[str, Estimate]]:
        """The same for being outside each limit: which tolerance decides whether a drive is bad."""
        inputs = {name: self.column(name) for name in self.plan.names}
        found = {}
        for metric, spec in self.specs.items():
            held, used = self.held(spec)
            bad = (~held[used]).astype(float)
            groups = self.groups and self.groups.take(used)
            found[metric] = {name: variance_share(column[used], bad, groups) for name, column in inputs.items()}
        return found

    def rank_correlations(self, metric: str) -> dict[str, Estimate]:
        """Spearman's rank correlation of a metric with every parameter that varies."""
        usable = self.usable(metric)
        keep = np.isfinite(usable.values)
        index, values = usable.index[keep], usable.values[keep]
        groups = self.groups and self.groups.take(index)
        return {name: rank_correlation(self.column(name)[index], values, groups) for name in self.plan.names}

    @property
    def met(self) -> bool:
        """True when the outcome of every specification is "met": see `Verdict.outcome` for what that shows."""
        return all(verdict.outcome == "met" for verdict in self.verdicts)

    def report(self, out: str | Path) -> Path:
        """Write the page, tables, summary and exact input into a folder; returns the page.

        Args:
            out: the folder; of a study that was run with `out` that one.
        """
        from hdfast.report.tolerance import write_study

        return write_study(self, Path(out))

    def __repr__(self) -> str:
        counts = ", ".join(f"{name} {count:,}" for name, count in self.status_counts.items())
        head = f"Study: {self.n:,} rows ({counts}), {self.plan.sampling}, seed {self.plan.seed}"
        rows = [
            [
                name,
                share_text(verdict.yield_),
                interval_text(verdict.interval),
                f"{100 * verdict.spec.min_yield:g} %",
                verdict.outcome,
            ]
            for name, verdict in self.yields.items()
        ]
        return head + ("\n" + text_table(HEADER, rows) if rows else "")
