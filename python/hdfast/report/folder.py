"""The result folder: page, Parquet table, JSON summary and the exact input. Every file appears whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hdfast import catalogue
from hdfast.config import Config
from hdfast.files import PAGE, SUMMARY, json_ready, prepare, retract, write_atomically, write_bytes, write_json
from hdfast.recordings import save
from hdfast.report import html, tables
from hdfast.result import SweepResult
from hdfast.simulate import Trajectory
from hdfast.tolerance.limits import Verdict

ROWS, TRAJECTORY, RECORDING = "rows.parquet", "trajectory.parquet", "recording.parquet"


def summary(config: Config, result: SweepResult, verdicts: list[Verdict], seed: int) -> dict[str, Any]:
    """The result in numbers, ready for JSON; null where a number is not finite."""
    numbers = {
        "title": config.title,
        **_origin(config),
        "seed": seed,
        "rows": len(result),
        "status": result.status_counts(),
        "interrupted": result.interrupted,
        "seconds": result.seconds,
        "rows_per_second": result.rows_per_second,
        "threads": result.threads,
        "simd": result.simd,
        "specifications": {verdict.spec.metric: tables.verdict_entry(verdict) for verdict in verdicts},
        "metrics": {name: tables.statistics(result, name) for name in result.metrics},
    }
    return dict(json_ready(numbers))


def simulate_summary(config: Config, run: Trajectory) -> dict[str, Any]:
    """A single row in numbers, ready for JSON; null where a number is not finite."""
    numbers = {
        "title": config.title,
        **_origin(config),
        "status": run.status,
        "message": run.message,
        "metrics": {name: {"unit": run.units[name], "value": value} for name, value in run.metrics.items()},
        "parameters": run.parameters,
    }
    return dict(json_ready(numbers))


def _origin(config: Config) -> dict[str, Any]:
    info = catalogue.build_info()
    return {
        "version": info["version"],
        "build": {key: value for key, value in info.items() if isinstance(value, (str, int, bool, list))},
        "finished_at": datetime.now(UTC).isoformat(timespec="seconds"),
        **config.checksums,
        "model": {
            "base": config.model.base,
            "spring": config.model.spring,
            "orders": list(config.model.orders),
            "terms": list(config.model.terms),
        },
    }


def write_table(path: Path, table: Any, seed: int | None, version: str) -> None:
    """A table as Parquet; units stand in the metadata of each column."""
    import pyarrow.parquet as pq

    metadata = {"hdfast_version": version} | ({} if seed is None else {"seed": str(seed)})
    table = table.replace_schema_metadata({**(table.schema.metadata or {}), **metadata})
    write_atomically(path, lambda stream: pq.write_table(table, stream, compression="zstd"))


def write_inputs(folder: Path, inputs: Mapping[str, bytes]) -> None:
    """Copies of what results came from, see `Config.inputs`."""
    for name, content in inputs.items():
        place = folder / name
        write_bytes(prepare(place.parent) / place.name, content)


def write_sweep(
    folder: Path,
    config: Config,
    result: SweepResult,
    verdicts: list[Verdict],
    seed: int,
    nominal: Trajectory | None,
) -> dict[str, Any]:
    """Write everything of a sweep, the summary last, and return the summary.

    Without `nominal`, as after an interruption, there is no page. An interrupted sweep has no verdicts: the rows that
    ended first are no random sample.
    """
    numbers = summary(config, result, verdicts, seed)
    retract(folder, config.inputs)
    write_inputs(folder, config.inputs)
    write_table(folder / ROWS, result.to_arrow(), seed, numbers["version"])
    if nominal is not None:
        page = html.sweep_page(config, result, verdicts, nominal, seed)
        write_atomically(folder / PAGE, lambda stream: stream.write(page.encode()))
    write_json(folder / SUMMARY, numbers)
    return numbers


def write_simulate(folder: Path, config: Config, run: Trajectory) -> dict[str, Any]:
    """Write everything of a single row, the summary last, and return the summary."""
    import pyarrow as pa

    numbers = simulate_summary(config, run)
    columns = {"t": (run.t, "s"), **{name: (values, run.units[name]) for name, values in run.signals.items()}}
    schema = pa.schema([pa.field(name, pa.float64(), metadata={"unit": unit}) for name, (_, unit) in columns.items()])
    table = pa.Table.from_arrays([pa.array(values) for values, _ in columns.values()], schema=schema)
    retract(folder, config.inputs)
    write_inputs(folder, config.inputs)
    write_table(folder / TRAJECTORY, table, None, numbers["version"])
    if run.recorded is not None:
        save(run.recorded, folder / RECORDING)
    page = html.simulate_page(config, run)
    write_atomically(folder / PAGE, lambda stream: stream.write(page.encode()))
    write_json(folder / SUMMARY, numbers)
    return numbers
