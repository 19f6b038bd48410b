"""Recordings made ready for replay: one clock, one band, and the samples that may be judged."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.angle_noise import another
from hdfast.diagnosis.band import CLOCK, FINE, SLOW_SHARE, Band, low_pass, noise_density
from hdfast.diagnosis.clocks import Clocks
from hdfast.diagnosis.reading import reading
from hdfast.diagnosis.source import Mask, Source
from hdfast.health.subject import REQUIRED
from hdfast.scenario import Scenario

LEAD_IN = 0.25
AT_REST, RESTING = 0.02, 0.02
SLOWEST_SHARE = 0.005
MARGIN, REVERSED = 3.0, 1.5
CONSTANT = 1e-9
FIRST = 8
SHAKES = 2
REPLAYED = (*REQUIRED, "load_torque")


@dataclass(frozen=True, eq=False)
class Unit:
    """One recording at the working rate.

    Attributes:
        name: file name.
        role: "fit" or "heldout".
        group: label shared by recordings of one rig, day and temperature.
        offset: time of the first sample, on the recording's own clock [s].
        before: time from the beginning of the whole recording to the first sample [s].
        t: times from 0 on [s], shape (n,).
        angle, speed, acceleration: smoothed motor motion [rad, rad/s, rad/s^2], shape (n,).
        ratio: reduction ratio.
        reversing: rate of the direction of motion, which is 1 or -1, in the band of the motor torque [1/s], shape (n,).
        measured: what is compared, by channel: motor_torque [N m], te [rad], output_torque [N m], each (n,).
        beyond: motor torque above the band of the motion [N m], which no replay explains, shape (n,).
        judged: which samples of a channel count, each (n,).
        resting: samples in the midst of a standstill, (n,).
        slowest: speed below which the direction of motion is not certain [rad/s].
        command: motor torque on which the actuator acts [N m], shape (n,).
        load_torque: external torque on the load [N m], shape (n,).
        scenario: the prescribed motion with the recorded torques.
        density: how many times as dense as its samples it is simulated.
        locked: angle of a load that cannot move [rad], or None.
        filtered: whether what the load's sensors recorded went through their low-pass.
        reading: from there to what the load's sensors recorded, by their own times, (n, density (n - 1) + 1); None
            where the working rate is far below the recorder's, or its clock even and no means are taken.
        step: of the recorded motor angle [rad], 0 where it has none.
        noises: further noises of its angle and their rates [rad, rad/s], each (n,); none where nothing was recorded.
    """

    name: str
    role: str
    group: str
    offset: float
    before: float
    t: Floats = field(repr=False)
    angle: Floats = field(repr=False)
    reversing: Floats = field(repr=False)
    speed: Floats = field(repr=False)
    acceleration: Floats = field(repr=False)
    measured: Mapping[str, Floats] = field(repr=False)
    beyond: Floats = field(repr=False)
    judged: Mapping[str, Mask] = field(repr=False)
    resting: Mask = field(repr=False)
    slowest: float
    command: Floats = field(repr=False)
    load_torque: Floats = field(repr=False)
    temperature: Floats | None = field(repr=False)
    scenario: Scenario = field(repr=False)
    density: int
    ratio: float
    locked: float | None = None
    filtered: bool = False
    reading: scipy.sparse.csr_array | None = field(default=None, repr=False)
    step: float = 0.0
    noises: tuple[tuple[Floats, Floats], ...] = field(default=(), repr=False)

    @property
    def turned(self) -> Floats:
        """Motor angle over the ratio [rad], shape (n,)."""
        return self.angle / self.ratio

    @property
    def fine(self) -> Floats:
        """Times at which it is simulated [s], shape (density (n - 1) + 1,)."""
        return denser(self.t, self.density)

    def read(self, values: Floats, band: Band) -> Floats:
        """What the load's sensors show, (M, n), of simulated values (M, density (n - 1) + 1)."""
        if self.reading is not None:
            return np.ascontiguousarray((self.reading @ values.T).T)
        return band.sensed_of(values, self.density) if self.filtered else values[:, :: self.density]

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

    @cached_property
    def beginning(self) -> Scenario:
        """The prescribed motion of the first samples."""
        return imposed(*(values[:FIRST] for values in (self.t, self.angle, self.command, self.load_torque)))

    def ahead(self, lag: float) -> Scenario:
        """The motion before a motor encoder that shows it through a low-pass of first order with this lag [s]."""
        return self.moved(lag * self.speed).scenario if lag != 0.0 else self.scenario

    def moved(self, angle: Floats) -> Unit:
        """The same recording replayed on a motion that differs by some angle [rad], shape (n,)."""
        return replace(self, scenario=imposed(self.t, self.angle + angle, self.command, self.load_torque))

    @cached_property
    def shaken(self) -> tuple[Unit, ...]:
        """The same recording, replayed with each of the further noises of its angle."""
        return tuple(
            replace(self.moved(noise), angle=self.angle + noise, speed=self.speed + rate) for noise, rate in self.noises
        )

    def commanded(self, command: Floats) -> Unit:
        """The same recording with another torque before the actuator [N m], shape (n,)."""
        return replace(self, command=command, scenario=imposed(self.t, self.angle, command, self.load_torque))


