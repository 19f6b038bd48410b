"""One recording that analyses can rely on: time runs forward, gaps in a channel are NaN."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.recordings.clock import MOST_DISORDER
from hdfast.recordings.columns import COLUMNS, FEWEST_FINITE
from hdfast.recordings.doubled import doubled
from hdfast.recordings.table import Table
from hdfast.recordings.units import correction, scalable


@dataclass(frozen=True, eq=False)
class Recording(Table):
    """A table whose time is finite and strictly increases over at least 8 samples.

    Raises:
        InputError: naming the recording and what is wrong with its time.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if "t" not in self.columns:
            raise InputError(
                f"{self.name}: no column for t (the file has: {self.listing}); map it with columns "
                "(on the command line  --column t=NAME)"
            )
        if self.samples < 8:
            raise InputError(f"{self.name}: {self.samples} samples (allowed: at least 8)")
        checks.times(f"{self.name}: t - first", self.columns["t"] - self.columns["t"][0])

    def need(self, purpose: str, *names: str) -> list[Floats]:
        """The named columns, reduced to the samples where all of them are known.

        Raises:
            InputError: naming every missing column and its purpose, or one that the file gives in another unit.
        """
        missing = [name for name in names if name not in self.columns]
        if missing:
            listed = ", ".join(f"{name} [{COLUMNS[name][0]}]" for name in missing)
            raise InputError(f"{self.name}: {purpose} needs {listed} (the file has: {self.listing})")
        for name in names:
            unit = self.units.get(name, "")
            said = correction(name, unit)
            if said:
                option = f" (on the command line  --column {name}=NAME*SCALE)" if scalable(name, unit) else ""
                raise InputError(f"{self.name}: {said}{option}")
        known = np.logical_and.reduce([np.isfinite(self.columns[name]) for name in names])
        if known.sum() < 8:
            raise InputError(f"{self.name}: {purpose} finds {int(known.sum())} samples with {', '.join(names)}")
        return [self.columns[name][known] for name in names]

    def optional(self, notes: list[str], *names: str) -> list[str]:
        """Those of the named columns that are filled; one that is there and is not gets a note."""
        notes += [
            f"{self.name}: less than {100.0 * FEWEST_FINITE:g} % of {name} are numbers; the column is not used"
            for name in names
            if name in self.columns and not self.filled(name)
        ]
        return [name for name in names if self.filled(name)]


def checked(table: Table) -> Recording:
    """The recording of a table; samples without time, rows written twice and few that repeat a time are left out.

    What is left out is noted.

    Raises:
        InputError: as `Recording`.
    """
    columns, notes = table.columns, table.notes
    timed = np.isfinite(columns.get("t", np.zeros(0)))
    if not timed.all():
        columns = {name: values[timed] for name, values in columns.items()}
        notes = (*notes, f"{int((~timed).sum())} samples without time left out")
    if timed.any():
        again = doubled(columns)
        if again.any():
            columns = {name: values[~again] for name, values in columns.items()}
            notes = (*notes, f"{int(again.sum())} rows written twice left out")
        new = np.diff(columns["t"], prepend=np.nan) != 0.0
        if 0.0 < np.mean(~new) <= MOST_DISORDER:
            columns = {name: values[new] for name, values in columns.items()}
            notes = (*notes, f"{int((~new).sum())} samples that repeat the time before them left out")
    return Recording(table.name, columns, table.resolution, notes, table.units, table.file_columns, table.rates)
