"""Stiff rows: found on the way, run by the Rosenbrock method, right."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import RPM, SCENARIO, parameters
from oracles import left_out
from termed import VALUES, torque_steps

SIGNALS = ["theta_m", "omega_m", "theta_l", "omega_l"]
START_STOP = hdfast.Scenario.start_stop(speed_rpm=300, start="speed_ramp", stop="brake", t_end=3.0)
# rates of 100 / s to 1e6 / s beside a mode of some 100 / s
LAGS = np.array([1e-2, 3e-4, 3e-5, 1e-5, 1e-6])


def run(p, terms, scenario, t, method, rtol):
    row = {name: value for name, value in p.items() if name not in SCENARIO}
    model = hdfast.Model(terms=terms)
    start = np.zeros(5)
    options = {"model": model, "scenario": scenario, "t_eval": t, "signals": SIGNALS, "initial_state": start}
    result = hdfast.sweep(row, metrics=[], method=method, rtol=rtol, **options)
    assert result.finished.all(), result.message(0)
    return np.array([result[name][0] for name in SIGNALS])


@pytest.mark.parametrize("stiffness", [3.0, 100.0])
def test_against_scipy_radau_bristles(stiffness):
    """LuGre at 300 r/min."""
    values = VALUES["presliding_friction"] | {"sigma_0": stiffness}
    p = parameters(**values)
    pieces = [(0.06, 0.25), (0.12, 0.07)]
    t = np.linspace(0.0, pieces[-1][0], 31)
    found = run(p, ["presliding_friction"], torque_steps(pieces), t, "rodas5p", 1e-10)
    oracle = left_out.LeftOut(p, ["presliding_friction"])
    expected = oracle.solve(t, pieces, method="Radau", rtol=1e-10, max_step=1e-3)
    assert expected[1, -1] > 300 * RPM
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-7 * np.ptp(other))


@pytest.mark.parametrize("terms", [["hysteresis", "actuator_lag"], ["base_compliance", "viscoelastic"]], ids="+".join)
def test_against_the_explicit_method(terms):
    row = {name: value for term in terms for name, value in VALUES[term].items()}
    options = {"model": hdfast.Model(terms=terms), "scenario": START_STOP, "t_eval": np.linspace(0.0, 3.0, 61)}
    explicit = hdfast.sweep(row, method="dop853", rtol=1e-10, **options)
    implicit = hdfast.sweep(row, method="rodas5p", rtol=1e-9, **options)
    assert implicit.method[0] == "rodas5p"
    np.testing.assert_allclose(implicit["te"], explicit["te"], rtol=0.0, atol=1e-6 * np.ptp(explicit["te"]))
    for name in ("te_rms", "te_pp", "peak_windup", "rise_time", "energy_in", "loss_mesh"):
        np.testing.assert_allclose(implicit[name], explicit[name], rtol=1e-6, err_msg=name)


def test_exact_stopping_and_sticking():
    """The events of dry friction are landed on by the Rosenbrock method as well."""
    options = {
        "model": hdfast.Model(terms=["coulomb_friction", "actuator_lag"]),
        "scenario": torque_steps([(0.1, 0.16), (0.6, 0.0)]),
        "t_eval": np.linspace(0.0, 0.6, 31),
        "signals": ["theta_m", "omega_m"],
        "metrics": [],
    }
    row = {"T_c": 0.04, "tau_e": 1e-4}
    explicit = hdfast.sweep(row, method="dop853", rtol=1e-10, **options)
    implicit = hdfast.sweep(row, method="rodas5p", rtol=1e-9, **options)
    np.testing.assert_allclose(implicit["theta_m"], explicit["theta_m"], rtol=0.0, atol=1e-6)
    assert np.all(implicit["omega_m"][0, -5:] == 0.0)


def test_exact_stiff_rows_are_found_and_the_others_left_alone(monkeypatch):
    rows = {"tau_e": np.tile(LAGS, 9), "J_l": np.linspace(0.4, 0.6, 45)}
    options = {"model": hdfast.Model(terms=["actuator_lag"]), "scenario": START_STOP, "t_eval": [1.0, 2.0]}
    found = hdfast.sweep(rows, **options)
    assert found.finished.all()
    stiff = found.method == "rodas5p"
    assert stiff.reshape(9, 5)[:, 2:].all()
    assert not stiff[::5].any()
    assert np.all(found.steps < 4000)
    for method, chosen in (("rodas5p", stiff), ("dop853", ~stiff)):
        alone = hdfast.sweep({name: values[chosen] for name, values in rows.items()}, method=method, **options)
        np.testing.assert_array_equal(alone["te_pp"], found["te_pp"][chosen])
        np.testing.assert_array_equal(alone["te"], found["te"][chosen])
    monkeypatch.setenv("HDFAST_SIMD", "scalar")
    again = hdfast.sweep(rows, threads=3, **options)
    np.testing.assert_array_equal(again.method, found.method)
    np.testing.assert_array_equal(again.final_state, found.final_state)


def test_exact_the_choice_is_the_rows_own_where_steps_end_at_the_samples_of_a_table():
    t = np.linspace(0.0, 1.0, 201)
    rows = {"tau_e": np.geomspace(1e-3, 2e-5, 40)}
    options = {
        "model": hdfast.Model(terms=["actuator_lag"]),
        "scenario": hdfast.Scenario.torque_profile(t, 0.1 + 0.05 * np.sin(40.0 * t), t_end=1.0),
        "metrics": [],
    }
    together = hdfast.sweep(rows, **options)
    alone = [hdfast.sweep({"tau_e": [lag]}, **options) for lag in rows["tau_e"]]
    assert together.method.tolist() == [one.method[0] for one in alone]
    assert together.steps.tolist() == [one.steps[0] for one in alone]
    assert set(together.method) == {"dop853", "rodas5p"}


def test_exact_methods_are_reported():
    assert set(hdfast.sweep({"J_l": [0.4, 0.5]}, metrics=[]).method) == {"dop853"}
    assert set(hdfast.sweep({"J_l": [0.4, 0.5]}, method="bs3", metrics=[], rtol=1e-3).method) == {"bs3"}


def test_regress_steps_of_bristles():
    """LuGre friction at 300 r/min attempts 1.5 times the steps of the plain model; benches measure what one costs."""

    def attempted(terms):
        rows = {"J_l": np.linspace(0.4, 0.6, 8)}
        found = hdfast.sweep(rows, model=hdfast.Model(terms=terms), scenario=START_STOP, metrics=["te_rms"])
        assert found.finished.all()
        return found.steps + found.rejected

    assert np.max(attempted(["presliding_friction"]) / attempted([])) < 2.0