def prepare(
    source: Source, band: Band, ratio: float, *, number: int = 0, means: bool = False, locked: bool = False
) -> Unit:
    """Bring a recording to the working rate.

    Args:
        source: the recording; `motor_angle` and `motor_torque` are needed.
        band: working rate and low-pass.
        ratio: reduction ratio, for the transmission error.
        number: of the recording, which draws its own further noises.
        means: whether what is recorded of the load's side are means over the time since the one before.
        locked: whether the load as stated cannot move, so that a torque tells the windup near standstill as well.

    Raises:
        InputError: too few samples are left of it at the working rate.
    """
    recording = source.recording
    clocks = Clocks.of(source, band)
    clock, t, bring = clocks.recorded, clocks.working, clocks.bring
    encoder = clocks.filled(recording["motor_angle"])
    angle = clocks.thinned(encoder, band.replayed)
    spline = scipy.interpolate.CubicSpline(t, angle)
    speed, acceleration = spline(t, 1), spline(t, 2)
    recorded = {"motor_torque": recording["motor_torque"]}
    if "load_angle" in recording:
        error = recording["motor_angle"] / ratio - recording["load_angle"]
        if np.isfinite(error).any():
            recorded["te"] = error
    if "output_torque" in recording:
        recorded["output_torque"] = recording["output_torque"]
    measured = {
        channel: bring(values, band.of(channel), whole=channel != "motor_torque")
        for channel, values in recorded.items()
    }
    loaded = "load_torque" in recording and bool(np.isfinite(recording["load_torque"]).any())
    load = bring(recording["load_torque"], band.sensed) if loaded else np.zeros_like(t)
    command = band.quiet(measured["motor_torque"])
    own = clocks.stride == 1 and (means or _uneven(clock, clocks.step))
    density = FINE if own else band.density
    usable = _usable(source, clock, t, band)
    slowest = _slowest(clock, recording["motor_angle"], speed, band)
    turning = np.diff(np.sign(speed), prepend=np.sign(speed[0]), append=np.sign(speed[-1])) != 0.0
    moving = (np.abs(speed) > slowest) & ~turning[1:] & ~turning[:-1]
    forgotten = round(REVERSED * band.rate / band.motion)
    judged = {"motor_torque": usable & _eroded(moving, forgotten)}
    resting = bool(np.all(np.abs(speed[t <= AT_REST]) <= min(slowest, RESTING * np.max(np.abs(speed)))))
    settled = (resting | (t >= min(LEAD_IN, 0.1 * t[-1]))) & _settled(clock, recording["motor_angle"], t, band)
    for channel, values in recorded.items():
        if channel not in judged:
            judged[channel] = settled & usable & _unbroken(clock, values, t, band)
    nearest = np.clip(np.rint(clock / t[1]).astype(np.int64), 0, len(t) - 1)

    def alive(channel: str, mask: Mask) -> Mask:
        return mask & (_varies(measured[channel]) and _varies(recorded[channel][mask[nearest]]))

    judged = {channel: alive(channel, mask) for channel, mask in judged.items()}
    stays = "te" in judged and not _varies(recording["load_angle"])
    if stays:
        judged["te"][:] = False
    held = locked and stays
    if held and not any(mask.any() for mask in judged.values()):
        judged["motor_torque"] = alive("motor_torque", usable)
    return Unit(
        name=source.name,
        role=source.role,
        group=source.group,
        offset=float(recording["t"][0]),
        before=float(recording["t"][0] - source.start),
        t=t,
        angle=angle,
        reversing=band.reversing(t, spline(denser(t, band.density), 1), slowest),
        speed=speed,
        acceleration=acceleration,
        measured=measured,
        beyond=bring(recording["motor_torque"], band.sensed) - measured["motor_torque"],
        command=command,
        judged=judged,
        resting=usable & _eroded(np.abs(speed) <= slowest, forgotten),
        slowest=slowest,
        load_torque=load,
        temperature=bring(recording["temperature"], band.motion) if "temperature" in recording else None,
        scenario=imposed(t, angle, command, load),
        density=density,
        ratio=ratio,
        locked=float(np.nanmean(recording["load_angle"])) if held else None,
        filtered=band.sensed < clocks.widest,
        reading=reading(denser(t, density), clock, t, clocks.step if means else 0.0) if own else None,
        step=source.steps.get("motor_angle", 0.0),
        noises=_noises(source, encoder, clocks, band, number),
    )


