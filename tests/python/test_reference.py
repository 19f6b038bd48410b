"""The plain-Python reference against SciPy on an independent formulation, and against closed forms."""

from __future__ import annotations

import functools
import math

import hdfast
import numpy as np
import pytest
from drives import (
    LABELS,
    MOTION,
    ORDERS,
    RPM,
    SPEED,
    TORQUE,
    kinematic_error,
    linear,
    parameters,
    problem,
    ramp_and_brake,
    segment,
)
from hdfast.reference import Metrics, advance, solve_rows
from hdfast.sensors import SensorStage
from oracles import closed_forms, lagrange
from scipy.optimize import brentq

TIMES = np.linspace(0.0, 0.6, 241)
FRACTIONAL = ["1/121", "120/121", "2", "240/121", "7/2"]
STATES = ["theta_m", "omega_m", "theta_l", "omega_l"]
CASES = {
    "step_coast": {},
    "ramp_brake": {"segments": ramp_and_brake(0.1, 0.4, 0.02)},
    "saturated": {"segments": ramp_and_brake(0.1, 0.4, 0.02), "p": parameters(tau_max=0.15, K_i=4.0, omega_set=30.0)},
    "loaded": {"p": parameters(tau_load=30.0, theta_m0=1.3)},
    "beyond_range": {"p": parameters(tau_load=-90.0, omega_set=-20.0), "segments": ramp_and_brake(0.1, 0.4, 0.02)},
    "slip": {"p": parameters(s=1.0, B_ml=3e-3)},
    "held": {
        "p": parameters(tau_load=30.0, theta_m0=1.3),
        "segments": [
            segment(0.0, TORQUE, hold=1.0, load_set=1.0),
            segment(0.1, TORQUE, hold=1.0, hold_slope=-10.0, sustain_slope=10.0, load_set=1.0),
            segment(0.2, TORQUE, sustain=1.0, load_set=1.0),
        ],
    },
    "piecewise": {"p": parameters("piecewise", tau_load=60.0), "spring": "piecewise"},
    "even_terms": {"p": parameters(k2=4e5, k4=-1e11, tau_load=20.0)},
    "zero_angle": {"initial": "zero_angle"},
    "given_state": {"initial_state": [5.0, -8.0, 5.0 / 121 + 3e-4, 0.05, 0.01], "segments": ramp_and_brake(0.1, 0.4)},
    "bumpless": {
        "segments": [
            segment(0.0, TORQUE, sustain=1.5, load=5.0),
            segment(0.3, SPEED, bumpless=True, set=1.0, load=5.0, load_slope=-10.0),
            segment(0.45, SPEED, ref=3.0, load=12.0),
        ],
        "t_off": 0.45,
    },
    "motion": {
        "segments": [
            segment(0.0, MOTION, c0=0.3, c1=5.0, c2=-2.0, c3=4.0),
            segment(0.35, TORQUE, sustain=1.0, load_set=1.0),
        ],
        "p": parameters(tau_load=10.0),
        "initial_state": [0.3, 5.0, 0.3 / 121, 5.0 / 121],
    },
    "fractional": {
        "p": {**parameters(), **kinematic_error([8e-5, 3e-5, 9e-5, 2e-5, 1e-5], [1.0, 2.0, 3.0, 4.0, 5.0], FRACTIONAL)},
        "orders": [1 / 121, 120 / 121, 2.0, 240 / 121, 3.5],
        "labels": FRACTIONAL,
        "segments": ramp_and_brake(0.1, 0.4),
    },
}


@functools.cache
def known(name):
    """A case with its oracle."""
    row = case(name)
    return row, oracle(row)


def case(name):
    given = dict(CASES[name])
    given.setdefault("t_off", 0.4)
    return problem(given.pop("p", None), given.pop("segments", None), t_end=0.6, **given)


def oracle(row):
    """The same row in the independent formulation."""
    p, kind = row.parameters, (row.orders, row.labels, row.spring)
    if row.initial_state is not None:
        start = np.array([*row.initial_state, 0.0])[:5]
    elif row.initial == "zero_angle":
        start = np.zeros(5)
    else:
        start = lagrange.relaxed_start(p, *kind, row.segments)
    return lagrange.solve(p, *kind, row.segments, row.t_end, start)


def windup(states, row):
    """Windup [rad] from absolute angles."""
    drive = lagrange.Lagrangian(row.parameters, row.orders, row.labels, row.spring)
    return drive.windup(states[[0, 2]])


