"""The channels of a recording that a sensor stands behind."""

from __future__ import annotations

from dataclasses import dataclass

ANGLES = ("motor_angle", "load_angle")
TORQUES = ("motor_torque", "output_torque", "load_torque")
ANY = (*ANGLES, *TORQUES)


@dataclass(frozen=True)
class Channel:
    """A column of a recording: its unit and the simulated signal behind it, empty where there is none."""

    name: str
    unit: str
    signal: str


CHANNELS = {
    channel.name: channel
    for channel in (
        Channel("motor_angle", "rad", "theta_m"),
        Channel("load_angle", "rad", "theta_l"),
        Channel("motor_torque", "N m", "tau_m"),
        Channel("output_torque", "N m", "gear_torque"),
        Channel("load_torque", "N m", ""),
    )
}
