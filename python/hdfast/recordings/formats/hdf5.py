"""HDF5 files: one dataset per column, named by its path such as "run1/motor_angle"."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hdfast.errors import InputError
from hdfast.recordings.formats.source import Source, Wanted, check_size, numbers, one_dimensional

PACKING = ("_FillValue", "scale_factor", "add_offset")


def read(path: Path, wanted: Wanted, separator: str = "/") -> Source:
    """Read the wanted datasets; an attribute `unit` or `units` is its unit. Links to other files are not followed.

    Packed numbers are unpacked by the attributes `scale_factor`, `add_offset` and `_FillValue` (missing) of the netCDF
    convention.
    """
    import h5py

    found: dict[str, Any] = {}
    units: dict[str, str] = {}
    with h5py.File(path, "r") as file:
        names = _names(file, h5py.Dataset)
        for full in names:
            name = full.replace("/", separator)
            if name not in wanted:
                continue
            dataset = file[full]
            if dataset.is_virtual or dataset.external:
                raise InputError(f"{path}: column {name!r} lies in another file; copy it into this one")
            if dataset.shape is None or dataset.dtype.kind not in "iuf" or dataset.attrs.get("MATLAB_class") == b"char":
                raise InputError(f"{path}: column {name!r} holds {dataset.dtype}, not numbers")
            one_dimensional(path, name, dataset.shape)
            check_size(path, dataset.size)
            found[name] = _unpacked(numbers(path, name, dataset[()]), dataset.attrs)
            unit = dataset.attrs.get("unit", dataset.attrs.get("units"))
            if isinstance(unit, np.ndarray) and unit.size == 1:
                unit = unit.item()
            if isinstance(unit, (str, bytes)):
                units[name] = unit if isinstance(unit, str) else unit.decode("utf-8", "replace")
    return Source([full.replace("/", separator) for full in names], found, units)


def _unpacked(values: Any, attributes: Any) -> Any:
    """Numbers as packed data stand for them; whatever has no such attribute stays as it is."""
    given = {name: np.float64(np.asarray(attributes[name]).item()) for name in PACKING if name in attributes}
    if not given:
        return values
    values = np.where(values == given.get("_FillValue", np.nan), np.nan, values)
    return values * given.get("scale_factor", 1.0) + given.get("add_offset", 0.0)


def _names(file: Any, dataset: type) -> list[str]:
    names: list[str] = []

    def visit(name: str, item: Any) -> None:
        if isinstance(item, dataset) and not name.startswith("#"):
            names.append(name)

    file.visititems(visit)
    return names
