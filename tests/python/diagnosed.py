"""Campaigns of simulated drives for the tests of the diagnosis; what is in the drive is not in its campaign."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import hdfast
import numpy as np
from hdfast.toml_write import dump

END = 4.0
RATE = 500.0
NOMINAL = {"J_m": 3.0e-4, "J_l": 0.5, "B_m": 6e-4, "B_ml": 6e-4, "B_l": 0.5, "B_sp": 20.0, "k1": 31020.0}
REST = {"k3": 1.3445e10, "k5": -3.211e15, "phi_max": 0.001465}
ORDERS, COS, SIN = (1, 2, 4), (-6.2e-6, 7.1e-5, 2.0e-5), (1.9e-5, 5.5e-5, -8.3e-6)
MOTOR_STEP, LOAD_STEP, TORQUE_NOISE = 4.8e-5, 6e-6, 2e-3
CORNERS = (0.0, 0.2, 0.5, 1.5, 2.0, 2.7, 2.9, 3.5, 3.7, 4.0)
SHARES = (0.0, 0.0, 1.0, 1.0, -0.5, -0.5, 0.25, 0.25, 0.0, 0.0)
RUNS = ((40.0, 0.0, "fit"), (-30.0, 5.0, "fit"), (15.0, -8.0, "fit"), (25.0, 3.0, "heldout"))


def write(
    folder: Path,
    terms: Sequence[str] = (),
    values: Mapping[str, float] | None = None,
    *,
    seed: int = 0,
    motor_only: bool = False,
) -> Path:
    """Write a campaign whose drive has `terms`; returns the campaign file."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    true = {name: value * rng.normal(1.0, 0.05) for name, value in NOMINAL.items()} | REST
    error = {f"te_cos_{order}": value for order, value in zip(ORDERS, COS, strict=True)}
    error |= {f"te_sin_{order}": value for order, value in zip(ORDERS, SIN, strict=True)}
    model = hdfast.Model(terms=terms, orders=ORDERS)
    t = np.arange(0.0, END, 1.0 / RATE)
    entries = []
    for number, (speed, load, role) in enumerate(RUNS):
        scenario = hdfast.Scenario.speed_profile(CORNERS, speed=speed * np.array(SHARES), load=load, t_end=END)
        result = hdfast.sweep(
            {name: [value] for name, value in (true | error | dict(values or {})).items()},
            model=model,
            scenario=scenario,
            t_eval=t,
            signals=["theta_m", "theta_l", "tau_m"],
            metrics=[],
            rtol=1e-8,
        )
        motor, output, torque = (result.samples[name][0] for name in ("theta_m", "theta_l", "tau_m"))
        columns = {
            "t": t,
            "motor_angle": np.round(motor / MOTOR_STEP) * MOTOR_STEP,
            "motor_torque": torque + TORQUE_NOISE * rng.standard_normal(len(t)),
            "load_torque": np.full(len(t), load),
        }
        if not motor_only:
            noisy = output + 1e-6 * rng.standard_normal(len(t))
            columns["load_angle"] = np.round(noisy / LOAD_STEP) * LOAD_STEP
        np.savez(folder / f"run{number}.npz", **columns)
        entries.append({"file": f"run{number}.npz", "role": role, "group": str(number)})
    content = {
        "title": "simulated drive",
        "drive": {"ratio": 121, **NOMINAL, **REST},
        "kinematic_error": {"orders": list(ORDERS), "cos": list(COS), "sin": list(SIN), "sigma": 1e-5},
        "sensors": {
            "motor_angle": {"resolution": MOTOR_STEP},
            "load_angle": {"resolution": LOAD_STEP, "noise": 1e-6},
            "motor_torque": {"noise": TORQUE_NOISE},
        },
        "recording": entries,
    }
    file = folder / "campaign.toml"
    file.write_text(dump(content), encoding="utf-8")
    return file
