"""What a campaign says of the rig: its sensors and its controller."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

from hdfast import checks
from hdfast.errors import InputError, choose, shorten
from hdfast.recordings.columns import COLUMNS
from hdfast.sections import Sections

CHANNELS = tuple(name for name in COLUMNS if name != "t")
CONTROLLERS = ("pi",)


@dataclass(frozen=True)
class SensorFacts:
    """What is stated of one channel; None where nothing is.

    Attributes:
        resolution: smallest step, in the unit of the channel.
        noise: standard deviation, in the unit of the channel.
        lowpass_hz: corner of a first-order filter [Hz].
        delay_s: lag of the channel [s].
        averaged: each value is the mean over the time since the one before.
        mounted_on: the body that carries the sensor.
    """

    resolution: float | None = None
    noise: float | None = None
    lowpass_hz: float | None = None
    delay_s: float | None = None
    averaged: bool | None = None
    mounted_on: str | None = None


@dataclass(frozen=True)
class Controller:
    """The speed controller of the motor, tau = kp e + ki integral of e within +-limit.

    Attributes:
        kind: "pi".
        kp: proportional gain [N m s/rad].
        ki: integral gain [N m/rad].
        limit: torque limit [N m].
        period: time between two outputs [s]; 0 is continuous.
    """

    kind: str
    kp: float
    ki: float = 0.0
    limit: float = math.inf
    period: float = 0.0


def read_sensors(file: Sections) -> dict[str, SensorFacts]:
    """Read [sensors]: facts by channel."""
    section = file.section("sensors")
    file.known(("sensors",), section, CHANNELS)
    found = {}
    for channel, entry in section.items():
        path = ("sensors", channel)
        given = file.table(path, entry)
        file.known(path, given, [item.name for item in fields(SensorFacts)])
        found[channel] = SensorFacts(
            **{key: file.guard((*path, key), _fact, channel, key, value) for key, value in given.items()}
        )
    return found


def _fact(channel: str, key: str, value: Any) -> float | bool | str:
    name = f"sensors.{channel}.{key}"
    if key == "averaged":
        if not isinstance(value, bool):
            raise InputError(f"{name} = {shorten(value)} is not true or false")
        return value
    if key == "mounted_on":
        if not isinstance(value, str):
            raise InputError(f"{name} = {shorten(value)} is not text")
        return value
    return checks.positive(name, value) if key == "lowpass_hz" else checks.finite(name, value, 0.0)


def read_controller(file: Sections) -> Controller | None:
    """Read [controller]; None when the file has none."""
    section = file.section("controller")
    if not section:
        return None
    path = ("controller",)
    file.known(path, section, [item.name for item in fields(Controller)])
    for key in ("kind", "kp"):
        if key not in section:
            raise file.error(path, f"[controller] needs the key {key!r}")
    kind = file.guard((*path, "kind"), choose, "kind", section["kind"], CONTROLLERS)
    gains = {
        key: file.guard((*path, key), checks.number, key, value, 0.0, math.inf if key == "limit" else 1e9)
        for key, value in section.items()
        if key != "kind"
    }
    return Controller(kind, **gains)
