"""The band that all recordings of a campaign are compared in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.source import Source, fitted
from hdfast.health.steps import lattice
from hdfast.recordings.clock import period
from hdfast.sensors import SensorFacts

HIGHEST_RATE, CLOCK = 500.0, 0.01
FINE, PER_PERIOD = 4, 12.0
MOST_SAMPLES = 40_000
PASS_SHARE, WIDER = 0.4, 1.5
NARROWEST = 0.05
NOISE_SHARE = 0.01
DROWNED = 4.0
SLOW_SHARE, QUIET_SHARE = 0.5, 0.25
TOP_SHARES = (0.75, 0.95)
SEGMENT = 256
SHORTEST, STEEPNESS = 32, 8
#: Of the low-pass, in periods of its corner: what is farther away counts for less than 1e-12.
REACH = 12.0
SLOWEST = 1e-9


@dataclass(frozen=True)
class Band:
    """Working rate, and what recorded and simulated signals alike lose to zero-phase low-passes.

    Attributes:
        rate: working rate [Hz].
        motion: corner for the motor torque [Hz]; it takes two derivatives of the angle, whose noise sets it.
        sensed: corner for what the load's sensors show [Hz].
        angle_noise: power density of the motor angle's noise, median over the recordings [rad^2/Hz].
    """

    rate: float
    motion: float
    sensed: float
    angle_noise: float = 0.0

    def of(self, channel: str) -> float:
        """Corner of a compared channel [Hz]."""
        return self.motion if channel == "motor_torque" else self.sensed

    def stride(self, channel: str) -> int:
        """Every so many samples of a channel are as good as all of them."""
        return max(1, int(PASS_SHARE * self.rate / self.of(channel)))

    @property
    def density(self) -> int:
        """How many times as dense as the working rate a torque is simulated, up to `FINE`.

        Dry friction steps between two samples: at the working rate the step would fall on one of them.
        """
        return min(FINE, math.ceil(PER_PERIOD * self.motion / self.rate))

    @property
    def replayed(self) -> float:
        """Corner of the motion that is replayed [Hz]: what its torque loses is lost behind it, once as recorded."""
        return min(WIDER * self.motion, PASS_SHARE * self.rate)

    def smooth(self, values: Floats, channel: str) -> Floats:
        """Equally spaced values (..., n) of a channel at the working rate through its low-pass.

        What the load's sensors show passes whole where their band is the widest. A torque never does.
        """
        corner = self.of(channel)
        whole = channel != "motor_torque" and corner >= PASS_SHARE * self.rate
        return values if whole else low_pass(values, corner, self.rate)

    def simulated(self, values: Floats, density: int) -> Floats:
        """Simulated torques (..., density (n - 1) + 1) through the motion's low-pass, at the working rate (..., n).

        The torque that holds a drive to its recorded motion between the samples is not the one that was there: a line
        above half of the rate would be seen in the band, as large as no motor that gives way has it.
        """
        return low_pass(values, self.motion, density * self.rate, density)

    def sensed_of(self, values: Floats, density: int) -> Floats:
        """Simulated values (..., density (n - 1) + 1) through the low-pass of the load's sensors, (..., n)."""
        return low_pass(values, self.sensed, density * self.rate, density)

    def reversing(self, t: Floats, speed: Floats, slowest: float) -> Floats:
        """Rate of the direction of motion [1/s], (n,), uncertain when slow, from speeds `density` times as dense."""
        direction = self.simulated(np.clip(speed / max(slowest, SLOWEST), -1.0, 1.0), self.density)
        return np.asarray(np.gradient(direction, t))

    def slow(self, values: Floats) -> Floats:
        """Their slow part: motion rather than noise."""
        return low_pass(values, SLOW_SHARE * self.motion, self.rate)

    def quiet(self, values: Floats) -> Floats:
        """The part of a torque so slow that a filter or a gain has no noise of the angle to win by removing."""
        return low_pass(values, QUIET_SHARE * self.motion, self.rate)


