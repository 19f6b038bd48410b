"""The sensor chain: what a bench would have written down."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.recordings import Recording


@dataclass(frozen=True)
class Sensor:
    """One channel: y = q round((x(t - delay) + noise) / q).

    Attributes:
        resolution: smallest step q in the unit of the channel, 0 for none.
        noise: standard deviation before rounding, in the unit of the channel.
        delay: lag of the channel [s].
    """

    resolution: float = 0.0
    noise: float = 0.0
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name in ("resolution", "noise", "delay"):
            checks.finite(name, getattr(self, name), 0.0)


def encoder(bits: int, noise: float = 0.0, delay: float = 0.0) -> Sensor:
    """An angle sensor with 2^bits steps per revolution of its shaft; noise [rad], delay [s]."""
    return Sensor(2.0 * math.pi / 2 ** checks.whole("bits", bits, 1, 40), noise, delay)


MOTOR_ENCODER, LOAD_ENCODER = encoder(17), encoder(20, noise=1e-6)


@dataclass(frozen=True)
class SensorChain:
    """Every channel of a bench and the common sampling rate [Hz].

    The defaults are a 17-bit encoder on the motor, a 20-bit encoder on the load, torque cells and 1 kHz.
    """

    rate: float = 1000.0
    motor_angle: Sensor = MOTOR_ENCODER
    load_angle: Sensor = LOAD_ENCODER
    motor_torque: Sensor = Sensor(noise=2e-3)
    load_torque: Sensor = Sensor(noise=0.05)
    output_torque: Sensor = Sensor(noise=0.05)

    def __post_init__(self) -> None:
        checks.positive("rate", self.rate, 1e6, "Hz")

    def times(self, end: float) -> Floats:
        """Sample times from 0 to `end` [s]."""
        return np.arange(math.floor(end * self.rate * (1.0 + 1e-12)) + 1) / self.rate

    def sensor(self, column: str) -> Sensor:
        """The sensor of a column; columns without one are recorded as they are."""
        found = getattr(self, column, None)
        return found if isinstance(found, Sensor) else Sensor()

    def record(self, name: str, t: Floats, signals: Mapping[str, Floats], seed: int | list[int]) -> Recording:
        """Sample the signals, given (n,) at the times t [s], through the sensors.

        The steps of a sensor fall at random, so that no test depends on them; its zero is exact.
        """
        rng = np.random.default_rng(seed)
        columns = {"t": t}
        for column, values in signals.items():
            sensor = self.sensor(column)
            seen = np.interp(t - sensor.delay, t, values) if sensor.delay else np.asarray(values, dtype=np.float64)
            offset = float(rng.uniform(0.0, 1.0)) * sensor.resolution
            if sensor.noise:
                seen = seen + sensor.noise * rng.standard_normal(len(t))
            if sensor.resolution:
                seen = np.round((seen + offset) / sensor.resolution) * sensor.resolution - offset
            columns[column] = seen
        steps = {column: self.sensor(column).resolution for column in signals if self.sensor(column).resolution}
        return Recording(name, columns, steps)

    def describe(self, columns: list[str]) -> dict[str, dict[str, float]]:
        """The section [sensors] of a campaign file."""
        found = {}
        for column in columns:
            sensor = self.sensor(column)
            entry = {"resolution": sensor.resolution, "noise": sensor.noise, "delay_s": sensor.delay}
            kept = {key: value for key, value in entry.items() if value}
            if kept:
                found[column] = kept
        return found
