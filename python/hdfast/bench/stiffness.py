"""The virtual stiffness test: input locked, torque at the output up, down and up again, slowly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdfast import checks, spring
from hdfast.bench.hysteresis import SlipLoop, relaxed
from hdfast.bench.rig import record, rig
from hdfast.checks import Floats
from hdfast.model import Model
from hdfast.recordings import Recording
from hdfast.scenario import Scenario
from hdfast.sensors import SensorStage
from hdfast.simulate import simulate

PATH_POINTS = 4001


@dataclass(frozen=True, eq=False)
class StiffnessBench:
    """What the virtual test rig knows: a recording and the truth behind it.

    Attributes:
        recording: t, motor_angle, motor_torque, load_angle and load_torque.
        truth: spring parameters, hysteresis torque [N m] and loss per cycle [J] by name.
    """

    recording: Recording
    truth: dict[str, float]


def stiffness(
    drive: Mapping[str, float] | None = None,
    *,
    model: Model | None = None,
    torque: float = 67.0,
    rate: float = 2.0,
    loops: int = 2,
    loop: SlipLoop | None = None,
    sensors: SensorStage | None = None,
    seed: int | Sequence[int] = 1,
) -> StiffnessBench:
    """Record a torque-windup loop of a known drive, quasi-statically.

    Args:
        drive: parameters that differ from the defaults.
        model: the equations; its spring law counts.
        torque: largest torque [N m].
        rate: speed of the torque [N m/s].
        loops: whole loops after the first quarter.
        loop: slip elements beside the spring; default 2 N m. `SlipLoop(torque=0)` has none.
        sensors: the sensors; default `rig()`.
        seed: seed of noise and encoder positions.

    Raises:
        InputError: naming the argument, its value and the allowed range.
    """
    model = Model() if model is None else model
    stage = rig() if sensors is None else sensors
    slip = SlipLoop() if loop is None else loop
    top = checks.positive("torque", torque, 1e5, "N m")
    quarter = top / checks.positive("rate", rate, 1e6, "N m/s")
    values = simulate(dict(drive or {}), model=model, scenario=Scenario.start_stop(t_end=1e-3), strict=True).parameters
    corners = np.array([0.0, top, *[-top, top] * checks.whole("loops", loops, 1, 100), 0.0])
    moments = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)) / top * quarter)])
    at = stage.times(float(moments[-1]))
    t = stage.grid(at)
    load = np.interp(t, moments, corners)
    windup, cycle = _windup(model.spring, values, slip, t, load, moments, corners)
    signals = {
        "motor_angle": np.zeros_like(t),
        "motor_torque": load / values["ratio"],
        "load_angle": -windup,
        "load_torque": load,
    }
    names = ["k1", "k3", "k5", "phi_max"] if model.spring == "polynomial" else ["K1", "K2", "K3", "T1", "T2"]
    truth = {name: values[name] for name in names} | {"hysteresis_torque": slip.torque, "loop_energy": cycle}
    return StiffnessBench(record(stage, "stiffness", t, signals, seed, at), truth)


def _windup(
    law: str, k: Mapping[str, float], slip: SlipLoop, t: Floats, load: Floats, moments: Floats, corners: Floats
) -> tuple[Floats, float]:
    """Windup (n,) under the load and the energy of the last whole loop [J]."""
    windup = np.zeros_like(load)
    stretch, start, energy = relaxed(), 0.0, 0.0
    for index in range(1, len(corners)):
        inside = (t >= moments[index - 1]) & (t <= moments[index])
        path = np.linspace(
            start, start + np.sign(corners[index] - corners[index - 1]) * _reach(law, k, corners), PATH_POINTS
        )
        held = spring.torque(law, k, path) + slip.along(path, stretch)[0]
        rising = 1.0 if path[-1] > path[0] else -1.0
        windup[inside] = np.interp(rising * load[inside], rising * held, path)
        end = float(np.interp(rising * corners[index], rising * held, path))
        part = np.linspace(start, end, PATH_POINTS)
        torque, stretch = slip.along(part, stretch)
        if len(corners) - 4 <= index - 1 < len(corners) - 2:
            energy += float(np.trapezoid(spring.torque(law, k, part) + torque, part))
        start = end
    return windup, energy


def _reach(law: str, k: Mapping[str, float], corners: Floats) -> float:
    """Windup [rad] from one end of the loop beyond the other, of the softer sign of a spring with even powers."""
    top = 1.2 * float(np.max(np.abs(corners)))
    scale = 1e-4
    while float(np.min(np.abs(spring.torque(law, k, scale * np.array([-1.0, 1.0]))))) < top:
        scale *= 1.5
    return 2.0 * scale