def choose_band(sources: Sequence[Source], inertia: float, sensors: Mapping[str, SensorFacts]) -> Band:
    """The widest band of motion in which the angle's noise disturbs the inertia torque by less than its share.

    Where that disturbance is below the torque's own noise it costs nothing, whatever its share; the band ends where it
    would drown that noise: beyond, a smaller inertia would always seem better. Noise is that of the resolution, or what
    a signal shows near the top of its spectrum, and no more than is stated: with a slow clock drives move there as
    well. The slowest clock, or the slowest column that holds its values, sets the rate of all; what is fitted the rest.

    Args:
        sources: recordings of the campaign.
        inertia: total inertia at the motor [kg m^2].
        sensors: what is stated of them, by channel.
    """
    rate = min(source.rate for source in sources)
    sources = fitted(sources)
    total = sum(float(np.ptp(source.recording["t"])) for source in sources)
    working = rate / max(1, math.ceil(max(rate / HIGHEST_RATE, rate * total / MOST_SAMPLES) - CLOCK))
    torque = float(np.median([np.nanstd(source.recording["motor_torque"]) for source in sources]))
    densities = {
        name: [_density(name, source, sensors.get(name, SensorFacts())) for source in sources]
        for name in ("motor_angle", "motor_torque")
    }
    noise = {name: max(own) for name, own in densities.items()}
    inertial = max(noise["motor_angle"], 1e-300) * (2.0 * math.pi) ** 4 * max(inertia, 1e-12) ** 2
    disturbed = (5.0 * (NOISE_SHARE * torque) ** 2 / inertial) ** 0.2
    level = (noise["motor_torque"] / inertial) ** 0.25
    corner = min(max(disturbed, level), math.sqrt(DROWNED) * level)
    widest = PASS_SHARE * working
    motion = min(widest, max(corner, NARROWEST * working))
    return Band(float(working), float(motion), float(widest), float(np.median(densities["motor_angle"])))


def _density(name: str, source: Source, facts: SensorFacts) -> float:
    """Power density of the noise of a column [square of its unit per Hz], no more than a stated noise has."""
    t, values = source.numbers(name)
    shown = noise_density(t, values)
    return min(shown, 2.0 * period(t) * facts.deviation**2) if facts.noise else shown


def noise_density(clock: Floats, values: Floats) -> float:
    """Power density of the noise of samples (n,) [square of their unit per Hz]."""
    known = np.isfinite(values)
    t, own = clock[known], values[known]
    step = period(t)
    quantised = lattice(np.diff(own)) ** 2 / 12.0 * 2.0 * step
    if len(t) < SHORTEST:
        return quantised
    second = np.diff(np.interp(np.arange(t[0], t[-1], step), t, own), 2)
    length = min(SEGMENT, len(second))
    frequency, power = scipy.signal.welch(second, 1.0 / step, nperseg=length, average="median")
    top = (frequency > TOP_SHARES[0] * 0.5 / step) & (frequency < TOP_SHARES[1] * 0.5 / step)
    differences = (2.0 * np.sin(np.pi * frequency[top] * step)) ** 4
    return max(quantised, float(np.median(power[top] / differences)))


def low_pass(values: Floats, corner: float, rate: float, stride: int = 1) -> Floats:
    """Zero-phase low-pass of (..., n), the same at any rate; too short a series as it is.

    Beyond its ends a series goes on as its reflection in the end points, as far as the filter reaches, and to a length
    that is quickly transformed.

    Args:
        values: at equal distances.
        corner: frequency at which half of the amplitude is left [Hz].
        rate: of the values [Hz].
        stride: of the filtered values only every so many are wanted; divides n - 1.

    Returns:
        Filtered values (..., (n - 1) / stride + 1).
    """
    n = values.shape[-1]
    if n < SHORTEST:
        return values[..., ::stride]
    first, last = values[..., :1], values[..., -1:]
    line = first + (last - first) * np.linspace(0.0, 1.0, n)
    beyond = min(math.ceil(REACH * rate / corner), n - 2)
    quick = stride * scipy.fft.next_fast_len(math.ceil((n + 2 * beyond) / stride), real=True)
    length = min(2 * (n - 1), quick)
    own = np.zeros((*values.shape[:-1], length))
    np.subtract(values, line, out=own[..., :n])
    own[..., n : n + beyond] = -own[..., n - 2 : n - 2 - beyond : -1]
    own[..., length - beyond :] = -own[..., beyond:0:-1]
    passed = _thinned(_shares(rate / corner, length) * scipy.fft.rfft(own), length, stride)
    return np.asarray(line[..., ::stride] + scipy.fft.irfft(passed, length // stride)[..., : (n - 1) // stride + 1])


@lru_cache(maxsize=256)
def _shares(rate: float, length: int) -> Floats:
    """What the low-pass leaves of each frequency of as many values, (length // 2 + 1,); their rate in corners."""
    return 1.0 / (1.0 + (rate * np.arange(length // 2 + 1) / length) ** STEEPNESS)


def _thinned(spectrum: Floats, length: int, stride: int) -> Floats:
    """Spectrum of every so many of the values that a half spectrum (..., length // 2 + 1) is of."""
    part = length // stride
    kept = part // 2 + 1
    found = np.zeros((*spectrum.shape[:-1], kept), dtype=np.complex128)
    for turn in range(-(stride // 2), stride - stride // 2):
        at = abs(turn) * part
        if turn < 0:
            found += spectrum[..., at - kept + 1 : at + 1][..., ::-1].conj()
        else:
            found += spectrum[..., at : at + kept]
    return found / stride
