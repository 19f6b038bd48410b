"""Units as files write them, and their factors to the unit of a standard column."""

from __future__ import annotations

import math
import re

from hdfast.recordings.columns import COLUMNS

TURN, DEGREE, RPM = 2.0 * math.pi, math.pi / 180.0, math.pi / 30.0
UNITS = {
    "s": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "rad": {
        "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "µrad": 1e-6, "rev": TURN, "turn": TURN, "turns": TURN,
        "deg": DEGREE, "degree": DEGREE, "degrees": DEGREE, "°": DEGREE, "arcmin": DEGREE / 60, "arcsec": DEGREE / 3600,
    },
    "N m": {"Nm": 1.0, "mNm": 1e-3, "kNm": 1e3, "MNm": 1e6, "Ncm": 1e-2, "Nmm": 1e-3},
    "rad/s": {
        "rad/s": 1.0, "deg/s": DEGREE, "°/s": DEGREE, "rps": TURN,
        "rpm": RPM, "r/min": RPM, "1/min": RPM, "U/min": RPM,
    },
    "degC": {"degC": 1.0, "°C": 1.0, "C": 1.0, "Cel": 1.0},
}  # fmt: skip
FACTORS = {unit: (target, factor) for target, units in UNITS.items() for unit, factor in units.items()}
SHIFTED = ("K", "°F", "degF", "F")
OF_A_SENSOR = ("A", "mA", "V", "mV", "counts", "count", "inc", "ticks", "%")
NONE = "-"
KNOWN = (*FACTORS, *SHIFTED, *OF_A_SENSOR, NONE)
BRACKETED = re.compile(r"(?P<rest>.*?)\s*(\[(?P<square>[^][]*)\]|\((?P<round>[^()]*)\))")
SUFFIXED = re.compile(r"(?P<rest>.+)_(?P<unit>[^\W_]{2,})")


def plain(unit: str) -> str:
    """A unit as it stands here: without blanks, dots and products, so that "N m", "N·m" and "N*m" are "Nm".

    Capitals do not count unless they tell two units apart, as "mNm" and "MNm".
    """
    given = unit.translate(str.maketrans("", "", " ·*⋅.")).replace("μ", "µ")
    alike = [known for known in KNOWN if known.casefold() == given.casefold()]
    return alike[0] if len(alike) == 1 else given


def known_unit(unit: str) -> bool:
    """True for a unit of this module."""
    return plain(unit) in KNOWN


def named_with_unit(name: str) -> tuple[str, str]:
    """A column's name in a file apart from the unit in it, as in "angle [deg]", "angle (deg)" and "angle_deg".

    The unit is empty where none of this module is there; a suffix of one letter counts as part of the name.
    """
    if found := BRACKETED.fullmatch(name):
        unit = (found["square"] or found["round"] or "").strip()
        return (found["rest"], unit) if known_unit(unit) and plain(unit) != NONE else (name, "")
    if (found := SUFFIXED.fullmatch(name)) and known_unit(found["unit"]):
        return found["rest"], found["unit"]
    return name, ""


def factor(unit: str, target: str) -> float | None:
    """Factor from a unit to the target unit, None when there is none."""
    found = FACTORS.get(plain(unit))
    return found[1] if found is not None and found[0] == target else None


def scalable(name: str, unit: str) -> bool:
    """True for a unit that some factor turns into that of a standard column."""
    return factor(unit, COLUMNS[name][0]) is not None or plain(unit) in OF_A_SENSOR


def correction(name: str, unit: str) -> str:
    """What has to be stated of a standard column that a file gives in a unit; nothing where none has to.

    A unit of which nothing is known counts as the column's own.
    """
    target = COLUMNS[name][0]
    scale = factor(unit, target)
    if scale == 1.0 or not known_unit(unit) or plain(unit) == NONE:
        return ""
    found = f"the file gives {name} in {unit}, not in {target}"
    if scalable(name, unit):
        hint = f"scale = {scale:.9g}" if scale is not None else f"a scale from {unit} to {target}"
        return f"{found}: state {hint} in [columns] {name}"
    if name == "temperature" and plain(unit) in SHIFTED:
        return f"{found}: convert it to {target} in the file, which no scale does"
    return f"{found}: name another column in [columns] {name}, or correct its unit in the file"
