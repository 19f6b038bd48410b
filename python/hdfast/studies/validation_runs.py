"""What the validation simulates: runs held at the article's speeds, starts, a stop, a static fit, a torque loop."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.bench.kinematic_error import motion
from hdfast.bench.rig import record, rig
from hdfast.bench.stiffness import stiffness as torque_loop
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.fit import Fit
from hdfast.identify.kinematic_error import kinematic_error
from hdfast.identify.stiffness import stiffness
from hdfast.model import Model
from hdfast.params import params
from hdfast.result import SweepResult
from hdfast.scenario import Scenario
from hdfast.scenario_parts import RPM
from hdfast.sensors import SensorFacts
from hdfast.simulate import Trajectory, simulate
from hdfast.studies import trends
from hdfast.studies.cases import LOADS

SPEEDS = (15.0, 50.0, 100.0, 300.0, 600.0)
POINTS = (15.0, 50.0, 100.0)
END, RUN_IN = 15.0, 2.0
SHOWN_TURNS = 8.0  # motor revolutions: as many as tell the orders apart in a spectrum
NOISE = 1.36e-6  # rad; the article's residual of 7.7665e-5, read as degrees
LOOP_RATE = 200.0  # Hz
SAMPLE_RATE = 1000.0  # of starts, Hz
MOST_RATIO = 1e4
METRICS = ("te_mean", "te_peak", "te_pp", "te_rms", "initial_te_peak", "rise_time", "mode_amplitude_start")


@dataclass(frozen=True, eq=False)
class Runs:
    """Everything the claims of the validation rest on.

    Attributes:
        drive: what differs from the defaults.
        held: `METRICS` over `LOADS` and `SPEEDS`.
        from_rest: start and run at each of `POINTS` [r/min].
        released: start from zero angles at the first of `POINTS`.
        stop: torque step and coast at 100 r/min.
        fit: series of the kinematic error at 15 r/min.
        loop: spring from a torque loop at the locked input.
    """

    drive: Mapping[str, float]
    held: SweepResult
    from_rest: dict[float, Trajectory]
    released: Trajectory
    stop: Trajectory
    fit: Fit
    loop: Fit

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters by name."""
        return parameters(self.drive)


def parameters(drive: Mapping[str, float]) -> dict[str, float]:
    """All parameters by name; `drive` holds what differs from the defaults."""
    return {row.name: row.default for row in params()} | dict(drive)


def require(drive: Mapping[str, float]) -> None:
    """Refuse a drive on which the claims cannot be decided, before anything is simulated.

    Raises:
        InputError: the ratio is not positive or beyond what is identified, or the samples of a start miss the mode.
    """
    p = parameters(drive)
    checks.positive("ratio", p["ratio"], MOST_RATIO)
    if p["k1"] >= trends.inertias(p)[2] * (2.0 * math.pi * SAMPLE_RATE) ** 2:
        mode = trends.free_frequency(p) / (2.0 * math.pi)
        raise InputError(
            f"ratio = {p['ratio']:g}, J_m = {p['J_m']:g} kg m^2 and k1 = {p['k1']:g} N m/rad put the torsional mode at "
            f"{mode:.4g} Hz (allowed for validate: below {SAMPLE_RATE:g} Hz)"
        )


def runs(drive: Mapping[str, float] | None, threads: int | None) -> Runs:
    """Simulate everything; `drive` holds what differs from the defaults.

    Raises:
        InputError: as `require`.
    """
    changed = dict(drive or {})
    require(changed)
    bench = torque_loop(changed, sensors=rig(LOOP_RATE))
    return Runs(
        changed,
        _held(changed, threads),
        {speed: _from_rest(changed, speed) for speed in POINTS},
        _from_rest(changed, POINTS[0], "zero_angle"),
        simulate(changed, scenario=Scenario.start_stop(speed_rpm=100.0)),
        _static_fit(changed),
        stiffness(bench.recording),
    )


def te(held: SweepResult, metric: str, load: float) -> Floats:
    """A metric over `SPEEDS` at a load inertia [kg m^2]."""
    rows = np.arange(len(held)).reshape(len(LOADS), len(SPEEDS))[LOADS.index(load)]
    return np.asarray(held[metric][rows])


def _held(drive: Mapping[str, float], threads: int | None) -> SweepResult:
    from hdfast.sweep import sweep

    shape = (len(LOADS), len(SPEEDS))
    columns: dict[str, Any] = dict(drive)
    columns["J_l"] = np.repeat(LOADS, len(SPEEDS))
    columns["omega_set"] = np.tile(np.array(SPEEDS) * RPM, len(LOADS))
    scenarios = []
    for speed in SPEEDS:
        revolutions = max(3, math.floor((END - RUN_IN) * speed / 60.0))
        begin = END - revolutions * 60.0 / speed
        scenarios.append(
            Scenario.start_stop(speed_rpm=speed, start="speed_ramp", stop=None, t_end=END, run_window=(begin, END))
        )
    index = np.tile(np.arange(len(SPEEDS)), shape[0])
    return sweep(columns, scenario=scenarios, scenario_index=index, metrics=list(METRICS), rtol=1e-8, threads=threads)


def _from_rest(drive: Mapping[str, float], speed: float, initial: str = "relaxed") -> Trajectory:
    end = max(10.0, RUN_IN + SHOWN_TURNS * 60.0 / speed)
    scenario = Scenario.start_stop(
        speed_rpm=speed, start="speed_ramp", stop=None, t_end=end, initial=initial, run_window=(RUN_IN, end)
    )
    return simulate(drive, scenario=scenario, t_eval=np.linspace(0.0, end, round(SAMPLE_RATE * end) + 1))


def _static_fit(drive: dict[str, float]) -> Fit:
    sensors = rig(20.0, motor_angle=SensorFacts(), load_angle=SensorFacts(noise=NOISE))
    duration = 121.1 * 4.0
    t = sensors.times(duration)
    recorded = []
    for seed, speed in enumerate((15.0, -15.0)):
        signals = motion(drive, Model(), speed, duration, t)
        angles = {name: signals[name] for name in ("motor_angle", "load_angle")}
        recorded.append(record(sensors, f"{speed:g} r/min", t, angles, seed))
    return kinematic_error(recorded, ratio=parameters(drive)["ratio"])
