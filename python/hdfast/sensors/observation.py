"""The sensor stage behind a sweep: which signals and times it needs, and what it records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast import catalogue
from hdfast.catalogue import Quantity
from hdfast.checks import Floats
from hdfast.errors import InputError, shorten
from hdfast.sensors.channels import CHANNELS
from hdfast.sensors.stage import SensorStage

SOURCES = {name: channel.signal for name, channel in CHANNELS.items() if channel.signal}


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
        self, samples: Sequence[Floats], grids: Sequence[Floats], index: Any
    ) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """Signals and readings by name, each (M, K) at the times asked for, from samples at `self.grids`.

        Args:
            samples: one array (M, T) per signal.
            grids: the times asked for [s].
            index: (M,) which grid a row takes; None for the first.
        """
        by_name = dict(zip((signal.name for signal in self.signals), samples, strict=True))
        count = len(samples[0])
        shape = (count, max(map(len, grids)))
        seen = {name: np.full(shape, np.nan) for name in by_name}
        recorded = {name: np.full(shape, np.nan) for name in SOURCES}
        for number, (fine, at) in enumerate(zip(self.grids, grids, strict=True)):
            rows = np.arange(count) if index is None else np.flatnonzero(index == number)
            part = {name: values[rows, : len(fine)] for name, values in by_name.items()}
            place = np.searchsorted(fine, at)
            for name, values in part.items():
                seen[name][rows, : len(at)] = values[:, place]
            given = {name: value if np.ndim(value) == 0 else value[rows] for name, value in self.values.items()}
            channels = {name: part[signal] for name, signal in SOURCES.items()}
            for name, values in self.stage.apply(fine, channels, given, at=at, rows=rows).items():
                recorded[name][rows, : len(at)] = values
        return seen, recorded


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
