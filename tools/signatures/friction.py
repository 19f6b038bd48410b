"""Friction and drag."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from hdfast import Scenario

from signatures.manoeuvres import Case, Curves, compare, held_speed, ladder
from signatures.picture import Curve, Signature

SPEED, TORQUE, TIME = "motor speed [r/min]", "motor torque [mN m]", "time [s]"
SLOW = [-30.0, -20.0, -12.0, -6.0, -2.0, -0.2, 0.2, 2.0, 6.0, 12.0, 20.0, 30.0]
FINE = [*-np.geomspace(60.0, 1.0, 14), *np.geomspace(1.0, 60.0, 14)]
WIDE = [*-np.linspace(600.0, 20.0, 12), *np.linspace(20.0, 600.0, 12)]
DRY = Case(("coulomb_friction",), {"T_c": 0.03})


def _ladder(term: str, values: Mapping[str, float], speeds: Sequence[float], company: Case | None = None) -> Curves:
    return compare(partial(ladder, speeds_rpm=speeds), term, values, company)


def _coast(case: Case, speed: float, end: float) -> Curve:
    scenario = Scenario.start_stop(speed_rpm=speed, start="speed_ramp", t_off=2.0, t_end=end)
    t = np.linspace(1.9, end, 900)
    return t - 2.0, case.run(scenario, t, ["omega_m"])["omega_m"] * 60.0 / (2.0 * np.pi)


def _rocking(case: Case, degrees: float) -> Curve:
    t = np.linspace(0.0, 3.0, 1201)
    angle = np.radians(degrees) * np.sin(2.0 * np.pi * t)
    tau = case.run(Scenario.motion(t, angle), t[400:], ["tau_m"])["tau_m"]
    return np.degrees(angle[400:]), 1e3 * tau


def _over_load(case: Case) -> Curve:
    loads = np.linspace(-60.0, 60.0, 13)
    torque = [np.mean(held_speed(case, 30.0, 1, "tau_m", 128, load)[1]) - load / 121.0 for load in loads]
    return loads, 1e3 * np.array(torque)


def _offset(case: Case) -> Curve:
    t = np.linspace(0.0, 6.0, 1201)
    angle = 3.0 * 2.0 * np.pi * (1.0 - np.cos(2.0 * np.pi * t / 3.0)) / 2.0
    return t[200:], 1e6 * case.run(Scenario.motion(t, angle), t[200:], ["windup"])["windup"]


def _ripple(case: Case) -> Curve:
    forward = held_speed(case, 15.0, 2, "tau_m", 200)
    back = held_speed(case, -15.0, 2, "tau_m", 200)
    return np.concatenate([forward[0], [np.nan], -back[0]]), 1e3 * np.concatenate([forward[1], [np.nan], back[1]])


def _warming(case: Case) -> Curve:
    end = 3600.0
    knots = np.linspace(0.0, end, 64)
    t = np.linspace(1.0, end, 120)
    run = case.run(Scenario.motion(knots, 600.0 * np.pi / 30.0 * knots), t, ["tau_m"], max_steps=2**31 - 1)
    return t / 60.0, 1e3 * run["tau_m"]


FRICTION = {
    "coulomb_friction": Signature(
        "Coasting from 100 r/min: viscous drag alone dies out without end, dry friction brings an exact stop.",
        TIME,
        "motor speed [r/min]",
        compare(partial(_coast, speed=100.0, end=3.5), "coulomb_friction", {"T_c": 0.02}),
    ),
    "coulomb_friction_smooth": Signature(
        "Speed ladder: the level turns over within the speed omega_eps (0.5 rad/s here) instead of jumping.",
        SPEED,
        TORQUE,
        _ladder("coulomb_friction_smooth", {"T_c": 0.03, "omega_eps": 0.5}, list(np.linspace(-15.0, 15.0, 32))),
    ),
    "stribeck_friction": Signature(
        "Speed ladder: the torque falls before it rises.", SPEED, TORQUE,
        _ladder("stribeck_friction", {"T_c": 0.03, "breakaway_ratio": 1.5}, FINE),
    ),
    "presliding_friction": Signature(
        "Motor rocked by 1 degree at 1 Hz: a loop that starts like a spring before it slides.",
        "motor angle [degrees]",
        TORQUE,
        compare(partial(_rocking, degrees=1.0), "presliding_friction", {"sigma_0": 5.0}),
    ),
    "asymmetric_friction": Signature(
        "Speed ladder with dry friction of 30 mN m: the level differs between the directions by 2 eps_c T_c.",
        SPEED, TORQUE, _ladder("asymmetric_friction", {"eps_c": 0.15}, SLOW, DRY),
    ),
    "load_dependent_friction": Signature(
        "Load grid at 30 r/min, torque for the load taken off: friction grows with the size of the load.",
        "load torque [N m]",
        "torque less load / ratio [mN m]",
        compare(_over_load, "load_dependent_friction", {}),
    ),
    "load_side_friction": Signature(
        "Motor turned to and fro: the windup takes an offset of T_cl / K that follows the direction.",
        TIME,
        "windup [µrad]",
        compare(_offset, "load_side_friction", {"T_cl": 1.0}),
    ),
    "nonlinear_viscous": Signature(
        "Speed ladder: the line bends.", SPEED, TORQUE,
        _ladder("nonlinear_viscous", {"drag_torque": 0.05}, WIDE),
    ),
    "position_dependent_friction": Signature(
        "15 r/min in both directions with dry friction: the ripple keeps its place and changes its sign.",
        "motor angle [turns]",
        TORQUE,
        compare(_ripple, "position_dependent_friction", {"friction_ripple": 0.2}, DRY),
    ),
    "thermal_viscous": Signature(
        "600 r/min held for an hour: the torque falls as the drive warms.",
        "time [min]",
        TORQUE,
        compare(_warming, "thermal_viscous", {}),
    ),
    "wear_run_in": Signature(
        "Speed ladder after ten hours of running, with dry friction: every torque has fallen by the same share.",
        SPEED, TORQUE, _ladder("wear_run_in", {"friction_wear": 0.3}, WIDE, DRY),
    ),
}  # fmt: skip
