"""How large an injected effect has to be to be seen: a matched filter in the spectrum of what the model leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.proof.bridge.injections import TURN, Injection, Shape
from hdfast.proof.bridge.machine import Machine, Recorded

DEVIATIONS = 4.5
NEIGHBOURS = 25
STILL, HALF = 0.02, 0.5


def detectable(machine: Machine, injection: Injection, shape: Shape) -> float:
    """Amplitude at which the part that a refit does not absorb stands `DEVIATIONS` above the noise; inf if none does.

    A line counts where the drive is slow enough for it to pass the band in which model and recordings are compared; one
    that passes it less than half of the time is hidden by sampling, not by the model. Absorbed are inertia, viscous and
    dry friction and an offset of the torque, an offset and a slope of other channels.
    """
    typical = injection.typical(machine)
    passed = [_passes(one, machine, shape) for one in machine.fitted]
    if np.mean(np.concatenate(passed)) < HALF:
        return np.inf
    changes = [
        injection.change(_quiet(one, injection.channel), typical, shape) * there
        for one, there in zip(machine.fitted, passed, strict=True)
    ]
    columns = np.concatenate([_absorbing(one, injection.channel) for one in machine.fitted])
    together = np.nan_to_num(np.concatenate(changes))
    left = together - columns @ np.linalg.lstsq(columns, together, rcond=None)[0]
    edges = np.cumsum([len(one.t) for one in machine.fitted])[:-1]
    power = [
        _signal_to_noise(part, one, injection.channel, machine.corner)
        for part, one in zip(np.split(left, edges), machine.fitted, strict=True)
    ]
    return DEVIATIONS * typical / float(np.sqrt(sum(power))) if any(power) else np.inf


def share(machine: Machine, injection: Injection, shape: Shape, amplitude: float) -> float:
    """Size of the change over the spread of the channel."""
    changes = [injection.change(one, amplitude, shape) for one in machine.fitted]
    spread = [float(np.nanstd(one.columns[injection.channel])) for one in machine.fitted]
    sizes = [float(np.nanstd(own)) for own in changes]
    return max(size / max(whole, 1e-300) for size, whole in zip(sizes, spread, strict=True))


def _quiet(one: Recorded, channel: str) -> Recorded:
    """The recording without what the model leaves of a channel: noise that is late or filtered is still noise."""
    return replace(one, columns={**one.columns, channel: one.columns[channel] - one.rest[channel]})


def _passes(one: Recorded, machine: Machine, shape: Shape) -> NDArray[np.bool_]:
    return np.asarray(shape.get("order", 0.0) * np.abs(one.speed) < TURN * machine.corner)


def _absorbing(one: Recorded, channel: str) -> Floats:
    if channel != "motor_torque":
        return np.stack([np.ones_like(one.t), one.angle], axis=1)
    direction = np.tanh(one.speed / max(STILL * float(np.abs(one.speed).max()), 1e-12))
    return np.stack([one.acceleration, one.speed, direction, np.ones_like(one.t)], axis=1)


def _signal_to_noise(signal: Floats, one: Recorded, channel: str, corner: float) -> float:
    """Sum of signal over noise power of a recording, in the band in which the model was compared."""
    step = float(np.median(np.diff(one.t)))
    band = np.fft.rfftfreq(len(signal), step)
    inside = (band > 0.0) & (band < (corner if channel == "motor_torque" else np.inf))
    noise = scipy.ndimage.uniform_filter1d(
        np.abs(np.fft.rfft(one.rest[channel] - one.rest[channel].mean())) ** 2, NEIGHBOURS
    )
    return 2.0 * float(np.sum(np.abs(np.fft.rfft(signal))[inside] ** 2 / noise[inside]))
