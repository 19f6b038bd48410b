"""Derivatives against extrapolated differences of the engine's own values, and against closed forms."""

from __future__ import annotations

import importlib
import math

import hdfast
import numpy as np
import pytest
from differentiated import AT_SPEED, AT_TORQUE, INITIAL, PRECISE, START_STOP, assert_close, random_row
from drives import linear
from scipy.linalg import expm_frechet
from termed import COMBINATIONS, VALUES, torque_steps, with_company

DRIVE = ["ratio", "J_m", "J_l", "B_m", "B_l", "B_ml", "B_sp", "s", "k1", "k2", "k3", "te_scale", "te_cos_2", "te_sin_3"]
SCENARIO = ["omega_set", "tau_load", "K_p", "K_i", "tau_max", "theta_m0"]
UNDIFFERENTIATED = {"time_outside_range", "energy_residual"}


@pytest.mark.parametrize("seed", range(3))
def test_against_differences_of_the_nominal_drive(seed):
    signals = ["theta_m", "te", "omega_l", "windup", "tau_m", "gear_torque"]
    assert_close(random_row(seed), [*DRIVE, *SCENARIO], 1e-6, signals=signals, **AT_SPEED)


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_against_differences_of_the_metrics(base):
    wrt = ["J_m", "J_l", "B_m", "te_sin_3", "omega_set", "tau_load", "K_p"]
    options = PRECISE | {
        "model": hdfast.Model(base=base),
        "scenario": START_STOP,
        "metrics": [name for name in hdfast.metrics() if name not in UNDIFFERENTIATED and "mode_" not in name],
    }
    row = random_row(7)
    if base == "one_inertia":
        options["metrics"] = [name for name in options["metrics"] if "windup" not in name and "te_peak" not in name]
    assert_close(row, wrt, 1e-6, steps=(1e-3, 1e-4, 1e-5), **options)


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_against_differences_where_the_controller_reaches_its_limit(base):
    """The limit is the only corner of these models; also at loose tolerances no step with derivatives straddles it."""
    options = AT_SPEED | {"model": hdfast.Model(base=base)}
    row, wrt = random_row(4, tau_max=0.12), ["tau_max", "K_p", "J_l", "omega_set"]
    result = hdfast.sweep(row, **options, sensitivities=wrt)
    assert_close(row, wrt, 1e-6, **options)
    loose = hdfast.sweep(row, **(options | {"rtol": 1e-6}), sensitivities=wrt)
    for name, exact in result.sample_sensitivities.items():
        error = np.max(np.abs(loose.sample_sensitivities[name] - exact), axis=1)
        assert np.all(error < 1e-3 * np.max(np.abs(exact), axis=1)), name


@pytest.mark.parametrize(("tau_max", "same"), [(2.0, True), (0.12, False)], ids=["within", "limited"])
def test_exact_values_under_speed_control(tau_max, same):
    """Bits differ only where the controller reaches its limit, by less than the tolerance allows."""
    options = AT_SPEED | {"rtol": 1e-6}
    row = random_row(4, tau_max=tau_max)
    plain, found = hdfast.sweep(row, **options), hdfast.sweep(row, sensitivities=["J_l"], **options)
    for name, values in plain.samples.items():
        off = np.max(np.abs(found[name] - values)) / np.ptp(values)
        assert off == 0.0 if same else off < 1e-5, name


def test_against_differences_of_the_initial_state():
    options = AT_SPEED | {"scenario": hdfast.Scenario.start_stop(speed_rpm=120, stop="brake", t_end=2.0)}
    row, start = random_row(3), [0.4, 9.0, 0.0035, 0.07, 0.02]
    assert_close(row, INITIAL, 1e-6, start=start, **options)


