"""The sensors of a virtual bench, and the recordings made through them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from hdfast import checks
from hdfast.checks import Floats
from hdfast.drive_file import Effect
from hdfast.recordings import Recording
from hdfast.sensors import SensorFacts, SensorStage, encoder, stage_of

SENSORS = {
    "motor_angle": encoder(17),
    "load_angle": encoder(20, noise=1e-6),
    "motor_torque": SensorFacts(noise=2e-3),
    "load_torque": SensorFacts(noise=0.05),
    "output_torque": SensorFacts(noise=0.05),
}


def rig(rate: float = 1000.0, *, effects: Iterable[Effect] = (), **channels: SensorFacts) -> SensorStage:
    """The sensors of a bench: a 17-bit encoder on the motor, a 20-bit encoder on the load and torque cells.

    Args:
        rate: readings per second [Hz], at most 1e6.
        effects: further effects, as a file declares them in `[[terms]]`.
        channels: facts in place of the default ones; `SensorFacts()` is a perfect sensor.
    """
    return stage_of({**SENSORS, **channels}, effects, rate=checks.positive("rate", rate, 1e6, "Hz"))


def record(
    sensors: SensorStage,
    name: str,
    t: Floats,
    signals: Mapping[str, Floats],
    seed: int | Sequence[int],
    at: Floats | None = None,
) -> Recording:
    """A recording of signals, drawn from a seed; the steps of a sensor fall at random.

    Args:
        sensors: what the signals pass.
        name: of the recording.
        t: times of the signals [s], (n,); `SensorStage.grid` tells those that the sensors need.
        signals: by channel, (n,).
        seed: of noise and encoder positions.
        at: times of the readings [s], (k,); default t.
    """
    at = t if at is None else at
    drawn = sensors.drawn(seed)
    return Recording(name, {"t": at, **drawn.apply(t, signals, at=at)}, drawn.resolution)
