"""Conversions of a result; the optional packages are imported here and only when asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hdfast import catalogue
from hdfast.errors import InputError, choose, require_package

if TYPE_CHECKING:
    from hdfast.result import SweepResult

STATE_UNITS = {"theta_m": "rad", "omega_m": "rad/s", "theta_l": "rad", "omega_l": "rad/s", "z": "rad"}


def _parameter_columns(result: SweepResult, parameters: str) -> Iterator[tuple[str, Any, str, str]]:
    choose("parameters", parameters, ("all", "given", "none"))
    request = result.request
    for position, parameter in enumerate(request.table):
        if parameters == "none" or (parameters == "given" and parameter.name not in request.rows.columns):
            continue
        column = request.rows.columns.get(parameter.name)
        if column is None:
            column = np.full(len(result), request.defaults[position])
        yield parameter.name, column, parameter.unit, parameter.meaning
    for parameter, given in request.sensor_values:
        if parameters == "all" or (parameters == "given" and np.ndim(given) == 1):
            yield parameter.name, np.broadcast_to(given, len(result)), parameter.unit, parameter.meaning


def columns(result: SweepResult, parameters: str = "all") -> Iterator[tuple[str, Any, str, str]]:
    """(name, values, unit, meaning) of every per-row column: parameters, metrics, final states, outcome."""
    yield from _parameter_columns(result, parameters)
    for metric in result.request.metrics:
        yield metric.name, result.metrics[metric.name], metric.unit, metric.meaning
    for j, name in enumerate(result.states):
        yield f"final_{name}", result.final_state[:, j], STATE_UNITS[name], f"{name} at the end of the row"
    yield "end_time", result.time, "s", "time reached"
    yield "steps", result.steps, "1", "accepted steps"
    yield "rejected", result.rejected, "1", "rejected steps"


def to_arrow(result: SweepResult, parameters: str) -> Any:
    """See `SweepResult.to_arrow`."""
    import pyarrow as pa

    fields, arrays = [], []
    for name, values, unit, meaning in columns(result, parameters):
        array = pa.array(np.ascontiguousarray(values))
        fields.append(pa.field(name, array.type, metadata={"unit": unit, "meaning": meaning}))
        arrays.append(array)
    names = [status.name for status in catalogue.statuses().values()]
    codes = {code: position for position, code in enumerate(catalogue.statuses())}
    positions = np.array([codes[int(code)] for code in range(max(codes) + 1)], dtype=np.int8)[result.status]
    status = pa.DictionaryArray.from_arrays(pa.array(positions), pa.array(names))
    fields.append(pa.field("status", status.type, metadata={"unit": "", "meaning": "outcome of the row"}))
    return pa.Table.from_arrays([*arrays, status], schema=pa.schema(fields))


def to_pandas(result: SweepResult, parameters: str) -> Any:
    """See `SweepResult.to_pandas`."""
    require_package("pandas", "pandas")
    frame = to_arrow(result, parameters).to_pandas()
    frame.index.name = "row"
    frame.attrs["units"] = {name: unit for name, _, unit, _ in columns(result, parameters)}
    return frame


def to_polars(result: SweepResult, parameters: str) -> Any:
    """See `SweepResult.to_polars`."""
    require_package("polars", "polars")
    import polars

    return polars.from_arrow(to_arrow(result, parameters))


def to_xarray(result: SweepResult, parameters: str) -> Any:
    """See `SweepResult.to_xarray`."""
    require_package("xarray", "xarray")
    import xarray

    data: dict[str, Any] = {
        name: ("row", values, {"units": unit, "long_name": meaning})
        for name, values, unit, meaning in columns(result, parameters)
        if not name.startswith("final_")
    }
    states = ", ".join(STATE_UNITS[name] for name in result.states)
    data["final_state"] = (("row", "state"), result.final_state, {"units": states})
    data["status"] = ("row", result.status, {"flags": str({s.code: s.name for s in catalogue.statuses().values()})})
    coordinates: dict[str, Any] = {"row": np.arange(len(result)), "state": list(result.states)}
    samples = {**result.samples, **result.recorded}
    if samples:
        if len(result.t_eval) == 1:
            coordinates["time"] = ("time", result.t_eval[0], {"units": "s"})
        else:
            data["grid"] = ("row", result.request.grid_index)
        taken = set(data) & set(samples)
        if taken:
            raise InputError(f"signals and metrics share the names {sorted(taken)}")
        for name, values in samples.items():
            data[name] = (("row", "time"), values, {"units": result.units[name]})
    if result.sensitivities:
        coordinates["wrt"] = list(result.sensitivities)
        along = {**result.sample_sensitivities, **result.recorded_sensitivities}
        derived: dict[str, tuple[tuple[str, ...], Any]]
        derived = {name: (("row", "wrt"), values) for name, values in result.metric_sensitivities.items()}
        derived |= {name: (("row", "time", "wrt"), values) for name, values in along.items()}
        derived["final_state"] = (("row", "state", "wrt"), result.final_state_sensitivities)
        units = result.units | {"final_state": states}
        data |= {f"d_{name}": (*found, {"units": f"{units[name]} per unit of wrt"}) for name, found in derived.items()}
    return xarray.Dataset(data, coordinates, {"model": str(result.model)})
