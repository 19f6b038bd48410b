"""Yaw axis of a robot head: torque of growing amplitude below breakaway, angle quantised to 2.4e-5.

The axis never breaks away, so it is a drive with a locked output: the windup is the angle away from its mean, and the
effort (unit as logged) is the motor torque. The pause of 1 s in the log parts the recording.

igricart, FrictionIdentification, public repository.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from anchors.campaign import NO_KINEMATIC_ERROR, Part, about, write_campaign
from anchors.source import read

COUNT = 2.3968e-5
FIT_SHARE = 0.6
LOCKED = 1e9


def stretches(raw: dict[str, np.ndarray]) -> list[dict[str, np.ndarray]]:
    """The recording without its pauses longer than 0.1 s."""
    breaks = np.flatnonzero(np.diff(raw["t"]) > 0.1) + 1
    return [
        {key: values[begin:end] for key, values in raw.items()}
        for begin, end in zip([0, *breaks], [*breaks, len(raw["t"])], strict=True)
    ]


def write(folder: Path) -> Path:
    """Linear spring and viscous damping; the amplitudes of the first 60 % fit, the larger ones are held out."""
    raw = read("heads_dyn_friction_exists_yaw")
    raw["q"] = raw["q"] - raw["q"].mean()
    parts = []
    for piece in stretches(raw):
        limit = FIT_SHARE * raw["t"][-1]
        for role, keep in (("fit", piece["t"] < limit), ("heldout", piece["t"] >= limit)):
            if keep.any():
                t = piece["t"][keep]
                columns = {
                    "t": t - t[0],
                    "motor_angle": piece["q"][keep],
                    "motor_torque": piece["effort"][keep],
                    "load_angle": np.zeros(keep.sum()),
                }
                parts.append(Part(f"{role}{len(parts)}", columns, role, started_at_s=float(t[0])))
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
