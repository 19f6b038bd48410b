"""Sensors: the same motion, read."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from hdfast import Model, Scenario, simulate
from hdfast.checks import Floats
from hdfast.sensors import SensorStage

from signatures.manoeuvres import RPM, Case, Curves
from signatures.picture import WITH, WITHOUT, Curve, Signature

TE, SECONDS = "transmission error [µrad]", "time [s]"
RATIO = 121.0
PAIR = [("clock_skew", "load_angle")]


@lru_cache(maxsize=8)
def _held(rpm: float, duration: float, rate: float, te_scale: float = 1.0) -> tuple[Floats, Floats, Floats]:
    """Time [s], motor and load angle [rad] at constant speed."""
    knots = np.linspace(0.0, duration, 64)
    t = np.linspace(0.0, duration, round(duration * rate) + 1)
    case = Case((), {"te_scale": te_scale})
    run = case.run(Scenario.motion(knots, rpm * RPM * knots), t, ["theta_m", "theta_l"])
    return t, run["theta_m"], run["theta_l"]


def _te(
    effect: str, channel: str, values: Mapping[str, float], rpm: float, duration: float, rate: float = 200.0
) -> Curves:
    def curves() -> dict[str, Curve]:
        t, motor, load = _held(rpm, duration, rate)
        found = {}
        for name, effects in ((WITHOUT, []), (WITH, [(effect, channel)])):
            stage = SensorStage(effects, values if effects else {}, seed=1)
            seen = stage.apply(t, {"motor_angle": motor, "load_angle": load})
            found[name] = t, 1e6 * (seen["motor_angle"] / RATIO - seen["load_angle"])
        return found

    return curves


def _ring(effect: str, values: Mapping[str, float], at_rate: float | None = None) -> Curves:
    """Output torque after a torque step at the motor."""

    def curves() -> dict[str, Curve]:
        t = np.linspace(0.0, 0.4, 4001)
        run = simulate({"te_scale": 0.0}, model=Model(), t_eval=t, signals=["gear_torque"], metrics=[])
        stage = SensorStage([(effect, "output_torque")], values, seed=1)
        at = t if at_rate is None else np.arange(0.0, 0.4, 1.0 / at_rate)
        seen = stage.apply(t, {"output_torque": run["gear_torque"]}, at=at)["output_torque"]
        return {WITHOUT: (t, run["gear_torque"]), WITH: (at, seen)}

    return curves


def _over_turn(effect: str, values: Mapping[str, float], rpm: float, part: float, points: int) -> Curves:
    def curves() -> dict[str, Curve]:
        t = np.linspace(0.0, part * 60.0 * RATIO / rpm, points)
        load = rpm * RPM / RATIO * t
        seen = SensorStage([(effect, "load_angle")], values).apply(t, {"load_angle": load})["load_angle"]
        turns = load / (2.0 * np.pi)
        return {WITHOUT: (turns, 0.0 * turns), WITH: (turns, 1e6 * (seen - load))}

    return curves


def _stairs() -> dict[str, Curve]:
    t, _, load = _held(0.5, 1.2, 500.0)
    seen = SensorStage([("quantisation", "load_angle")], {"resolution": 4.8e-5}).apply(t, {"load_angle": load})
    return {WITHOUT: (t, 1e6 * load), WITH: (t, 1e6 * seen["load_angle"])}


def _folded() -> dict[str, Curve]:
    t = np.linspace(0.0, 1.0, 4001)
    x = np.sin(2.0 * np.pi * 40.0 * t)
    seen = SensorStage([("aliasing", "output_torque")], {"f_s": 43.0}).apply(t, {"output_torque": x})["output_torque"]
    return {WITHOUT: (t, x), WITH: (t, seen)}


def _noise_over_speed() -> dict[str, Curve]:
    speeds = np.array([5.0, 15.0, 50.0, 100.0, 200.0, 400.0, 600.0])
    size = []
    stage = SensorStage([("sampling_jitter", "motor_angle")], {"jitter": 2e-5}, seed=1)
    t = np.arange(4000) * 1e-3
    for rpm in speeds:
        motor = rpm * RPM * t
        size.append(np.std(stage.apply(t, {"motor_angle": motor})["motor_angle"] - motor))
    return {WITHOUT: (speeds, 0.0 * speeds), WITH: (speeds, 1e6 * np.array(size))}


def _offset_over_speed(effect: str, values: Mapping[str, float]) -> Curves:
    def curves() -> dict[str, Curve]:
        speeds = np.array([-100.0, -50.0, -15.0, 15.0, 50.0, 100.0])
        found: dict[str, list[float]] = {WITHOUT: [], WITH: []}
        for rpm in speeds:
            t, motor, load = _held(float(rpm), 4.0, 200.0, 0.0)
            for name, effects in ((WITHOUT, []), (WITH, [(effect, "load_angle")])):
                stage = SensorStage(effects, values if effects else {})
                seen = stage.apply(t, {"load_angle": load})["load_angle"]
                found[name].append(1e6 * float(np.mean(motor / RATIO - seen)))
        return {name: (speeds, np.array(size)) for name, size in found.items()}

    return curves


def _drifting() -> dict[str, Curve]:
    t = np.linspace(0.0, 600.0, 601)
    x = np.where((t > 200.0) & (t < 400.0), 20.0, 0.0)
    stage = SensorStage([("sensor_offset_drift", "output_torque")], {"offset": 0.5, "drift": 2e-3})
    return {WITHOUT: (t, x), WITH: (t, stage.apply(t, {"output_torque": x})["output_torque"])}


def _skewed() -> dict[str, Curve]:
    found = {}
    for name, rpm, effects in ((WITHOUT, 100.0, []), ("with, 100 r/min", 100.0, PAIR), ("with, 50 r/min", 50.0, PAIR)):
        t, motor, load = _held(rpm, 30.0, 10.0, 0.0)
        seen = SensorStage(effects, {"skew": 5e-5} if effects else {}).apply(t, {"load_angle": load})["load_angle"]
        found[name] = t, 1e6 * (motor / RATIO - seen)
    return found


def _noisy() -> dict[str, Curve]:
    return _te("sensor_noise", "load_angle", {"noise": 1e-5}, 15.0, 4.0)()


SENSOR = {
    "encoder_eccentricity": Signature(
        "One output turn: the reading is off by one wave per turn of the shaft that carries the encoder.",
        "output angle [turns]", "error of the load angle [µrad]",
        _over_turn("encoder_eccentricity", {"psi": 0.5}, 15.0, 1.0, 400),
    ),
    "encoder_interpolation_error": Signature(
        "A hundredth of an output turn: one wave per line of the encoder.",
        "output angle [turns]", "error of the load angle [µrad]",
        _over_turn("encoder_interpolation_error", {}, 15.0, 0.005, 1200),
    ),
    "ratio_error": Signature(
        "15 r/min: the transmission error grows with the angle; it comes back with it.",
        SECONDS, TE, _te("ratio_error", "motor_angle", {"ratio_error": 1e-3}, 15.0, 16.0, 50.0),
    ),
    "clock_skew": Signature(
        "Two speeds, load encoder on a clock slow by 50 parts per million: a ramp in time in proportion to the speed.",
        SECONDS, TE, _skewed,
    ),
    "sensor_lowpass": Signature(
        "Output torque after a torque step at the motor: the ring is smaller and late.",
        SECONDS, "output torque [N m]", _ring("sensor_lowpass", {"tau_s": 8e-3}),
    ),
    "sensor_averaging": Signature(
        "Output torque after a torque step at the motor, read 100 times per second as a mean.",
        SECONDS, "output torque [N m]", _ring("sensor_averaging", {}, 100.0),
    ),
    "aliasing": Signature(
        "A mode of 40 Hz converted 43 times per second without a filter shows at 3 Hz.",
        SECONDS, "output torque [N m]", _folded,
    ),
    "sampling_jitter": Signature(
        "Constant speeds: the noise of the angle grows with the speed.",
        "motor speed [r/min]", "noise of the motor angle, rms [µrad]", _noise_over_speed,
    ),
    "sensor_delay": Signature(
        "Constant speeds, load encoder late by 1 ms: the mean transmission error follows the speed and its sign.",
        "motor speed [r/min]", "mean transmission error [µrad]", _offset_over_speed("sensor_delay", {}),
    ),
    "sensor_offset_drift": Signature(
        "Torque cell loaded and unloaded: the zero before and after differ.",
        SECONDS, "output torque [N m]", _drifting,
    ),
    "sensor_noise": Signature(
        "15 r/min: noise beside the kinematic error, the same at any speed.", SECONDS, TE, _noisy, "behind",
    ),
    "quantisation": Signature(
        "0.5 r/min, 17 bit on the load: a staircase.", SECONDS, "load angle [µrad]", _stairs, "behind",
    ),
}  # fmt: skip
