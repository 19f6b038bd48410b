"""Campaigns of simulated drives from which nothing is left out, each with a nuisance of its own.

Parameters are off within the stated tolerances; the torque carries coloured noise; encoders have 13 to 20 bit; clocks
jitter; some drives are seen from the motor alone, some declare their friction, some loads are pushed by a torque that
nobody records and that the controller answers to.
"""

from __future__ import annotations

from pathlib import Path

import hdfast
import numpy as np
from hdfast.toml_write import dump
from scipy.signal import lfilter

RATE, END = 500.0, 2.5
DRIVE = {"J_m": 3.0e-4, "J_l": 0.5, "B_m": 6e-4, "B_ml": 6e-4, "B_l": 0.5, "B_sp": 20.0, "k1": 31020.0}
SPRING = {"k3": 1.3445e10, "k5": -3.211e15, "phi_max": 0.001465}
TOLERANCE = {"J_m": 0.05, "J_l": 0.10, "B_m": 0.3, "B_ml": 0.3, "B_l": 0.3, "B_sp": 0.3, "k1": 0.05}
ORDERS = (1, 2, 4)
ROLES = ("fit", "fit", "fit", "heldout")


def write(folder: Path, seed: int) -> Path:
    """Write the campaign of a seed; returns its file."""
    rng = np.random.default_rng([seed, 77])
    folder.mkdir(parents=True, exist_ok=True)
    stated = {name: value * np.exp(rng.normal(0.0, 0.2)) for name, value in DRIVE.items()}
    true = {name: value * np.exp(rng.normal(0.0, 0.7 * TOLERANCE[name])) for name, value in stated.items()} | SPRING
    error = {f"te_{wave}_{order}": rng.normal(0.0, 6e-5 / order) for order in ORDERS for wave in ("cos", "sin")}
    friction = float(rng.uniform(0.01, 0.04)) if rng.uniform() < 0.4 else None
    known = {} if friction is None else {"coulomb_friction_T_c": friction * rng.normal(1.0, 0.1)}
    model = hdfast.Model(orders=ORDERS, terms=["coulomb_friction"] if friction else [])
    motor_only, disturbed = rng.uniform() < 0.4, rng.uniform() < 0.3
    angle_step, load_step = (2.0 * np.pi / 2.0 ** rng.integers(low, 21) for low in (13, 17))
    noise, memory = rng.uniform(1e-3, 6e-3), np.exp(-1.0 / (RATE * rng.uniform(0.002, 0.1)))
    gain = float(rng.uniform(0.02, 0.1))
    jitter = rng.uniform(0.0, 0.05) / RATE
    for number in range(len(ROLES)):
        speeds = rng.uniform(-50.0, 50.0, 5)
        corners = np.cumsum([0.0, *np.tile([0.15, 0.35], 5)])
        load = float(rng.choice([0.0, rng.uniform(-10.0, 10.0)]))
        profile = np.concatenate([[0.0], np.repeat(speeds, 2)])
        t = np.arange(0.0, END, 1.0 / RATE)
        push = _coloured(rng, len(t), 0.97) * rng.uniform(0.02, 0.1) if disturbed else np.zeros_like(t)
        scenario = hdfast.Scenario.speed_profile(corners, speed=profile, load=(t, load + push), K_p=gain, t_end=END)
        run = hdfast.sweep(
            {name: [value] for name, value in (true | error | known).items()}, model=model, scenario=scenario,
            t_eval=t, signals=["theta_m", "theta_l", "tau_m"], metrics=[], rtol=1e-8,
        )  # fmt: skip
        motor, output, torque = (run.samples[name][0] for name in ("theta_m", "theta_l", "tau_m"))
        columns = {
            "t": t + jitter * rng.uniform(-1.0, 1.0, len(t)),
            "motor_angle": np.round(motor / angle_step) * angle_step,
            "motor_torque": torque + noise * _coloured(rng, len(t), memory),
            "load_torque": np.full(len(t), load),
        }
        if not motor_only:
            columns["load_angle"] = np.round(output / load_step) * load_step
        np.savez(folder / f"run{number}.npz", **columns)
    content = {
        "title": f"nothing is left out, {seed}",
        "drive": {"ratio": 121, **SPRING, **{name: about(stated[name], TOLERANCE[name]) for name in stated}},
        "kinematic_error": {
            "orders": list(ORDERS),
            **{wave: [error[f"te_{wave}_{order}"] for order in ORDERS] for wave in ("cos", "sin")},
            "sigma": 1e-5,
        },
        "sensors": {"motor_angle": {"resolution": float(angle_step)}, "load_angle": {"resolution": float(load_step)}},
        "recording": [
            {"file": f"run{number}.npz", "role": role, "group": str(number)} for number, role in enumerate(ROLES)
        ],
    }
    if friction:
        content["terms"] = [{"effect": "coulomb_friction", "parameters": {"T_c": about(friction, 0.2)}}]
    file = folder / "campaign.toml"
    file.write_text(dump(content), encoding="utf-8")
    return file


def about(value: float, sigma: float) -> dict[str, float]:
    """A value with a relative tolerance, as campaign files state it."""
    return {"value": float(value), "sigma": sigma}


def _coloured(rng: np.random.Generator, size: int, memory: float) -> np.ndarray:
    """First-order Gauss-Markov noise of unit variance."""
    return lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], rng.standard_normal(size))
