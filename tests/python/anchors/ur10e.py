"""UR10e robot, joints 1, 2 and 4 moved one at a time: strain-wave gears, motor current in A.

Motor side: angle = 101 q (wave generator), torque = current times a torque constant that the publication leaves open.
The commanded torque in the same log, regressed on commanded current and friction, gives 8.5, 12.0 and 10.4 N m/A at the
joint; the scale of 10 N m/A is stated with a tolerance of 30 %.

S. Mamedov, S. Mikhel, Practical aspects of model-based collision detection, Frontiers in Robotics and AI 7, 2020.
"""

from __future__ import annotations

from pathlib import Path

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, cut, write_campaign
from anchors.source import read

RATIO = 101
JOINT_NM_PER_A = 10.0
SCALE_SIGMA = 0.3
FIT_SHARE = 0.6
INERTIA = {1: 6.0, 2: 16.0, 4: 0.95}
VISCOUS = {1: 25.0, 2: 25.0, 4: 4.5}


def write(folder: Path, joint: int) -> Path:
    """Viscous one-inertia baseline without kinematic error; the first 60 % fit, the rest is held out."""
    raw = read(f"ur10e_joint{joint}")
    columns = {"t": raw["t"], "motor_angle": RATIO * raw["q"], "current": raw["i"]}
    fit, rest = cut(columns, FIT_SHARE)
    parts = [Part("fit", fit), Part("heldout", rest, "heldout", started_at_s=float(raw["t"][len(fit["t"])]))]
    sections = {
        "title": f"UR10e joint {joint}",
        "drive": {
            "ratio": float(RATIO),
            "J_m": about(INERTIA[joint] / RATIO**2, 0.5),
            "B_m": about(VISCOUS[joint] / RATIO**2, 0.5),
            **RIGID,
        },
        "kinematic_error": NO_KINEMATIC_ERROR,
        "columns": {"motor_torque": {"name": "current", "scale": JOINT_NM_PER_A / RATIO, "sigma": SCALE_SIGMA}},
        "sensors": {"motor_angle": {"resolution": 1e-4 * RATIO}},
    }
    return write_campaign(folder, sections, parts)
