"""Kinematic error, stiffness, clearance and hysteresis of the mesh."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from hdfast import Scenario

from signatures.manoeuvres import Case, Curves, compare, held_speed, loop, orders
from signatures.picture import Curve, Signature

WINDUP, OUTPUT = "windup [µrad]", "output torque [N m]"
ORDER, TE = "order [cycles per motor turn]", "transmission error [µrad]"
REAL = Case((), {"te_scale": 1.0})


def _loop(term: str, values: Mapping[str, float], top: float) -> Curves:
    return compare(partial(loop, top=top, duration=4.0), term, values)


def _lines(case: Case) -> Curve:
    order, amplitude = orders(case, 15.0, 121, "te", (0.95, 1.05), points=32)
    return order, 1e6 * amplitude


def _beat(case: Case) -> Curve:
    turns, te = held_speed(case, 15.0, 121, "te", 16)
    return turns, 1e6 * te


def _both_ways(case: Case) -> Curve:
    t = np.linspace(0.0, 16.0, 401)
    turns = 2.0 * (1.0 - np.abs(1.0 - t / 8.0))
    smooth = np.convolve(np.pad(turns, 10, mode="edge"), np.hanning(21) / np.hanning(21).sum(), mode="valid")
    te = case.run(Scenario.motion(t, 2.0 * np.pi * smooth), t, ["te"])["te"]
    return smooth, 1e6 * te


def _pulses(case: Case) -> Curve:
    turns, te = held_speed(case, 15.0, 3, "te", 400)
    return turns, 1e6 * te


def _teeth(case: Case) -> Curve:
    turns, te = held_speed(case, 2.0, 1, "te", 6000)
    part = turns < 0.03
    return turns[part], 1e6 * (te[part] - np.mean(te[part]))


def _order_two(case: Case) -> Curve:
    loads = np.linspace(-60.0, 60.0, 9)
    te = [held_speed(case, 15.0, 4, "te", 64, float(load))[1] for load in loads]
    return loads, np.array([2e6 * np.abs(np.fft.rfft(y)[8]) / len(y) for y in te])


def _creep(case: Case) -> Curve:
    held = np.linspace(0.0, 130.0, 9)
    load = ([0.0, 5.0, 5.2, 130.0], [0.0, 0.0, 20.0, 20.0])
    t = 5.0 + np.linspace(0.6, 125.0, 600)
    run = case.run(Scenario.motion(held, 0.0 * held, load=load), t, ["te"], max_steps=20_000_000, rtol=1e-6)
    return t - 5.0, 1e6 * run["te"]


def _struck(case: Case, top: float, damping: float) -> Curve:
    """Input locked; the load is raised to `top` within a second and taken away again."""
    held = np.linspace(0.0, 2.5, 9)
    t = np.linspace(0.8, 2.5, 1201)
    load = ([0.0, 1.0, 1.02, 2.5], [0.0, top, 0.0, 0.0])
    damped = Case(case.terms, {**case.values, "B_l": damping})
    return t, 1e6 * damped.run(Scenario.motion(held, 0.0 * held, load=load), t, ["te"])["te"]


MESH = {
    "coupling_slip": Signature(
        "Input locked, torque raised just beyond what the coupling holds and taken away: the angle does not come back.",
        "time [s]", TE, compare(partial(_struck, top=101.0, damping=20.0), "coupling_slip", {}),
    ),
    "ratcheting": Signature(
        "Input locked, overloaded and relieved: the output rests whole teeth further, 1.49 deg each.",
        "time [s]", TE, compare(partial(_struck, top=355.0, damping=300.0), "ratcheting", {}),
    ),
    "te_harmonic": Signature(
        "15 r/min over one output turn: one more sharp line beside order 1, here 10 µrad at order 120/121.",
        ORDER, "TE amplitude [µrad]",
        compare(_lines, "te_harmonic", {"A_cos": 1e-5}, REAL), "bars",
    ),
    "te_load_dependence": Signature(
        "Line of order 2 at 15 r/min under several loads: its size follows the load.",
        "load torque [N m]", "TE at order 2 [µrad]",
        compare(_order_two, "te_load_dependence", {"A_cos": 7e-7}, REAL),
    ),
    "te_beat": Signature(
        "15 r/min over one output turn: two beats of the orders 2 and 240/121.",
        "motor angle [turns]", TE, compare(_beat, "te_beat", {"A_cos": 6e-5}, REAL),
    ),
    "te_hysteresis": Signature(
        "Two turns forward and back: the branches lie apart by twice direction_offset.",
        "motor angle [turns]", TE,
        compare(_both_ways, "te_hysteresis", {"direction_offset": 3e-5}, REAL),
    ),
    "tooth_passage": Signature(
        "2 r/min, a few degrees of the motor: a line of 240 cycles per turn, which most recordings fold.",
        "motor angle [turns]", "TE less its mean [µrad]",
        compare(_teeth, "tooth_passage", {}),
    ),
    "local_fault": Signature(
        "15 r/min: a pulse each time the damaged place passes.",
        "motor angle [turns]", TE, compare(_pulses, "local_fault", {}),
    ),
    "backlash": Signature(
        "Input locked, slow torque of 4 % of the rated: a flat piece around zero, as wide at any torque.",
        WINDUP, OUTPUT, _loop("backlash", {}, 2.7),
    ),
    "soft_windup": Signature(
        "Input locked, slow torque: softer around zero.", WINDUP, OUTPUT, _loop("soft_windup", {"delta_K": 1.5e4}, 6.0),
    ),
    "mesh_stiffness_variation": Signature(
        "Line of order 2 at 15 r/min under several loads, no kinematic error: it grows with the size of the load.",
        "load torque [N m]", "TE at order 2 [µrad]",
        compare(_order_two, "mesh_stiffness_variation", {"eps_2": 0.05, "eps_o": 0.0}),
    ),
    "hysteresis": Signature(
        "Input locked, slow torque: a loop, the same at any rate.",
        WINDUP, OUTPUT, _loop("hysteresis", {"T_h": 4.0}, 30.0),
    ),
    "maxwell_slip": Signature(
        "Input locked, slow torque: a loop, the same at any rate, inside of which smaller ones nearly close.",
        WINDUP, OUTPUT, _loop("maxwell_slip", {"T_h": 4.0}, 30.0),
    ),
    "viscoelastic": Signature(
        "Input locked, 20 N m applied and held: the windup creeps for minutes.",
        "time after loading [s]", "windup [µrad]",
        compare(_creep, "viscoelastic", {}),
    ),
}  # fmt: skip
