"""Parameter rows from whatever a user has: array, dict of columns, structured array, pandas, polars or Arrow table.

Nothing here copies an (M, P) array: columns stay strided views of what was given, unless their dtype must change.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, ParameterError, shorten
from hdfast.params import ParameterTable

ACCEPTED = "a float64 array (M, P), a dict of columns, a structured array or a pandas, polars or Arrow table"


@dataclass(frozen=True)
class Rows:
    """M rows of parameters: columns that vary and values that all rows share, by parameter name."""

    count: int
    columns: dict[str, Floats]
    shared: dict[str, float]


def table_columns(argument: str, value: Any) -> dict[str, Any]:
    """Columns by name of a mapping, structured array or table; arrays are not converted yet.

    Raises:
        InputError: the object has no named columns.
    """
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, np.ndarray) and value.dtype.names:
        return {name: value[name] for name in value.dtype.names}
    if hasattr(value, "column_names") and hasattr(value, "column"):
        return {name: _arrow_column(value.column(name)) for name in _different(argument, value.column_names)}
    if all(hasattr(value, name) for name in ("__len__", "__getitem__", "columns")):
        return {name: value[name] for name in _different(argument, value.columns)}
    if hasattr(value, "__arrow_c_stream__"):
        import pyarrow as pa

        with contextlib.suppress(pa.ArrowInvalid):
            return table_columns(argument, pa.table(value))
    raise InputError(f"{argument} = {shorten(value)} has no named columns (allowed: a dict of arrays or a table)")


def _different(argument: str, names: Iterable[Any]) -> list[Any]:
    listed = list(names)
    if len(set(map(str, listed))) != len(listed):
        raise ParameterError(f"{argument} has two columns of one name")
    return listed


def _arrow_column(column: Any) -> Any:
    import pyarrow as pa

    if not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
        return np.asarray(column.to_pylist(), dtype=object)
    return np.asarray(column.cast(pa.float64()))


def read_rows(value: Any, drive: ParameterTable, every: ParameterTable) -> Rows:
    """Check and split what a user gave as rows.

    Args:
        value: the rows; see `ACCEPTED`.
        drive: columns of a plain array.
        every: those and the scenario columns, which only named columns may carry.

    Raises:
        InputError: wrong shape or dtype.
        ParameterError: unknown name, with the model that has it or the nearest known one.
    """
    if isinstance(value, np.ndarray) and value.dtype.names is None:
        return _from_array(value, drive)
    if isinstance(value, (list, tuple)) or (np.isscalar(value) and not isinstance(value, str)):
        return _from_array(checks.as_floats("rows", value), drive)
    try:
        named = table_columns("rows", value)
    except InputError as error:
        if isinstance(error, ParameterError):
            raise
        raise InputError(f"rows = {shorten(value)} cannot be read (allowed: {ACCEPTED})") from None
    return _from_columns(named, every)


def _from_array(value: np.ndarray[Any, Any], drive: ParameterTable) -> Rows:
    width = len(drive)
    if value.ndim != 2 or value.shape[1] != width:
        hint = "; one row is rows[None, :]" if value.shape == (width,) else ""
        raise InputError(
            f"rows has shape {value.shape}, allowed: (M, {width}) with the columns of hdfast.params(model){hint}"
        )
    array = checks.as_floats("rows", value) if isinstance(value, np.ma.MaskedArray) else np.asarray(value)
    checks.as_floats("rows", array[:0])
    return Rows(len(array), {name: checks.as_floats(name, array[:, j]) for j, name in enumerate(drive.names)}, {})


def _from_columns(named: dict[str, Any], every: ParameterTable) -> Rows:
    columns: dict[str, Floats] = {}
    shared: dict[str, float] = {}
    count: int | None = None
    first = ""
    for written, given in named.items():
        if written not in every:
            raise ParameterError(
                f"rows: parameter {shorten(written)} is not known{every.hint(written)} (see hdfast.params(model).names)"
            )
        name = every.canonical(written)
        if name in columns or name in shared:
            raise ParameterError(f"rows: parameter {name!r} is given twice")
        if type(given) is float:
            shared[name] = given
            continue
        array = checks.as_floats(f"rows[{name!r}]", given)
        if array.ndim == 0:
            shared[name] = float(array)
            continue
        if array.ndim != 1:
            raise InputError(f"rows[{name!r}] has shape {array.shape}, allowed: a number or (M,)")
        if count is None:
            count, first = len(array), name
        elif len(array) != count:
            raise InputError(
                f"rows[{name!r}] has {len(array)} values, rows[{first!r}] has {count} (allowed: the same number)"
            )
        columns[name] = array
    return Rows(1 if count is None else count, columns, shared)
