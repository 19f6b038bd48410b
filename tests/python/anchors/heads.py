"""Yaw axis of a robot head: torque of growing amplitude below breakaway, angle quantised to 2.4e-5.

The axis never breaks away, so it is a drive with a locked output: the windup is the angle away from its mean, and the
effort (unit as logged) is the motor torque. What comes before the pause of 1 s in the log has no torque and is left
out.

igricart, FrictionIdentification, public repository.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from anchors.campaign import NO_KINEMATIC_ERROR, Part, about, cut, write_campaign
from anchors.source import read

COUNT = 2.3968e-5
FIT_SHARE = 0.58
LOCKED = 1e9


def write(folder: Path) -> Path:
    """Linear spring and viscous damping; the pulses in one direction fit, those in the other are held out."""
    raw = read("heads_dyn_friction_exists_yaw")
    driven = raw["t"] > raw["t"][np.argmax(np.diff(raw["t"]))]
    raw = {key: values[driven] for key, values in raw.items()}
    columns = {
        "t": raw["t"] - raw["t"][0],
        "motor_angle": raw["q"] - raw["q"].mean(),
        "motor_torque": raw["effort"],
        "load_angle": np.zeros(driven.sum()),
    }
    fit, rest = cut(columns, FIT_SHARE)
    parts = [Part("fit", fit), Part("heldout", rest, "heldout", started_at_s=float(columns["t"][len(fit["t"])]))]
    sections = {
        "title": "Robot head, yaw axis below breakaway",
        "drive": {
            "ratio": 1.0,
            "J_m": about(1e-2, 1.0),
            "J_l": LOCKED,
            "B_m": about(1.0, 3.0),
            "B_l": 0.0,
            "B_ml": 0.0,
            "B_sp": about(1.0, 3.0),
            "k1": about(2e3, 1.0),
            "k3": 0.0,
            "k5": 0.0,
            "phi_max": 1e-2,
        },
        "kinematic_error": NO_KINEMATIC_ERROR,
        "sensors": {"motor_angle": {"resolution": COUNT}},
    }
    return write_campaign(folder, sections, parts)
