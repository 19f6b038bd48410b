"""Kinova Gen3, joint 7, at five constant speeds: strain-wave gear 100:1, joint torque sensor, current.

Motor side: angle = 100 q, torque = 7.6 N m/A times the current, divided by 100. The torque sensor reads about -0.25 N m
with the arm at rest; no acceleration shows in it, so its sign is taken as logged. The first 30 ms are left out: a
current of up to 4 A there moves nothing.

HBRS-SDP, joint-friction-model, public repository.
"""

from __future__ import annotations

from pathlib import Path

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, write_campaign
from anchors.source import read

RATIO = 100
JOINT_NM_PER_A = 7.6
SPEEDS = ("0.05", "0.10", "0.50", "0.90", "1.50")
HELD_OUT = "0.90"
INERTIA = 0.14
SETTLED_S = 0.03
COULOMB = 1.39
VISCOUS = 0.69


def write(folder: Path) -> Path:
    """One inertia with Coulomb and viscous friction; one group per speed, 0.90 rad/s held out."""
    parts = []
    for index, speed in enumerate(SPEEDS):
        raw = read(f"kinova_gen3_j7_v{speed}")
        raw = {key: values[raw["t"] >= SETTLED_S] for key, values in raw.items()}
        columns = {
            "t": raw["t"] - raw["t"][0],
            "motor_angle": RATIO * raw["q"],
            "current": raw["i_meas"],
            "output_torque": raw["tau_meas"],
        }
        role = "heldout" if speed == HELD_OUT else "fit"
        parts.append(Part(f"v{speed}", columns, role, group=f"v{speed}", started_at_s=60.0 * index))
    sections = {
        "title": "Kinova Gen3 joint 7 at constant speeds",
        "drive": {
            "base": "one_inertia",
            "ratio": float(RATIO),
            "J_m": about(INERTIA / RATIO**2, 0.3),
            "B_m": about(VISCOUS / RATIO**2, 0.3),
            **RIGID,
        },
        "kinematic_error": NO_KINEMATIC_ERROR,
        "terms": [{"effect": "coulomb_friction", "parameters": {"T_c": about(COULOMB / RATIO, 0.3)}}],
        "columns": {"motor_torque": {"name": "current", "scale": JOINT_NM_PER_A / RATIO, "sigma": 0.1}},
    }
    return write_campaign(folder, sections, parts)