@pytest.mark.parametrize("name", CASES)
def test_against_scipy(name):
    """States and windup of every kind of input, spring and start; rtol 1e-9 against the oracle's 1e-12."""
    row, solution = known(name)
    truth = solution.at(TIMES)
    result = solve_rows([row], [TIMES], [*STATES, "windup"], rtol=1e-9)
    assert result.status == ["finished"]
    for name_, exact in zip(STATES, truth, strict=False):
        size = {"theta_m": 1.0, "omega_m": 10.0, "theta_l": 1e-2, "omega_l": 0.1}[name_]
        np.testing.assert_allclose(result.samples[name_][0], exact, atol=2e-7 * size, rtol=2e-8, err_msg=name_)
    np.testing.assert_allclose(result.samples["windup"][0], windup(truth, row), atol=3e-12, rtol=1e-7)
    np.testing.assert_allclose(result.final_state[0], solution.at(row.t_end)[:, 0], atol=1e-8, rtol=1e-7)


@pytest.mark.parametrize("method", ["bs3", "tsit5", "dopri5", "dop853"])
def test_against_scipy_error_follows_rtol(method):
    """Windup and speed errors fall with rtol for every method."""
    row, solution = known("ramp_brake")
    truth = solution.at(TIMES)
    exact = windup(truth, row)
    errors = []
    tolerances = [1e-4, 1e-6] if method == "bs3" else [1e-4, 1e-6, 1e-8, 1e-10]
    for rtol in tolerances:
        samples = solve_rows([row], [TIMES], ["windup", "omega_l"], method=method, rtol=rtol).samples
        speed = np.max(np.abs(np.array(samples["omega_l"][0]) - truth[3])) / np.max(np.abs(truth[3]))
        angle = np.max(np.abs(np.array(samples["windup"][0]) - exact)) / np.max(np.abs(exact))
        errors.append(max(speed, angle))
    assert all(error < 100 * rtol for error, rtol in zip(errors, tolerances, strict=True)), errors
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.7 < slope < 1.3, errors


def test_against_scipy_metrics():
    """Metrics located inside the steps against the same definitions on a very fine grid of the oracle."""
    row = problem(parameters(omega_set=300 * RPM), ramp_and_brake(0.2, 1.2), t_end=2.0, t_off=1.2, t_run=0.8)
    metrics = Metrics(advance(row, rtol=1e-9))
    t = np.linspace(0.0, 2.0, 80_001)
    truth = oracle(row).at(t)
    te = truth[0] / 121 - truth[2]
    phi = windup(truth, row)
    run, stop = (t >= 0.8) & (t <= 1.2), t >= 1.2

    def check(name, value, rtol=2e-6):
        np.testing.assert_allclose(metrics[name], value, rtol=rtol, err_msg=name)

    check("peak_windup", np.max(np.abs(phi)))
    check("initial_te_peak", np.max(np.abs(phi[t <= 0.5])))
    for suffix, phase in (("", run), ("_stop", stop), ("_start", t <= 0.8)):
        window = te[phase]
        check(f"te_peak{suffix}", np.max(np.abs(window)))
        check(f"te_pp{suffix}", np.ptp(window))
        mean = np.trapezoid(window, t[phase]) / np.ptp(t[phase])
        check(f"te_mean{suffix}", mean, 1e-5)
        check(f"te_rms{suffix}", math.sqrt(np.trapezoid((window - mean) ** 2, t[phase]) / np.ptp(t[phase])))
    speed = truth[3][run]
    check("speed_ripple", np.ptp(speed))
    mean = np.trapezoid(speed, t[run]) / 0.4
    check("speed_ripple_rms", math.sqrt(np.trapezoid((speed - mean) ** 2, t[run]) / 0.4), 1e-5)
    check("time_outside_range", np.mean(np.abs(phi) > 1.465e-3) * 2.0, 2e-3)


def test_against_scipy_order_amplitudes_and_steady_speed():
    """Whole revolutions before t_off; the fit over the motor angle equals the Fourier coefficients."""
    row = problem(parameters(), ramp_and_brake(0.2, 1.6), t_end=1.6, t_off=1.6)
    metrics = Metrics(advance(row, rtol=1e-9))
    truth = oracle(row)
    angle = truth.at(1.6)[0, 0] - 2 * math.pi
    begin = brentq(lambda t: truth.at(t)[0, 0] - angle, 0.5, 1.1, xtol=1e-14)
    np.testing.assert_allclose(metrics["steady_speed"], 2 * math.pi / (1.6 - begin), rtol=1e-8)
    t = np.linspace(begin, 1.6, 40_001)
    theta, omega, theta_l, omega_l, _ = truth.at(t)
    assert np.all(omega > 0)
    for order in (1, 2, 4, 15):
        for name, signal in (("order", theta / 121 - theta_l), ("speed_order", omega_l)):
            phasor = np.trapezoid(signal * np.exp(-1j * order * theta), theta) / math.pi
            np.testing.assert_allclose(metrics[f"{name}_{order}"], abs(phasor), rtol=1e-5)