def test_against_differences_of_a_piecewise_spring_with_fractional_orders():
    model = hdfast.Model(spring="piecewise", orders=[1, 2, "120/121", 2.5])
    row = {"K1": 3.1e4, "K2": 5.0e4, "K3": 5.7e4, "T1": 5.0, "T2": 20.0, "tau_load": 9.0, "te_cos_5/2": 4e-5}
    wrt = ["K1", "K2", "K3", "T1", "te_cos_5/2", "te_sin_120/121", "ratio"]
    row |= {"te_sin_120/121": 3e-5, "ratio": 121.0}
    assert_close(row, wrt, 1e-6, steps=(1e-3, 1e-4, 1e-5), model=model, **AT_SPEED)


FRICTION = ["coulomb_friction", "stribeck_friction", "load_side_friction", "load_dependent_friction"]
OTHERS = [[term] for term in VALUES if term not in FRICTION]


@pytest.mark.parametrize(
    "terms",
    [
        *([term] for term in FRICTION),
        *COMBINATIONS[:2],
        *(pytest.param(terms, marks=pytest.mark.long) for terms in [*OTHERS, *COMBINATIONS[2:]]),
    ],
    ids="+".join,
)
def test_against_differences_with_terms(terms):
    """Every parameter of every term, through stops, holds and releases where the term has them."""
    on, values = with_company(terms)
    wrt = [*values, "J_m", "k1", "tau_load"]
    model = hdfast.Model(terms=on)
    assert_close(random_row(5, **values), wrt, 1e-6, steps=(1e-4, 1e-5, 1e-6), model=model, **AT_TORQUE)


@pytest.mark.parametrize(
    ("terms", "values"),
    [(["presliding_friction"], {"sigma_0": 100.0}), (["actuator_lag"], {"tau_e": 1e-5})],
    ids=["bristles", "current loop"],
)
def test_against_differences_of_stiff_rows(terms, values):
    """Rows that `auto` hands to rodas5p; their values are those of a run without derivatives."""
    values = VALUES[terms[0]] | values
    options = AT_TORQUE | {"model": hdfast.Model(terms=terms), "rtol": 1e-10}
    row, wrt = random_row(5, **values), [*values, "J_m", "tau_load"]
    found, plain = hdfast.sweep(row, sensitivities=wrt, **options), hdfast.sweep(row, **options)
    assert list(found.method) == list(plain.method) == ["rodas5p"]
    np.testing.assert_array_equal(found["te"], plain["te"])
    assert_close(row, wrt, 1e-5, steps=(1e-3, 1e-4), **options)


def test_against_differences_on_the_rigid_gear():
    model = hdfast.Model(base="one_inertia", terms=["coulomb_friction", "te_hysteresis"])
    row = {"coulomb_friction_T_c": 0.04, "direction_offset": 1e-4, "settling_angle": 0.4, "J_m": 3e-4, "J_l": 0.5}
    assert_close(row, list(row), 1e-6, steps=(1e-4, 1e-5), model=model, **AT_TORQUE)


def test_exact_linear_drive():
    """A linear drive under constant torque: the derivative of the matrix exponential."""
    p = linear(J_l=0.4)
    t, torque = 0.037, 0.1

    def system(J_l, k1):
        i, J_m = p["ratio"], p["J_m"]
        B_sp, d_m, d_l = p["B_sp"], p["B_m"] + p["B_ml"], p["B_l"]
        # states theta_m, omega_m, te, omega_l, one
        return np.array(
            [
                [0, 1, 0, 0, 0],
                [0, -(d_m + B_sp / i**2) / J_m, -k1 / i / J_m, B_sp / i / J_m, torque / J_m],
                [0, 1 / i, 0, -1, 0],
                [0, B_sp / i / J_l, k1 / J_l, -(d_l + B_sp) / J_l, 0],
                [0, 0, 0, 0, 0],
            ]
        )

    A = system(p["J_l"], p["k1"])
    row = {name: value for name, value in p.items() if name not in ("K_p", "K_i", "tau_max")}
    found = hdfast.jacobian(
        row,
        wrt=["J_l", "k1"],
        signals=["omega_m", "te", "omega_l"],
        t_eval=[t],
        scenario=hdfast.Scenario.torque_profile([0.0, 0.1], [torque, torque]),
        initial_state=[[0.0, 0.0, 0.0, 0.0, 0.0]],
        rtol=1e-12,
    )
    for column, (name, h) in enumerate((("J_l", 1e-4), ("k1", 1.0))):
        up, down = ({"J_l": p["J_l"], "k1": p["k1"], name: p[name] + sign * h} for sign in (1, -1))
        change = (system(**up) - system(**down)) / (2 * h)
        if name == "J_l":
            change[3] = -A[3] / p["J_l"]
        expected = expm_frechet(A * t, change * t, compute_expm=False)[[1, 2, 3], 4]
        np.testing.assert_allclose(found[0, :, column], expected, rtol=1e-9)


