"""XL330 servo with a pendulum: 0.49 kg at 0.1 m, four trajectories at two position gains, from the BAM project.

Angle and torque at the output shaft, ratio 1. The servo has no current sensor: the torque column is the motor voltage,
duty / 885 times the supply, times torque constant over resistance; the back-EMF is then part of the viscous friction,
and is absent while the torque is switched off. The duty is a 16-bit two's complement number. The scale of 0.082 N m/V
follows from the known pendulum, m g l = 0.481 N m; it is stated with a tolerance of 30 %.

M. Duclusaud, G. Passault, V. Padois, O. Ly, Extended friction models for the physics simulation of servo actuators,
2025.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, write_campaign
from anchors.source import read

TRAJECTORIES = ("sin_sin", "lift_and_drop", "up_and_down", "sin_time_square")
GAINS = (100, 400)
FULL_DUTY = 885.0
NM_PER_V = 0.082
COUNT = 2.0 * np.pi / 4096


def voltage(raw: dict[str, np.ndarray]) -> np.ndarray:
    """Mean motor voltage [V]; zero while the torque is off."""
    duty = np.where(raw["duty"] >= 2**15, raw["duty"] - 2**16, raw["duty"])
    return duty / FULL_DUTY * raw["volts"] * (raw["torque_enable"] > 0)


def write(folder: Path, held_out: str = "kp100") -> Path:
    """Viscous one-inertia baseline without gravity; `held_out` is a trajectory or a gain such as "kp100"."""
    parts = []
    for gain in GAINS:
        for trajectory in TRAJECTORIES:
            name = f"kp{gain}_{trajectory}"
            raw = read(f"bam_xl330_{name}")
            columns = {"t": raw["t"], "motor_angle": raw["q"], "voltage": voltage(raw), "temperature": raw["temp_C"]}
            role = "heldout" if held_out in name.split("_", 1) else "fit"
            parts.append(Part(name, columns, role, group=name, started_at_s=60.0 * len(parts)))
    sections = {
        "title": f"XL330 servo with a pendulum, {held_out} held out",
        "drive": {"ratio": 1.0, "J_m": about(6.5e-3, 0.3), "B_m": about(0.04, 0.5), **RIGID},
        "kinematic_error": NO_KINEMATIC_ERROR,
        "columns": {"motor_torque": {"name": "voltage", "scale": NM_PER_V, "sigma": 0.3}},
        "sensors": {"motor_angle": {"resolution": COUNT}},
    }
    return write_campaign(folder, sections, parts)
