"""Recordings from and to files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.errors import InputError
from hdfast.files import write_atomically
from hdfast.recordings.columns import COLUMNS, ColumnMap, read_column_map
from hdfast.recordings.formats import Source, Wanted, read
from hdfast.recordings.recording import Recording, checked
from hdfast.recordings.table import Table
from hdfast.recordings.units import known_unit, named_with_unit
from hdfast.rows import table_columns

SAVED = (".csv", ".parquet", ".npz")


def load(path: str | Path, columns: Mapping[str, Any] | None = None) -> Recording:
    """Load a recording.

    Args:
        path: a text table with a header line (.csv, .txt, .tsv; comma, semicolon or tab; lines starting with # are
            skipped), .parquet, .npz, .mat, .h5, .hdf5, or, with an extra, .mf4, .mdf and .tdms.
        columns: standard column -> name in the file, or {"name": ..., "scale": factor to SI units}.

    Raises:
        InputError: the file cannot be read, a mapped column is not in it, or its time does not run forward.
        MissingPackageError: the kind of file needs an optional package.
    """
    return checked(load_table(path, columns))


def load_table(path: str | Path, columns: Mapping[str, Any] | None = None) -> Table:
    """As `load`, without judging what the columns hold."""
    path = Path(path)
    return to_table(path.name, read(path, wanted(columns)), columns)


def wanted(columns: Mapping[str, Any] | None) -> Wanted:
    """Names that are looked for in a file: the standard ones and those of a column map."""
    return frozenset([*COLUMNS, *(entry.name for entry in read_column_map(columns).values())])


def to_table(name: str, source: Source, columns: Mapping[str, Any] | None = None) -> Table:
    """The standard columns among those found; what is neither standard nor mapped is left out and noted."""
    mapped = read_column_map(columns)
    found = source.columns
    for standard, entry in mapped.items():
        if entry.name not in found:
            listed = ", ".join(map(str, source.names))
            raise InputError(f"{name}: no column {entry.name!r} for {standard} (found: {listed[:400]})")
    taken = {entry.name for entry in mapped.values()}
    for standard in COLUMNS:
        if standard not in mapped and standard in found and standard not in taken:
            mapped[standard] = ColumnMap(standard)
    with np.errstate(over="ignore", invalid="ignore"):
        arrays = {
            standard: checks.as_floats(f"{name}: {entry.name}", found[entry.name]) * entry.factor
            for standard, entry in mapped.items()
        }
    used = {entry.name for entry in mapped.values()}
    left = [str(key) for key in source.names if key not in used]
    notes = (*source.notes, f"columns left out: {', '.join(left)[:400]}") if left else source.notes
    stated = {
        standard: source.units.get(entry.name) or named_with_unit(entry.name)[1]
        for standard, entry in mapped.items()
        if entry.scale is None
    }
    units = {standard: unit for standard, unit in stated.items() if unit}
    notes += tuple(
        f"{standard} is in {unit!r} by the file, a unit that is not known: taken for {COLUMNS[standard][0]}"
        for standard, unit in units.items()
        if not known_unit(unit)
    )
    rates = {standard: source.rates[entry.name] for standard, entry in mapped.items() if entry.name in source.rates}
    return Table(name, arrays, notes=notes, units=units, file_columns=tuple(map(str, source.names)), rates=rates)


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
    found = table_columns("recording", item)
    return checked(to_table(f"recording {index}", Source(list(found), found), columns))


def save(recording: Recording, path: str | Path) -> None:
    """Write a recording as CSV, Parquet (units in the metadata) or NPZ, whole or not at all.

    Raises:
        InputError: the suffix is none of these.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SAVED:
        raise InputError(f"{path}: unknown kind of file (allowed: {', '.join(SAVED)})")
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