def test_exact_a_jacobian_of_many_rows_or_of_nothing_is_refused_before_it_runs(monkeypatch):
    monkeypatch.setattr(importlib.import_module("hdfast.jacobian"), "run", None)
    for options, text in (
        ({"row": hdfast.defaults(2)}, "row holds 2 rows"),
        ({"signals": []}, r"signals = \[\]"),
        ({"threads": 2}, "option = 'threads'"),
    ):
        with pytest.raises(hdfast.InputError, match=text):
            hdfast.jacobian(wrt=["J_l"], t_eval=[0.0, 0.1], **options)


def test_exact_coast_down_to_a_stop():
    """From rest at J/B ln(1 + B omega/T_c) on, the angle is J/B (omega - T_c t/J) whatever happens later."""
    speed, level = 60.0, 0.03
    p = linear(J_l=1e-3, coulomb_friction_T_c=level)
    J, B = p["J_m"] + p["J_l"] / 121**2, p["B_m"] + p["B_ml"] + p["B_l"] / 121**2
    stop = J / B * math.log1p(B * speed / level)
    found = hdfast.jacobian(
        {name: value for name, value in p.items() if name not in ("K_p", "K_i", "tau_max")},
        wrt=["T_c", "initial_omega_m", "initial_theta_m", "initial_theta_l"],
        signals=["theta_m", "omega_m"],
        t_eval=[1.5 * stop, 3.0 * stop],
        model=hdfast.Model(terms=["coulomb_friction"]),
        scenario=torque_steps([(4.0 * stop, 0.0)]),
        initial_state=[[0.0, speed, 0.0, speed / p["ratio"], 0.0]],
        rtol=1e-10,
    )
    by_level = -J / B**2 * (math.log1p(B * speed / level) - B * speed / (level + B * speed))
    by_speed = J / B * (1.0 - level / (level + B * speed))
    np.testing.assert_allclose(found[:, 0, :2], [[by_level, by_speed]] * 2, rtol=2e-3)
    np.testing.assert_allclose(found[:, 0, 2] + found[:, 0, 3] / p["ratio"], 1.0, rtol=1e-9)
    assert np.all(found[:, 1] == 0.0)


def test_against_differences_of_a_ripple_that_ends_in_a_stop():
    """The lowest speed is that of the stopped output, 0 whatever the friction, wherever the step lands."""
    levels = np.array([30.0, 33.0, 34.0, 36.0, 38.0, 40.0])
    t, speed = [0.0, 0.3, 1.0, 1.2, 1.6], [0.0, 100.0, 100.0, 0.0, 0.0]
    options = {
        "model": hdfast.Model(terms=["load_side_friction"]),
        "scenario": hdfast.Scenario.speed_profile(t, speed, run_window=(0.6, 1.5), t_end=1.6),
        "metrics": ["speed_ripple"],
    }
    found = hdfast.sweep({"T_cl": levels}, sensitivities=["T_cl"], rtol=1e-6, **options)
    up, down = (hdfast.sweep({"T_cl": levels + h}, rtol=1e-11, **options)["speed_ripple"] for h in (1e-2, -1e-2))
    np.testing.assert_allclose(found.metric_sensitivities["speed_ripple"][:, 0], (up - down) / 2e-2, rtol=1e-3)


