"""NPZ archives: one array per column. Pickled objects are never opened."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from hdfast.errors import InputError
from hdfast.recordings.formats.source import Source, Wanted, check_size, numbers, one_dimensional


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted arrays, after a look at the shapes they declare."""
    columns: dict[str, Any] = {}
    with zipfile.ZipFile(path) as archive:
        members = {name.removesuffix(".npy"): name for name in archive.namelist() if name.endswith(".npy")}
        for name, member in members.items():
            if name in wanted:
                columns[name] = _array(path, archive, name, member)
    return Source(list(members), columns)


def _array(path: Path, archive: zipfile.ZipFile, name: str, member: str) -> Any:
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        head = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = head(stream)
    if dtype.hasobject:
        raise InputError(f"{path}: column {name!r} holds Python objects, not numbers")
    one_dimensional(path, name, shape)
    check_size(path, int(np.prod(shape, dtype=np.float64)))
    with archive.open(member) as stream:
        return numbers(path, name, np.lib.format.read_array(stream, allow_pickle=False))
