"""Campaigns of a complete drive that a PI loop of 4 kHz moves and a recorder of 1 kHz sees, simulated on its own.

The command shakes with the steps of a 16 bit encoder. Its reference comes once per millisecond, so that it jumps there
while the drive accelerates, and is logged right after.
"""

from __future__ import annotations

from pathlib import Path

import numba
import numpy as np
from hdfast.toml_write import dump

STEP, PER_TICK, PER_SAMPLE = 1e-5, 25, 100
TICK, SAMPLE = STEP * PER_TICK, STEP * PER_SAMPLE
RATIO, J_M, J_L, K1, B_M, B_L, B_SP = 100.0, 2.5e-4, 0.6, 1.8e4, 9e-4, 0.8, 15.0
ORDERS, AMPLITUDES, PHASES = (1, 2, 4), (3e-5, 1.2e-4, 2e-5), (0.4, 1.1, -0.7)
MOTOR_STEP, LOAD_STEP, TORQUE_STEP, TORQUE_NOISE = 2.0 * np.pi / 2**16, 2.0 * np.pi / 2**20, 1e-3, 4e-3
POSITION_GAIN, SPEED_GAIN, INTEGRAL_GAIN, FILTER, LIMIT = 20.0, 0.05, 1.0, 0.35, 2.5
SERIES = np.array([ORDERS, AMPLITUDES, PHASES]).T


@numba.njit(cache=True)
def recorded(reference, torques):
    """Time [s], angles [rad] and logged torque [N m] along a reference angle [rad], with its errors, each (n,)."""
    found = np.empty((len(torques), 4))
    motor = motor_speed = load = load_speed = whole = command = last = seen_speed = 0.0
    for step in range(len(found) * PER_SAMPLE):
        at, since = step // PER_SAMPLE, step % PER_SAMPLE
        if since % PER_TICK == 0:
            seen = np.round(motor / MOTOR_STEP) * MOTOR_STEP
            seen_speed += FILTER * ((seen - last) / TICK - seen_speed)
            last = seen
            ahead = (reference[at + 1] - reference[at]) / SAMPLE
            error = POSITION_GAIN * (reference[at] + STEP * since * ahead - seen) + ahead - seen_speed
            whole = min(max(whole + INTEGRAL_GAIN * error * TICK, -LIMIT), LIMIT)
            command = min(max(SPEED_GAIN * error + whole, -LIMIT), LIMIT)
        if since == 0:
            found[at] = STEP * step, motor, load, command + torques[at]
        error = slope = 0.0
        for order, amplitude, phase in SERIES:
            error += amplitude * np.sin(order * motor + phase)
            slope += amplitude * order * np.cos(order * motor + phase)
        lever = 1.0 / RATIO - slope
        passed = K1 * (motor / RATIO - load - error) + B_SP * (motor_speed * lever - load_speed)
        motor_speed += STEP / J_M * (command - B_M * motor_speed - lever * passed)
        motor += STEP * motor_speed
        load_speed += STEP / J_L * (passed - B_L * load_speed)
        load += STEP * load_speed
    return found


def write(folder: Path, seed: int) -> Path:
    """Write a campaign of two recordings to fit and one to prove on, of a drive that is stated 10 % wrong."""
    rng = np.random.default_rng(seed)
    motions = ladder([5, 15, 40, 100, -100, -40, -15, -5]), swing(12.0), ladder([10, 60, -60, -10, 25, -25])
    for number, reference in enumerate(motions):
        noise = TORQUE_NOISE * rng.standard_normal(len(reference) - 1)
        t, motor, load, torque = recorded(reference, noise).T
        columns = {"motor_angle": (motor, MOTOR_STEP), "load_angle": (load, LOAD_STEP), "motor_torque": (torque, 1e-3)}
        rounded = {name: np.round(values / step) * step for name, (values, step) in columns.items()}
        np.savez(folder / f"r{number}.npz", t=t, **rounded)
    drive = {"J_m": 1.1 * J_M, "J_l": 0.9 * J_L, "k1": 1.1 * K1, "B_m": 0.7 * B_M, "B_l": 1.3 * B_L, "B_sp": B_SP}
    loose = {name: 0.1 if name in ("J_m", "J_l", "k1") else 0.5 for name in drive}
    content = {
        "title": f"a complete drive in a sampled loop, {seed}",
        "drive": {"ratio": RATIO, "B_ml": 0.0, **drive, "sigma": loose},
        "kinematic_error": {
            "orders": list(ORDERS), "amplitude": list(AMPLITUDES), "phase": list(PHASES), "sigma": 1e-5,
        },
        "sensors": {
            "motor_angle": {"resolution": MOTOR_STEP},
            "load_angle": {"resolution": LOAD_STEP},
            "motor_torque": {"resolution": TORQUE_STEP, "noise": TORQUE_NOISE},
        },
        "recording": [
            {"file": f"r{number}.npz", "role": role, "group": str(number)}
            for number, role in enumerate(("fit", "fit", "heldout"))
        ],
    }  # fmt: skip
    file = folder / "campaign.toml"
    file.write_text(dump(content), encoding="utf-8")
    return file


def ladder(speeds: list[float]) -> np.ndarray:
    """Angle [rad] at the samples: ramps of .3 s to steady speeds [rad/s], each held for 1.2 s, and a rest."""
    corners = np.cumsum([0, *[300, 1200] * len(speeds), 300, 300])
    marks = np.concatenate([[0.0], np.repeat(speeds, 2), [0.0, 0.0]])
    return np.cumsum(np.interp(np.arange(corners[-1]), corners, marks)) * SAMPLE


def swing(seconds: float) -> np.ndarray:
    """Angle [rad] at the samples: three tones that rise within a second."""
    t = np.arange(round(seconds / SAMPLE)) * SAMPLE
    tones = [(3.0, 0.8, 0.0), (2.0, 1.7, 1.0), (0.6, 4.3, 2.0)]
    return np.minimum(t, 1.0) * sum(size * np.sin(2.0 * np.pi * f * t + phase) for size, f, phase in tones)
