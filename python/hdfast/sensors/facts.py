"""What a file states of its sensors, and the stage made of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from hdfast import checks
from hdfast.drive_file import Effect
from hdfast.errors import InputError, shorten
from hdfast.sections import Sections
from hdfast.sensors.channels import CHANNELS
from hdfast.sensors.stage import SensorStage

STATED = (*CHANNELS, "speed_reference", "temperature")
TURN = 2.0 * math.pi
KEYS = {
    "resolution": ("quantisation", "resolution"),
    "noise": ("sensor_noise", "noise"),
    "lowpass_hz": ("sensor_lowpass", "tau_s"),
    "delay_s": ("sensor_delay", "tau_y"),
    "averaged": ("sensor_averaging", "window_share"),
}


@dataclass(frozen=True)
class SensorFacts:
    """What is stated of one channel; None where nothing is.

    Attributes:
        resolution: smallest step, in the unit of the channel.
        noise: standard deviation, in the unit of the channel.
        lowpass_hz: corner of a first-order filter [Hz].
        delay_s: lag of the channel [s].
        averaged: each value is the mean over the usual (median) time between two of them.
        mounted_on: the body that carries the sensor.
    """

    resolution: float | None = None
    noise: float | None = None
    lowpass_hz: float | None = None
    delay_s: float | None = None
    averaged: bool | None = None
    mounted_on: str | None = None

    @property
    def deviation(self) -> float:
        """Standard deviation of a sample's noise, resolution included, in the unit of the channel; 0 for nothing."""
        return math.hypot((self.resolution or 0.0) / math.sqrt(12.0), self.noise or 0.0)


def encoder(bits: int, noise: float = 0.0, delay_s: float = 0.0) -> SensorFacts:
    """An angle sensor with 2^bits steps per revolution of its shaft; noise [rad], delay [s]."""
    return SensorFacts(TURN / 2 ** checks.whole("bits", bits, 1, 40), noise, delay_s=delay_s)


def read_sensors(file: Sections) -> dict[str, SensorFacts]:
    """Read [sensors]: facts by channel."""
    section = file.section("sensors")
    file.known(("sensors",), section, STATED)
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
        return checks.flag(name, value)
    if key == "mounted_on":
        if not isinstance(value, str):
            raise InputError(f"{name} = {shorten(value)} is not text")
        return value
    return checks.positive(name, value) if key == "lowpass_hz" else checks.finite(name, value, 0.0)


def stage_of(
    facts: Mapping[str, SensorFacts],
    effects: Iterable[Effect] = (),
    *,
    rate: float = 1000.0,
    seed: int = 0,
) -> SensorStage:
    """The stage of stated facts and declared effects; a declared effect takes the place of the fact it repeats.

    Args:
        facts: by channel.
        effects: as in `[[terms]]`; those without a channel are left out.
        rate: readings per second [Hz].
        seed: of noise and jitter.
    """
    values: dict[tuple[str, str], dict[str, float]] = {}
    for channel, entry in facts.items():
        for key, (effect, own) in KEYS.items():
            stated = getattr(entry, key)
            if stated and channel in CHANNELS:
                values[effect, channel] = {own: 1.0 / (TURN * stated) if key == "lowpass_hz" else float(stated)}
    for declared in effects:
        if declared.channel is not None:
            values[declared.effect, declared.channel] = dict(declared.values)
    named = {f"{c}_{e}_{own}": value for (e, c), given in values.items() for own, value in given.items()}
    return SensorStage(list(values), named, rate, seed)


def facts_of(stage: SensorStage) -> dict[str, dict[str, Any]]:
    """The section `[sensors]` of a stage: what a data sheet would say, and no more."""
    found: dict[str, dict[str, Any]] = {}
    for effect, channel in stage.effects:
        for key, (stated, own) in KEYS.items():
            value = stage.value(f"{channel}_{effect}_{own}") if stated == effect else 0.0
            # [sensors] has no word for a channel that is early, nor for means over a part of the time
            told = value == 1.0 if key == "averaged" else value > 0.0
            if told:
                written = {"lowpass_hz": 1.0 / (TURN * value), "averaged": True}.get(key, value)
                found.setdefault(channel, {})[key] = written
    return found
