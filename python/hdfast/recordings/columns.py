"""The standard columns of a recording, and how a file that names or scales them otherwise is mapped."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hdfast import checks
from hdfast.errors import InputError, choose, shorten

COLUMNS = {
    "t": ("s", "time"),
    "motor_angle": ("rad", "motor angle, unwrapped"),
    "motor_torque": ("N m", "motor torque, positive accelerates forward"),
    "load_angle": ("rad", "load angle, unwrapped"),
    "load_torque": ("N m", "external torque on the load, positive resists"),
    "output_torque": ("N m", "torque between gear and load, positive drives the load"),
    "speed_reference": ("rad/s", "motor speed asked for"),
    "temperature": ("degC", "temperature of the gear"),
}
CHANNELS = tuple(name for name in COLUMNS if name != "t")
FEWEST_FINITE = 0.5  # share of the samples: a column with fewer numbers is not used


@dataclass(frozen=True)
class ColumnMap:
    """Where a standard column stands in a file.

    Attributes:
        name: its name there.
        scale: factor that turns it into SI units, None where none is stated; negative flips the sign.
        sigma: relative standard deviation of that factor, or None.
    """

    name: str
    scale: float | None = None
    sigma: float | None = None

    @property
    def factor(self) -> float:
        """The stated factor, or 1."""
        return 1.0 if self.scale is None else self.scale

    def absence(self, standard: str) -> str:
        """What is said of a file that lacks it."""
        return f"no column {self.name!r} for {standard}"


def read_column_map(given: Mapping[str, Any] | None) -> dict[str, ColumnMap]:
    """Read a map such as `{"motor_angle": {"name": "enc_m", "scale": 4.79e-5}, "t": "time"}`.

    Raises:
        InputError: an unknown standard column or key, or a scale that is no finite number other than zero.
    """
    return {choose("columns", key, COLUMNS): _entry(key, value) for key, value in (given or {}).items()}


def _entry(key: str, value: Any) -> ColumnMap:
    if isinstance(value, ColumnMap):
        return value
    if isinstance(value, str):
        return ColumnMap(value)
    if not isinstance(value, Mapping):
        raise InputError(f"columns.{key} = {shorten(value)} is not a name or a table with name and scale")
    for name in value:
        choose(f"columns.{key}", name, ("name", "scale", "sigma"))
    name = value.get("name", key)
    if not isinstance(name, str):
        raise InputError(f"columns.{key}.name = {shorten(name)} is not text")
    scale = checks.finite(f"columns.{key}.scale", value["scale"]) if "scale" in value else None
    if scale == 0.0:
        raise InputError(f"columns.{key}.scale = 0 (allowed: a finite number other than zero)")
    sigma = checks.finite(f"columns.{key}.sigma", value["sigma"], 0.0) if "sigma" in value else None
    return ColumnMap(name, scale, sigma)
