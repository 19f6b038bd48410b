"""Rows of a configuration file through the engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdfast import catalogue
from hdfast.checks import Floats
from hdfast.config import Config
from hdfast.request import Progress
from hdfast.result import MAIN_METRICS, SweepResult
from hdfast.sweep import sweep
from hdfast.tolerance.sample import Plan


def columns(config: Config, plan: Plan, start: int, stop: int) -> dict[str, Any]:
    """Parameter columns of the rows start to stop: nominal numbers, and samples of every toleranced parameter."""
    drawn: dict[str, Any] = {**config.drive, **plan.draw(start, stop)}
    if not plan.tolerances:
        first = config.table.names[0]
        drawn[first] = np.full(stop - start, config.nominal()[first])
    return drawn


def simulate(
    config: Config,
    rows: Mapping[str, Any],
    *,
    metrics: list[str] | None = None,
    threads: int | None = None,
    progress: bool | Progress = False,
    t_eval: Floats | None = None,
    signals: list[str] | None = None,
) -> SweepResult:
    """One sweep of parameter columns with model, scenario and numerical settings of the file."""
    run = config.run
    return sweep(
        dict(rows),
        model=config.model,
        scenario=config.scenario,
        metrics=metrics,
        method=run.method,
        rtol=run.rtol,
        atol=run.atol,
        max_steps=run.max_steps,
        threads=run.threads if threads is None else threads,
        progress=progress,
        t_eval=t_eval,
        signals=signals,
    )


def simulate_rows(
    config: Config,
    *,
    rows: int | None = None,
    seed: int | None = None,
    threads: int | None = None,
    progress: bool | Progress = False,
) -> SweepResult:
    """Draw and simulate the rows of a configuration file; arguments override its [run] section."""
    plan = config.plan(seed)
    count = plan.rows(config.run.rows if rows is None else rows)
    metrics = None
    if config.run.metrics is not None:
        metrics = list(dict.fromkeys([*config.run.metrics, *config.specs]))
    elif config.specs:
        metrics = list(dict.fromkeys([*catalogue.metrics(), *config.specs]))
    return simulate(config, columns(config, plan, 0, count), metrics=metrics, threads=threads, progress=progress)


def study_metrics(config: Config) -> list[str]:
    """Metrics a study keeps: those with limits, then those the file asks for, or else the main ones."""
    asked = MAIN_METRICS if config.run.metrics is None else config.run.metrics
    return list(dict.fromkeys([*config.specs, *asked]))
