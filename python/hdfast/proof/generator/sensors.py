"""The sensor chain: faults, noise, quantisation, averaging, sampling with jitter, lost samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.random import Generator

from hdfast.proof.generator import noise as noises
from hdfast.proof.generator.noise import Noise
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.stepping import GRID, TRACES


class Faults(NamedTuple):
    """What the sensors get wrong beyond noise; all zero when sound."""

    eccentricity: float = 0.0  # of the load encoder [rad]
    eccentricity_phase: float = 0.0
    lowpass: float = 0.0  # time constant in the load-side channels [s]
    delay: float = 0.0  # of the load-side channels against the motor side [s]
    torque_delay: float = 0.0  # of the drive: the shaft feels the recorded torque this much later [s]
    skew: float = 0.0  # of the load-side clock against the motor-side clock [-]
    scale: float = 0.0  # relative error of the load encoder's scale [-]
    drift: float = 0.0  # of the torque reading [N m/s]


SOUND = Faults()
CHANNELS = ("motor_angle", "load_angle", "motor_torque", "output_torque")


class Chain(NamedTuple):
    """How a rig samples.

    Attributes:
        rate: samples per second [1/s].
        averaged: True when a sample is the mean over its interval.
        jitter: standard deviation of the sampling instant as a share of the interval.
        dropped: share of lost samples.
        skew: error of the common clock [-].
        resolution: step of each of `CHANNELS`: motor and load encoder [rad], motor and output torque [N m].
        noise: of each of `CHANNELS`.
    """

    rate: float
    averaged: bool
    jitter: float
    dropped: float
    skew: float
    resolution: tuple[float, ...]
    noise: tuple[Noise, ...]

    def noisier(self, factor: float) -> Chain:
        """The same chain with noise and steps times `factor`."""
        noise = tuple(Noise(n.white * factor, n.pink * factor, n.corner) for n in self.noise)
        return self._replace(noise=noise, resolution=tuple(step * factor for step in self.resolution))


def clean(traces: Array, faults: Faults, step: float = GRID) -> dict[str, Array]:
    """The four channels without noise, faults included; `traces` as of `stepping.run`, `step` [s] apart."""
    named = dict(zip(TRACES, traces, strict=True))
    t = np.arange(traces.shape[1]) * step
    load, output, torque = named["load_angle"], named["output_torque"], named["motor_torque"]
    late = faults.delay - faults.skew * t
    if faults.delay != 0.0 or faults.skew != 0.0:
        load = np.interp(t - late, t, load)
        output = np.interp(t - late, t, output)
    if faults.torque_delay != 0.0:
        torque = np.interp(t + faults.torque_delay, t, torque)
    if faults.lowpass > 0.0:
        share = step / (faults.lowpass + step)
        load = _lag(load, share)
        output = _lag(output, share)
    load = load * (1.0 + faults.scale) + faults.eccentricity * np.sin(load + faults.eccentricity_phase)
    return {
        "motor_angle": named["motor_angle"],
        "motor_torque": torque + faults.drift * (t - t.mean()),
        "load_angle": load,
        "output_torque": output,
    }


def _lag(x: Array, share: float) -> Array:
    out, _ = scipy.signal.lfilter([share], [1.0, share - 1.0], x, zi=[(1.0 - share) * x[0]])
    return np.asarray(out)


def disturb(channels: dict[str, Array], chain: Chain, rng: Generator) -> dict[str, Array]:
    """Noise and quantisation on the grid."""
    out = {}
    for name, step, noise in zip(CHANNELS, chain.resolution, chain.noise, strict=True):
        noisy = channels[name] + noises.draw(noise, rng, channels[name].size, GRID)
        out[name] = step * np.round(noisy / step) if step > 0.0 else noisy
    return out


def sample(grid: dict[str, Array], chain: Chain, rng: Generator) -> dict[str, Array]:
    """Sampled columns with their times; averages are stamped at the middle of their interval."""
    count = next(iter(grid.values())).size
    t = np.arange(count) * GRID
    width = max(round(1.0 / (chain.rate * GRID)), 1)
    instants = np.arange(1.0, (count - 1) * GRID * chain.rate - 1.0) / chain.rate
    jittered = instants + chain.jitter / chain.rate * np.clip(rng.standard_normal(instants.size), -3, 3)
    keep = rng.random(instants.size) >= chain.dropped
    out = {"t": (jittered * (1.0 + chain.skew))[keep]}
    for name, values in grid.items():
        smooth = scipy.ndimage.uniform_filter1d(values, width) if chain.averaged else values
        out[name] = np.interp(jittered, t, smooth)[keep]
    return out


def recorded_noise(chain: Chain, rng: Generator, seconds: float = 4.0) -> dict[str, float]:
    """Standard deviation of each channel's noise in the recorded samples, quantisation of a moving shaft included."""
    count = round(seconds / GRID)
    still = dict.fromkeys(CHANNELS, np.zeros(count))
    step = dict(zip(CHANNELS, chain.resolution, strict=True))
    noisy = disturb(still, chain._replace(resolution=(0.0, 0.0, 0.0, 0.0)), rng)
    rounded = {name: values + step[name] * (rng.random(count) - 0.5) for name, values in noisy.items()}
    columns = sample(rounded, chain, rng)
    return {name: float(np.std(columns[name])) for name in CHANNELS}