def test_exact_peak_of_a_periodic_error():
    """The largest error of a rigid gear that turns over it is that of the error itself, however heavy the motor."""
    found = hdfast.sweep(
        {"tau_load": np.linspace(0.0, 10.0, 100)},
        model=hdfast.Model(base="one_inertia", orders=[1, 2]),
        metrics=["te_peak_stop"],
        sensitivities=["J_m"],
        rtol=1e-8,
        scenario=hdfast.Scenario.start_stop(t_end=1.6, t_on=0.05, t_off=0.9),
    )
    peak, change = found["te_peak_stop"], found.metric_sensitivities["te_peak_stop"][:, 0] * linear()["J_m"]
    turned_over = np.isclose(peak, peak.max(), rtol=1e-9)
    assert turned_over.sum() > 50
    np.testing.assert_array_less(np.abs(change[turned_over]), 1e-8 * peak.max())


def rows(count):
    rng = np.random.default_rng(1)
    columns = {"J_l": rng.uniform(0.3, 0.7, count), "k1": rng.uniform(2e4, 4e4, count), "tau_load": 3.0}
    return columns | {"coulomb_friction_T_c": rng.uniform(0.01, 0.05, count)}


def test_exact_bits_on_any_number_of_threads_and_values_but_for_rests(monkeypatch):
    """Steps of a rest, of which these rows have some, may be others with derivatives than without."""
    model = hdfast.Model(terms=["coulomb_friction", "hysteresis"])
    options = {"model": model, "t_eval": np.linspace(0.0, 6.0, 50)}
    plain = hdfast.sweep(rows(37), **options)
    wrt = ["J_l", "T_c", "initial_omega_m"]
    one = hdfast.sweep(rows(37), sensitivities=wrt, threads=1, **options)
    two = hdfast.sweep(rows(37), sensitivities=wrt, threads=2, **options)
    alone = hdfast.sweep(rows(37), sensitivities=wrt[1:2], **options)
    monkeypatch.setenv("HDFAST_SIMD", "scalar")
    scalar = hdfast.sweep(rows(37), sensitivities=wrt, **options)
    for name in plain.metrics:
        size = np.max(np.abs(plain[name]))
        np.testing.assert_allclose(one[name], plain[name], rtol=0.0, atol=1e-7 * size + 1e-14, err_msg=name)
    assert np.mean(np.any(one["te"] != plain["te"], axis=1)) < 0.1
    np.testing.assert_array_equal(plain.steps, one.steps)
    for other in (two, scalar):
        np.testing.assert_array_equal(one.final_state_sensitivities, other.final_state_sensitivities)
        for name, values in {**one.metric_sensitivities, **one.sample_sensitivities}.items():
            again = {**other.metric_sensitivities, **other.sample_sensitivities}[name]
            np.testing.assert_array_equal(values, again)
    np.testing.assert_array_equal(one.final_state_sensitivities[..., 1:2], alone.final_state_sensitivities)


def test_exact_rows_that_fail_have_no_derivatives():
    result = hdfast.sweep({"J_l": [0.5, -1.0, 0.4]}, sensitivities=["J_l", "K_p"], t_eval=[1.0], metrics=["te_pp"])
    assert np.isnan(result.metric_sensitivities["te_pp"][1]).all()
    assert np.isnan(result.sample_sensitivities["te"][1]).all()
    assert np.isfinite(result.sample_sensitivities["te"][[0, 2]]).all()
    assert result.final_state_sensitivities.shape == (3, 5, 2)


def test_exact_an_rms_of_nothing_has_no_slope():
    model = hdfast.Model("one_inertia", terms=["coulomb_friction"])
    scenario = hdfast.Scenario.start_stop(start="speed_ramp", stop="brake", t_off=0.9, t_end=1.6)
    options = {"metrics": ["residual_ring", "te_rms"], "sensitivities": ["B_m"]}
    result = hdfast.sweep({}, model=model, scenario=scenario, **options)
    assert (result["residual_ring"][0], result.metric_sensitivities["residual_ring"][0, 0]) == (0.0, 0.0)
    smooth = hdfast.sweep({"te_scale": 0.0}, model=model, scenario=scenario, **options)
    assert (smooth["te_rms"][0], smooth.metric_sensitivities["te_rms"][0, 0]) == (0.0, 0.0)


