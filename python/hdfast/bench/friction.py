"""Bench fixtures with dry friction: a ladder of constant speeds and a coast-down.

Both recordings come from a rigid drive written here, independent of the engine: the torque that holds a speed is the
friction law itself, and a coasting drive is one inertia that stops for good at speed zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdfast import checks
from hdfast.bench.rig import record, rig
from hdfast.checks import Floats
from hdfast.recordings import Recording
from hdfast.scenario_parts import MAX_SPEED_RPM, RPM
from hdfast.sensors import SensorStage

RIPPLE = 0.005  # N m, twice per revolution
LADDER_RPM = (2.0, 4.0, 8.0, 15.0, 25.0, 40.0, 60.0, 100.0, 150.0, 220.0, 320.0, 450.0, 600.0)


@dataclass(frozen=True)
class FrictionLaw:
    """Friction at the motor shaft: sgn(w) [T_c (1 + eps sgn w) + (T_s - T_c) exp(-(w/w_s)^2) + c_L |T|/i] + B w.

    Attributes:
        T_c, T_s: Coulomb and breakaway torque [N m].
        omega_s: speed scale of the Stribeck dip [rad/s].
        B: viscous damping seen at the motor [N m s/rad], at 20 degC.
        asymmetry: eps.
        load_share: c_L.
        beta: fall of B with temperature [1/K].
    """

    T_c: float = 0.03
    T_s: float = 0.04
    omega_s: float = 3.0
    B: float = 1.2e-3
    asymmetry: float = 0.0
    load_share: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        for name in ("T_c", "T_s", "B"):
            checks.finite(name, getattr(self, name), 0.0)
        checks.positive("omega_s", self.omega_s, unit="rad/s")
        for name in ("asymmetry", "load_share", "beta"):
            checks.finite(name, getattr(self, name))

    def torque(self, omega: Floats, load: Floats, temperature: Floats, ratio: float) -> Floats:
        """Friction torque [N m] at motor speed omega [rad/s], output torque [N m], temperature [degC]."""
        sign = np.sign(omega)
        dip = (self.T_s - self.T_c) * np.exp(-((omega / self.omega_s) ** 2))
        dry = self.T_c * (1.0 + self.asymmetry * sign) + dip + self.load_share * np.abs(load) / ratio
        return np.asarray(sign * dry + self.B * np.exp(-self.beta * (temperature - 20.0)) * omega)


def friction(
    law: FrictionLaw | None = None,
    *,
    ratio: float = 121.0,
    speeds_rpm: Sequence[float] = LADDER_RPM,
    dwell_revolutions: float = 4.0,
    loads: Sequence[float] = (0.0,),
    temperature: float | None = None,
    sensors: SensorStage | None = None,
    seed: int = 1,
) -> list[Recording]:
    """A speed ladder in both directions and random order, one recording for each load.

    Args:
        law: the friction.
        ratio: gear ratio.
        speeds_rpm: motor speeds [r/min].
        dwell_revolutions: motor revolutions at each speed, at least 1 s.
        loads: output torques [N m], positive resists forward motion.
        temperature: at the start [degC], rising by 10 K during a recording; None records none.
        sensors: the sensors; default `rig()`.
        seed: seed of noise, encoder positions and order.

    Raises:
        InputError: naming the argument, its value and the allowed range.
    """
    law = FrictionLaw() if law is None else law
    stage = rig() if sensors is None else sensors
    checks.positive("dwell_revolutions", dwell_revolutions, 1e4)
    checks.positive("ratio", ratio)
    ladder = np.array([checks.positive("speeds_rpm", speed, MAX_SPEED_RPM, "r/min") for speed in speeds_rpm])
    rng = np.random.default_rng([seed, 99])
    found = []
    for index, load in enumerate(loads):
        steps = np.concatenate([ladder, -ladder]) * RPM
        rng.shuffle(steps)
        dwell = np.maximum(dwell_revolutions * 2.0 * math.pi / np.abs(steps), 1.0)
        corners = np.concatenate([[0.0], np.cumsum(dwell)])
        at = stage.times(float(corners[-1]))
        t = stage.grid(at)
        speed = steps[np.minimum(np.searchsorted(corners[1:], t, side="right"), len(steps) - 1)]
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
        warm = 20.0 + 0.0 * t if temperature is None else temperature + 10.0 * t / t[-1]
        held = np.full_like(t, load)
        torque = law.torque(speed, held, warm, ratio) + held / ratio + RIPPLE * np.sin(2.0 * angle)
        signals = {"motor_angle": angle, "motor_torque": torque, "speed_reference": speed, "load_torque": held}
        if temperature is not None:
            signals["temperature"] = warm
        found.append(record(stage, f"ladder at {load:g} N m", t, signals, [seed, index], at))
    return found


def coastdown(
    law: FrictionLaw | None = None,
    *,
    inertia: float = 3e-4 + 0.5 / 121.0**2,
    speeds_rpm: Sequence[float] = (100.0, 300.0, 600.0),
    sensors: SensorStage | None = None,
    seed: int = 1,
) -> list[Recording]:
    """Coasting to rest from several speeds without motor torque; the Stribeck dip is left out (T_s = T_c).

    Args:
        law: the friction; T_c and B count.
        inertia: moving inertia at the motor [kg m^2].
        speeds_rpm: motor speed at the start of each recording [r/min].
        sensors: the sensors; default `rig()`.
        seed: seed of noise and encoder positions.

    Raises:
        InputError: naming the argument, its value and the allowed range.
    """
    law = FrictionLaw() if law is None else law
    stage = rig() if sensors is None else sensors
    checks.positive("B", law.B)
    checks.positive("inertia", inertia)
    a, b = law.T_c / inertia, law.B / inertia
    runs = []
    for index, speed in enumerate(speeds_rpm):
        omega = checks.positive("speeds_rpm", speed, MAX_SPEED_RPM, "r/min") * RPM
        rest = math.log(1.0 + b * omega / a) / b if a else 6.0 / b
        at = stage.times(rest + 0.1)
        t = stage.grid(at)
        moving = np.minimum(t, rest)
        angle = (omega + a / b) / b * -np.expm1(-b * moving) - a / b * moving
        signals = {"motor_angle": angle, "motor_torque": np.zeros_like(t)}
        runs.append(record(stage, f"coast from {speed:g} r/min", t, signals, [seed, index], at))
    return runs
