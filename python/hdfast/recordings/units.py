"""Units as files write them, and their factors to the unit of a standard column."""

from __future__ import annotations

import math

from hdfast.recordings.columns import COLUMNS

DEGREE, RPM = math.pi / 180.0, math.pi / 30.0
SI = ("s", "rad", "Nm", "rad/s", "degC", "°C", "Cel", "-")
FACTORS = {
    "ms": ("s", 1e-3), "us": ("s", 1e-6), "µs": ("s", 1e-6), "ns": ("s", 1e-9), "min": ("s", 60.0),
    "deg": ("rad", DEGREE), "°": ("rad", DEGREE), "mrad": ("rad", 1e-3), "urad": ("rad", 1e-6),
    "rev": ("rad", 2 * math.pi),
    "mNm": ("N m", 1e-3), "kNm": ("N m", 1e3), "Ncm": ("N m", 1e-2),
    "deg/s": ("rad/s", DEGREE), "°/s": ("rad/s", DEGREE), "rpm": ("rad/s", RPM), "r/min": ("rad/s", RPM),
    "1/min": ("rad/s", RPM), "U/min": ("rad/s", RPM), "rps": ("rad/s", 2 * math.pi),
}  # fmt: skip
SHIFTED = ("K", "°F", "degF")
WITHOUT_FACTOR = ("A", "mA", "V", "mV", "counts", "count", "inc", "ticks", "%", *SHIFTED)


def plain(unit: str) -> str:
    """A unit without blanks, dots and products: "N m", "N·m" and "N*m" are "Nm"."""
    return unit.translate(str.maketrans("", "", " ·*⋅.")).replace("μ", "µ")


def known_unit(unit: str) -> bool:
    """True for a unit of this module."""
    return plain(unit) in (*SI, *FACTORS, *WITHOUT_FACTOR)


def factor(unit: str, target: str) -> float | None:
    """Factor from a unit to the target unit, None when there is none."""
    if plain(unit) == plain(target):
        return 1.0
    found = FACTORS.get(plain(unit))
    return found[1] if found is not None and found[0] == target else None


def shifted(name: str, unit: str) -> bool:
    """True for a temperature in a unit that a factor does not turn into degC."""
    return name == "temperature" and plain(unit) in SHIFTED


def correction(name: str, unit: str) -> str:
    """What has to be stated of a standard column that a file gives in a unit; nothing where none has to.

    A unit of which nothing is known counts as the column's own.
    """
    target = COLUMNS[name][0]
    scale = factor(unit, target)
    if scale == 1.0 or (scale is None and plain(unit) not in WITHOUT_FACTOR):
        return ""
    found = f"the file gives {name} in {unit}, not in {target}"
    if shifted(name, unit):
        return f"{found}: convert it to {target} in the file, which no scale does"
    hint = f"scale = {scale:.9g}" if scale is not None else f"a scale from {unit} to {target}"
    return f"{found}: state {hint} in [columns] {name}"
