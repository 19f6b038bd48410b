"""Tables and the JSON summary of a result."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hdfast.config import Config
from hdfast.printing import interval_text, share_text
from hdfast.result import PERCENTILES, SweepResult
from hdfast.tolerance.limits import Verdict

METRIC_HEADER = ["metric", "unit", *(f"P{q:g}" for q in PERCENTILES), "mean", "rows"]
SPEC_HEADER = ["specification", "unit", "lower", "upper", "yield", "95 % interval", "asked for", "met"]
TOLERANCE_HEADER = ["parameter", "unit", "nominal", "distribution", "source of the nominal value"]


def number(value: float) -> str:
    """A value with four digits, a dash for NaN and no limit."""
    return "-" if not math.isfinite(value) else f"{value:.4g}"


def metric_rows(result: SweepResult) -> list[list[str]]:
    """Percentiles, mean and number of usable rows of every metric."""
    return [_metric_row(result, name) for name in result.metrics]


def _metric_row(result: SweepResult, name: str) -> list[str]:
    values = result.usable(name)
    mean = float(np.mean(values)) if values.size else math.nan
    cells = [number(value) for value in result.percentiles(name, PERCENTILES)]
    return [name, result.units[name], *cells, number(mean), str(values.size)]


def spec_rows(verdicts: list[Verdict], units: dict[str, str]) -> list[list[str]]:
    """Limits, yield with its confidence interval, and whether it is enough."""
    return [
        [
            verdict.spec.metric,
            units[verdict.spec.metric],
            number(verdict.spec.lower),
            number(verdict.spec.upper),
            share_text(verdict.yield_),
            interval_text(verdict.interval),
            f"{100 * verdict.spec.min_yield:g} %",
            "yes" if verdict.met else "NO",
        ]
        for verdict in verdicts
    ]


def tolerance_rows(config: Config) -> list[list[str]]:
    """Every parameter that varies."""
    nominal = config.nominal()
    return [
        [name, config.table[name].unit, f"{nominal[name]:.6g}", tolerance.describe(), config.table[name].source]
        for name, tolerance in config.tolerances.items()
    ]


def nominal_rows(config: Config) -> list[list[str]]:
    """Nominal value of every parameter."""
    nominal = config.nominal()
    return [[row.name, f"{nominal[row.name]:.6g}", row.unit, row.meaning] for row in config.table]


def statistics(result: SweepResult, name: str) -> dict[str, Any]:
    """Statistics of a metric for the JSON summary; NaN where there is no usable row."""
    values = result.usable(name)
    numbers = dict(zip((f"P{q:g}" for q in PERCENTILES), result.percentiles(name, PERCENTILES).tolist(), strict=True))
    numbers["mean"] = float(np.mean(values)) if values.size else math.nan
    numbers["std"] = float(np.std(values, ddof=1)) if values.size > 1 else math.nan
    numbers["min"] = float(np.min(values)) if values.size else math.nan
    numbers["max"] = float(np.max(values)) if values.size else math.nan
    return {"unit": result.units[name], "rows": int(values.size), **numbers}


def verdict_entry(verdict: Verdict) -> dict[str, Any]:
    """A specification for the JSON summary."""
    spec = verdict.spec
    return {
        "lower": spec.lower,
        "upper": spec.upper,
        "min_yield": spec.min_yield,
        "yield": verdict.yield_,
        "interval_95": None if math.isnan(verdict.interval[0]) else list(verdict.interval),
        "met": verdict.met,
    }
