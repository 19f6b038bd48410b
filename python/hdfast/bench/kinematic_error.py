"""The virtual transmission-error test: slow constant speed, both directions, simulated by the engine."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdfast import checks
from hdfast.bench.rig import record, rig
from hdfast.catalogue import FINISHED
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.model import Model
from hdfast.recordings import Recording
from hdfast.request import MAX_STEPS
from hdfast.scenario import Scenario
from hdfast.sensors import SensorStage
from hdfast.simulate import Trajectory, simulate

RUN_IN, RAMP = 2.0, 0.5
TOLERANCE = 1e-8
MARGIN = 0.02  # revolutions beyond the whole number, so that rounding of the angle loses none


def motion(
    drive: Mapping[str, float] | None,
    model: Model,
    speed_rpm: float,
    duration: float,
    t: Floats,
    load: float = 0.0,
) -> dict[str, Floats]:
    """Noise-free signals (n,) of a run held at constant speed, at the times t [s] (n,) after the run-in."""
    end = RUN_IN + duration
    scenario = Scenario.speed_profile([0.0, RAMP, end], speed_rpm=[0.0, speed_rpm, speed_rpm], t_end=end, load=load)
    run = simulate(
        dict(drive or {}),
        model=model,
        scenario=scenario,
        t_eval=np.minimum(RUN_IN + t, end),
        signals=["theta_m", "theta_l", "tau_m", "gear_torque"],
        metrics=[],
        rtol=TOLERANCE,
        max_steps=MAX_STEPS,
        strict=True,
    )
    whole(run)
    return {
        "motor_angle": run["theta_m"],
        "motor_torque": run["tau_m"],
        "load_angle": run["theta_l"],
        "output_torque": run["gear_torque"],
    }


def whole(run: Trajectory) -> None:
    """Refuse a simulation that ended before its time.

    Raises:
        InputError: with the engine's remedy.
    """
    if run.status != FINISHED:
        raise InputError(f"the bench cannot be simulated: {run.message}")


def kinematic_error(
    drive: Mapping[str, float] | None = None,
    *,
    model: Model | None = None,
    speed_rpm: float = 15.0,
    revolutions: int = 121,
    sensors: SensorStage | None = None,
    seed: int = 1,
) -> list[Recording]:
    """Record whole motor revolutions forward and backward.

    Args:
        drive: parameters that differ from the defaults.
        model: the equations.
        speed_rpm: held motor speed [r/min].
        revolutions: motor revolutions in each direction; `ratio` of them are one of the output.
        sensors: the sensors; default `rig()`.
        seed: seed of noise and encoder positions.

    Raises:
        InputError: naming the argument, its value and the allowed range.
    """
    model = Model() if model is None else model
    stage = rig() if sensors is None else sensors
    speed = checks.positive("speed_rpm", speed_rpm, 1e4, "r/min")
    duration = 60.0 / speed * (checks.whole("revolutions", revolutions, 1, 10**6) + MARGIN)
    at = stage.times(duration)
    t = stage.grid(at)
    runs = []
    for index, (name, sign) in enumerate((("forward", 1.0), ("backward", -1.0))):
        signals = motion(drive, model, sign * speed, duration, t)
        runs.append(record(stage, name, t, signals, [seed, index], at))
    return runs
