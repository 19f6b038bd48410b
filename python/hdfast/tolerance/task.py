"""What a worker does: some rows of a study, from their numbers to a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import catalogue
from hdfast.checks import Floats
from hdfast.config import Config
from hdfast.request import Progress
from hdfast.tolerance.sample import Plan
from hdfast.tolerance.simulation import columns, simulate

POISON = "internal"


@dataclass(frozen=True)
class Piece:
    """Finished rows start to stop.

    Attributes:
        table: `pyarrow.Table` with the drawn parameters, the metrics, status and steps.
        samples: arrays (rows, T) by signal, empty without trajectories.
        poison: (row, what happened) of rows whose simulation took its process down.
    """

    start: int
    stop: int
    table: Any
    samples: dict[str, Floats]
    poison: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class Task:
    """A study as a function of row numbers; picklable, the same answer in every process."""

    config: Config
    plan: Plan
    metrics: tuple[str, ...]
    threads: int | None = None
    progress: Progress | None = None

    def __call__(self, start: int, stop: int) -> Piece:
        """Simulate the rows start to stop."""
        drawn = columns(self.config, self.plan, start, stop)
        wanted = self.config.trajectories
        result = simulate(
            self.config,
            drawn,
            metrics=list(self.metrics),
            threads=self.threads,
            progress=self.progress or False,
            t_eval=None if wanted is None else wanted.times(self.config.scenario.t_end),
            signals=None if wanted is None else list(wanted.signals),
        )
        table = self._table(drawn, result.metrics, result.status, result.steps)
        return Piece(start, stop, table, {name: np.asarray(values) for name, values in result.samples.items()})

    def poisoned(self, row: int, reason: str) -> Piece:
        """The outcome of a row that cannot be run without losing the process: status "internal", no metrics."""
        nothing = {name: np.full(1, np.nan) for name in self.metrics}
        drawn = columns(self.config, self.plan, row, row + 1)
        table = self._table(
            drawn, nothing, np.array([catalogue.status_code(POISON)], dtype=np.uint8), np.zeros(1, dtype=np.uint32)
        )
        wanted = self.config.trajectories
        samples = {}
        if wanted is not None:
            empty = np.full((1, len(wanted.times(self.config.scenario.t_end))), np.nan)
            samples = dict.fromkeys(wanted.signals, empty)
        return Piece(row, row + 1, table, samples, ((row, reason),))

    @property
    def varied(self) -> tuple[str, ...]:
        """Parameters that have a column."""
        return self.plan.names

    def _table(
        self, drawn: dict[str, Any], metrics: dict[str, Floats], status: NDArray[np.uint8], steps: NDArray[np.uint32]
    ) -> Any:
        import pyarrow as pa

        fields, arrays = [], []
        units = self.config.table
        for name in self.varied:
            fields.append(pa.field(name, pa.float64(), metadata={"unit": units[name].unit}))
            arrays.append(pa.array(np.ascontiguousarray(drawn[name])))
        for name in self.metrics:
            fields.append(pa.field(name, pa.float64(), metadata={"unit": catalogue.metric(name).unit}))
            arrays.append(pa.array(np.ascontiguousarray(metrics[name])))
        names = pa.array([item.name for item in catalogue.statuses().values()])
        positions = np.zeros(256, dtype=np.int8)
        for position, code in enumerate(catalogue.statuses()):
            positions[code] = position
        arrays += [pa.DictionaryArray.from_arrays(pa.array(positions[status]), names), pa.array(steps)]
        fields += [pa.field("status", arrays[-2].type), pa.field("steps", pa.uint32(), metadata={"unit": "1"})]
        return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def join(pieces: list[Piece]) -> Piece:
    """Neighbouring pieces as one, whatever order they came in; its bytes are those of one uninterrupted run."""
    import pyarrow as pa

    pieces = sorted(pieces, key=lambda piece: piece.start)
    if len(pieces) == 1:
        return pieces[0]
    table = pa.concat_tables([piece.table for piece in pieces]).combine_chunks()
    samples = {name: np.concatenate([piece.samples[name] for piece in pieces]) for name in pieces[0].samples}
    poison = tuple(entry for piece in pieces for entry in piece.poison)
    return Piece(pieces[0].start, pieces[-1].stop, table, samples, poison)
