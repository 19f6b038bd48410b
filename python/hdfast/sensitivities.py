"""What derivatives can be taken with respect to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose
from hdfast.model import STATES, Model
from hdfast.params import ParameterTable
from hdfast.sensors.stage import SensorStage

INITIAL = "initial_"
METHODS = ("dop853", "rodas5p")


@dataclass(frozen=True)
class Directions:
    """What is differentiated: W names, of the drive and of its sensors.

    Attributes:
        names: in the order asked for.
        drive: positions in the parameter table, or (with True) among the states of the core, by name.
        sensors: what the sensor stage calls its parameters, by name.
    """

    names: tuple[str, ...]
    drive: Mapping[str, tuple[bool, int]]
    sensors: Mapping[str, str]

    def arranged(self, drive: Floats, sensors: Floats) -> Floats:
        """Derivatives (..., W) in the order of the names."""
        if not self.sensors:
            return drive
        found = [*self.drive, *self.sensors]
        return np.concatenate([drive, sensors], axis=-1)[..., [found.index(name) for name in self.names]]

    def of_motion(self, values: Floats, drive: Floats) -> Floats:
        """Derivatives of values that no sensor changes; NaN where the values are."""
        if not self.sensors:
            return drive
        return self.arranged(drive, np.repeat(0.0 * np.abs(values)[..., None], len(self.sensors), axis=-1))


def choose_directions(
    names: Any, model: Model, table: ParameterTable, method: str, stage: SensorStage | None
) -> Directions:
    """Parameters of drive, scenario and sensors and initial states, by the names given.

    Raises:
        InputError: not a list, an unknown name, a name twice, or a method that carries no derivatives.
    """
    if names is None:
        return Directions((), {}, {})
    listed = checks.listed("sensitivities", names)
    own = ParameterTable(()) if stage is None else stage.named(table)
    known = [*table.names, *(INITIAL + state for state in model.states), *own.names]
    drive: dict[str, tuple[bool, int]] = {}
    sensors: dict[str, str] = {}
    for name in listed:
        if isinstance(name, str) and name in table:
            found: Any = (False, table.column(name))
        elif stage is not None and name in own:
            found = stage.parameters[own.column(name)].name
        else:
            state = choose("sensitivities", name, known, table.owner).removeprefix(INITIAL)
            found = (True, STATES["two_inertia"].index(state))
        if found in (*drive.values(), *sensors.values()):
            raise InputError(f"sensitivities contains {name!r} twice")
        (sensors if isinstance(found, str) else drive)[name] = found
    if drive and method not in METHODS:
        raise InputError(f"method = {method!r} carries no sensitivities (allowed: auto, {', '.join(METHODS)})")
    return Directions(tuple(listed), drive, sensors)
