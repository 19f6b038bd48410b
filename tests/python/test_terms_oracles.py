"""Every term, alone and in company, against the catalogue's equations solved by SciPy."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import RPM, SCENARIO, parameters
from oracles import left_out
from termed import COMBINATIONS, FEWER_TEETH, LOAD, RUN, VALUES, assert_close, simulate, torque_steps, with_company

EVERY = [
    *([term] for term in VALUES),
    *COMBINATIONS[:7],
    *(pytest.param(terms, marks=pytest.mark.long) for terms in COMBINATIONS[7:]),
]


def test_exact_every_term_has_an_oracle():
    assert {term.id for term in hdfast.terms() if not term.channels} == set(VALUES)
    for term, values in VALUES.items():
        table = hdfast.params(hdfast.Model(terms=[term]))
        plain = hdfast.params(hdfast.Model())
        assert {table.canonical(name) for name in values} == set(table.names) - set(plain.names), term


@pytest.mark.parametrize("terms", EVERY, ids="+".join)
def test_against_scipy(terms, long):
    """Trajectories with reversals, stops and breakaways, for every term alone and in company."""
    on, values = with_company(terms)
    if "teeth" in values and not long:
        values |= FEWER_TEETH
    p = parameters(s=0.4, **values)
    pieces = [(2.0 * end, torque) for end, torque in RUN] if long else RUN
    t = np.linspace(0.0, pieces[-1][0], 91)
    found = simulate(p, on, torque_steps(pieces, LOAD), t)
    expected = left_out.LeftOut(p, on, LOAD).solve(t, pieces, rtol=1e-11 if long else 1e-9)
    assert_close(found, expected, 1e-6)
    rest = [term for term in on if term not in terms]
    p = parameters(s=0.4, **{name: value for term in rest for name, value in VALUES[term].items()})
    without = simulate(p, rest, torque_steps(pieces, LOAD), t)
    assert np.max(np.abs(found[1] - without[1])) > 1e-4, "the term changes nothing"


def test_against_scipy_radau_bristles():
    """LuGre at 300 r/min against an implicit method."""
    terms = ["presliding_friction"]
    values = VALUES["presliding_friction"]
    p = parameters(**values)
    pieces = [(0.06, 0.25), (0.12, 0.07)]
    t = np.linspace(0.0, pieces[-1][0], 31)
    found = simulate(p, terms, torque_steps(pieces), t)
    expected = left_out.LeftOut(p, terms).solve(t, pieces, method="Radau", rtol=1e-10, max_step=1e-3)
    assert expected[1, -1] > 300 * RPM
    assert_close(found, expected, 1e-7)


LINES = ["te_harmonic", "te_load_dependence", "te_beat", "te_hysteresis"]
ERRORS = [*LINES, "tooth_passage", "local_fault", "wear_run_in"]


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
@pytest.mark.parametrize("terms", [[term] for term in ERRORS] + [LINES], ids="+".join)
def test_against_the_steepest_slope_of_a_period(terms, base):
    """The smallest local ratio takes in what terms add to the kinematic error."""
    p = parameters(**{name: value for term in terms for name, value in VALUES[term].items()})
    turns = 121 if {"te_harmonic", "te_beat"} & set(terms) else 1
    oracle = left_out.LeftOut(p, terms, LOAD)

    def slope(angle):
        settled = [angle, p["omega_set"], 0.0, 0.0, 1.0]
        return oracle.kinematic_error(settled, np.zeros(oracle.size))[1]

    row = {name: value for name, value in p.items() if name not in SCENARIO}
    scenario = hdfast.Scenario.start_stop(load=LOAD)
    found = hdfast.sweep(row, model=hdfast.Model(base, terms=terms), scenario=scenario, metrics=["upsilon_min"])
    steepest = largest(slope, turns)
    expected = 1 / p["ratio"] - steepest
    assert abs(found["upsilon_min"][0] - expected) < 1e-4 * steepest
    if terms != ["te_hysteresis"]:
        nominal = largest(lambda angle: oracle.gear.theta_e(angle, 1), turns)
        assert abs(expected - (1 / p["ratio"] - nominal)) > 1e-2 * steepest


def largest(function, turns):
    """Of a function of the motor angle over so many turns: the top of a grid, and of a fine one around it."""
    angle, spacing = np.linspace(0.0, 2 * np.pi * turns, 400_001, retstep=True)
    top = angle[np.argmax(function(angle))]
    return function(np.linspace(top - spacing, top + spacing, 2001)).max()


@pytest.mark.parametrize("term", ERRORS)
def test_exact_a_relaxed_start_winds_the_spring_for_its_load_alone(term):
    p = parameters(**VALUES[term])
    row = {name: value for name, value in p.items() if name not in SCENARIO} | {"theta_m0": 1.3}
    scenario = hdfast.Scenario.start_stop(load=LOAD)
    options = {"scenario": scenario, "t_eval": [0.0], "signals": ["windup"], "metrics": []}
    found = hdfast.sweep(row, model=hdfast.Model(terms=[term]), **options)["windup"]
    nominal = hdfast.sweep({"theta_m0": 1.3}, **options)["windup"]
    np.testing.assert_allclose(found, nominal, rtol=1e-9)
