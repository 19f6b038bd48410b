"""A configuration file as a Monte Carlo run: draw rows, simulate them, hold them against the specification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.config import Config, Spec
from hdfast.request import Progress
from hdfast.result import SweepResult
from hdfast.sweep import sweep

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Verdict:
    """A specification held against a run. Rows that failed or lack the metric count as not met.

    Attributes:
        within: number of rows inside the limits, of `rows`.
        interval: two-sided 95 % confidence interval of the yield (Clopper and Pearson).
    """

    spec: Spec
    within: int
    rows: int
    interval: tuple[float, float]

    @property
    def yield_(self) -> float:
        """Share of rows inside the limits."""
        return self.within / self.rows

    @property
    def met(self) -> bool:
        """True when the yield reaches what the specification asks for."""
        return self.within >= self.spec.min_yield * self.rows


def draw(config: Config, rows: int | None = None, seed: int | None = None) -> dict[str, Any]:
    """Parameter columns of a Monte Carlo run: nominal numbers, and (M,) samples of every toleranced parameter."""
    count = config.run.rows if rows is None else rows
    start = config.run.seed if seed is None else seed
    drawn = {name: tolerance.sample(count, start) for name, tolerance in config.tolerances.items()}
    columns: dict[str, Any] = {**config.drive, **drawn}
    if not drawn:
        first = config.table.names[0]
        columns[first] = np.full(count, config.nominal()[first])
    return columns


def simulate_rows(
    config: Config,
    *,
    rows: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
    progress: bool | Progress = False,
) -> SweepResult:
    """Draw and simulate the rows of a configuration file; arguments override its [run] section."""
    run = config.run
    metrics = None
    if run.metrics is not None:
        metrics = list(dict.fromkeys([*run.metrics, *config.specs]))
    elif config.specs:
        from hdfast import catalogue

        metrics = list(dict.fromkeys([*catalogue.metrics(), *config.specs]))
    return sweep(
        draw(config, rows, seed),
        model=config.model,
        scenario=config.scenario,
        metrics=metrics,
        method=run.method,
        rtol=run.rtol,
        atol=run.atol,
        max_steps=run.max_steps,
        threads=run.threads if threads is None else threads,
        progress=progress,
    )


def judge(config: Config, result: SweepResult) -> list[Verdict]:
    """Every specification of the file held against a result."""
    return [_verdict(spec, result[spec.metric][:], result) for spec in config.specs.values()]


def _verdict(spec: Spec, values: Floats, result: SweepResult) -> Verdict:
    within = int(np.count_nonzero(result.finished & (values >= spec.lower) & (values <= spec.upper)))
    return Verdict(spec, within, len(result), _interval(within, len(result)))


def _interval(hits: int, rows: int) -> tuple[float, float]:
    from scipy.stats import beta

    tail = (1.0 - CONFIDENCE) / 2.0
    low = 0.0 if hits == 0 else float(beta.ppf(tail, hits, rows - hits + 1))
    high = 1.0 if hits == rows else float(beta.ppf(1.0 - tail, hits + 1, rows - hits))
    return low, high