def test_exact_an_rms_that_is_rounding_is_none():
    """Of a speed of 50 rad/s that ripples by 1e-6 rad/s the mean of squares is that of the mean in all its digits."""
    t = np.linspace(0.0, 2.0, 201)
    options = {"model": hdfast.Model("one_inertia", orders=[2]), "scenario": hdfast.Scenario.motion(t, 50.0 * t)}
    row = {"ratio": 1.0, "te_cos_2": np.array([1e-8, 1e-4]), "te_sin_2": 0.0}
    found = hdfast.sweep(row, metrics=["speed_ripple_rms"], sensitivities=["te_cos_2"], **options)
    assert found["speed_ripple_rms"][0] == 0.0 == found.metric_sensitivities["speed_ripple_rms"][0, 0]
    assert abs(found["speed_ripple_rms"][1] / (1e-4 * 100.0 / np.sqrt(2.0)) - 1.0) < 1e-6


def test_against_differences_of_friction_with_a_cusp_at_rest():
    """The slope of a Stribeck law with an exponent below 1 is infinite at rest, where the drive begins."""
    model, step = hdfast.Model(terms=["stribeck_friction"]), 1e-4
    options = {"model": model, "metrics": ["te_rms"], "rtol": 1e-10, "scenario": START_STOP}
    drive = {"stribeck_shape": 0.5, "J_l": [0.5, 0.5 + step, 0.5 - step]}
    result = hdfast.sweep(drive, sensitivities=["J_l"], **options)
    _, above, below = result["te_rms"]
    assert result.metric_sensitivities["te_rms"][0, 0] == pytest.approx((above - below) / (2.0 * step), rel=1e-3)


def test_exact_dataset_holds_the_derivatives():
    result = hdfast.sweep({"J_l": [0.5, 0.4]}, sensitivities=["J_l", "K_p"], t_eval=[0.5, 1.0], metrics=["te_pp"])
    data = result.to_xarray()
    np.testing.assert_array_equal(data["d_te"].sel(wrt="J_l"), result.sample_sensitivities["te"][..., 0])
    np.testing.assert_array_equal(data["d_te_pp"].sel(wrt="K_p"), result.metric_sensitivities["te_pp"][:, 1])
    assert data["d_final_state"].shape == (2, 5, 2)
    assert data["d_te_pp"].attrs["units"] == "rad per unit of wrt"


@pytest.mark.parametrize("terms", [[], ["coulomb_friction"]], ids=str)
def test_exact_derivatives_take_the_steps_of_the_values(terms):
    """No more and no fewer; benches measure what a column costs in each."""
    options = {"model": hdfast.Model(terms=terms)}
    rows = {"J_l": np.linspace(0.4, 0.6, 8)}
    plain = hdfast.sweep(rows, **options)
    found = hdfast.sweep(rows, sensitivities=["J_l", "k1", "te_scale", "B_sp"], **options)
    np.testing.assert_array_equal(found.steps, plain.steps)
    np.testing.assert_array_equal(found.rejected, plain.rejected)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"sensitivities": ["J_ll"]}, "J_l"),
        ({"sensitivities": ["K1"]}, "K1 belongs to"),
        ({"sensitivities": "J_l"}, "not a list"),
        ({"sensitivities": ["J_l", "J_l"]}, "twice"),
        ({"sensitivities": [3]}, "3"),
        ({"sensitivities": ["initial_omega"]}, "initial_omega_m"),
        ({"sensitivities": ["J_l"], "method": "bs3"}, "bs3"),
        ({"sensitivities": ["initial_theta_l"], "model": hdfast.Model(base="one_inertia")}, "initial_theta"),
    ],
)
def test_exact_wrong_calls(options, text):
    with pytest.raises(hdfast.InputError, match=text):
        hdfast.sweep({}, **options)
