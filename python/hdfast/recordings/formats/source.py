"""What a reader finds in a file, before anything has a meaning."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.recordings.clock import period, usual_steps

Wanted = frozenset[str]
GAP = 2.5  # usual steps of a column's own clock: one missing sample is bridged


@dataclass
class Source:
    """Columns of a file by their names there.

    Attributes:
        names: every column of the file.
        columns: arrays of those that were wanted.
        units: unit of a column, where the file states one.
        notes: what the reader had to decide.
        rates: samples per second of a column that the reader interpolated on the times of others.
    """

    names: list[str]
    columns: dict[str, Any]
    units: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    rates: dict[str, float] = field(default_factory=dict)

    def join(self, name: str, t: Floats, values: Any) -> None:
        """Add a column with its times t (n,) [s]: they are the column `t`, or it is interpolated on that and noted.

        Within a gap of its own times it is NaN.
        """
        raster = self.columns.setdefault("t", t)
        if not np.array_equal(t, raster, equal_nan=True):
            values = _interpolated(raster, t, values) if t.size else values[:0]
            self.notes += (f"{name} interpolated on the times of the other columns",)
            if t.size > 1 and t[-1] > t[0] and np.median(np.diff(t)) > 0.0:
                self.rates[name] = 1.0 / period(t)
        self.columns[name] = values


def _interpolated(raster: Floats, t: Floats, values: Any) -> Floats:
    """Values (n,) of times t on a raster (m,); NaN outside t and within its gaps."""
    found: Floats = np.interp(raster, t, values, left=np.nan, right=np.nan)
    steps = np.diff(t)
    if steps.size and np.max(steps) > GAP * np.min(steps):
        after = np.clip(np.searchsorted(t, raster), 1, t.size - 1)
        wide = steps > GAP * usual_steps(t)
        found[wide[after - 1] & (t[after - 1] < raster) & (raster < t[after])] = np.nan
    return found


Reader = Callable[[Path, Wanted], Source]


def check_size(path: Path, samples: int, columns: int = 1) -> None:
    """Refuse what would not fit into a quarter of the memory, whatever the size of the file.

    Raises:
        InputError: naming the file and the size it declares.
    """
    check_memory(path, f"{samples} samples in {columns} columns", 8.0 * samples * columns)


def check_memory(path: Path, content: str, needed: float) -> None:
    """Refuse a content, named in the plural, that would take more than a quarter of the memory [bytes].

    Raises:
        InputError: naming the file, the content and its size.
    """
    limit = checks.memory_limit() / 4.0
    if needed > limit:
        raise InputError(f"{path}: {content} need {needed / 1e9:.3g} GB (allowed: {limit / 1e9:.3g} GB)")


def one_dimensional(path: Path, name: str, shape: Iterable[int]) -> None:
    """Refuse arrays that are no column; one row or one column of a matrix is a column.

    Raises:
        InputError: naming file, column and shape.
    """
    sizes = tuple(shape)
    if math.prod(sizes) != max(sizes, default=0) or not sizes:
        raise InputError(f"{path}: column {name!r} has shape {sizes} (allowed: (n,))")


def numbers(path: Path, name: str, values: Any) -> Any:
    """A column as an array (n,) of numbers.

    Raises:
        InputError: naming file and column, and the first row that is no number.
    """
    array = np.asarray(values)
    one_dimensional(path, name, array.shape)
    array = array.reshape(-1)
    if array.dtype.kind in "iuf":
        return array
    sample = f"; row 1 holds {array[0]!r}" if array.size else ""
    raise InputError(f"{path}: column {name!r} has dtype {array.dtype}, not real numbers{sample[:80]}")
