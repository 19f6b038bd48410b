"""What derivatives can be taken with respect to."""

from __future__ import annotations

from typing import Any

from hdfast.errors import InputError, choose, shorten
from hdfast.model import STATES, Model
from hdfast.params import ParameterTable

INITIAL = "initial_"
METHODS = ("dop853", "rodas5p")

Direction = tuple[bool, int]


def choose_directions(names: Any, model: Model, table: ParameterTable, method: str) -> dict[str, Direction]:
    """Positions in the parameter table, or (with True) among the states of the core, by the names given.

    Raises:
        InputError: not a list, an unknown name, a name twice, or a method that carries no derivatives.
    """
    if names is None:
        return {}
    if isinstance(names, (str, bytes)) or not hasattr(names, "__iter__"):
        raise InputError(f"sensitivities = {shorten(names)} is not a list of names")
    listed = list(names)
    if listed and method not in METHODS:
        raise InputError(f"method = {method!r} carries no sensitivities (allowed: auto, {', '.join(METHODS)})")
    known = [*table.names, *(INITIAL + state for state in model.states)]
    chosen: dict[str, Direction] = {}
    for name in listed:
        position: Direction
        if isinstance(name, str) and name in table:
            position = (False, table.column(name))
        else:
            state = choose("sensitivities", name, known).removeprefix(INITIAL)
            position = (True, STATES["two_inertia"].index(state))
        if position in chosen.values():
            raise InputError(f"sensitivities contains {name!r} twice")
        chosen[name] = position
    return chosen
