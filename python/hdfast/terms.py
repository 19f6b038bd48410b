"""The catalogue of physics beyond the nominal model: terms of the compiled core and of sensors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from hdfast import _core
from hdfast.errors import InputError, nearest, shorten


@dataclass(frozen=True)
class TermParameter:
    """One parameter of a term: SI unit, default and plausible range for a size-25 unit, allowed range."""

    name: str
    symbol: str
    unit: str
    default: float
    low: float
    high: float
    meaning: str
    allowed: tuple[float, float] = (-math.inf, math.inf)


@dataclass(frozen=True)
class Term:
    """One effect: where it sits, its equation and source, its parameters, and which of them is its amplitude.

    An effect at the place "sensor" acts on channels of a recording and belongs to a `hdfast.sensors.SensorStage`; all
    others join the base models in `bases`.
    """

    id: str
    place: str
    description: str
    equation: str
    source: str
    amplitude: str
    parameters: tuple[TermParameter, ...]
    states: tuple[tuple[str, str], ...]
    channels: tuple[str, ...] = ()
    bases: tuple[str, ...] = ()

    def owns(self, name: object) -> bool:
        """Whether a parameter has this name, with or without the id before it."""
        return any(name in (part.name, f"{self.id}_{part.name}") for part in self.parameters)


class TermTable:
    """Terms in the order in which they act; prints as a table, iterates over `Term`, indexed by id."""

    def __init__(self, rows: tuple[Term, ...]) -> None:
        self._rows = rows

    @property
    def ids(self) -> list[str]:
        """Effect ids in the order in which the terms act."""
        return [row.id for row in self._rows]

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[Term]:
        return iter(self._rows)

    def __contains__(self, name: object) -> bool:
        return name in self.ids

    def __getitem__(self, name: str) -> Term:
        for row in self._rows:
            if row.id == name:
                return row
        raise InputError(f"terms: no term {shorten(name)} exists{nearest(str(name), self.ids)} (see hdfast terms)")

    def _cells(self) -> list[list[str]]:
        def parameters(row: Term) -> str:
            return ", ".join(f"{p.name} = {p.default:.4g} {p.unit}" for p in row.parameters)

        return [[row.id, row.place, row.equation, parameters(row), row.source] for row in self._rows]

    def __repr__(self) -> str:
        from hdfast.printing import text_table

        return text_table(["id", "place", "equation", "parameters", "source"], self._cells())

    def _repr_html_(self) -> str:
        from hdfast.printing import html_table

        return html_table(["id", "place", "equation", "parameters", "source"], self._cells())


@lru_cache(maxsize=1)
def terms() -> TermTable:
    """Catalogue of the physics beyond the nominal model: id, place, equation, parameters with units, source."""
    from hdfast.sensors.catalogue import EFFECTS

    return TermTable((*(_term(entry) for entry in _core.terms()), *(effect.info for effect in EFFECTS.values())))


def _term(entry: dict[str, Any]) -> Term:
    parameters = tuple(TermParameter(**parameter) for parameter in entry["parameters"])
    tuples = {name: tuple(entry[name]) for name in ("bases", "states")}
    return Term(**(entry | tuples | {"parameters": parameters}))
