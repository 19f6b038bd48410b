"""A recording as it was read: columns of equal length, nothing judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError, nearest
from hdfast.recordings.columns import COLUMNS, FEWEST_FINITE


@dataclass(frozen=True, eq=False)
class Table(Mapping[str, Floats]):
    """Columns (n,) by standard name, in SI units (temperature in degC); a mapping, so `Scenario.replay` takes it.

    Attributes:
        name: for messages and reports.
        columns: arrays (n,) by name of `COLUMNS`; NaN where a sample is missing.
        resolution: smallest step of a sensor by column, where it is stated.
        notes: what was left out or changed while loading.
        units: what the file states as the unit of a column that no scale was given for.
        file_columns: names of all columns of the file.
        rates: samples per second that a column had of its own before it was interpolated on the times of others.
    """

    name: str
    columns: Mapping[str, Floats] = field(repr=False)
    resolution: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    file_columns: tuple[str, ...] = field(default=(), repr=False)
    rates: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        first = next(iter(self.columns), None)
        size = np.shape(self.columns[first]) if first is not None else (0,)
        for name, values in self.columns.items():
            if name not in COLUMNS:
                raise InputError(
                    f"{self.name}: column {name!r} is not known{nearest(name, COLUMNS)} (allowed: {', '.join(COLUMNS)})"
                )
            if np.shape(values) != size or len(size) != 1:
                raise InputError(f"{self.name}: column {name!r} has shape {np.shape(values)}, {first} has {size}")

    def __getitem__(self, name: str) -> Floats:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def samples(self) -> int:
        """Number n of samples."""
        return len(next(iter(self.columns.values()), ()))

    def filled(self, name: str) -> bool:
        """True when half of the samples of a column or more are numbers, False without the column or samples."""
        found = self.columns.get(name, np.zeros(0))
        return found.size > 0 and bool(np.mean(np.isfinite(found)) >= FEWEST_FINITE)

    @property
    def listing(self) -> str:
        """The columns of the file, for messages."""
        return (", ".join(self.file_columns or self.columns) or "none")[:400]
