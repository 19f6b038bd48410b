"""The result folder of a tolerance study: page, tables as Parquet and CSV, summary and exact input; no clock in any."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv as pc
import pyarrow.parquet as pq

from hdfast.catalogue import build_info
from hdfast.files import (
    PAGE,
    SUMMARY,
    alone_in,
    json_ready,
    prepare_inputs,
    prepare_study,
    retract,
    write_atomically,
    write_json,
    write_text,
)
from hdfast.report.folder import write_inputs
from hdfast.report.tolerance_page import page
from hdfast.tolerance.intervals import Estimate
from hdfast.tolerance.limits import Verdict
from hdfast.tolerance.store import FolderStore, MemoryStore
from hdfast.tolerance.study import Study

STATISTICS, WORST = "statistics", "worst"


def write_study(study: Study, out: Path) -> Path:
    """Write everything of a study, the summary last; returns the page.

    Raises:
        InputError: the folder cannot be written, or holds another input and no results; of a study with a folder it is
            another one, or its rows have become others: another run is at work there or was.
        FailedRowsError: rows failed and the policy is "refuse".
    """
    inputs = study.config.inputs
    if isinstance(study.store, FolderStore):
        study.store.require_own(out)
    with alone_in(out):
        if isinstance(study.store, FolderStore):
            study.store.require_unchanged()
            folder = prepare_study(out, inputs)
        else:
            folder = prepare_inputs(out, inputs)
        numbers = summary(study)
        text = page(study)
        retract(folder, inputs)
        write_inputs(folder, inputs)
        _write_table(folder, STATISTICS, statistics_rows(study))
        _write_table(folder, WORST, study.worst())
        if isinstance(study.store, MemoryStore):
            rows = study.store.table()
            place = folder / study.store.files
            write_atomically(place, lambda stream: pq.write_table(rows, stream, compression="zstd"))
        write_text(folder / PAGE, text)
        write_json(folder / SUMMARY, numbers)
    return folder / PAGE


def summary(study: Study) -> dict[str, Any]:
    """The study in numbers, ready for JSON; null where a number is not known."""
    info = build_info()
    numbers = {
        "title": study.config.title,
        "version": info["version"],
        **study.config.checksums,
        "rows": study.n,
        "sampling": study.plan.sampling,
        "seed": study.plan.seed,
        "failed": study.policy,
        "status": study.status_counts,
        "poison": [{"row": row, "reason": reason} for row, reason in study.store.poison],
        "specifications": {name: _verdict(verdict) for name, verdict in study.yields.items()},
        "capability": {
            name: {"cp": found.cp, "cpk": _estimate(found.cpk), "ppk": found.ppk}
            for name, found in study.capabilities.items()
        },
        "metrics": {row["metric"]: {k: v for k, v in row.items() if k != "metric"} for row in statistics_rows(study)},
        "withheld": study.withheld,
        "rare": {
            metric: {
                "ppm": _estimate(found.ppm),
                "levels": found.levels,
                "rows": found.evaluations,
                "missing": found.missing,
            }
            for metric, found in study.rare_events.items()
        },
        "contributions": {
            metric: {name: _estimate(share) for name, share in shares.items()}
            for metric, shares in study.contributions.items()
        },
    }
    return dict(json_ready(numbers))


def statistics_rows(study: Study) -> list[dict[str, Any]]:
    """One entry per metric: unit, rows, moments, and every percentile with its limits."""
    found = []
    for metric, row in study.summaries.items():
        entry: dict[str, Any] = {"metric": metric, "unit": row.unit, "rows": row.rows, "missing": row.missing}
        entry |= {"mean": row.mean.value, "mean_low": row.mean.low, "mean_high": row.mean.high}
        entry |= {"std": row.deviation, "skewness": row.skewness, "kurtosis": row.kurtosis}
        entry |= {"min": row.low, "max": row.high}
        entry |= {"holds_95_low": row.tolerance[0], "holds_95_high": row.tolerance[1]}
        for percentage, estimate in row.percentiles.items():
            label = f"P{percentage:g}"
            entry |= {label: estimate.value, f"{label}_low": estimate.low, f"{label}_high": estimate.high}
        found.append(entry)
    return found


def _verdict(verdict: Verdict) -> dict[str, Any]:
    spec = verdict.spec
    return {
        "outcome": verdict.outcome,
        "lower": spec.lower,
        "upper": spec.upper,
        "min_yield": spec.min_yield,
        "yield": verdict.yield_,
        "interval_95": list(verdict.interval),
        "ppm": _estimate(verdict.ppm),
        "within": verdict.within,
        "rows": verdict.rows,
        "missing": verdict.missing,
    }


def _estimate(estimate: Estimate) -> list[float]:
    return [estimate.value, estimate.low, estimate.high]


def _write_table(folder: Path, name: str, rows: list[dict[str, Any]]) -> None:
    """As Parquet and CSV, where there are rows."""
    if rows:
        table = pa.Table.from_pylist(rows)
        write_atomically(folder / f"{name}.parquet", lambda stream: pq.write_table(table, stream))
        write_atomically(folder / f"{name}.csv", lambda stream: pc.write_csv(table, stream))
