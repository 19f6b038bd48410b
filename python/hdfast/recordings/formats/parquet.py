"""Parquet tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hdfast.errors import InputError
from hdfast.recordings.formats.source import Source, Wanted, check_size


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted columns; a unit stands in the metadata of its field.

    Of whole numbers beyond 2^53, as times since an epoch are, the nearest floats are taken.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:
        schema = file.schema_arrow
        twice = next((name for name in schema.names if schema.names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"{path}: two columns are named {twice!r}")
        used = [name for name in schema.names if name in wanted]
        check_size(path, file.metadata.num_rows, max(len(used), 1))
        for name in used:
            kind = schema.field(name).type
            if not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
                raise InputError(f"{path}: column {name!r} holds {kind}, not numbers")
        table = file.read(columns=used)
    units = {name: (schema.field(name).metadata or {}).get(b"unit", b"").decode("utf-8", "replace") for name in used}
    columns: dict[str, Any] = {name: table.column(name).cast(pa.float64(), safe=False).to_numpy() for name in used}
    return Source(list(schema.names), columns, {name: unit for name, unit in units.items() if unit})
