"""The virtual start-stop test: any scenario of the engine through the sensors."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.bench.kinematic_error import whole
from hdfast.bench.rig import record, rig
from hdfast.model import Model
from hdfast.recordings import Recording
from hdfast.request import MAX_STEPS
from hdfast.scenario import Scenario
from hdfast.sensors import SensorStage
from hdfast.simulate import simulate

SIGNALS = {
    "motor_angle": "theta_m",
    "motor_torque": "tau_m",
    "load_angle": "theta_l",
    "output_torque": "gear_torque",
}


def startstop(
    drive: Mapping[str, float] | None = None,
    *,
    model: Model | None = None,
    scenario: Scenario | None = None,
    sensors: SensorStage | None = None,
    seed: int = 1,
) -> Recording:
    """Record a start, run and stop.

    Args:
        drive: parameters that differ from the defaults.
        model: the equations.
        scenario: the inputs; default `Scenario.start_stop()`.
        sensors: the sensors; default `rig()`.
        seed: seed of noise and encoder positions.

    Raises:
        InputError: an argument cannot mean anything, or the drive does not come to the end of the scenario.
        RowError: the drive cannot be simulated.
    """
    chosen = Scenario.start_stop() if scenario is None else scenario
    stage = rig() if sensors is None else sensors
    at = stage.times(chosen.t_end)
    t = stage.grid(at)
    run = simulate(
        dict(drive or {}),
        model=model,
        scenario=chosen,
        t_eval=t,
        signals=list(SIGNALS.values()),
        metrics=[],
        rtol=1e-8,
        max_steps=MAX_STEPS,
        strict=True,
    )
    whole(run)
    return record(stage, "startstop", t, {column: run[signal] for column, signal in SIGNALS.items()}, seed, at)
