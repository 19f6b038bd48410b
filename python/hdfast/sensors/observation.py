"""The sensor stage behind a sweep: which signals and times it needs, and what it records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import catalogue
from hdfast.catalogue import Quantity
from hdfast.checks import Floats
from hdfast.errors import InputError, shorten
from hdfast.sensors.channels import CHANNELS
from hdfast.sensors.stage import SensorStage

SOURCES = {name: channel.signal for name, channel in CHANNELS.items() if channel.signal}
PORTION = 2**16  # numbers of one signal that pass the sensors at once, and that an interrupt may lose


@dataclass(frozen=True, eq=False)
class Observed:
    """What a sweep with sensors found, at the times asked for.

    Attributes:
        samples: (M, K) by signal.
        slopes: their derivatives along D directions, (M, K, D) by signal.
        recorded: readings, (M, K) by channel.
        recorded_slopes: their derivatives along D directions and with respect to the stage's parameters, (M, K, D + W).
        taken: (M,) True where a row passed the sensors before an interrupt; the others are NaN in all of these.
    """

    samples: dict[str, Floats]
    slopes: dict[str, Floats]
    recorded: dict[str, Floats]
    recorded_slopes: dict[str, Floats]
    taken: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Observation:
    """What a sweep with sensors samples.

    Attributes:
        stage: the sensors.
        values: their parameters where rows give them, a number or (M,), by name.
        signals: the signals asked for, then those behind the channels.
        grids: times at which to simulate [s].
    """

    stage: SensorStage
    values: Mapping[str, Any]
    signals: list[Quantity]
    grids: list[Floats]

    def take(
        self,
        samples: Sequence[Floats],
        slopes: Sequence[Floats],
        grids: Sequence[Floats],
        index: Any,
        wrt: Sequence[str],
        whole: NDArray[np.bool_],
    ) -> Observed:
        """What is seen and read at the times asked for, from samples at `self.grids`; Ctrl-C ends the reading.

        Args:
            samples: one array (M, T) per signal.
            slopes: their derivatives, one array (M, T, D) per signal.
            grids: the times asked for [s].
            index: (M,) which grid a row takes; None for the first.
            wrt: parameters of the stage with respect to which the readings are differentiated.
            whole: (M,) True for the rows that pass the sensors.
        """
        names = [signal.name for signal in self.signals]
        count, directions = len(samples[0]), slopes[0].shape[-1]
        shape = (count, max(map(len, grids)))
        found = Observed(
            samples={name: np.full(shape, np.nan) for name in names},
            slopes={name: np.full((*shape, directions), np.nan) for name in names},
            recorded={name: np.full(shape, np.nan) for name in SOURCES},
            recorded_slopes={name: np.full((*shape, directions + len(wrt)), np.nan) for name in SOURCES},
            taken=np.zeros(count, dtype=np.bool_),
        )
        numbers = np.zeros(count, dtype=np.uint32) if index is None else index
        with suppress(KeyboardInterrupt):
            for number, rows in self._portions(numbers, whole, 1 + directions + len(wrt)):
                fine, at = self.grids[number], grids[number]
                part = {name: own[rows, : len(fine)] for name, own in zip(names, samples, strict=True)}
                moving = {name: own[rows, : len(fine)] for name, own in zip(names, slopes, strict=True)}
                given = {name: value if np.ndim(value) == 0 else value[rows] for name, value in self.values.items()}
                read, derived = self.stage.linearise(
                    fine,
                    {channel: part[signal] for channel, signal in SOURCES.items()},
                    {channel: moving[signal] for channel, signal in SOURCES.items()},
                    given,
                    wrt=wrt,
                    at=at,
                    rows=rows,
                )
                place = np.searchsorted(fine, at)
                for into, own in (
                    (found.samples, {name: values[:, place] for name, values in part.items()}),
                    (found.slopes, {name: values[:, place] for name, values in moving.items()}),
                    (found.recorded, read),
                    (found.recorded_slopes, derived),
                ):
                    for name, values in own.items():
                        into[name][rows, : len(at)] = values
                found.taken[rows] = True
        return found

    def _portions(
        self, numbers: NDArray[np.uint32], whole: NDArray[np.bool_], width: int
    ) -> Iterator[tuple[int, NDArray[np.int64]]]:
        """Rows that share a grid, by its number, few at once."""
        for number, fine in enumerate(self.grids):
            rows = np.flatnonzero(whole & (numbers == number))
            size = max(1, PORTION // (len(fine) * width))
            yield from ((number, rows[start : start + size]) for start in range(0, len(rows), size))


def observe(stage: Any, values: Mapping[str, Any], chosen: Sequence[Quantity], grids: Sequence[Floats]) -> Observation:
    """Prepare a sweep with sensors; nothing runs.

    Raises:
        InputError: no stage, no times, or a value that cannot be.
    """
    if not isinstance(stage, SensorStage):
        raise InputError(f"sensors = {shorten(stage)} is not a hdfast.sensors.SensorStage")
    if not grids:
        raise InputError("sensors need t_eval, the times of the readings [s]")
    known = catalogue.signals()
    named = {signal.name for signal in chosen}
    behind = [known[name] for name in SOURCES.values() if name not in named]
    return Observation(stage, stage.checked(values), [*chosen, *behind], [stage.grid(at) for at in grids])
