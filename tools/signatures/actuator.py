"""Motor and drive."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from hdfast import Scenario

from signatures.manoeuvres import Case, Curves, compare
from signatures.picture import Curve, Signature

TIME, SPEED = "time after the step [ms]", "motor speed [r/min]"
PER_RPM = 60.0 / (2.0 * np.pi)


def _step(case: Case, torque: float, duration: float) -> Curve:
    lead = 0.002
    scenario = Scenario.torque_profile([0.0, lead, lead, lead + duration], [0.0, 0.0, torque, torque])
    t = np.linspace(0.0, lead + duration, 600)
    return 1e3 * (t - lead), PER_RPM * case.run(scenario, t, ["omega_m"])["omega_m"]


def _steps(term: str, values: Mapping[str, float], torque: float, duration: float) -> Curves:
    return compare(partial(_step, torque=torque, duration=duration), term, values)


def _speed_orders(case: Case, rpm: float, keep: tuple[float, float], load: float = 0.0) -> Curve:
    turns = 8
    lead = 3.0
    end = lead + (turns + 1) * 60.0 / rpm
    scenario = Scenario.speed_profile([0.0, 1.0, end], speed_rpm=[0.0, rpm, rpm], K_p=0.02, K_i=0.05, load=load)
    t = np.linspace(lead, end, 20_000)
    run = case.run(scenario, t, ["theta_m", "omega_m"])
    first = np.ceil(run["theta_m"][0] / (2.0 * np.pi))
    grid = 2.0 * np.pi * (first + np.arange(turns * 256) / 256)
    omega = np.interp(grid, run["theta_m"], run["omega_m"])
    size = 2.0 * np.abs(np.fft.rfft(omega)) / len(omega) * PER_RPM
    order = np.arange(len(size)) / turns
    chosen = (order >= keep[0]) & (order <= keep[1]) & (size > 1e-3 * np.max(size[4:]))
    return order[chosen], size[chosen]


def _ripples(
    term: str, values: Mapping[str, float], rpm: float, keep: tuple[float, float], load: float = 0.0
) -> Curves:
    return compare(partial(_speed_orders, rpm=rpm, keep=keep, load=load), term, values)


def _gain(case: Case) -> Curve:
    scenario = Scenario.torque_profile([0.0, 0.5, 0.5, 1.0, 1.0, 1.5], [0.0, 0.0, 0.2, 0.2, 0.0, 0.0])
    t = np.linspace(0.4, 1.5, 600)
    return t - 0.5, PER_RPM * case.run(scenario, t, ["omega_m"])["omega_m"]


ACTUATOR = {
    "delay": Signature(
        "Torque step of 0.1 N m: the motor starts late.", TIME, SPEED, _steps("delay", {"tau_d": 2e-3}, 0.1, 0.012)
    ),
    "actuator_lag": Signature(
        "Torque step of 0.1 N m: the speed starts with a horizontal tangent and stays behind by tau_e.",
        TIME, SPEED, _steps("actuator_lag", {"tau_e": 2e-3}, 0.1, 0.012),
    ),
    "torque_saturation": Signature(
        "Torque step of 1.5 N m: the slope is that of the limit.",
        TIME, SPEED, _steps("torque_saturation", {"tau_limit": 0.6, "tau_stall": 3.0}, 1.5, 0.06),
    ),
    "torque_gain": Signature(
        "Torque of 0.2 N m for half a second: every speed is off by the same factor.",
        "time after the step [s]", SPEED,
        compare(_gain, "torque_gain", {"gain_error": 0.1}),
    ),
    "torque_ripple": Signature(
        "60 r/min against 30 N m: lines of the speed at 1, 2 and 6 times the pole pairs.",
        "order [cycles per motor turn]", "speed amplitude [r/min]",
        _ripples("torque_ripple", {"r_2": 0.03, "r_6": 0.03, "tau_off": 0.005}, 60.0, (2.0, 30.0), 30.0), "bars",
    ),
    "cogging": Signature(
        "30 r/min without load: a line of the speed at the cogging order, whatever the current.",
        "order [cycles per motor turn]", "speed amplitude [r/min]",
        _ripples("cogging", {"T_cog": 0.01, "T_cog_2": 0.005}, 30.0, (2.0, 56.0)), "bars",
    ),
}  # fmt: skip
