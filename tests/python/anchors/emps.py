"""Electro-Mechanical Positioning System: a ball-screw carriage in closed loop, recorded for identification.

The carriage is a one-inertia drive with a lead: angle = position 2 pi / lead, torque = force lead / 2 pi, so
J = M (lead / 2 pi)^2 and B = F_v (lead / 2 pi)^2.

The published controller is a cascade, u = k_v [k_p (q_r - q) - dq/dt] in V, force = g u. A PI controller on the speed,

    force = g k_v (n - dq/dt) + g k_v k_p integral of (n - dq/dt) over time,

equals it when n + k_p integral of n = k_p (q_r - q(0)), that is when n is the speed dq_r/dt behind a first-order
low-pass of the corner k_p, starting from n(0) = k_p (q_r(0) - q(0)): the integral of dq/dt is q - q(0), and what is
left is g k_v [k_p (q_r - q) - dq/dt]. With n linear between the samples its integral is the trapezoidal sum, so that
the recursion in `speed_reference` makes the two equal at every sample, not only in the limit of short steps.

A. Janot, M. Gautier, M. Brunot, Data set and reference models of EMPS, Nonlinear System Identification Benchmarks,
2019.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from anchors.campaign import NO_KINEMATIC_ERROR, RIGID, Part, about, cut, write_campaign
from anchors.source import read

LEAD = 2.5e-3
ARM = LEAD / (2.0 * np.pi)
NEWTON_PER_VOLT = 35.15065188248547
K_P = 160.18
K_V = 243.45
LIMIT_V = 10.0
COUNTS = 50_000
PERIOD = 1e-3
FIT_SHARE = 0.6


def speed_reference(position_reference: np.ndarray, position: float) -> np.ndarray:
    """Reference n [m/s] with which the PI controller equals the cascade; `position` is q at the first sample [m]."""
    demand = K_P * (position_reference - position)
    half = 0.5 * PERIOD * K_P
    first = demand[0]
    changes = np.diff(demand) / (1.0 + half)
    pole = (1.0 - half) / (1.0 + half)
    rest, _ = lfilter([1.0], [1.0, -pole], changes, zi=[pole * first])
    return np.concatenate([[first], rest])


def columns(raw: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Standard columns of a stretch of the recording; the speed reference starts with an empty integral."""
    return {
        "t": raw["t"] - raw["t"][0],
        "motor_angle": raw["pos_m"] / ARM,
        "motor_torque": raw["force_N"] * ARM,
        "speed_reference": speed_reference(raw["pos_ref_m"], raw["pos_m"][0]) / ARM,
    }


def write(folder: Path) -> Path:
    """Viscous baseline; the first 60 % fit, the rest is held out."""
    raw = read("emps_estimation")
    fit, rest = cut(raw, FIT_SHARE)
    start = float(raw["t"][len(fit["t"])])
    parts = [Part("fit", columns(fit)), Part("heldout", columns(rest), "heldout", started_at_s=start)]
    sections = {
        "title": "EMPS, ball-screw axis in closed loop",
        "drive": {"ratio": 1.0, "J_m": about(95.0 * ARM**2, 0.1), "B_m": about(200.0 * ARM**2, 0.5), **RIGID},
        "kinematic_error": NO_KINEMATIC_ERROR,
        "controller": {
            "kind": "pi",
            "kp": NEWTON_PER_VOLT * K_V * ARM**2,
            "ki": NEWTON_PER_VOLT * K_V * K_P * ARM**2,
            "limit": LIMIT_V * NEWTON_PER_VOLT * ARM,
            "period": PERIOD,
        },
        "sensors": {"motor_angle": {"resolution": 2.0 * np.pi / COUNTS}},
    }
    return write_campaign(folder, sections, parts)
