"""MAT files of version 5 to 7, and of version 7.3, which are HDF5 files; fields of a struct by "run.angle"."""

from __future__ import annotations

from pathlib import Path

from hdfast.recordings.formats import hdf5, mat5
from hdfast.recordings.formats.source import Source, Wanted

HDF5_MARK = b"MATLAB 7.3 MAT-file"


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted variables and fields."""
    with path.open("rb") as stream:
        mark = stream.read(len(HDF5_MARK))
    return hdf5.read(path, wanted, ".") if mark == HDF5_MARK else mat5.read(path, wanted)
