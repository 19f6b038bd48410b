"""HEJ-90 planetary actuator on a bench: torque commands, ratio 28.17, stated backlash 0.48 deg at the joint.

Motor side: angle = ratio times joint angle, torque = 3.2265 N m/A (the factor between the logged current and the logged
torque estimate) over the ratio. The rows come at 1 kHz, but the bus renews its values every 15 ms and the bench torque
at other instants. Time is logged in whole milliseconds: of rows with one time stamp the last is kept.

mmaag01, Actuator-Net, public repository.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, write_campaign
from anchors.source import read

RATIO = 28.171597633136095
JOINT_NM_PER_A = 3.2265
RUNS = {"TMS42_0p5-5_35Max": "fit", "Nm70_0p2_1p5_0p09": "heldout"}


def write(folder: Path) -> Path:
    """One inertia, stiff gear; the pulses up to 70 N m are held out."""
    parts = []
    for name, role in RUNS.items():
        raw = read(f"hej90_{name}")
        last = np.append(np.diff(raw["t"]) > 0.0, True)
        columns = {
            "t": raw["t"][last],
            "motor_angle": RATIO * raw["posAct"][last],
            "current": raw["i"][last],
            "output_torque": raw["torAct"][last],
        }
        parts.append(Part(name, columns, role, group=name, started_at_s=60.0 * len(parts)))
    sections = {
        "title": "HEJ-90 planetary actuator",
        "drive": {
            "base": "one_inertia",
            "ratio": RATIO,
            "J_m": about(0.75 / RATIO**2, 0.5),
            "B_m": about(0.4 / RATIO**2, 1.0),
            **RIGID,
        },
        "kinematic_error": NO_KINEMATIC_ERROR,
        "columns": {"motor_torque": {"name": "current", "scale": JOINT_NM_PER_A / RATIO, "sigma": 0.1}},
    }
    return write_campaign(folder, sections, parts)
