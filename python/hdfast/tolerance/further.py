"""Questions to a study that take further rows: what a tolerance does, sensitivity designs, rare events, allocation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.config import Config
from hdfast.errors import InputError, choose
from hdfast.result import SweepResult
from hdfast.tolerance.allocation import Allocation, allocate
from hdfast.tolerance.effects import PERCENTAGE, Effect, effects
from hdfast.tolerance.indices import (
    Indices,
    Screening,
    morris_effects,
    morris_points,
    saltelli_points,
    sobol_indices,
)
from hdfast.tolerance.limits import Spec, margin
from hdfast.tolerance.policy import WHOLE, gate
from hdfast.tolerance.rare import RareEvent, subset_simulation
from hdfast.tolerance.sample import Plan
from hdfast.tolerance.sensitivity import Gradient, gradient
from hdfast.tolerance.simulation import simulate
from hdfast.tolerance.task import Task

EFFECT_ROWS = 1000


class FurtherRuns:
    """What a study can be asked that its own rows do not answer."""

    config: Config
    plan: Plan
    policy: str
    task: Task
    metrics: tuple[str, ...]

    @property
    def specs(self) -> dict[str, Spec]:
        """Limits by metric."""
        return self.config.specs

    @property
    def _allowed(self) -> dict[str, tuple[float, float]]:
        return {name: self.config.table[name].allowed for name in self.plan.names}

    def evaluate(self, columns: Mapping[str, Floats]) -> tuple[dict[str, Floats], NDArray[np.bool_]]:
        """Metrics of other rows of the same drive: columns (m,) to metrics (m,) and which rows finished."""
        result = self._run(columns)
        return dict(result.metrics), result.finished

    def _run(self, columns: Mapping[str, Floats]) -> SweepResult:
        given: dict[str, Any] = {**self.config.drive, **columns}
        return simulate(self.config, given, metrics=list(self.metrics), threads=self.task.threads)

    @cached_property
    def effects(self) -> list[Effect]:
        """What holding, halving and widening each tolerance by half does; runs `EFFECT_ROWS` rows per variant."""
        return self.effects_of()

    def effects_of(
        self,
        names: Sequence[str] | None = None,
        *,
        rows: int = EFFECT_ROWS,
        percentage: float = PERCENTAGE,
        **options: Any,
    ) -> list[Effect]:
        """As `effects`, for some parameters, other factors or more rows; see `hdfast.tolerance.effects.effects`."""
        return effects(
            lambda variant, count: self.evaluate(variant.draw(0, count)),
            self.plan,
            self.specs,
            list(self.metrics),
            rows=rows,
            percentage=percentage,
            names=names,
            policy=self.policy,
            allowed=self._allowed,
            **options,
        )

    def sobol(self, base: int = 1024) -> dict[str, Indices]:
        """First and total order Sobol indices by metric, from base * (d + 2) rows of their own.

        Raises:
            InputError: the parameters are correlated, or none varies.
            FailedRowsError: a row failed or lacks a metric with limits; other metrics it lacks are left out.
        """
        self._require_independence("Sobol indices")
        points = saltelli_points(len(self.plan.names), checks.whole("base", base, 2, 10**7), self.plan.seed)
        return {
            m: sobol_indices(v, self.plan.names, seed=self.plan.seed)
            for m, v in self._complete(self._at(points)).items()
        }

    def morris(self, walks: int = 50) -> dict[str, Screening]:
        """Elementary effects by metric, over the range P0.5 to P99.5 of every parameter; walks * (d + 1) rows.

        Raises: as `sobol`.
        """
        self._require_independence("Elementary effects")
        points = morris_points(len(self.plan.names), checks.whole("walks", walks, 2, 10**6), self.plan.seed)
        found = self._complete(self._at(0.005 + 0.99 * points))
        return {metric: morris_effects(points, values, self.plan.names) for metric, values in found.items()}

    def gradients(self, step: float = 0.1) -> dict[str, Gradient]:
        """Linear error propagation by metric; differences, see `hdfast.tolerance.sensitivity.gradient`.

        Raises: as `sobol`.
        """
        self._require_independence("Linear error propagation")
        checks.positive("step", step, 10.0)
        return gradient(self._complete, self.plan.tolerances, step)

    @cached_property
    def rare_events(self) -> dict[str, RareEvent]:
        """Answers of `rare` so far, by metric; the report shows them."""
        return {}

    def rare(self, metric: str, **options: Any) -> RareEvent:
        """Probability that a metric leaves its limits, by subset simulation; see `subset_simulation`.

        Rows that failed or lack the metric are refused, or count as outside under "worst" and "exclude".

        Raises:
            FailedRowsError: under "refuse", when a row failed.
        """
        self._require_tolerances("Rare events")
        spec = self.specs[choose("metric", metric, self.specs)]
        missing = 0

        def distance(scores: Floats) -> Floats:
            result = self._run(self.plan.from_scores(self.plan.dependent_scores(scores)))
            if self.policy == "refuse":
                gate(result[metric], result.finished, self.policy, metric, reason=result.message)
            found = margin(spec, np.where(result.finished, result[metric], np.nan), 1.0)
            nonlocal missing
            missing += int(np.count_nonzero(np.isneginf(found)))
            return found

        found = subset_simulation(distance, len(self.plan.names), **{"seed": self.plan.seed, **options})
        self.rare_events[metric] = found = replace(found, missing=missing)
        return found

    def allocate(self, **options: Any) -> Allocation:
        """Which tolerances to tighten or relax at the lowest cost; see `hdfast.tolerance.allocation.allocate`."""
        return allocate(self.evaluate, self.plan, self.specs, policy=self.policy, allowed=self._allowed, **options)

    def _require_tolerances(self, what: str) -> None:
        if not self.plan.names:
            raise InputError(f"{what} need parameters that vary: the file has no section [tolerance.<name>]")

    def _require_independence(self, what: str) -> None:
        self._require_tolerances(what)
        if self.plan.correlation is not None:
            raise InputError(f"{what} need independent parameters; these are correlated: use contributions or effects")

    def _at(self, points: Floats) -> dict[str, Floats]:
        """Columns (m,) at (m, d) probabilities."""
        return {t.name: t.quantile(points[:, j]) for j, t in enumerate(self.plan.tolerances)}

    def _complete(self, columns: Mapping[str, Floats]) -> dict[str, Floats]:
        """Metrics that every row has."""
        result = self._run(columns)
        whole = {}
        for metric, found in result.metrics.items():
            if metric in self.specs or not result.finished.all():
                gate(found, result.finished, "refuse", metric, reason=result.message, remedy=WHOLE)
            if np.all(np.isfinite(found)):
                whole[metric] = np.asarray(found)
        return whole
