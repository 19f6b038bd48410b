"""One recording: arrays of equal length by standard column name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, nearest
from hdfast.recordings.columns import COLUMNS


@dataclass(frozen=True, eq=False)
class Recording(Mapping[str, Floats]):
    """Columns (n,) by standard name, in SI units (temperature in degC); a mapping, so `Scenario.replay` takes it.

    Attributes:
        name: for messages and reports.
        columns: arrays (n,) by name of `COLUMNS`; NaN where a sample is missing.
        resolution: smallest step of a sensor by column, where it is stated.
        notes: what was left out or changed while loading.
    """

    name: str
    columns: Mapping[str, Floats] = field(repr=False)
    resolution: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if "t" not in self.columns:
            raise InputError(f"{self.name}: column 't' is missing (found: {', '.join(self.columns) or 'none'})")
        size = np.shape(self.columns["t"])
        for name, values in self.columns.items():
            if name not in COLUMNS:
                raise InputError(
                    f"{self.name}: column {name!r} is not known{nearest(name, COLUMNS)} (allowed: {', '.join(COLUMNS)})"
                )
            if np.shape(values) != size or len(size) != 1:
                raise InputError(f"{self.name}: column {name!r} has shape {np.shape(values)}, t has {size}")
        if size[0] < 8:
            raise InputError(f"{self.name}: {size[0]} samples (allowed: at least 8)")
        checks.times(f"{self.name}: t - first", self.columns["t"] - self.columns["t"][0])

    def __getitem__(self, name: str) -> Floats:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    def need(self, purpose: str, *names: str) -> list[Floats]:
        """The named columns, reduced to the samples where all of them are known.

        Raises:
            InputError: naming every missing column and what it is needed for.
        """
        missing = [name for name in names if name not in self.columns]
        if missing:
            listed = ", ".join(f"{name} [{COLUMNS[name][0]}]" for name in missing)
            raise InputError(f"{self.name}: {purpose} needs {listed} (the recording has {', '.join(self.columns)})")
        known = np.logical_and.reduce([np.isfinite(self.columns[name]) for name in names])
        if known.sum() < 8:
            raise InputError(f"{self.name}: {purpose} finds {int(known.sum())} samples with {', '.join(names)}")
        return [self.columns[name][known] for name in names]
