"""The bench of the article as a campaign: starts and stops at 15, 50 and 100 r/min, ratio 121, simulated.

The recorded drive has dry friction, and either the angle sensor at its output is slow, or all channels pass a low-pass
and the averaging of a 100 Hz logger; the nominal drive has none of it. So the recording starts more slowly and stops
sooner than the simulation, and lacks its high-frequency part: the two differences that the article describes.
"""

from __future__ import annotations

from pathlib import Path

import hdfast
import numpy as np
from scipy.signal import lfilter

from anchors.campaign import Part, about, write_campaign

SPEEDS_RPM = (15.0, 50.0, 100.0)
HELD_OUT_RPM = 50.0
REPEATS = 2
RATE = 1000.0
TICK = 10
BANDWIDTH_HZ = 20.0
T_RAMP, T_OFF, T_END = 0.05, 3.0, 5.0
TORQUE_LIMIT = 0.045
NOISE = {"motor_angle": 1e-5, "load_angle": 1e-6, "motor_torque": 2e-4}
CHANNELS = {"motor_angle": "theta_m", "load_angle": "theta_l", "motor_torque": "tau_m"}
TERMS = {"none": (), "coulomb": ("coulomb_friction",), "stribeck": ("stribeck_friction",)}
FRICTION = {"T_c": 0.025}


def run(speed_rpm: float, friction: str) -> hdfast.Trajectory:
    """Start under speed control with a limited torque, then coast; 1 kHz."""
    scenario = hdfast.Scenario.start_stop(
        speed_rpm=speed_rpm, start="speed_ramp", t_ramp=T_RAMP, t_off=T_OFF, t_end=T_END, tau_max=TORQUE_LIMIT
    )
    terms = TERMS[friction]
    grid = np.arange(int(T_END * RATE)) / RATE
    return hdfast.simulate(FRICTION if terms else {}, model=hdfast.Model(terms=terms), scenario=scenario, t_eval=grid)


def slow(values: np.ndarray) -> np.ndarray:
    """First-order low-pass of a signal that is straight between its samples."""
    span = 2.0 * np.pi * BANDWIDTH_HZ / RATE
    pole = np.exp(-span)
    share = (1.0 - pole) / span
    return values[0] + lfilter([1.0 - share, share - pole], [1.0, -pole], values - values[0])


def logged(values: np.ndarray) -> np.ndarray:
    """What a sensor shows slowly, and then the mean of the samples of one tick of the logger."""
    return slow(values).reshape(-1, TICK).mean(axis=1)


def write(folder: Path, friction: str = "stribeck", *, late: str = "all", seed: int = 0) -> Path:
    """The campaign of the bench; without friction and with no sensor late it is the twin of itself.

    The runs at 50 r/min are held out. `late` is "all", "output" or "none". Where all sensors are, they log the mean of
    every tick of 10 ms, on a clock that starts with the first mean; else at 1 kHz.
    """
    random = np.random.default_rng(seed)
    parts = []
    for speed in SPEEDS_RPM:
        trajectory = run(speed, friction)
        for repeat in range(REPEATS):
            columns = {"t": trajectory.t[:: TICK if late == "all" else 1]}
            for channel, signal in CHANNELS.items():
                values = trajectory[signal]
                if late == "all":
                    values = logged(values)
                elif late == "output" and channel == "load_angle":
                    values = slow(values)
                columns[channel] = values + NOISE[channel] * random.normal(size=len(values))
            role = "heldout" if speed == HELD_OUT_RPM else "fit"
            name = f"{speed:g}rpm_{repeat}"
            parts.append(Part(name, columns, role, group=name, started_at_s=60.0 * len(parts), input="motor_torque"))
    defaults = {row.name: row.default for row in hdfast.params()}
    orders = list(range(1, 16))
    tight = {name: about(defaults[name], 0.1) for name in ("J_m", "J_l", "k1")}
    loose = {name: about(defaults[name], 0.5) for name in ("B_m", "B_l", "B_ml", "B_sp")}
    sections = {
        "title": "Bench of the article, simulated",
        "drive": {name: defaults[name] for name in ("ratio", "k3", "k5", "phi_max")} | tight | loose,
        "kinematic_error": {
            "orders": orders,
            "cos": [defaults[f"te_cos_{order}"] for order in orders],
            "sin": [defaults[f"te_sin_{order}"] for order in orders],
            "sigma": 1e-6,
        },
        "sensors": {channel: {"noise": size} for channel, size in NOISE.items()},
    }
    return write_campaign(folder, sections, parts)
