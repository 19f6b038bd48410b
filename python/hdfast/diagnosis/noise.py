"""Noise of the compared channels: what the sensors state, or what the recordings show at their highest frequencies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.band import Band
from hdfast.diagnosis.source import Source
from hdfast.recordings.clock import period
from hdfast.sensors import SensorFacts

COLUMNS = ("motor_angle", "load_angle", "motor_torque", "output_torque")


def as_coarse(sensors: Mapping[str, SensorFacts], sources: Sequence[Source]) -> dict[str, SensorFacts]:
    """What is stated of the sensors, with the step that recordings show where it is the larger one."""
    return {
        name: replace(facts, resolution=max(facts.resolution or 0.0, *(one.steps.get(name, 0.0) for one in sources)))
        for name, facts in sensors.items()
    }


def floors(
    sources: Sequence[Source],
    channels: Sequence[str],
    band: Band,
    sensors: Mapping[str, SensorFacts],
    ratio: float,
    inertia: float,
) -> Floats:
    """Standard deviation of the noise of each channel in the working band, in the channel's unit, shape (C,).

    What the motor angle's noise brings into the torque is not taken for more than the torque varies: with an inertia
    that is known too large all of it would be noise.
    """
    seen = {column: _of(column, sources, sensors) for column in COLUMNS}
    rates = {column: _rate(column, sources) for column in COLUMNS}
    rates["te"] = min(rates["motor_angle"], rates["load_angle"])
    share = {channel: math.sqrt(min(1.0, 2.0 * band.of(channel) / rates[channel])) for channel in channels}
    moved = math.sqrt(min(1.0, 2.0 * band.motion / rates["motor_angle"]) / 5.0)
    inertial = inertia * seen["motor_angle"] * (2.0 * math.pi * band.motion) ** 2 * moved
    of_a_sample = _by_channel(seen, ratio)
    found = {channel: share[channel] * of_a_sample[channel] for channel in channels}
    varied = max(float(np.nanstd(source.recording["motor_torque"])) for source in sources)
    found["motor_torque"] = math.hypot(found["motor_torque"], min(inertial, varied))
    return np.array([found[channel] for channel in channels])


def stated(channels: Sequence[str], sensors: Mapping[str, SensorFacts], ratio: float, floor: Floats) -> Floats:
    """Standard deviation of the noise that the sensors state for each channel, not below the floor, shape (C,).

    Noise that falls with frequency is larger in the band than its highest frequencies show.
    """
    of_a_sample = _by_channel({column: sensors.get(column, SensorFacts()).deviation for column in COLUMNS}, ratio)
    return np.maximum(floor, [of_a_sample[channel] for channel in channels])


def _by_channel(noise: Mapping[str, float], ratio: float) -> dict[str, float]:
    """Noise of one sample of each compared channel, from that of the columns."""
    return {
        "motor_torque": noise["motor_torque"],
        "te": math.hypot(noise["motor_angle"] / ratio, noise["load_angle"]),
        "output_torque": noise["output_torque"],
    }


def _of(column: str, sources: Sequence[Source], sensors: Mapping[str, SensorFacts]) -> float:
    """Noise of one sample of a column: as stated or as its third differences show, whichever is less, 0 without any.

    What moves fast need not be noise, and what is stated may be a bound. Where nothing is stated and most third
    differences are 0, a sensor is so coarse that its step alone shows.
    """
    own = [source for source in sources if column in source.recording]
    if not own:
        return 0.0
    said = sensors.get(column, SensorFacts()).deviation
    shown = float(np.median([_white(source.numbers(column)[1]) for source in own]))
    coarse = SensorFacts(resolution=max(source.steps.get(column, 0.0) for source in own)).deviation
    return min(said, shown) if said > 0.0 and shown > 0.0 else max(said, shown) or coarse


def _rate(column: str, sources: Sequence[Source]) -> float:
    """Numbers per second of a column, median over the recordings that have it; infinite where none has."""
    clocks = [source.numbers(column)[0] for source in sources if column in source.recording]
    rates = [1.0 / period(t) for t in clocks if len(t) > 1]
    return float(np.median(rates)) if rates else math.inf


def _white(values: Floats) -> float:
    """Robust noise of a smooth signal from its third differences."""
    third = np.diff(values, 3)
    return 1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0) if len(third) else 0.0
