"""Recordings from and to CSV, Parquet and NPZ files."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.errors import InputError
from hdfast.files import write_atomically
from hdfast.recordings.columns import COLUMNS, ColumnMap, read_column_map
from hdfast.recordings.recording import Recording, checked
from hdfast.recordings.table import Table
from hdfast.rows import table_columns

SUFFIXES = (".csv", ".parquet", ".npz")


def load(path: str | Path, columns: Mapping[str, Any] | None = None) -> Recording:
    """Load a recording.

    Args:
        path: CSV with a header line (lines starting with # are skipped), Parquet, or NPZ.
        columns: standard column -> name in the file, or {"name": ..., "scale": factor to SI units}.

    Raises:
        InputError: the file cannot be read, a mapped column is not in it, or its time does not run forward.
    """
    return checked(load_table(path, columns))


def load_table(path: str | Path, columns: Mapping[str, Any] | None = None) -> Table:
    """As `load`, without judging what the columns hold."""
    path = Path(path)
    return to_table(path.name, read(path), columns)


def read(path: Path) -> dict[str, Any]:
    """Every column of a file under its own name.

    Raises:
        InputError: the file cannot be read.
    """
    readers = {".csv": _read_csv, ".parquet": _read_parquet, ".npz": _read_npz}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: unknown kind of file (allowed: {', '.join(SUFFIXES)})")
    try:
        return reader(path)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None


def to_table(name: str, found: Mapping[str, Any], columns: Mapping[str, Any] | None = None) -> Table:
    """The standard columns among those found; what is neither standard nor mapped is left out and noted."""
    mapped = read_column_map(columns)
    for standard, entry in mapped.items():
        if entry.name not in found:
            raise InputError(f"{name}: no column {entry.name!r} for {standard} (found: {', '.join(map(str, found))})")
    taken = {entry.name for entry in mapped.values()}
    for standard in COLUMNS:
        if standard not in mapped and standard in found and standard not in taken:
            mapped[standard] = ColumnMap(standard)
    arrays = {
        standard: checks.as_floats(f"{name}: {entry.name}", found[entry.name]) * entry.scale
        for standard, entry in mapped.items()
    }
    left = [str(key) for key in found if key not in {entry.name for entry in mapped.values()}]
    return Table(name, arrays, notes=(f"columns left out: {', '.join(left)}",) if left else ())


def gather(recordings: Any, columns: Mapping[str, Any] | None = None) -> list[Recording]:
    """One or many recordings, given as `Recording`, path, mapping or table, as a list.

    Raises:
        InputError: nothing was given, or one of them cannot be read.
    """
    single = isinstance(recordings, (str, Path, Mapping, np.ndarray)) or hasattr(recordings, "columns")
    listed: Iterable[Any] = [recordings] if single else recordings
    found = [_one(item, index, columns) for index, item in enumerate(listed)]
    if not found:
        raise InputError("recordings is empty (allowed: at least one recording)")
    return found


def _one(item: Any, index: int, columns: Mapping[str, Any] | None) -> Recording:
    if isinstance(item, Table):
        return item if isinstance(item, Recording) else checked(item)
    if isinstance(item, (str, Path)):
        return load(item, columns)
    return checked(to_table(f"recording {index}", table_columns("recording", item), columns))


def save(recording: Recording, path: str | Path) -> None:
    """Write a recording as CSV, Parquet (units in the metadata) or NPZ, whole or not at all.

    Raises:
        InputError: the suffix is none of these.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: unknown kind of file (allowed: {', '.join(SUFFIXES)})")
    if suffix == ".npz":
        arrays: dict[str, Any] = dict(recording.columns)
        write_atomically(path, lambda stream: np.savez_compressed(stream, **arrays))
        return
    import pyarrow as pa

    fields = [pa.field(name, pa.float64(), metadata={"unit": COLUMNS[name][0]}) for name in recording.columns]
    table = pa.Table.from_arrays([pa.array(values) for values in recording.values()], schema=pa.schema(fields))
    if suffix == ".parquet":
        import pyarrow.parquet as pq

        write_atomically(path, lambda stream: pq.write_table(table, stream, compression="zstd"))
        return
    from pyarrow import csv

    write_atomically(path, lambda stream: csv.write_csv(table, stream))


def _read_csv(path: Path) -> dict[str, Any]:
    from pyarrow import csv

    lines = path.read_bytes().splitlines(keepends=True)
    body = b"".join(line for line in lines if not line.lstrip().startswith(b"#"))
    convert = csv.ConvertOptions(null_values=["", "nan", "NaN", "NA", "null"], strings_can_be_null=True)
    return table_columns(path.name, csv.read_csv(io.BytesIO(body), convert_options=convert))


def _read_parquet(path: Path) -> dict[str, Any]:
    import pyarrow.parquet as pq

    return table_columns(path.name, pq.read_table(path))


def _read_npz(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files if archive[name].ndim == 1}
