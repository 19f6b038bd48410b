"""XL330 servo with a pendulum: 0.49 kg at 0.1 m, four trajectories at two position gains, from the BAM project.

Angle and torque at the output shaft, ratio 1. The servo has no current sensor. Its publisher's model of the motor is
k_t (U - k_t speed) / R while it is powered and zero while the torque is switched off, with U = duty / 885 times the
supply. Taken are k_t, R and armature of the published fit with Coulomb friction (bam/params/xl330/m1.json); those with
other laws and of other versions have k_t = 0.29 to 0.38 N m/A and R = 2.0 to 3.6 ohm. The torque column is this torque:
the voltage alone would have a viscous friction seven times the servo's, the back-EMF, that is gone while the torque is
off. The servo's own speed lags by 20 ms, so the speed is that of the angle. The pendulum's inertia is known and stands
behind the gear, which carries it. The duty is a 16-bit two's complement number.

M. Duclusaud, G. Passault, V. Padois, O. Ly, Extended friction models for the physics simulation of servo actuators,
2025.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, write_campaign
from anchors.oracle import speed_of
from anchors.source import read

TRAJECTORIES = ("sin_sin", "lift_and_drop", "up_and_down", "sin_time_square")
GAINS = (100, 400)
FULL_DUTY = 885.0
TORQUE_CONSTANT, RESISTANCE = 0.37, 3.5
ARMATURE, PENDULUM = 1.9e-3, 0.49 * 0.1**2
SPEED_CORNER = 20.0
COUNT = 2.0 * np.pi / 4096


def voltage(raw: dict[str, np.ndarray]) -> np.ndarray:
    """Mean voltage that drives a current [V]: without the back-EMF; zero while the torque is off."""
    duty = np.where(raw["duty"] >= 2**15, raw["duty"] - 2**16, raw["duty"])
    back_emf = TORQUE_CONSTANT * speed_of(raw["q"], raw["t"], SPEED_CORNER)
    return (duty / FULL_DUTY * raw["volts"] - back_emf) * (raw["torque_enable"] > 0)


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
        "drive": {
            "ratio": 1.0,
            "J_m": about(ARMATURE, 0.3),
            "B_m": about(5e-3, 0.5),
            **RIGID,
            "J_l": about(PENDULUM, 0.05),
        },
        "kinematic_error": NO_KINEMATIC_ERROR,
        "columns": {"motor_torque": {"name": "voltage", "scale": TORQUE_CONSTANT / RESISTANCE, "sigma": 0.3}},
        "sensors": {"motor_angle": {"resolution": COUNT}},
    }
    return write_campaign(folder, sections, parts)
