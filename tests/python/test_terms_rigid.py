"""Terms on a rigid gear, and the torque that a drive delivers during a prescribed motion."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import linear, parameters
from oracles import left_out_rigid
from termed import FEWER_TEETH, LOAD, RUN, VALUES, assert_close, simulate, torque_steps, with_company

ALLOWED = [term.id for term in hdfast.terms() if "one_inertia" in term.bases]
REFUSED = [term.id for term in hdfast.terms() if term.bases == ("two_inertia",)]
COMBINATIONS = [
    ["coulomb_friction", "load_side_friction"],
    ["load_dependent_friction", "load_side_friction", "gravity_unbalance"],
    ["stribeck_friction", "position_dependent_friction", "asymmetric_friction", "torque_gain"],
    ["delay", "torque_saturation", "actuator_lag", "torque_ripple", "cogging"],
    ["presliding_friction", "coulomb_friction_smooth", "position_dependent_friction", "asymmetric_friction"],
    ["presliding_friction", "nonlinear_viscous", "external_periodic_torque", "coulomb_friction_smooth"],
    ["coulomb_friction", "load_dependent_friction", "thermal_viscous", "wear_run_in", "te_hysteresis"],
    ["te_harmonic", "te_load_dependence", "te_beat", "tooth_passage", "local_fault", "load_motor_ripple"],
]
ALONE = [pytest.param([term], marks=pytest.mark.long) for term in ALLOWED]


@pytest.mark.parametrize("terms", COMBINATIONS + ALONE, ids="+".join)
def test_against_scipy_rigid(terms, long):
    """Trajectories with reversals, stops and breakaways, for every term alone and in company."""
    on, values = with_company(terms)
    p = parameters(s=0.4, **values | FEWER_TEETH) if "teeth" in values else parameters(s=0.4, **values)
    pieces = [(2.0 * end, torque) for end, torque in RUN] if long else RUN
    t = np.linspace(0.0, pieces[-1][0], 91)
    found = simulate(p, on, torque_steps(pieces, LOAD), t, base="one_inertia")
    expected = left_out_rigid.RigidLeftOut(p, on, LOAD).solve(t, pieces, rtol=1e-10 if long else 1e-9)
    assert_close(found, expected, 1e-6)


@pytest.mark.parametrize("term", REFUSED)
def test_exact_terms_that_need_more_than_one_inertia_are_refused(term):
    with pytest.raises(hdfast.InputError, match=rf"{term}.*one_inertia.*allowed: two_inertia"):
        hdfast.Model("one_inertia", terms=[term])


@pytest.mark.parametrize(("order", "width"), [(240.0, 0.05), (60.0, 0.02), (2.0, 0.4)])
def test_against_short_steps_no_pulse_is_run_over(order, width):
    """Nothing but the pulses themselves would keep the steps of a rigid gear short."""
    row = {"fault_height": 5e-6, "order": order, "fault_width": width}
    scenario = hdfast.Scenario.start_stop(speed_rpm=100.0, t_off=0.6, t_end=0.7, run_window=(0.1, 0.6))
    model = hdfast.Model("one_inertia", terms=["local_fault"])
    metrics = ["speed_ripple_rms", "te_mean", "te_rms"]
    own, short = (
        hdfast.sweep(row, model=model, scenario=scenario, metrics=metrics, max_step=step) for step in (np.inf, 1e-5)
    )
    for name in metrics:
        np.testing.assert_allclose(own[name], short[name], rtol=1e-3)


def test_exact_dry_levels_of_both_sides_add():
    """A rigid shaft moves when the torque passes T_c + T_cl/i and not before; held, both carry the same share."""
    values = {"coulomb_friction_T_c": 0.03, "T_cl": 2.0}
    p = linear(**values)
    holding = 0.03 + 2.0 / p["ratio"]
    terms = ["coulomb_friction", "load_side_friction"]
    t = np.array([0.0, 1.0])
    for share in (0.5, 0.999, 1.001):
        scenario = torque_steps([(1.0, share * holding)])
        omega_m, gear = simulate(p, terms, scenario, t, ["omega_m", "gear_torque"], base="one_inertia")
        if share < 1.0:
            assert np.all(omega_m == 0.0)
            np.testing.assert_allclose(gear[-1], share * 2.0, rtol=1e-12)
        else:
            assert omega_m[-1] > 1e-3


def test_exact_gear_torque_of_a_shaft_that_breaks_away_at_once():
    """The sample at time 0 is that of the shaft let go: J_l alpha/i + load + T_cl."""
    torque, load, holding = 0.5, 5.0, 3.0
    p = linear(T_cl=holding)
    alpha = (torque - (load + holding) / p["ratio"]) / (p["J_m"] + p["J_l"] / p["ratio"] ** 2)
    expected = p["J_l"] * alpha / p["ratio"] + load + holding
    scenario = torque_steps([(1.0, torque)], load)
    gear = simulate(p, ["load_side_friction"], scenario, [0.0, 1e-9], ["gear_torque"], base="one_inertia")[0]
    np.testing.assert_allclose(gear, expected, rtol=1e-6)


@pytest.mark.parametrize("backwards", [False, True])
def test_exact_acceleration_under_load_dependent_friction(backwards):
    """J alpha = tau - T/i - c |T|/i with T = J_l alpha/i + load: one linear equation per sign of T."""
    p = linear(**VALUES["load_dependent_friction"], B_m=0.0, B_ml=0.0, B_l=0.0)
    way, load = (-1.0, 30.0) if backwards else (1.0, 30.0)
    torque = 0.6 * way
    share = p["c_back"] if backwards else p["c_drive"]
    seen = (1.0 + share * way) / p["ratio"]
    alpha = (torque - seen * load) / (p["J_m"] + seen * p["J_l"] / p["ratio"])
    t = np.array([0.0, 0.01])
    scenario = torque_steps([(0.01, torque)], load)
    omega_m, gear = simulate(
        p, ["load_dependent_friction"], scenario, t, ["omega_m", "gear_torque"], base="one_inertia"
    )
    np.testing.assert_allclose(omega_m[-1], alpha * 0.01, rtol=1e-9)
    np.testing.assert_allclose(gear[-1], p["J_l"] * alpha / p["ratio"] + load, rtol=1e-9)


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_lag_of_the_torque_asked_for_during_a_motion(base):
    """A ramp of torque behind a lag of first order, while the motor is moved; tau_m does not see it."""
    lag, rise = 5e-3, 3.0
    t = np.linspace(0.0, 0.05, 51)
    signals = ["tau_drive", "tau_m"]
    scenario = hdfast.Scenario.motion(t, 20.0 * t, torque=([0.0, 0.05], [0.0, 0.05 * rise]))
    drive, needed = simulate(linear(tau_e=lag), ["actuator_lag"], scenario, t, signals, base=base)
    np.testing.assert_allclose(drive, rise * (t - lag * (1.0 - np.exp(-t / lag))), rtol=0, atol=1e-9)
    plain = simulate(linear(), [], hdfast.Scenario.motion(t, 20.0 * t), t, signals, base=base)
    np.testing.assert_allclose(needed, plain[1], rtol=0, atol=1e-8)
    assert np.all(plain[0] == 0.0)


def test_exact_torque_of_a_rigid_motion_with_friction():
    """J alpha + B omega + load/i + T_c sgn(omega) on dense knots, reversals included."""
    p = linear(**VALUES["coulomb_friction"])
    t = np.linspace(0.0, 2.0, 2001)
    angle, speed, alpha = 3.0 * np.sin(4 * t), 12.0 * np.cos(4 * t), -48.0 * np.sin(4 * t)
    J, B = p["J_m"] + p["J_l"] / 121**2, p["B_m"] + p["B_ml"] + p["B_l"] / 121**2
    scenario = hdfast.Scenario.motion(t, angle, load=LOAD)
    found = simulate(p, ["coulomb_friction"], scenario, t, ["tau_m"], base="one_inertia")[0]
    expected = J * alpha + B * speed + LOAD / 121 + VALUES["coulomb_friction"]["coulomb_friction_T_c"] * np.sign(speed)
    inside = slice(5, -5)
    np.testing.assert_allclose(found[inside], expected[inside], rtol=0, atol=1e-6)


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_replayed_motion_needs_the_torque_that_made_it(base):
    """tau_drive and tau_m agree when the motion of a torque-driven run is prescribed together with its torque."""
    terms = ["stribeck_friction", "load_dependent_friction", "te_harmonic", "torque_gain"]
    p = linear(**{name: value for term in terms for name, value in VALUES[term].items()})
    t = np.linspace(0.0, 1.0, 2001)
    torque = 0.25 + 0.05 * np.sin(7.0 * t)
    free = hdfast.Scenario.torque_profile(t, torque, load=LOAD)
    motor_angle, drive = simulate(p, terms, free, t, ["theta_m", "tau_drive"], base=base)
    recording = {"t": t, "motor_angle": motor_angle, "motor_torque": torque}
    scenario = hdfast.Scenario.replay(recording, input="motor_motion", load=LOAD)
    found = simulate(p, terms, scenario, t, ["tau_m", "tau_drive"], rtol=1e-8, base=base)
    np.testing.assert_allclose(found[1], drive, rtol=1e-9)
    late = (t > 0.2) & (t < 0.99)
    np.testing.assert_allclose(found[0][late], found[1][late], rtol=0, atol=1e-5)
