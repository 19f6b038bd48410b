"""Motions of the motor that could be recorded next, within what the recordings at hand have already done."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.band import Band
from hdfast.diagnosis.prepare import Unit, denser, imposed

SHORTEST_RAMP = 0.02
SHORTEST, LONGEST = 2.0, 10.0
USUAL = 0.999
PLANNED = 500.0
ACCELERATIONS = (0.1, 0.3, 1.0)
LONGER, FASTER, HALF_A_MINUTE = 3.0, 2.0, 30.0
STEADY_SHARE, FULL_SPEED_SHARE = 0.05, 0.25
WHOLE_TURN = 2.2 * math.pi  # of the output, and a tenth of it


@dataclass(frozen=True)
class Limits:
    """What a proposed motion may not exceed.

    Attributes:
        speed, acceleration: of the motor [rad/s, rad/s^2].
        low, high: of the motor angle [rad].
        duration: [s].
        beyond: in which of these it is wider than the recordings at hand.
    """

    speed: float
    acceleration: float
    low: float
    high: float
    duration: float
    beyond: tuple[str, ...] = ()

    @classmethod
    def of(cls, units: Sequence[Unit]) -> Limits:
        """The ranges of the recordings at hand; single samples do not widen them.

        At a steady speed noise of the angle is all that accelerates: where no recording does more, full speed is
        reached in a quarter of the time.
        """
        speed = max(float(np.quantile(np.abs(unit.speed), USUAL)) for unit in units)
        duration = float(np.clip(np.median([unit.t[-1] for unit in units]), SHORTEST, LONGEST))
        gaining = [unit for unit in units if np.ptp(unit.speed) > STEADY_SHARE * np.max(np.abs(unit.speed))]
        return cls(
            speed,
            max(
                (float(np.quantile(np.abs(unit.acceleration), USUAL)) for unit in gaining),
                default=speed / (FULL_SPEED_SHARE * duration),
            ),
            min(float(unit.angle.min()) for unit in units),
            max(float(unit.angle.max()) for unit in units),
            duration,
        )

    def wider(self, ratio: float) -> Iterator[Limits]:
        """What a rig may be able to do beyond the recordings, each step on top of the one before.

        More time, then a whole turn of the output with the time that it takes, then twice the speed.
        """
        longer = replace(self, duration=LONGER * self.duration, beyond=("duration",))
        yield longer
        turn = WHOLE_TURN * abs(ratio)
        missing = 0.5 * (turn - (self.high - self.low))
        farther = longer
        if missing > 0.0:
            turned = replace(longer, low=self.low - missing, high=self.high + missing, beyond=("duration", "angle"))
            farther = turned.lasting(turn)
            yield farther
        faster = replace(
            farther,
            speed=FASTER * self.speed,
            acceleration=FASTER * self.acceleration,
            duration=longer.duration,
            beyond=(*farther.beyond, "speed", "acceleration"),
        )
        yield faster.lasting(turn) if missing > 0.0 else faster

    def lasting(self, travel: float) -> Limits:
        """The same, long enough for a travel [rad] at full speed, up to half a minute."""
        return replace(self, duration=max(self.duration, min(travel / self.speed, HALF_A_MINUTE)))


@dataclass(frozen=True)
class Segment:
    """Go to a speed [rad/s] on a smooth ramp [s] and hold it [s]."""

    speed: float
    ramp: float
    hold: float


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """A motion from standstill.

    Attributes:
        kind: where it comes from.
        segments: one after another.
        start: motor angle at its beginning [rad].
    """

    kind: str
    segments: tuple[Segment, ...]
    start: float = 0.0

    def motion(self, rate: float) -> tuple[Floats, Floats, Floats]:
        """Times [s], angle [rad] and speed [rad/s] at a rate [Hz], each (n,)."""
        corners = np.cumsum([0.0] + [part for one in self.segments for part in (one.ramp, one.hold)])
        t = np.arange(0.0, corners[-1], 1.0 / rate)
        before = np.array([0.0, *(one.speed for one in self.segments)])
        which = np.clip(np.searchsorted(corners[::2], t, side="right") - 1, 0, len(self.segments) - 1)
        ramps = np.array([one.ramp for one in self.segments])
        done = np.clip((t - corners[::2][which]) / ramps[which], 0.0, 1.0)
        speed = before[which] + (before[which + 1] - before[which]) * 0.5 * (1.0 - np.cos(math.pi * done))
        angle = self.start + np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / rate
        return t, angle, speed

    def within(self, limits: Limits) -> Manoeuvre:
        """The same kind of motion inside the limits: slower where it turns too far, softer where it is too abrupt."""
        stretch = limits.duration / sum(one.ramp + one.hold for one in self.segments)
        times = [(one.ramp * stretch, (one.ramp + one.hold) * stretch) for one in self.segments]
        speeds = [one.speed for one in self.segments]
        jumps = np.abs(np.diff([0.0, *speeds]))
        needed = 0.5 * math.pi * jumps / limits.acceleration
        slower = [whole / max(need, whole) for need, (_, whole) in zip(needed, times, strict=True)]
        share = min(limits.speed / max(limits.speed, *map(abs, speeds)), *slower)
        shaped = [
            Segment(share * speed, max(ramp, share * need), whole - max(ramp, share * need))
            for speed, need, (ramp, whole) in zip(speeds, needed, times, strict=True)
        ]
        travel = limits.high - limits.low
        angle = Manoeuvre(self.kind, tuple(shaped)).motion(PLANNED)[1]
        turned = float(np.ptp(angle))
        reach = travel / max(travel, turned)
        start = limits.low - reach * float(angle.min()) + 0.5 * (travel - reach * turned)
        return Manoeuvre(self.kind, tuple(replace(one, speed=reach * one.speed) for one in shaped), start)

    def unit(self, band: Band, ratio: float, like: Unit, slowest: float) -> Unit:
        """A recording of this motion with nothing measured yet, with the channels of another one.

        Args:
            band: working rate and low-pass.
            ratio: reduction ratio.
            like: the other recording.
            slowest: motor speed below which the torque is not judged [rad/s].
        """
        t, angle, speed = self.motion(band.rate)
        nothing = np.zeros_like(t)
        moving = np.abs(speed) > slowest
        return Unit(
            name=self.kind,
            role="fit",
            group=self.kind,
            before=0.0,
            offset=0.0,
            t=t,
            angle=angle,
            beyond=nothing,
            reversing=band.reversing(t, np.interp(denser(t, band.density), t, speed), slowest),
            speed=speed,
            acceleration=np.gradient(speed, 1.0 / band.rate),
            measured=dict.fromkeys(like.measured, nothing),
            judged={
                channel: moving if channel == "motor_torque" else np.ones_like(moving) for channel in like.measured
            },
            resting=np.zeros_like(moving),
            slowest=slowest,
            command=nothing,
            load_torque=nothing,
            temperature=None if like.temperature is None else np.full_like(t, float(np.mean(like.temperature))),
            scenario=imposed(t, angle, nothing, nothing),
            density=band.density,
            ratio=ratio,
        )

    def to_dict(self) -> dict[str, Any]:
        """What is needed to run it."""
        return {
            "kind": self.kind,
            "start_angle_rad": self.start,
            "segments": [{"speed_rad_s": one.speed, "ramp_s": one.ramp, "hold_s": one.hold} for one in self.segments],
        }


def known(limits: Limits) -> list[Manoeuvre]:
    """The classical ones: ladders, slow passages through zero, starts and stops, growing shakes, slow turns."""
    v = limits.speed
    shares = (0.1, 0.25, 0.5, 1.0)
    kinds: Mapping[str, list[Segment]] = {
        "ladder both ways": [Segment(sign * s * v, 0.1, 1.0) for s in shares for sign in (1.0, -1.0)],
        "ladder upwards, then downwards": [Segment(sign * s * v, 0.1, 1.0) for sign in (1.0, -1.0) for s in shares],
        "slow passages through zero": [
            Segment(sign * a * v, 2.0, 0.01) for a in ACCELERATIONS for sign in (1.0, -1.0)
        ],
        "starts and stops": [
            Segment(speed * v, 0.02, 0.5) for speed in (0.3, 0.0, -0.3, 0.0, 1.0, 0.0, -1.0, 0.0)
        ],
        "growing shakes": [
            Segment(sign * s * v, 0.05, 0.02) for s in (0.05, 0.1, 0.2, 0.4, 0.8) for sign in (1.0, -1.0, 1.0, -1.0)
        ],
        "there and back": [Segment(v, 0.3, 3.0), Segment(-v, 0.6, 3.0)],
        "slow in both directions": [Segment(0.1 * v, 0.1, 5.0), Segment(-0.1 * v, 0.2, 5.0)],
    }  # fmt: skip
    return [Manoeuvre(kind, tuple(segments)).within(limits) for kind, segments in kinds.items()]


def drawn(limits: Limits, count: int, rng: np.random.Generator) -> list[Manoeuvre]:
    """Random speeds, ramps and holds."""
    found = []
    for _ in range(count):
        segments = [
            Segment(
                float(limits.speed * rng.choice([-1.0, 1.0]) * rng.uniform() ** 2),
                float(np.exp(rng.uniform(np.log(SHORTEST_RAMP), 0.0))),
                float(rng.exponential(0.5)),
            )
            for _ in range(rng.integers(4, 11))
        ]
        found.append(Manoeuvre("drawn at random", tuple(segments)).within(limits))
    return found


def varied(one: Manoeuvre, limits: Limits, rng: np.random.Generator) -> Manoeuvre:
    """A neighbour: other speeds and times of the same segments."""
    factors = np.exp(rng.normal(0.0, 0.3, (len(one.segments), 3)))
    segments = [
        Segment(part.speed * a, part.ramp * b, part.hold * c)
        for part, (a, b, c) in zip(one.segments, factors.tolist(), strict=True)
    ]
    kind = one.kind if one.kind.endswith("adapted") else f"{one.kind}, adapted"
    return Manoeuvre(kind, tuple(segments)).within(limits)
