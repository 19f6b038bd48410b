"""Bench fixture: slow torque ramps from rest at many motor angles, rigid drive with dry friction written here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hdfast import checks
from hdfast.bench.friction import FrictionLaw
from hdfast.bench.rig import record, rig
from hdfast.checks import Floats
from hdfast.recordings import Recording
from hdfast.sensors import SensorStage

STEP = 1e-4  # s
PAUSE, GLIDE, BRAKE, MOVE = 0.6, 0.2, 0.05, 1.0  # s
ORDER = 2.0


@dataclass(frozen=True, eq=False)
class StartingBench:
    """Recordings of starts and the truth behind them.

    Attributes:
        recordings: one for each direction: t, motor_angle, motor_torque.
        torques: starting torques [N m] in the order of the recordings and of time, positive in both directions.
        truth: mean forward and backward [N m], relative ripple twice per motor revolution, spread [N m].
    """

    recordings: list[Recording]
    torques: Floats
    truth: dict[str, float]


@dataclass
class _Track:
    """Motion under construction, sampled every STEP."""

    angle: list[Floats] = field(default_factory=lambda: [np.zeros(1)])
    torque: list[Floats] = field(default_factory=lambda: [np.zeros(1)])

    def go(self, angle: Floats, torque: Floats) -> None:
        """Append angles counted from the last one, and torques."""
        self.angle.append(self.angle[-1][-1] + angle)
        self.torque.append(torque)


def starting_torque(
    law: FrictionLaw | None = None,
    *,
    inertia: float = 3e-4 + 0.5 / 121.0**2,
    angles: int = 12,
    rate: float = 2e-3,
    ripple: float = 0.1,
    spread: float = 5e-4,
    presliding: float = 300.0,
    sensors: SensorStage | None = None,
    seed: int = 1,
) -> StartingBench:
    """Record starts at equally spaced motor angles in both directions, with moves to the next angle between them.

    Args:
        law: the friction; T_s, T_c, B and the asymmetry count.
        inertia: moving inertia at the motor [kg m^2].
        angles: starts in each direction.
        rate: speed of the torque [N m/s].
        ripple: relative amplitude of the starting torque twice per motor revolution.
        spread: standard deviation from start to start [N m].
        presliding: stiffness of the contact before it slips [N m/rad].
        sensors: the sensors; default `rig()`.
        seed: seed of noise, encoder positions and spread.

    Raises:
        InputError: naming the argument, its value and the allowed range.
    """
    law = FrictionLaw() if law is None else law
    stage = rig() if sensors is None else sensors
    count = checks.whole("angles", angles, 1, 1000)
    checks.positive("rate", rate, 10.0, "N m/s")
    for name, value in {"T_s": law.T_s, "B": law.B, "inertia": inertia, "presliding": presliding}.items():
        checks.positive(name, value)
    rng = np.random.default_rng([seed, 97])
    recordings, torques = [], []
    for index, (name, sign) in enumerate((("forward", 1.0), ("backward", -1.0))):
        track = _Track()
        for place in sign * 2.0 * math.pi * np.arange(count) / count:
            _move(track, place, law, inertia)
            mean = law.T_s * (1.0 + law.asymmetry * sign) * (1.0 + ripple * math.cos(ORDER * place))
            held = max(mean + spread * float(rng.standard_normal()), 1.05 * law.T_c)
            _start(track, sign, held, law, inertia, rate, presliding)
            torques.append(held)
        angle, torque = np.concatenate(track.angle), np.concatenate(track.torque)
        fine = STEP * np.arange(len(angle))
        at = stage.times(float(fine[-1]))
        t = stage.grid(at)
        signals = {"motor_angle": np.interp(t, fine, angle), "motor_torque": np.interp(t, fine, torque)}
        recordings.append(record(stage, f"starts {name}", t, signals, [seed, index], at))
    truth = {f"T_s_{name}": law.T_s * (1.0 + law.asymmetry * s) for name, s in (("forward", 1.0), ("backward", -1.0))}
    return StartingBench(recordings, np.array(torques), truth | {"ripple": ripple, "spread": spread})


def _times(duration: float) -> Floats:
    return np.asarray(STEP * np.arange(1, round(duration / STEP) + 1))


def _move(track: _Track, place: float, law: FrictionLaw, inertia: float) -> None:
    """To an angle along half a cosine, then a pause without torque."""
    far = place - float(track.angle[-1][-1])
    if far:
        s = math.pi * _times(MOVE) / MOVE
        speed, gain = 0.5 * math.pi * far / MOVE * np.sin(s), 0.5 * far * (math.pi / MOVE) ** 2 * np.cos(s)
        track.go(0.5 * far * (1.0 - np.cos(s)), math.copysign(law.T_c, far) + law.B * speed + inertia * gain)
    still = np.zeros_like(_times(PAUSE))
    track.go(still, still)


def _start(
    track: _Track, sign: float, held: float, law: FrictionLaw, inertia: float, rate: float, presliding: float
) -> None:
    """Torque up to slip and on for a moment, then a brake."""
    ramp = rate * _times(held / rate)
    track.go(sign * ramp / presliding, sign * ramp)
    s, decay = _times(GLIDE), law.B / inertia
    excess = (held - law.T_c) / law.B - rate * inertia / law.B**2
    speed = rate / law.B * s - excess * np.expm1(-decay * s)
    travelled = 0.5 * rate / law.B * s**2 + excess * (s + np.expm1(-decay * s) / decay)
    track.go(sign * travelled, sign * (held + rate * s))
    s = _times(BRAKE)
    slower = -speed[-1] / BRAKE
    track.go(sign * (speed[-1] * s + 0.5 * slower * s**2), np.full_like(s, sign * inertia * slower))
