"""Stops, breakaways and jumps wherever in a step they lie: steps of the engine's choice see what short ones see."""

import hdfast
import numpy as np
import pytest
from drives import linear, parameters
from hdfast import Scenario
from hypothesis import given, settings
from hypothesis import strategies as st
from termed import VALUES, simulate, torque_steps

PULLED = ["coulomb_friction", "load_side_friction", "external_periodic_torque"]


def assert_as_in_short_steps(p, terms, scenario, t, signals, tolerance=1e-6):
    """What the engine computes with steps of its own choice is what it computes with very short ones."""
    own, short = (simulate(p, terms, scenario, t, signals, rtol=1e-8, max_step=step) for step in (np.inf, 4e-5))
    sizes = np.max(np.abs(short), axis=1, keepdims=True)
    assert np.all(np.abs(own - short) <= tolerance * np.maximum(sizes, 1e-9)), (own, short)


@pytest.mark.parametrize("share", [0.999, 1.001, 1.05])
def test_exact_pull_at_rest_moves_where_it_exceeds_what_holds(share):
    """A drive at rest, whose steps would grow, feels every peak of an alternating torque; below the level none."""
    level = VALUES["load_side_friction"]["T_cl"]
    p = linear(coulomb_friction_T_c=0.04, T_cl=level, T_external=share * level, f_external=60.0, psi=0.0)
    t = np.linspace(0.0, 1.0, 11)
    theta_l, omega_m = simulate(p, PULLED, torque_steps([(1.0, 0.0)]), t, ["theta_l", "omega_m"])
    assert np.all(omega_m == 0.0)
    assert np.all(theta_l == 0.0) if share < 1.0 else np.all(np.diff(theta_l) < 0.0) or np.all(np.diff(theta_l) > 0.0)
    assert_as_in_short_steps(p, PULLED, torque_steps([(1.0, 0.0)]), t, ["theta_l"])


@settings(max_examples=25)
@given(
    levels=st.tuples(st.floats(-2.5, -1.3), st.floats(-1.0, 0.8)),
    pull=st.tuples(st.floats(-0.5, 1.3), st.floats(5.0, 200.0), st.floats(-3.0, 3.0)),
    torques=st.tuples(st.floats(0.0, 0.1), st.floats(-0.05, 0.05)),
)
def test_against_short_steps_where_shafts_are_pulled_to_and_fro(levels, pull, torques):
    p = linear(
        coulomb_friction_T_c=10 ** levels[0],
        T_cl=10 ** levels[1],
        T_external=10 ** pull[0],
        f_external=pull[1],
        psi=pull[2],
    )
    scenario = torque_steps([(0.3, torques[0]), (0.6, torques[1])])
    assert_as_in_short_steps(p, PULLED, scenario, np.linspace(0.0, 0.6, 4), ["theta_m"], 1e-4)


@pytest.mark.parametrize("rtol", [1e-5, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("load", [0.0, 10.0])
@pytest.mark.parametrize("term", ["coulomb_friction", "stribeck_friction", "load_dependent_friction"])
def test_regress_a_controller_that_brings_a_shaft_to_rest_leaves_it_there(term, load, rtol):
    """Its torque ends exactly at what friction holds, where rounding let the shaft go with every step."""
    scenario = Scenario.start_stop(speed_rpm=120, start="speed_ramp", stop="brake", t_off=1.5, t_end=6.0, load=load)
    rows = {"J_m": np.linspace(4e-4, 1e-3, 100)}
    result = hdfast.sweep(
        rows, model=hdfast.Model(terms=[term]), scenario=scenario, metrics=["te_pp"], rtol=rtol, method="dop853"
    )
    assert result.finished.all()
    assert result.steps.max() < 1.5 * np.median(result.steps)


def test_against_short_steps_coupling_that_slips_at_a_peak():
    """A held drive whose coupling slips at peaks of an alternating torque that are over within a step."""
    terms = ["coulomb_friction", "coupling_slip", "external_periodic_torque"]
    p = linear(coulomb_friction_T_c=5.0, T_slip=6.0, relief=0.1, T_external=5.8, f_external=7.0, psi=0.0)
    t = np.linspace(0.0, 1.0, 6)
    assert_as_in_short_steps(p, terms, torque_steps([(1.0, 0.0)]), t, ["windup", "theta_l"], 1e-5)


@pytest.mark.parametrize("s", [0.3, 1.0])
def test_exact_a_shaft_breaks_away_once_where_its_drag_differs_by_direction(s):
    """The output drags at the resting motor: what holds it counts the drag of the way it would go."""
    terms = ["stribeck_friction", "asymmetric_friction", "gravity_unbalance"]
    row = {name: value for term in terms for name, value in VALUES[term].items()} | {"s": s}
    scenario = Scenario.start_stop(stop="coast", t_on=0.1, t_off=0.3, t_end=0.8, load=6.0)
    result = hdfast.sweep(row, model=hdfast.Model(terms=terms), scenario=scenario, metrics=[], rtol=1e-12)
    assert result.finished.all()
    assert result.rejected[0] < 0.1 * result.steps[0]


def test_exact_event_in_a_step_of_no_length():
    """A drive breaks away between two knots of a table that are one rounding apart."""
    scenario = Scenario.torque_profile([0.0, 0.3, 0.1 * 3, 1.0], [0.0, 0.0, 1.0, 1.0])
    t = np.linspace(0.0, 1.0, 11)
    speed = simulate(parameters(), ["coulomb_friction"], scenario, t, ["omega_m"])[0]
    np.testing.assert_allclose(speed[:4], 0.0, atol=1e-12)
    assert np.all(speed[4:] > 0.0)


def test_exact_reversal_without_friction_is_no_stop():
    """A motor that turns round inside the gap, where nothing presses on its friction, goes on behind it as it came."""
    terms = ["backlash", "load_dependent_friction"]
    t = np.linspace(0.0, 0.2, 41)
    scenario = Scenario.torque_profile([0.0, 0.02, 0.02, 0.2], [0.02, 0.02, -0.02, -0.02])
    smooth, dry = (
        simulate(
            linear(half_gap=3e-4, c_drive=c, c_back=c, B_sp=0.0),
            terms,
            scenario,
            t,
            ["omega_m"],
            rtol=1e-9,
        )[0]
        for c in (0.0, 1e-9)
    )
    np.testing.assert_allclose(dry, smooth, atol=1e-6)
