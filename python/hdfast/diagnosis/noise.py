"""Noise of the compared channels: what the sensors state, or what the recordings show at their highest frequencies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.prepare import Band, Source
from hdfast.sensors import SensorFacts


def floors(
    sources: Sequence[Source],
    channels: Sequence[str],
    band: Band,
    sensors: Mapping[str, SensorFacts],
    ratio: float,
    inertia: float,
) -> Floats:
    """Standard deviation of the noise of each channel in the working band, in the channel's unit, shape (C,)."""
    angle = _of("motor_angle", sources, sensors)
    rate = float(np.median([1.0 / np.median(np.diff(source.recording["t"])) for source in sources]))
    share = math.sqrt(min(1.0, 2.0 * band.corner / rate))
    moved = math.sqrt(min(1.0, 2.0 * band.corner / rate) / 5.0)
    inertial = inertia * angle * (2.0 * math.pi * band.corner) ** 2 * moved
    by_channel = {
        "motor_torque": math.hypot(share * _of("motor_torque", sources, sensors), inertial),
        "te": share * math.hypot(angle / ratio, _of("load_angle", sources, sensors)),
        "output_torque": share * _of("output_torque", sources, sensors),
    }
    return np.array([by_channel[channel] for channel in channels])


def _of(column: str, sources: Sequence[Source], sensors: Mapping[str, SensorFacts]) -> float:
    """Noise of one sample of a column: as stated, else as its third differences show."""
    seen = [_white(source.recording[column]) for source in sources if column in source.recording]
    if not seen:
        return 0.0
    facts = sensors.get(column)
    stated = math.hypot((facts.resolution or 0.0) / math.sqrt(12.0), facts.noise or 0.0) if facts else 0.0
    return stated if stated > 0.0 else float(np.median(seen))


def _white(values: Floats) -> float:
    """Robust noise of a smooth signal from its third differences."""
    third = np.diff(values[np.isfinite(values)], 3)
    return 1.4826 * float(np.median(np.abs(third))) / math.sqrt(20.0) if len(third) else 0.0
