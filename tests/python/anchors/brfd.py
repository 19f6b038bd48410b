"""Banded rotary friction damper with backlash in a testing machine: prescribed sine motion, measured force.

No drive. As one it has the ratio 1 and a locked output: the motion is the motor angle (1 m = 1 rad), the force is the
torque that the motor must give and that arrives at the locked load, whose angle stays zero. So the windup is the
motion.

ARTS-Laboratory, Dataset-Friction-Damper-with-Backlash, CC BY-SA 4.0.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from anchors.campaign import NO_KINEMATIC_ERROR, Part, about, write_campaign
from anchors.source import read

RUNS = {
    "0p5Hz30lbtension0p5amplitude": "fit",
    "0p5Hz30lbtension1p5amplitude": "fit",
    "0p25Hz30lbtension1amplitude": "fit",
    "0p5Hz30lbtension1amplitude": "heldout",
}
LOCKED = 1e9


def write(folder: Path, *, every: int = 1, until: float = math.inf) -> Path:
    """Linear spring and viscous damping; the middle amplitude at 0.5 Hz is held out.

    Of the recordings, which have 1 kHz, only one sample in `every` is taken, and only those up to a time [s].
    """
    parts = []
    for name, role in RUNS.items():
        raw = read(f"brfd_{name}")
        raw = {key: values[raw["t"] <= until][::every] for key, values in raw.items()}
        columns = {
            "t": raw["t"],
            "motor_angle": raw["x_m"],
            "motor_torque": raw["force_N"],
            "load_angle": np.zeros_like(raw["t"]),
            "output_torque": raw["force_N"],
        }
        parts.append(Part(name, columns, role, group=name, started_at_s=120.0 * len(parts), input="motor_motion"))
    sections = {
        "title": "Rotary friction damper with backlash",
        "drive": {
            "ratio": 1.0,
            "J_m": about(10.0, 0.5),
            "J_l": LOCKED,
            "B_m": about(1e3, 1.0),
            "B_l": 0.0,
            "B_ml": 0.0,
            "B_sp": about(1e3, 1.0),
            "k1": about(3e5, 1.0),
            "k3": 0.0,
            "k5": 0.0,
            "phi_max": 0.05,
        },
        "kinematic_error": NO_KINEMATIC_ERROR,
    }
    return write_campaign(folder, sections, parts)
