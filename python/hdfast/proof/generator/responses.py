"""The channels of the linear statistics: torque, load angle and output torque of an imposed motion, and their noise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy
from numpy.random import Generator

from hdfast.proof.generator import sensors
from hdfast.proof.generator.effects import Drive
from hdfast.proof.generator.imposed import COARSE, SKIP, impose
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.stepping import RING, start_at_rest

RATE = 250.0
LOWPASS_ORDER = 4
SLOW = 0.1  # speed below which dry friction says nothing [rad/s]


@dataclass(frozen=True)
class Motion:
    """The true motion of one recording in steps of `COARSE`, (N,) each."""

    angle: Array
    speed: Array
    pull: Array
    load: Array
    temperature: Array


def channels(rig: Rig) -> tuple[str, ...]:
    """Channels of the linear statistics."""
    names = ["torque"]
    if not rig.motor_only:
        names.append("load_angle")
    if rig.has_output_torque:
        names.append("output_torque")
    return tuple(names)


def every(rig: Rig, most: float = RATE) -> int:
    """Steps of `COARSE` between two samples of the linear statistics."""
    return round(1.0 / (min(most, rig.chain.rate) * COARSE))


def sampled(rig: Rig, x: Array, most: float = RATE) -> Array:
    """What the recorded samples keep of a signal in steps of `COARSE`, aliases included, thinned to a rate [1/s]."""
    width = round(1.0 / (rig.chain.rate * COARSE))
    stride = every(rig, most)
    if not rig.chain.averaged:
        x = x[np.minimum(np.arange(x.size) // width * width + width // 2, x.size - 1)]
    whole = x[: x.size // stride * stride].reshape(-1, stride)
    return np.asarray(whole.mean(axis=1))


def told_by_motion(rig: Rig, torque: Array) -> Array:
    """The motor torque below half the recorder's rate: what acts faster moves the drive, and no sample tells of it."""
    if rig.chain.rate * COARSE >= 1.0:
        return torque
    return np.asarray(scipy.signal.sosfiltfilt(_lowpass(rig.chain.rate * COARSE), torque))


@cache
def _lowpass(corner: float) -> Array:
    """Second-order sections of the filter with this corner, as a share of half the rate."""
    return np.asarray(scipy.signal.butter(LOWPASS_ORDER, corner, output="sos"))


def inertial_torque(x: Array, inertia: float, step: float) -> Array:
    """Torque that an error of the motor angle looks like."""
    return np.asarray(inertia * np.gradient(np.gradient(x, step), step))


def responses(rig: Rig, drive: Drive, motions: list[Motion]) -> Iterator[list[Array]]:
    """Channels of each recording that this drive would show on the given motion, from its own balance at rest on."""
    for m in motions:
        start = start_at_rest(drive.plant, float(m.angle[0]), float(m.load[0]))[RING:]
        traces = impose(drive.plant, m.angle, m.speed, m.pull, m.load, m.temperature, start)
        clean = sensors.clean(traces, drive.faults, COARSE)
        clean["motor_torque"] = told_by_motion(rig, clean["motor_torque"])
        seen = {name: sampled(rig, x) for name, x in clean.items()}
        out = [seen["motor_torque"]]
        if not rig.motor_only:
            out.append(seen["load_angle"])
        if rig.has_output_torque:
            out.append(seen["output_torque"])
        yield out


def noises(rig: Rig, motions: list[Motion], rng: Generator, inertia: float) -> list[list[Array]]:
    """One realisation of the noise of the same channels; the motor encoder's reaches the torque through `inertia`."""
    out = []
    for m in motions:
        angle = np.repeat(m.angle, SKIP)
        still = np.zeros_like(angle)
        true = {
            "motor_angle": angle, "load_angle": angle / rig.plant.ratio, "motor_torque": still, "output_torque": still,
        }  # fmt: skip
        out.append(noise_of(rig, true, sensors.disturb(true, rig.chain, rng), inertia))
    return out


def noise_of(rig: Rig, true: dict[str, Array], seen: dict[str, Array], inertia: float) -> list[Array]:
    """Noise of the channels of one recording, from its signals on the grid."""
    off = {name: sampled(rig, halved(rig, noisy - true[name])) for name, noisy in seen.items()}
    row = [off["motor_torque"] - inertial_torque(off["motor_angle"], inertia, every(rig) * COARSE)]
    if not rig.motor_only:
        row.append(off["load_angle"] - off["motor_angle"] / rig.plant.ratio)
    if rig.has_output_torque:
        row.append(off["output_torque"])
    return row


def halved(rig: Rig, x: Array) -> Array:
    """A signal of the grid in steps of `COARSE`, as the chain samples."""
    x = x[: x.size // SKIP * SKIP]
    return np.asarray(x.reshape(-1, SKIP).mean(axis=1) if rig.chain.averaged else x[::SKIP])


def moving(rig: Rig, m: Motion) -> Array:
    """1 where the motor turns during a whole sample, else 0."""
    return np.asarray(sampled(rig, (np.abs(m.speed) > SLOW).astype(float)) >= 1.0, dtype=float)
