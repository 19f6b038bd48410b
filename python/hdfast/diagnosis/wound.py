"""Starts of a replay that is wound up before anything moves: a weight hangs on the load, or the load is locked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.prepare import Unit
from hdfast.model import Model
from hdfast.sweep import sweep

WEIGHT = "gravity_unbalance"


def wound_up(
    units: Sequence[Unit], model: Model, columns: Mapping[str, Floats | float], which: np.ndarray, threads: int | None
) -> Floats | None:
    """States at the start (M, 4), wound up by load torque and weight, or by a load that is locked; None without either.

    A start that is relaxed knows the load torque alone, so that a weight would set the load swinging: for the first
    instant it is counted as load torque. It takes the load along with the motor, which one that is locked never
    forgets.

    Args:
        units: the recordings.
        model: the equations.
        columns: parameters of M rows, a number or (M,), by long name.
        which: recording of each row, shape (M,).
        threads: threads of the engine.
    """
    hangs = WEIGHT in model.terms
    locked = np.array([np.nan if unit.locked is None else unit.locked for unit in units])[which]
    free = np.isnan(locked)
    if model.base != "two_inertia" or (free.all() and not hangs):
        return None
    angle, speed = np.array([(unit.angle[0], unit.speed[0]) for unit in units])[which].T
    if not free.any():
        return np.column_stack([angle, speed, locked, np.zeros_like(speed)])
    turned = angle / columns["ratio"]
    weight = columns[f"{WEIGHT}_T_gravity"] * np.sin(turned + columns[f"{WEIGHT}_psi"]) if hangs else 0.0
    found = sweep(
        {**columns, "tau_load": columns.get("tau_load", 0.0) + weight},
        model=model,
        scenario=[unit.beginning for unit in units],
        scenario_index=which,
        t_eval=[0.0],
        signals=["te", "omega_l"],
        metrics=[],
        method="tsit5",
        threads=threads,
    )
    te, follows = (np.nan_to_num(found.samples[name][:, 0]) for name in ("te", "omega_l"))
    return np.column_stack([angle, speed, np.where(free, turned - te, locked), np.where(free, follows, 0.0)])
