"""Effects that can be put into recordings exactly: the motion stays, the channel becomes what would have been read.

The torque of a motor that made the recorded motion against one more torque is the recorded one plus that torque; what a
sensor does to a channel can be done to the recorded channel.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.random import Generator

from hdfast.checks import Floats
from hdfast.proof.bridge.machine import DRY, Machine, Recorded
from hdfast.recordings.campaign import LOAD_SIDE
from hdfast.terms import terms

TURN = 2.0 * np.pi

Shape = Mapping[str, float]


@dataclass(frozen=True)
class Injection:
    """A way of changing one channel.

    Attributes:
        effect: id of the catalogue.
        place: of the effect.
        channel: what is changed.
        parameter: of the catalogue.
        typical: an amplitude at which the change is small, for a machine.
        shape: draws what is fixed besides the amplitude.
        change: of the channel (n,) for a recording, an amplitude and a shape.
        twins: effects that change the channel alike.
        needs: one of these has to be in the model.
        least_ratio: of the gear.
        swallowed: amplitude that the recordings' own nuisance may have, for a machine.
        depends_on: state variables.
        memory: kind of memory.
        value: of the parameter, for a machine and an amplitude.
    """

    effect: str
    place: str
    channel: str
    parameter: str
    typical: Callable[[Machine], float]
    shape: Callable[[Machine, Generator], Shape]
    change: Callable[[Recorded, float, Shape], Floats]
    twins: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    least_ratio: float = 0.0
    swallowed: Callable[[Machine], float] = lambda _: 0.0
    depends_on: tuple[str, ...] = ()
    memory: str = "none"
    value: Callable[[Machine, float], float] = lambda _, amplitude: amplitude

    def applies(self, machine: Machine) -> bool:
        """Whether the machine records the channel, does not state the effect, and has what it needs.

        What acts on the load would turn a recorded output as well.
        """
        if self.place == "load" and any(set(LOAD_SIDE) & set(one.columns) for one in machine.recordings):
            return False
        recorded = all(self.channel in one.columns for one in machine.recordings)
        needed = not self.needs or bool(set(self.needs) & set(machine.terms))
        stated = self.effect in machine.terms or (self.effect, self.channel) in machine.sensors
        return recorded and needed and not stated and abs(machine.ratio) > self.least_ratio

    def on(self, recorded: Recorded, amplitude: float, shape: Shape) -> dict[str, Floats]:
        """The columns with the effect."""
        changed = recorded.columns[self.channel] + self.change(recorded, amplitude, shape)
        return {**recorded.columns, self.channel: changed}


def _torque(machine: Machine) -> float:
    return float(np.median([np.nanstd(one.columns["motor_torque"]) for one in machine.fitted]))


def _phase(_: Machine, rng: Generator) -> Shape:
    return {"psi": float(rng.uniform(-np.pi, np.pi))}


def _line(*orders: float) -> Callable[[Machine, Generator], Shape]:
    return lambda machine, rng: {"order": float(rng.choice(orders)), **_phase(machine, rng)}


def _nothing(_: Machine, __: Generator) -> Shape:
    return {}


def _stribeck_speed(machine: Machine, rng: Generator) -> Shape:
    top = max(float(np.abs(one.speed).max()) for one in machine.fitted)
    return {"omega_s": top * float(rng.uniform(0.05, 0.2))}


def _ratio(machine: Machine, rng: Generator) -> Shape:
    return {"ratio": machine.ratio, **_phase(machine, rng)}


def _turned(one: Recorded, shape: Shape) -> Floats:
    return np.asarray(np.cos(shape["order"] * one.angle + shape["psi"]))


def _ripple(one: Recorded, amplitude: float, shape: Shape) -> Floats:
    torque = one.columns["motor_torque"]
    return np.asarray(torque / (1.0 + amplitude * _turned(one, shape)) - torque)


def _late(channel: str) -> Callable[[Recorded, float, Shape], Floats]:
    def change(one: Recorded, amplitude: float, _: Shape) -> Floats:
        values = one.columns[channel]
        known = np.isfinite(values)
        return np.asarray(np.interp(one.t - amplitude, one.t[known], values[known]) - values)

    return change


def _filtered(channel: str) -> Callable[[Recorded, float, Shape], Floats]:
    def change(one: Recorded, amplitude: float, _: Shape) -> Floats:
        values = one.columns[channel]
        known = np.isfinite(values)
        step = float(np.median(np.diff(one.t)))
        even = np.arange(one.t[0], one.t[-1] + step, step)
        share = -np.expm1(-step / max(amplitude, 1e-9))
        start = [(1.0 - share) * values[known][0]]
        slow, _end = scipy.signal.lfilter(
            [share], [1.0, share - 1.0], np.interp(even, one.t[known], values[known]), zi=start
        )
        return np.asarray(np.interp(one.t, even, slow) - values)

    return change


def _share_of_friction(machine: Machine, amplitude: float) -> float:
    return amplitude / machine.sliding_torque


def _offset_of_disc(_: Machine, amplitude: float) -> float:
    """Offset [m] that gives this amplitude [rad] on a disc of the diameter that the diagnosis assumes."""
    known = {p.name: p.default for p in terms()["encoder_eccentricity"].parameters}
    return 0.5 * known["disc_diameter"] * amplitude


def _sample(machine: Machine) -> float:
    return float(np.median(np.diff(machine.recordings[0].t)))


LATE = ("delay", "actuator_lag", "sensor_delay", "sensor_lowpass")

INJECTIONS = (
    Injection(
        "cogging", "motor", "motor_torque", "T_cog", lambda m: 0.02 * _torque(m), _line(12.0, 24.0),
        lambda one, size, s: size * _turned(one, s), depends_on=("motor_phase",),
    ),
    Injection(
        "torque_ripple", "actuator", "motor_torque", "r_2", lambda _: 0.02, _line(8.0, 10.0), _ripple,
        depends_on=("motor_phase", "motor_torque"),
    ),
    Injection(
        "gravity_unbalance", "load", "motor_torque", "T_gravity", lambda m: 0.05 * _torque(m) * abs(m.ratio), _ratio,
        lambda one, size, s: size / s["ratio"] * np.sin(one.angle / s["ratio"] + s["psi"]), least_ratio=5.0,
        depends_on=("load_phase",),
    ),
    Injection(
        "nonlinear_viscous", "motor", "motor_torque", "drag_torque",
        lambda m: 0.05 * _torque(m) * (100.0 / max(float(np.abs(one.speed).max()) for one in m.fitted)) ** 2, _nothing,
        lambda one, size, _: size * np.sign(one.speed) * (one.speed / 100.0) ** 2, depends_on=("motor_speed",),
    ),
    Injection(
        "stribeck_friction", "motor", "motor_torque", "breakaway_ratio", lambda m: 0.05 * _torque(m), _stribeck_speed,
        lambda one, size, s: size * np.sign(one.speed) * np.exp(-((one.speed / s["omega_s"]) ** 2)),
        needs=("coulomb_friction",), depends_on=("direction", "motor_speed"),
        value=lambda m, size: 1.0 + _share_of_friction(m, size),
    ),
    Injection(
        "position_dependent_friction", "mesh", "motor_torque", "friction_ripple", lambda m: 0.05 * _torque(m),
        _line(1.0, 2.0),
        lambda one, size, s: size * np.sign(one.speed) * _turned(one, s), needs=DRY,
        depends_on=("motor_phase", "direction"), value=_share_of_friction,
    ),
    Injection(
        "sensor_delay", "sensor", "motor_torque", "tau_y", _sample, _nothing, _late("motor_torque"), twins=LATE,
        swallowed=_sample, depends_on=("motor_torque",), memory="fading",
    ),
    Injection(
        "sensor_lowpass", "sensor", "motor_torque", "tau_s", _sample, _nothing, _filtered("motor_torque"), twins=LATE,
        swallowed=_sample, depends_on=("motor_torque",), memory="fading",
    ),
    Injection(
        "sensor_delay", "sensor", "load_angle", "tau_y", _sample, _nothing, _late("load_angle"),
        depends_on=("motor_speed",), memory="fading",
    ),
    Injection(
        "encoder_eccentricity", "sensor", "load_angle", "eccentricity", lambda _: 1e-4, _phase,
        lambda one, size, s: size * np.sin(one.columns["load_angle"] + s["psi"]), depends_on=("load_phase",),
        value=_offset_of_disc,
    ),
    Injection(
        "clock_skew", "sensor", "load_angle", "skew", lambda _: 1e-4, _nothing,
        lambda one, size, _: size * (one.t - one.t[0]) * np.gradient(one.columns["load_angle"], one.t),
        depends_on=("time_since_start", "motor_speed"),
    ),
    Injection(
        "sensor_offset_drift", "sensor", "output_torque", "drift", lambda _: 0.01, _nothing,
        lambda one, size, _: size * (one.t - one.t[0]), depends_on=("time_since_start",),
    ),
)  # fmt: skip
