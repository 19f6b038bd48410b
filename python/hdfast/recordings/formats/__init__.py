"""Kinds of files a recording can come from, one module per kind."""

from __future__ import annotations

import warnings
from importlib import import_module
from pathlib import Path

from hdfast.errors import InputError, MissingPackageError
from hdfast.recordings.formats.source import Source, Wanted

KINDS = {
    ".csv": "text", ".txt": "text", ".tsv": "text", ".parquet": "parquet", ".npz": "npz", ".mat": "matlab",
    ".h5": "hdf5", ".hdf5": "hdf5", ".mf4": "mdf", ".mdf": "mdf", ".tdms": "tdms",
}  # fmt: skip


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted columns of a file by its suffix.

    Args:
        path: the file.
        wanted: names of columns in the file; others are only listed.

    Raises:
        InputError: naming the file and, where there is one, line and column.
        MissingPackageError: the kind of file needs an optional package.
    """
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: unknown kind of file (allowed: {', '.join(KINDS)})")
    if not path.is_file():
        raise InputError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            source: Source = import_module(f"hdfast.recordings.formats.{kind}").read(path, wanted)
    except (InputError, MissingPackageError):
        raise
    except Exception as error:  # whatever the parser of a foreign format makes of a broken file
        said = str(error).strip().splitlines()
        reason = f": {said[0][:200]}" if said else ""
        raise InputError(f"{path}: cannot be read as {path.suffix[1:]} ({type(error).__name__}{reason})") from None
    return source


__all__ = ["KINDS", "Source", "Wanted", "read"]
