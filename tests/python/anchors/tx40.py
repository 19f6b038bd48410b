"""Staubli TX40 arm, joint 4: current in A and joint angle at 1 kHz, torque constant unknown.

Motor side: angle = 48 q (gear ratios 32, 32, 45, 48, 45, 32 of the six joints, published with FIGAROH). The torque
column is the current itself, with a tolerance of a factor: friction and inertia are known up to it.

T. Nguyen et al., FIGAROH: free dynamics and geometrical calibration of robots and humans, IEEE Humanoids, 2023.
"""

from __future__ import annotations

from pathlib import Path

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, cut, write_campaign
from anchors.source import read

RATIOS = (32, 32, 45, 48, 45, 32)
FIT_SHARE = 0.6


def write(folder: Path, joint: int = 4) -> Path:
    """Viscous one-inertia baseline; the first 60 % fit, the rest is held out."""
    raw = read("staubli_tx40")
    ratio = RATIOS[joint - 1]
    columns = {"t": raw["t"], "motor_angle": ratio * raw["q"][:, joint - 1], "current": raw["i"][:, joint - 1]}
    fit, rest = cut(columns, FIT_SHARE)
    parts = [Part("fit", fit), Part("heldout", rest, "heldout", started_at_s=float(raw["t"][len(fit["t"])]))]
    sections = {
        "title": f"TX40 joint {joint}",
        "drive": {"ratio": float(ratio), "J_m": about(1e-3 / ratio, 1.0), "B_m": about(4e-2 / ratio, 1.0), **RIGID},
        "kinematic_error": NO_KINEMATIC_ERROR,
        "columns": {"motor_torque": {"name": "current", "scale": 1.0, "sigma": 1.0}},
    }
    return write_campaign(folder, sections, parts)