def _noises(
    source: Source, encoder: Floats, clocks: Clocks, band: Band, number: int
) -> tuple[tuple[Floats, Floats], ...]:
    """Further noises of the motor angle (k,) [rad], through the low-pass that it went through, and their rates."""
    rate = 1.0 / clocks.step
    motion = low_pass(encoder, SLOW_SHARE * band.motion, rate)
    step = 0.0 if "motor_angle" in source.news else source.steps.get("motor_angle", 0.0)
    deviation = math.sqrt(0.5 * band.angle_noise * rate)

    def drawn(draw: int) -> tuple[Floats, Floats]:
        noise = another(encoder, motion, step, deviation, np.random.default_rng([draw, number]))
        found = clocks.thinned(noise, band.replayed)
        return found, scipy.interpolate.CubicSpline(clocks.working, found)(clocks.working, 1)

    return tuple(drawn(draw) for draw in range(SHAKES))


def _uneven(clock: Floats, step: float) -> bool:
    """Whether a clock (n,) leaves its period by more than it may."""
    return bool(np.max(np.abs(clock - step * np.rint(clock / step))) > CLOCK * step)


def denser(t: Floats, density: int) -> Floats:
    """Times so many times as dense as (n,) equally spaced ones: (density (n - 1) + 1,)."""
    return np.linspace(t[0], t[-1], density * (len(t) - 1) + 1)


def imposed(t: Floats, angle: Floats, command: Floats, load: Floats) -> Scenario:
    """The prescribed motion (n,) [s, rad] with the torques asked of the drive and put on the load (n,) [N m]."""
    replayed = {"t": t, "motor_angle": angle, "motor_torque": command, "load_torque": joined(load)}
    return Scenario.replay(replayed, input="motor_motion")


def joined(values: Floats) -> Floats:
    """Values (n,) between which straight lines are as large as what was sampled.

    Lines cut corners: of a frequency they leave sinc(f / rate)^2. Moved outwards by a twelfth of their second
    differences, values lose that in the fourth order of f alone.
    """
    return np.asarray(values - np.diff(np.pad(values, 1, mode="edge"), 2) / 12.0)


def _slowest(clock: Floats, angle: Floats, speed: Floats, band: Band) -> float:
    """Speed below which the direction of motion is not certain [rad/s]."""
    noise = 2.0 * math.pi * math.sqrt(noise_density(clock, angle) * band.replayed**3 / 3.0)
    return max(3.0 * noise, SLOWEST_SHARE * float(np.max(np.abs(speed))))


def _eroded(mask: Mask, width: int) -> Mask:
    """`mask` without the samples closer than `width` to a gap in it."""
    outside: Floats = np.convolve(~mask, np.ones(2 * width + 1))[width : width + len(mask)]
    inside: Mask = outside < 0.5
    return inside


def _varies(values: Floats) -> bool:
    """Whether values (n,), some of them missing, are neither dead nor known beforehand, as a locked output's angle is.

    One that stays has no noise to hold a mismatch against.
    """
    known = values[np.isfinite(values)]
    return bool(known.size and np.ptp(known) > CONSTANT * np.max(np.abs(known)))


def _usable(source: Source, clock: Floats, t: Floats, band: Band) -> Mask:
    """Times (n,) away from both ends, from gaps in what is replayed, and from flagged samples of a clock (m,)."""
    recording, margin = source.recording, MARGIN / band.motion
    flagged = ~source.good
    for column in REQUIRED:
        flagged &= np.isfinite(recording[column])
    usable: Mask = (t >= margin) & (t <= t[-1] - margin) & _away(t, clock[flagged], clock[flagged], margin)
    for column in REPLAYED:
        if column in recording:
            usable &= _unbroken(clock, recording[column], t, band)
    return usable


def _unbroken(clock: Floats, values: Floats, t: Floats, band: Band) -> Mask:
    """Times (n,) away from gaps of a clock (m,) and from as long ones between the numbers among its values (m,)."""
    widest = 1.5 * np.median(np.diff(clock)) + 1.0 / band.rate
    known = np.concatenate([clock[:1], clock[np.isfinite(values)], clock[-1:]])
    wide = np.flatnonzero(np.diff(known) > widest)
    return _away(t, known[wide], known[wide + 1], MARGIN / band.motion)


def _settled(clock: Floats, angle: Floats, t: Floats, band: Band) -> Mask:
    """Times (n,) at which what a bridged gap of the motor angle (m,) set swinging on the load has faded."""
    known = clock[np.isfinite(angle)]
    long = np.flatnonzero(np.diff(known) > MARGIN / band.motion)
    return _away(t, known[long], known[long + 1] + LEAD_IN, 0.0)


def _away(t: Floats, begin: Floats, end: Floats, margin: float) -> Mask:
    """Which of increasing times (n,) are farther than a margin from every stretch between begin and end (k,)."""
    entered, left = np.searchsorted(t, begin - margin), np.searchsorted(t, end + margin, side="right")
    inside = np.cumsum(np.bincount(entered, minlength=len(t) + 1) - np.bincount(left, minlength=len(t) + 1))
    away: Mask = inside[:-1] == 0
    return away
