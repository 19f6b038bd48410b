"""Recordings made ready for replay: one clock, one band, and the samples that may be judged."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.interpolate import CubicSpline
from scipy.sparse import csr_array

from hdfast.checks import Floats
from hdfast.diagnosis.reading import reading
from hdfast.recordings.clock import period
from hdfast.scenario import Scenario

Mask = NDArray[np.bool_]

HIGHEST_RATE, CLOCK = 500.0, 0.01
FINE, PER_PERIOD = 4, 12.0
MOST_SAMPLES = 40_000
PASS_SHARE = 0.4
NARROWEST = 0.05
NOISE_SHARE = 0.01
DROWNED = 4.0
SLOW_SHARE, QUIET_SHARE = 0.5, 0.25
TOP_SHARES = (0.75, 0.95)
SEGMENT = 256
SHORTEST = 32
LEAD_IN = 0.25
AT_REST, RESTING = 0.02, 0.02
SLOWEST_SHARE, SLOWEST = 0.005, 1e-9
MARGIN, REVERSED = 3.0, 1.5
CONSTANT = 1e-9


@dataclass(frozen=True)
class Band:
    """Working rate, and what recorded and simulated signals alike lose to zero-phase low-passes.

    Attributes:
        rate: working rate [Hz].
        motion: corner for the motion that is replayed and for the motor torque [Hz]; a torque takes two derivatives of
            the angle, so that the angle's noise sets it.
        sensed: corner for what the load's sensors show [Hz].
    """

    rate: float
    motion: float
    sensed: float

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

    def smooth(self, values: Floats, channel: str = "motor_torque") -> Floats:
        """Equally spaced values (..., n) of a channel at the working rate through its low-pass."""
        corner = self.of(channel)
        return values if corner >= PASS_SHARE * self.rate else _passed(values, corner, self.rate)

    def simulated(self, values: Floats, density: int) -> Floats:
        """Simulated torques (..., density (n - 1) + 1) through the motion's low-pass, at the working rate (..., n)."""
        whole = self.motion >= PASS_SHARE * self.rate
        passed = values if whole else _passed(values, self.motion, density * self.rate)
        return passed[..., ::density]

    def reversing(self, t: Floats, speed: Floats, slowest: float) -> Floats:
        """Rate of the direction of motion [1/s], (n,), uncertain when slow, from speeds `density` times as dense."""
        direction = self.simulated(np.clip(speed / max(slowest, SLOWEST), -1.0, 1.0), self.density)
        return np.asarray(np.gradient(direction, t))

    def slow(self, values: Floats) -> Floats:
        """Their slow part: motion rather than noise."""
        return _passed(values, SLOW_SHARE * self.motion, self.rate)

    def quiet(self, values: Floats) -> Floats:
        """The part of a torque so slow that a filter or a gain has no noise of the angle to win by removing."""
        return _passed(values, QUIET_SHARE * self.motion, self.rate)


