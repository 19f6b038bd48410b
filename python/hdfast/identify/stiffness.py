"""Torsional stiffness from torque-windup loops with the input locked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdfast import checks, spring
from hdfast.checks import Floats
from hdfast.errors import InputError, choose
from hdfast.identify import left_out, loop, spring_fit
from hdfast.identify.estimate import Estimates
from hdfast.identify.fit import Fit
from hdfast.identify.spring_fit import SpringFit

LAWS = ("odd", "full", "piecewise")
CATALOGUE_CORNERS = (14.0, 48.0)  # size 25, N m


def stiffness(
    recordings: Any,
    *,
    law: str = "odd",
    ratio: float | None = None,
    corners: tuple[float, float] = CATALOGUE_CORNERS,
    rated_torque: float = 67.0,
    columns: Mapping[str, Any] | None = None,
    base: Mapping[str, Any] | None = None,
    source: str = "",
) -> Fit:
    """Identify the spring from slow torque loops 0, +T, -T, +T, ... at the output shaft, the input locked.

    Windup is theta_m/ratio - theta_l, torque is output_torque, or load_torque when there is none. Loading and unloading
    branches are compared at equal windup, where hysteresis adds to the torque of the spring; the coefficients come from
    the parts where the branches run parallel. Loops of several amplitudes and rates share one spring; each keeps its
    own zero and its own hysteresis torque, and is listed with its losses. The estimates hold those of the largest loop.

    Args:
        recordings: one loop each; each needs t, load_angle and output_torque or load_torque.
        law: law of the model file: "odd" (k1, k3, k5), "full" (k1 ... k5) or "piecewise" (K1, K2, K3). The
            polynomials are fitted anyway, the slopes where the torques tell them.
        ratio: gear ratio, to take off what the motor turned; needed when it turned.
        corners: torques T1, T2 of the piecewise law [N m].
        rated_torque: for the lost motion (4 % of it) and the table of stiffness [N m].
        columns: standard column -> name in the file, or {"name": ..., "scale": ...}.
        base: sections of the model file into which the result is written.
        source: text of the campaign file, for the page.

    Raises:
        InputError: a column is missing, the loop is not whole or too coarse, the torques do not tell the slopes of a
            piecewise law that is asked for, or an argument is out of range.
    """
    choose("law", law, LAWS)
    i = None if ratio is None else checks.positive("ratio", ratio, 1e4)
    t1 = checks.positive("corners[0]", corners[0], 1e6, "N m")
    t2 = checks.number("corners[1]", corners[1], t1, 1e6, "N m")
    if t1 == t2:
        raise InputError(f"corners[1] = {t2:g} N m must be greater than corners[0] = {t1:g} N m")
    rated = checks.positive("rated_torque", rated_torque, 1e6, "N m")
    notes: list[str] = []
    listed = loop.loops(recordings, i, columns, rated, notes)
    largest, fitted = listed[0], loop.settled(listed, notes)
    points = loop.points(fitted)
    odd = spring_fit.odd(points, np.array([np.mean(item.found.reach) for item in fitted]))
    fits = {"odd": odd, "full": spring_fit.full(points, odd.zeros)}
    try:
        fits["piecewise"] = spring_fit.piecewise(points, odd, (t1, t2))
    except InputError as error:
        if law == "piecewise":
            raise
        notes.append(f"no K1, K2, K3: {error}")
    chosen = fits[law]
    phi_max = float(np.max(np.abs(np.array(largest.found.reach) - chosen.zeros[0])))
    drive = law_parameters(chosen, phi_max, (t1, t2))
    estimates = Estimates([*chosen.estimates, *loop.losses(listed)])
    notes += _limits(chosen, drive, phi_max, largest)
    terms, decided = left_out.hysteresis(estimates, phi_max, notes)
    several = {"Loops": loop.table(listed, fitted, chosen)} if len(listed) > 1 else {}
    return Fit(
        "stiffness",
        "Torsional stiffness from torque-windup loops" if several else "Torsional stiffness from a torque-windup loop",
        estimates,
        {"drive": drive, "terms": terms},
        notes,
        {
            "law": law,
            "laws": {name: {item.name: item.value for item in fit.estimates} for name, fit in fits.items()},
            "rms_residual": {name: fit.rms for name, fit in fits.items()},
            "range": phi_max,
            "cut": largest.pair.cut,
            "loops": [
                {"recording": item.name, "torque": item.size, "rate": item.rate}
                | {loss.name: loss.value for loss in item.losses}
                for item in listed
            ],
        },
        several
        | {
            "Spring laws": _law_table(fits, points.direction),
            "Stiffness along the spring": _slope_table(fits, phi_max, (0.0, t1, t2, rated)),
        },
        {"loops": fitted, "points": points, "fits": fits, "rated": rated, "corners": (t1, t2)},
        {
            "loop": ("1", np.concatenate([np.full(len(item.found.windup), float(j)) for j, item in enumerate(listed)])),
            "windup": ("rad", np.concatenate([item.found.windup for item in listed])),
            "torque": ("N m", np.concatenate([item.found.torque for item in listed])),
            "direction": ("1", np.concatenate([item.found.direction for item in listed])),
        },
        base or {},
        source,
        decided,
    )


def law_parameters(chosen: SpringFit, phi_max: float, corners: tuple[float, float]) -> dict[str, Any]:
    """Keys of the section [drive] for a fitted law; phi_max [rad], corners [N m]."""
    kept = {item.name: item.value for item in chosen.estimates if item.name[0] in "kK"}
    if chosen.law == "piecewise":
        return {"spring": "piecewise", **kept, "T1": corners[0], "T2": corners[1]}
    return {"spring": "polynomial", **kept, "phi_max": phi_max}


def _limits(chosen: SpringFit, drive: Mapping[str, Any], phi_max: float, largest: loop.Loop) -> list[str]:
    pair, zero = largest.pair, chosen.zeros[0]
    notes = [f"torque is the column {largest.column}; windup counts from {zero:.4g} rad, where the spring is relaxed"]
    if pair.cut:
        notes.append(
            f"the branches run parallel {pair.plateau:.3g} N m apart from {pair.cut * 1e6:.0f} µrad "
            "after a reversal on; the fit uses these parts, as the spring law cannot hold the loop"
        )
    else:
        notes.append("no stretch after a reversal had to be left out")
    if drive["spring"] == "polynomial":
        slope = spring.polynomial_tangent(drive, np.linspace(-phi_max, phi_max, 2001))
        notes.append(f"smallest tangent within the range of ±{phi_max:.4g} rad: {np.min(slope):.4g} N m/rad")
        beyond = np.linspace(phi_max, 3.0 * phi_max, 4001)
        tangent = spring.polynomial_tangent(dict(drive) | {"phi_max": np.inf}, beyond)
        vanishes = beyond[np.argmax(tangent <= 0.0)] if np.any(tangent <= 0.0) else np.inf
        notes.append(
            f"the tangent vanishes at {vanishes:.4g} rad, {100 * (vanishes / phi_max - 1):.0f} % outside; "
            "simulation continues linearly there"
            if np.isfinite(vanishes)
            else "the tangent stays positive up to three times the range"
        )
    return notes


def _law_table(fits: Mapping[str, SpringFit], direction: Floats) -> tuple[list[str], list[list[str]]]:
    header = ["law", "coefficients", "rms [N m]", "rms loading", "rms unloading", "largest [N m]"]
    rows = []
    for name, fit in fits.items():
        text = ", ".join(f"{item.name} {item.value:.4g}" for item in fit.estimates if item.name[0] in "kK")
        parts = [float(np.sqrt(np.mean(fit.residual[direction == s] ** 2))) for s in (1.0, -1.0)]
        values = [fit.rms, *parts, float(np.max(np.abs(fit.residual)))]
        rows.append([name, text, *(f"{value:.3g}" for value in values)])
    return header, rows


def _slope_table(
    fits: Mapping[str, SpringFit], phi_max: float, torques: tuple[float, ...]
) -> tuple[list[str], list[list[str]]]:
    grid = np.linspace(0.0, phi_max, 4001)
    rows = []
    for name, fit in fits.items():
        k = law_parameters(fit, phi_max, (torques[1], torques[2]))
        held = spring.torque(k["spring"], k, grid)
        slope = np.gradient(held, grid)
        cells = [f"{np.interp(T, held, slope):.4g}" if held[-1] >= 0.98 * T else "outside" for T in torques]
        rows.append([name, *cells])
    return ["law", *(f"K at {T:g} N m [N m/rad]" for T in torques)], rows
