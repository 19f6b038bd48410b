"""Starting torque from slow torque ramps out of rest: a distribution over angle and direction, not one number."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.identify import left_out
from hdfast.identify.estimate import Estimates, amplitude, estimate
from hdfast.identify.fit import Fit
from hdfast.identify.least_squares import fit
from hdfast.identify.reading import gather
from hdfast.identify.starts import Starts, starts

TURN = 2.0 * math.pi
ORDER = 2.0  # lobes of the wave generator
LEAST_STARTS = 8
REPEATS = 3
ENOUGH_ANGLES = 12
DIRECTIONS = (("forward", 1.0), ("backward", -1.0))
SHARES = (0.05, 0.5, 0.95)


def starting_torque(
    recordings: Any,
    *,
    columns: Mapping[str, Any] | None = None,
    base: Mapping[str, Any] | None = None,
    source: str = "",
) -> Fit:
    """Identify the motor torque at which the drive leaves rest.

    Fits the mean in each direction times 1 + a cos 2 theta_m + b sin 2 theta_m; the scatter around it is stated apart.
    The model file gets the level as breakaway of the dry friction that `base` declares, or as Coulomb torque when it
    declares none.

    Args:
        recordings: each needs t, motor_angle and motor_torque and holds one start or several; the torque rises by
            1 to 5 mN m/s out of rest, for a second or more, at twelve motor angles or more.
        columns, base, source: as in `stiffness`.

    Raises:
        InputError: a column is missing, or no start is found.
    """
    listed = gather(recordings, columns)
    notes = [f"{item.name}: {note}" for item in listed for note in item.notes]
    found = starts(listed, notes)
    sides = [(name, sign) for name, sign in DIRECTIONS if np.any(found.direction == sign)]
    design = np.stack([np.where(found.direction == sign, 1.0, 0.0) for _, sign in sides], axis=1)
    wave = _wave(found, len(sides), notes)
    line = fit(design, found.torque)
    for _ in range(REPEATS):
        levels = design @ line.coefficients[: len(sides)]
        line = fit(np.hstack([design, wave * levels[:, None]]), found.torque)
    estimates = [
        estimate(
            f"T_s_{name}", line.coefficients[j], "N m", line.sigma[j], line.freedom, f"mean starting torque {name}"
        )
        for j, (name, _) in enumerate(sides)
    ]
    ripple = None
    if wave.size:
        a, b = line.coefficients[len(sides) :]
        size, largest = math.hypot(a, b), float(np.max(line.sigma[len(sides) :]))
        meaning = "amplitude twice per motor revolution over the mean"
        ripple = (amplitude("ripple", size, "1", largest, line.freedom, meaning), math.atan2(-b, a))
        estimates.append(ripple[0])
    spread = math.sqrt(float(line.residuals @ line.residuals) / max(line.freedom, 1))
    meaning = "standard deviation from start to start"
    sigma = spread / math.sqrt(2.0 * line.freedom) if line.freedom > 0 else math.inf
    estimates.append(estimate("spread", spread, "N m", sigma, meaning=meaning))
    _completeness(found, sides, notes)
    terms, decided = left_out.breakaway(estimates[: len(sides)], ripple, (base or {}).get("terms", []), notes)
    return Fit(
        "starting_torque",
        "Starting torque from slow torque ramps",
        Estimates(estimates),
        {"terms": terms},
        notes,
        {"starts": len(found.torque), "reading_sigma": float(np.median(found.noise))},
        {"Distribution": _distribution(found, sides)},
        {"starts": found, "sides": sides, "line": line.coefficients, "waves": bool(wave.size)},
        {
            "motor_angle": ("rad", found.angle),
            "direction": ("1", found.direction),
            "torque": ("N m", found.torque),
            "reading_sigma": ("N m", found.noise),
            "recording": ("1", found.recording),
        },
        base or {},
        source,
        decided,
    )


def _wave(found: Starts, sides: int, notes: list[str]) -> Floats:
    """Columns of the second order, where the starts are many and spread enough to tell them from the mean."""
    columns = np.stack([np.cos(ORDER * found.angle), np.sin(ORDER * found.angle)], axis=1)
    square = np.hstack([np.ones((len(columns), 1)), columns])
    if len(found.torque) >= LEAST_STARTS + sides and np.linalg.cond(square) < 10.0:
        return columns
    notes.append(f"dependence on the motor angle is not known: {len(found.torque)} starts, too few or too close")
    return columns[:, :0]


def _completeness(found: Starts, sides: list[tuple[str, float]], notes: list[str]) -> None:
    if len(sides) < len(DIRECTIONS):
        notes.append("one direction only: asymmetry is not known")
    for name, sign in sides:
        places = len(np.unique(np.round(found.angle[found.direction == sign] % TURN / TURN * 24.0) % 24.0))
        if places < ENOUGH_ANGLES:
            notes.append(f"{name}: {places} motor angles; twelve or more tell the spread over a revolution")


def _distribution(found: Starts, sides: list[tuple[str, float]]) -> tuple[list[str], list[list[str]]]:
    header = ["direction", "starts", "least", *(f"{100 * share:g} %" for share in SHARES), "largest [N m]"]
    rows = []
    for name, sign in sides:
        torque = found.torque[found.direction == sign]
        values = [np.min(torque), *np.quantile(torque, SHARES), np.max(torque)]
        rows.append([name, str(len(torque)), *(f"{value:.4g}" for value in values)])
    return header, rows