@dataclass(frozen=True, eq=False)
class Unit:
    """One recording at the working rate.

    Attributes:
        name: file name.
        role: "fit" or "heldout".
        group: label shared by recordings of one rig, day and temperature.
        offset: time of the first sample in the recording [s].
        t: times from 0 on [s], shape (n,).
        angle, speed, acceleration: smoothed motor motion [rad, rad/s, rad/s^2], shape (n,).
        turned: motor angle over the ratio [rad], shape (n,).
        reversing: rate of the direction of motion, which is 1 or -1, in the band of the motor torque [1/s], shape (n,).
        measured: what is compared, by channel: motor_torque [N m], te [rad], output_torque [N m], each (n,).
        beyond: motor torque above the band of the motion [N m], which no replay explains, shape (n,).
        judged: which samples of a channel count, each (n,).
        command: motor torque on which the actuator acts [N m], shape (n,).
        load_torque: external torque on the load [N m], shape (n,).
        scenario: the prescribed motion with the recorded torques.
        density: how many times as dense as its samples it is simulated.
        reading: from there to what the load's sensors recorded, by their own times, (n, density (n - 1) + 1); None
            where the working rate is far below the recorder's, or its clock even.
    """

    name: str
    role: str
    group: str
    offset: float
    t: Floats = field(repr=False)
    angle: Floats = field(repr=False)
    turned: Floats = field(repr=False)
    reversing: Floats = field(repr=False)
    speed: Floats = field(repr=False)
    acceleration: Floats = field(repr=False)
    measured: Mapping[str, Floats] = field(repr=False)
    beyond: Floats = field(repr=False)
    judged: Mapping[str, Mask] = field(repr=False)
    command: Floats = field(repr=False)
    load_torque: Floats = field(repr=False)
    temperature: Floats | None = field(repr=False)
    scenario: Scenario = field(repr=False)
    density: int
    reading: csr_array | None = field(default=None, repr=False)

    @property
    def fine(self) -> Floats:
        """Times at which it is simulated [s], shape (density (n - 1) + 1,)."""
        return denser(self.t, self.density)

    def read(self, values: Floats) -> Floats:
        """What the load's sensors show, (M, n), of simulated values (M, density (n - 1) + 1)."""
        return values[:, :: self.density] if self.reading is None else np.ascontiguousarray((self.reading @ values.T).T)

    def thinned(self, stride: int) -> Unit:
        """Every so many samples of the same recording, to be looked at."""
        arrays: dict[str, Any] = {
            name: value[::stride] for name, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        measured = {channel: values[::stride] for channel, values in self.measured.items()}
        judged = {channel: mask[::stride] for channel, mask in self.judged.items()}
        return replace(self, **arrays, measured=measured, judged=judged)

    def seen_on(self, channels: Sequence[str]) -> Unit:
        """The same recording with no other channels to compare."""
        measured = {channel: values for channel, values in self.measured.items() if channel in channels}
        judged = {channel: mask for channel, mask in self.judged.items() if channel in channels}
        return replace(self, measured=measured, judged=judged)

    def commanded(self, command: Floats) -> Unit:
        """The same recording with another torque before the actuator [N m], shape (n,)."""
        return replace(self, command=command, scenario=imposed(self.t, self.angle, command, self.load_torque))


@dataclass(frozen=True)
class Source:
    """Columns of a recording, its part in the campaign, and the samples that health checks left usable.

    Attributes:
        name: file name.
        recording: columns by name.
        role: "fit" or "heldout".
        group: label shared by recordings of one rig, day and temperature.
        good: which samples are usable.
        news: new values per second of a column that holds its values for several samples, the slowest; else infinite.
    """

    name: str
    recording: Mapping[str, Floats]
    role: str
    group: str
    good: Mask
    news: float = math.inf

    @property
    def rate(self) -> float:
        """How many samples per second say something new [Hz]."""
        return min(1.0 / period(self.recording["t"]), self.news)


def fitted(sources: Sequence[Source]) -> list[Source]:
    """Those that are not held out."""
    return [source for source in sources if source.role == "fit"]


def choose_band(sources: Sequence[Source], inertia: float) -> Band:
    """The widest band of motion in which the angle's noise disturbs the inertia torque by less than its share.

    Where that disturbance is below the torque's own noise it costs nothing, whatever its share; the band ends where it
    would drown that noise: beyond, a smaller inertia would always seem better. Noise is that of the resolution, or what
    a signal shows near the top of its spectrum, where nothing moves. The slowest clock, or the slowest column that
    holds its values, sets the rate of all; what is fitted the rest.

    Args:
        sources: recordings of the campaign.
        inertia: total inertia at the motor [kg m^2].
    """
    rate = min(source.rate for source in sources)
    sources = fitted(sources)
    total = sum(float(np.ptp(source.recording["t"])) for source in sources)
    working = rate / max(1, math.ceil(max(rate / HIGHEST_RATE, rate * total / MOST_SAMPLES) - CLOCK))
    torque = float(np.median([np.nanstd(source.recording["motor_torque"]) for source in sources]))
    noise = {
        name: max(_noise(source.recording["t"], source.recording[name]) for source in sources)
        for name in ("motor_angle", "motor_torque")
    }
    inertial = max(noise["motor_angle"], 1e-300) * (2.0 * math.pi) ** 4 * max(inertia, 1e-12) ** 2
    disturbed = (5.0 * (NOISE_SHARE * torque) ** 2 / inertial) ** 0.2
    level = (noise["motor_torque"] / inertial) ** 0.25
    corner = min(max(disturbed, level), math.sqrt(DROWNED) * level)
    widest = PASS_SHARE * working
    return Band(float(working), float(min(widest, max(corner, NARROWEST * working))), float(widest))


def _noise(clock: Floats, values: Floats) -> float:
    """Power density of the noise of samples (n,) [square of their unit per Hz]."""
    known = np.isfinite(values)
    t, own = clock[known], values[known]
    step = period(t)
    quantised = _step(own) ** 2 / 12.0 * 2.0 * step
    if len(t) < SEGMENT:
        return quantised
    even = np.interp(np.arange(t[0], t[-1], step), t, own)
    frequency, power = signal.welch(np.diff(even, 2), 1.0 / step, nperseg=SEGMENT, average="median")
    top = (frequency > TOP_SHARES[0] * 0.5 / step) & (frequency < TOP_SHARES[1] * 0.5 / step)
    differences = (2.0 * np.sin(np.pi * frequency[top] * step)) ** 4
    return max(quantised, float(np.median(power[top] / differences)))


def prepare(source: Source, band: Band, ratio: float) -> Unit:
    """Bring a recording to the working rate.

    Args:
        source: the recording; `motor_angle` and `motor_torque` are needed.
        band: working rate and low-pass.
        ratio: reduction ratio, for the transmission error.
    """
    recording = source.recording
    clock = recording["t"] - recording["t"][0]
    step = period(clock)
    fine = np.arange(0.0, clock[-1] + 0.5 * step, step)
    rate = 1.0 / step
    stride = max(1, round(rate / band.rate))
    alike = abs(rate / (stride * band.rate) - 1.0) <= CLOCK
    t = fine[::stride] if alike else np.arange(0.0, fine[-1], 1.0 / band.rate)

    def bring(values: Floats, corner: float = band.motion) -> Floats:
        known = np.isfinite(values)
        even = np.interp(fine, clock[known], values[known])
        if corner < (1.0 - CLOCK) * PASS_SHARE * rate:
            even = _passed(even, corner, rate)
        return np.ascontiguousarray(even[::stride] if alike else np.interp(t, fine, even))

    angle = bring(recording["motor_angle"])
    spline = CubicSpline(t, angle)
    speed, acceleration = spline(t, 1), spline(t, 2)
    measured = {"motor_torque": bring(recording["motor_torque"])}
    if "load_angle" in recording:
        measured["te"] = bring(recording["motor_angle"] / ratio - recording["load_angle"], band.of("te"))
    if "output_torque" in recording:
        measured["output_torque"] = bring(recording["output_torque"], band.of("output_torque"))
    load = bring(recording["load_torque"]) if "load_torque" in recording else np.zeros_like(t)
    command = band.quiet(measured["motor_torque"])
    jittery = stride == 1 and _uneven(clock, step)
    density = FINE if jittery else band.density
    usable = _usable(source.good, clock, t, band)
    slowest = _slowest(clock, recording["motor_angle"], speed, band)
    turning = np.diff(np.sign(speed), prepend=np.sign(speed[0]), append=np.sign(speed[-1])) != 0.0
    moving = (np.abs(speed) > slowest) & ~turning[1:] & ~turning[:-1]
    judged = {"motor_torque": usable & _eroded(moving, round(REVERSED * band.rate / band.motion))}
    resting = bool(np.all(np.abs(speed[t <= AT_REST]) <= min(slowest, RESTING * np.max(np.abs(speed)))))
    settled = resting | (t >= min(LEAD_IN, 0.1 * t[-1]))
    for channel, column in (("te", "load_angle"), ("output_torque", "output_torque")):
        if channel in measured:
            judged[channel] = settled & _usable(source.good & np.isfinite(recording[column]), clock, t, band)
    judged = {channel: mask & _varies(measured[channel]) for channel, mask in judged.items()}
    return Unit(
        name=source.name,
        role=source.role,
        group=source.group,
        offset=float(recording["t"][0]),
        t=t,
        angle=angle,
        turned=angle / ratio,
        reversing=band.reversing(t, spline(denser(t, band.density), 1), slowest),
        speed=speed,
        acceleration=acceleration,
        measured={channel: band.smooth(values, channel) for channel, values in measured.items()},
        beyond=bring(recording["motor_torque"], band.sensed) - measured["motor_torque"],
        command=command,
        judged=judged,
        load_torque=load,
        temperature=bring(recording["temperature"]) if "temperature" in recording else None,
        scenario=imposed(t, angle, command, load),
        density=density,
        reading=reading(denser(t, density), clock, t) if jittery else None,
    )


def _uneven(clock: Floats, step: float) -> bool:
    """Whether a clock (n,) leaves its period by more than it may."""
    return bool(np.max(np.abs(clock - step * np.rint(clock / step))) > CLOCK * step)


def denser(t: Floats, density: int) -> Floats:
    """Times so many times as dense as (n,) equally spaced ones: (density (n - 1) + 1,)."""
    return np.linspace(t[0], t[-1], density * (len(t) - 1) + 1)


def imposed(t: Floats, angle: Floats, command: Floats, load: Floats) -> Scenario:
    """The prescribed motion (n,) [s, rad] with the torques asked of the drive and put on the load (n,) [N m]."""
    replayed = {"t": t, "motor_angle": angle, "motor_torque": command, "load_torque": load}
    return Scenario.replay(replayed, input="motor_motion")


def _passed(values: Floats, corner: float, rate: float) -> Floats:
    """Zero-phase low-pass of (..., n); too short a series as it is."""
    if values.shape[-1] < SHORTEST:
        return values
    filtered: Floats = signal.sosfiltfilt(_sections(corner, rate), values, axis=-1)
    return filtered


@lru_cache(maxsize=32)
def _sections(corner: float, rate: float) -> Floats:
    """Second-order sections of the low-pass."""
    return np.asarray(signal.butter(4, corner, fs=rate, output="sos"))


def _step(values: Floats) -> float:
    """Smallest non-zero increment."""
    increments = np.abs(np.diff(values[np.isfinite(values)]))
    return float(np.min(increments[increments > 0.0], initial=np.inf)) if np.any(increments > 0.0) else 0.0


def _slowest(clock: Floats, angle: Floats, speed: Floats, band: Band) -> float:
    """Speed below which the direction of motion is not certain [rad/s]."""
    noise = 2.0 * math.pi * math.sqrt(_noise(clock, angle) * band.motion**3 / 3.0)
    return max(3.0 * noise, SLOWEST_SHARE * float(np.max(np.abs(speed))))


def _eroded(mask: Mask, width: int) -> Mask:
    """`mask` without the samples closer than `width` to a gap in it."""
    outside: Floats = np.convolve(~mask, np.ones(2 * width + 1))[width : width + len(mask)]
    inside: Mask = outside < 0.5
    return inside


def _varies(values: Floats) -> bool:
    """Whether a channel is not dead."""
    return bool(np.ptp(values) > CONSTANT * np.max(np.abs(values)))


def _usable(good: Mask, clock: Floats, t: Floats, band: Band) -> Mask:
    """Times (n,) away from gaps of a clock (m,), from its samples that are not good (m,), and from both ends."""
    margin = MARGIN / band.motion
    spans = np.diff(clock)
    wide = np.flatnonzero(spans > 1.5 * np.median(spans) + 1.0 / band.rate)
    bad = [(clock[i], clock[i + 1]) for i in wide] + [(time, time) for time in clock[~good]]
    usable: Mask = (t >= margin) & (t <= t[-1] - margin)
    for begin, end in bad:
        usable &= (t < begin - margin) | (t > end + margin)
    return usable
