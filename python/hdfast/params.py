"""The parameter table: one name, unit, default and range per parameter, read from the compiled core."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import overload

import numpy as np

from hdfast import _core, checks
from hdfast.checks import Floats
from hdfast.errors import InputError, ParameterError, nearest, shorten
from hdfast.model import Model
from hdfast.spring import COEFFICIENTS
from hdfast.terms import terms

HEADER = ["name", "symbol", "unit", "default", "range", "meaning", "source"]


@dataclass(frozen=True)
class Parameter:
    """One parameter: SI unit, default of the SHF-25-120 drive and its source, plausible range, allowed range.

    Numbers in the allowed range are finite, and where it `may_be_infinite` infinity belongs to it.
    """

    name: str
    symbol: str
    unit: str
    default: float
    low: float
    high: float
    meaning: str
    source: str
    group: str
    allowed: tuple[float, float] = (-math.inf, math.inf)
    may_be_infinite: bool = False

    @property
    def limits(self) -> str:
        """What it may be, what is plausible, and what it means, in words."""
        low, high = self.allowed
        if high < math.inf:
            allowed = f"{low:g} to {high:g}"
        elif low > -math.inf:
            allowed = "above 0" if low == sys.float_info.min else f"from {low:g}"
            allowed = f"{allowed}, infinity too" if self.may_be_infinite else f"finite, {allowed}"
        else:
            allowed = "any finite number"
        return f"allowed: {allowed}; plausible: {self.low:g} to {self.high:g}; {self.meaning}"


class ParameterTable:
    """Parameters in column order; prints as a table, iterates over `Parameter`, indexed by position or name."""

    def __init__(self, rows: tuple[Parameter, ...], aliases: Mapping[str, str] | None = None) -> None:
        self._rows = rows
        self._index = {row.name: position for position, row in enumerate(rows)}
        self._aliases = dict(aliases or {})

    @property
    def names(self) -> list[str]:
        """Parameter names in column order."""
        return [row.name for row in self._rows]

    @property
    def units(self) -> dict[str, str]:
        """Unit by name."""
        return {row.name: row.unit for row in self._rows}

    @property
    def defaults(self) -> Floats:
        """Default values in column order, shape (P,)."""
        return np.array([row.default for row in self._rows], dtype=np.float64)

    def column(self, name: str) -> int:
        """Position of a parameter.

        Raises:
            ParameterError: naming the model that has it, or the nearest known name.
        """
        if name not in self:
            raise ParameterError(f"parameter {shorten(name)} is not known{self.hint(name)}")
        return self._index[self.canonical(name)]

    def hint(self, name: object) -> str:
        """Of a name that is not here: whose it is, else the nearest one; empty when there is none."""
        return self.owner(name) or nearest(str(name), self._index)

    def owner(self, name: object) -> str:
        """Of a name that is not here: the spring or the terms whose it is, in words; empty when it is nobody's."""
        springs = [spring for spring, names in COEFFICIENTS.items() if name in names]
        if springs:
            return f"; {name} belongs to Model(spring={springs[0]!r})"
        owners = [term.id for term in terms() if term.bases and term.owns(name)]
        if owners:
            return f"; {name} belongs to the term{'s' if len(owners) > 1 else ''} {', '.join(owners)}"
        return ""

    def canonical(self, name: str) -> str:
        """The column name behind a name: a term's parameter may always be written with the term's id before it."""
        return self._aliases.get(name, name)

    def joined(self, other: ParameterTable) -> ParameterTable:
        """These parameters, then the others."""
        return ParameterTable((*self._rows, *other._rows), {**self._aliases, **other._aliases})

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self._rows)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self.canonical(name) in self._index

    @overload
    def __getitem__(self, key: int | str) -> Parameter: ...
    @overload
    def __getitem__(self, key: slice) -> ParameterTable: ...
    def __getitem__(self, key: int | str | slice) -> Parameter | ParameterTable:
        if isinstance(key, slice):
            return ParameterTable(self._rows[key], self._aliases)
        return self._rows[self.column(key) if isinstance(key, str) else key]

    def _cells(self) -> list[list[str]]:
        return [
            [
                row.name,
                row.symbol,
                row.unit,
                f"{row.default:.6g}",
                f"{row.low:.4g} .. {row.high:.4g}",
                row.meaning,
                row.source,
            ]
            for row in self._rows
        ]

    def __repr__(self) -> str:
        from hdfast.printing import text_table

        return text_table(HEADER, self._cells(), right=(3,))

    def _repr_html_(self) -> str:
        from hdfast.printing import html_table

        return html_table(HEADER, self._cells())


@lru_cache(maxsize=64)
def layout(model: Model) -> ParameterTable:
    """Every column the core takes for a model: the drive's parameters, then the six of the scenario."""
    rows = _core.layout(model.base, model.spring, model.order_values, model.order_labels, list(model.terms))
    names = {row["name"] for row in rows}
    own = [(term, parameter.name) for term in model.terms for parameter in terms()[term].parameters]
    aliases = {f"{term}_{name}": name for term, name in own if f"{term}_{name}" not in names}
    return ParameterTable(tuple(Parameter(**row) for row in rows), aliases)


_DEFAULT_MODEL = Model()


def chosen_model(model: Model | None) -> Model:
    """The model given, or the default."""
    if model is None:
        return _DEFAULT_MODEL
    if not isinstance(model, Model):
        raise InputError(f"model = {shorten(model)} is not a hdfast.Model")
    return model


def params(model: Model | None = None) -> ParameterTable:
    """Parameters of a drive, in the column order of the arrays that `sweep` takes.

    Args:
        model: the model; the default is `Model()`.
    """
    table = layout(chosen_model(model))
    return table[: sum(row.group == "drive" for row in table)]


def defaults(rows: int, model: Model | None = None) -> Floats:
    """A float64 array (rows, P) with the default drive in every row; columns as in `params(model)`.

    Raises:
        InputError: a negative number of rows, or more than the memory of this machine holds.
    """
    count = checks.whole("rows", rows, 0, 2**40)
    values = params(model).defaults
    memory = checks.memory_limit()
    if count * values.nbytes > memory:
        raise InputError(
            f"rows = {count} needs {count * values.nbytes / 1e9:.3g} GB, this machine has {memory / 1e9:.3g} GB"
        )
    return np.tile(values, (count, 1))


def column(name: str, model: Model | None = None) -> int:
    """Column of a parameter in the arrays that `sweep` takes.

    Raises:
        ParameterError: naming the nearest known name.
    """
    return params(model).column(name)