def test_exact_rise_and_stop_of_one_inertia():
    """Without kinematic error the rigid drive is one exponential: times and shapes in closed form."""
    row = problem(linear(), t_end=6.0, base="one_inertia")
    tau = closed_forms.coast_time_constant(row.parameters)
    metrics = Metrics(advance(row, rtol=1e-9))
    steady = metrics["steady_speed"] / row.parameters["omega_set"]
    assert abs(steady - 1.0) < 1e-3
    np.testing.assert_allclose(metrics["stop_time"], tau * math.log(19), rtol=1e-7)
    np.testing.assert_allclose(
        metrics["rise_time"], tau * math.log((1 - 0.05 * steady) / (1 - 0.95 * steady)), rtol=1e-7
    )
    np.testing.assert_allclose(metrics["dead_time"], -tau * math.log(1 - 0.05 * steady), rtol=1e-7)
    np.testing.assert_allclose(metrics["stop_shape"], math.log(0.95 / 0.5) / math.log(10), rtol=1e-7)
    np.testing.assert_allclose(metrics["stop_shape"], 0.28, atol=5e-3)
    np.testing.assert_allclose(metrics["rise_shape"], 0.28, atol=5e-3)


def test_against_energy_form_of_one_inertia():
    """The rigid limit against I(theta) omega' + I'(theta) omega^2/2, with a tenfold kinematic error."""
    p = parameters(te_scale=10.0, theta_m0=0.7, s=1.0)
    row = problem(p, [segment(0.0, tau=0.02)], t_end=1.5, t_off=1.5, base="one_inertia")
    phasors = {n: 10.0 * (p[f"te_cos_{n}"] - 1j * p[f"te_sin_{n}"]) for n in range(1, 16)}
    exact = closed_forms.rigid_response(p, phasors, 1.5, 0.02)
    run = advance(row, rtol=1e-10)
    np.testing.assert_allclose(run.end[:2], exact, rtol=1e-9)
    np.testing.assert_allclose(Metrics(run)["energy_residual"], 0.0, atol=1e-9)


@pytest.mark.parametrize("orders", [ORDERS, [1 / 121, 240 / 121]], ids=["integer", "fractional"])
def test_exact_upsilon_min(orders):
    labels = LABELS if orders is ORDERS else ["1/121", "240/121"]
    p = {**parameters(), **kinematic_error([4e-5] * len(orders), range(len(orders)), labels)}
    row = problem(p, t_end=0.01, t_off=0.005, orders=orders, labels=labels)
    theta = np.linspace(0, 2 * math.pi * 121, 2_000_001)
    slope = sum(n * 4e-5 * np.cos(n * theta + k) for k, n in enumerate(orders))
    np.testing.assert_allclose(Metrics(advance(row))["upsilon_min"], np.min(1 / 121 - slope), rtol=1e-9)


def test_exact_marks_are_hit():
    """Every start of a segment and every mark is the end of a step."""
    row = problem(
        segments=ramp_and_brake(0.123, 0.456), t_end=2.5, t_off=0.456, t_run=0.3, ring_delay=0.1, ring_width=0.2
    )
    ends = {step.t + step.h for step in advance(row).steps}
    for mark in (0.123, 0.3, 0.456, 0.476, 0.5, 0.556, 0.756, 2.5):
        assert min(abs(mark - end) for end in ends) < 1e-15 * 4


@pytest.mark.parametrize(
    ("changes", "options", "status"),
    [
        ({}, {"max_steps": 20}, "max_steps"),
        ({"tau_load": math.nan}, {}, "bad_parameters"),
        ({"k5": -6e15}, {}, "bad_parameters"),
        ({"tau_load": 1e308}, {}, "not_finite"),
        ({"B_sp": 1e18}, {}, "step_too_small"),
    ],
)
def test_exact_failures_are_data(changes, options, status):
    row = problem(parameters(**changes), [segment(0.0, tau=0.1, load_set=1e3)], initial="zero_angle")
    result = solve_rows([row], [[0.0, 6.0]], ["te"], ["te_pp", "steady_speed"], **options)
    assert result.status[0] == status
    assert math.isnan(result["te_pp"][0])
    assert math.isnan(result.samples["te"][0][1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"model": hdfast.Model(terms=["delay"])}, "terms = "),
        ({"method": "rodas5p"}, "method = 'rodas5p' is not known"),
        ({"sensors": SensorStage([("sensor_noise", "load_angle")]), "t_eval": [0.0]}, "sensors = "),
        ({"sensitivities": ["J_l"]}, "sensitivities = "),
    ],
)
def test_exact_what_the_reference_has_not_is_refused(options, message):
    with pytest.raises(hdfast.InputError, match=message):
        hdfast.reference.sweep({}, **options)


def test_exact_the_reference_takes_the_default_scenario():
    given = {"t_eval": [0.0, 1e-3], "metrics": [], "max_steps": 10}
    default = hdfast.reference.simulate({}, scenario=None, **given)
    assert (
        default.samples["te"]
        == hdfast.reference.simulate({}, scenario=hdfast.Scenario.start_stop(), **given).samples["te"]
    )
    with pytest.raises(hdfast.InputError, match="scenario = 'start'"):
        hdfast.reference.simulate({}, scenario="start")
