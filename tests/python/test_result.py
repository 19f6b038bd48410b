from __future__ import annotations

import math
import re

import hdfast
import numpy as np
import pyarrow as pa
import pytest

SHORT = hdfast.Scenario.start_stop(t_end=1.4, t_off=0.7)


@pytest.fixture(scope="module")
def result():
    columns = {"J_l": [0.4, 0.5, -1.0], "tau_load": [0.0, 1.0, 2.0]}
    return hdfast.sweep(columns, scenario=SHORT, t_eval=np.linspace(0, 1.4, 15), signals=["te", "omega_l"], threads=1)


def test_exact_metrics_have_names_and_units(result):
    assert set(result.metrics) == set(hdfast.metrics())
    assert result.units["te_pp"] == "rad"
    assert result.units["omega_l"] == "rad/s"
    assert result["te_pp"] is result.metrics["te_pp"]
    assert all(values.shape == (3,) for values in result.metrics.values())
    assert result["te"].shape == (3, 15)
    assert result.final_state.shape == (3, 5)


def test_exact_status_in_words(result):
    assert result.status.tolist()[:2] == [0, 0]
    assert result.status_counts() == {"finished": 2, "bad_parameters": 1}
    assert "finished" in result.message(0)
    assert "J_l = -1 kg m^2" in result.message(2)
    assert result.message(-1) == result.message(2)
    for row in (3, -4, 1.5, "1"):
        with pytest.raises(hdfast.InputError, match="row"):
            result.message(row)


@pytest.mark.parametrize(
    ("spring", "name", "value", "reason"),
    [
        ("polynomial", "phi_max", 0.0025, "the stiffness has to be positive up to it"),
        ("piecewise", "T2", 20.0, "above T1"),
    ],
)
def test_exact_a_plausible_value_that_is_refused_is_told_why(spring, name, value, reason):
    row = {name: value} | ({"T1": 40.0} if name == "T2" else {})
    model = hdfast.Model(spring=spring)
    assert reason in hdfast.sweep(row, model=model, metrics=[]).message(0)
    with pytest.raises(hdfast.RowError, match=reason):
        hdfast.sweep(row, model=model, metrics=[], strict=True)


@pytest.mark.parametrize(
    ("name", "value", "limits"),
    [
        ("J_l", -1.0, "allowed: finite, above 0; plausible: 0.05 to 12"),
        ("J_m", math.inf, "allowed: finite, above 0; plausible: 0.0001 to 0.001"),
        ("B_m", -1.0, "allowed: finite, from 0"),
        ("omega_set", math.nan, "allowed: any finite number"),
        ("theta_m0", 2e9, "allowed: -1e+09 to 1e+09"),
        ("ratio", 0.0, "not 0"),
        ("K_p", 1e-13, "0 or at least 1e-12"),
        ("fault_width", 0.0, "allowed: 0.01 to 10"),
    ],
)
def test_exact_a_refused_value_is_told_what_is_allowed(name, value, limits):
    model = hdfast.Model(terms=["local_fault"])
    assert limits in hdfast.sweep({name: value}, model=model, metrics=[]).message(0)
    with pytest.raises(hdfast.RowError, match=re.escape(limits)):
        hdfast.sweep({name: value}, model=model, metrics=[], strict=True)


def test_exact_percentiles_are_those_of_a_metric(result):
    with pytest.raises(hdfast.InputError, match="metric = 'te' is not known"):
        result.percentiles("te")
    with pytest.raises(hdfast.InputError, match="q = 101 is out of range"):
        result.percentiles("te_pp", (101,))
    assert result.usable("te_pp").tolist() == result["te_pp"][:2].tolist()
    assert result.percentiles("te_pp", 50.0) == result.percentiles("te_pp", (50.0,))[0]


def test_exact_orders_are_found_as_they_were_asked_for():
    found = hdfast.sweep({}, scenario=SHORT, metrics=["order_0.5"])
    assert found["order_0.5"] is found["order_1/2"]
    with pytest.raises(hdfast.InputError, match=r"the result holds no \['order_1/2'\]"):
        found[["order_1/2"]]


def test_exact_rows_that_differ_in_a_sensor_can_be_told_apart():
    stage = hdfast.sensors.SensorStage([("encoder_eccentricity", "load_angle")], {"psi": 0.3})
    rows = {"eccentricity": np.array([0.0, 1e-5]), "J_l": 0.4}
    read = hdfast.sweep(rows, scenario=SHORT, t_eval=[0.0, 0.1], metrics=[], sensors=stage)
    assert read.parameters(1)["eccentricity"] == 1e-5
    assert read.parameters(1)["psi"] == 0.3
    assert read.to_arrow()["eccentricity"].to_pylist() == [0.0, 1e-5]
    assert "eccentricity" in read.to_arrow(parameters="given").column_names
    assert "psi" not in read.to_arrow(parameters="given").column_names


def test_exact_readings_are_found_by_name():
    stage = hdfast.sensors.SensorStage([("quantisation", "motor_angle")])
    read = hdfast.sweep({}, scenario=SHORT, t_eval=[0.0, 0.1], metrics=[], sensors=stage)
    assert read["motor_angle"] is read.recorded["motor_angle"]
    assert read.units["motor_angle"] == "rad"


def test_exact_names_are_listed_and_asked_for():
    assert {"tolerance", "diagnose", "identify", "reference", "compare", "sweep"} <= set(dir(hdfast))
    assert "coulomb_friction" in hdfast.terms()
    assert "coulomb_fricton" not in hdfast.terms()


def test_exact_unknown_name_offers_the_nearest(result):
    with pytest.raises(hdfast.InputError, match="did you mean 'te_pp'"):
        result["te_p"]


def test_exact_print(result):
    text = str(result)
    assert "3 rows, 2 finished, 1 failed" in text
    assert "rows/s" in text
    assert "te_pp" in text
    assert "P95" in text
    assert "bad_parameters 1" in text


def test_exact_parameters_of_a_row(result):
    values = result.parameters(1)
    assert values["J_l"] == 0.5
    assert values["tau_load"] == 1.0
    assert values["K_p"] == 0.05
    assert list(values) == [*hdfast.params().names, "omega_set", "tau_load", "K_p", "K_i", "tau_max", "theta_m0"]


def test_exact_percentiles_use_finished_rows(result):
    pair = result["te_pp"][:2]
    assert result.percentiles("te_pp", (0.0, 100.0)).tolist() == [pair.min(), pair.max()]


def test_exact_arrow(result):
    table = result.to_arrow()
    assert table.num_rows == 3
    assert table.schema.field("te_pp").metadata[b"unit"] == b"rad"
    assert table.schema.field("J_l").metadata[b"unit"] == b"kg m^2"
    assert table["status"].to_pylist() == ["finished", "finished", "bad_parameters"]
    assert table["J_l"].to_pylist() == [0.4, 0.5, -1.0]
    assert table["ratio"].to_pylist() == [121.0] * 3
    assert all(pa.types.is_floating(table.schema.field(name).type) for name in result.metrics)
    assert "ratio" not in result.to_arrow(parameters="given").column_names
    assert "J_l" not in result.to_arrow(parameters="none").column_names
    with pytest.raises(hdfast.InputError, match="parameters"):
        result.to_arrow(parameters="some")


def test_exact_other_tables(result):
    frame = result.to_pandas()
    assert frame["te_pp"].to_numpy() == pytest.approx(result["te_pp"], nan_ok=True)
    assert frame.attrs["units"]["te_pp"] == "rad"
    assert result.to_polars()["te_pp"].to_list()[:2] == result["te_pp"].tolist()[:2]


def test_exact_xarray(result):
    data = result.to_xarray()
    assert data["te"].dims == ("row", "time")
    assert data["te"].attrs["units"] == "rad"
    assert data["time"].to_numpy()[-1] == 1.4
    assert data["final_state"].sel(state="omega_m").shape == (3,)
    assert data["final_state"].attrs["units"] == "rad, rad/s, rad, rad/s, rad"
    several = hdfast.sweep({"J_l": [0.4, 0.5]}, scenario=SHORT, t_eval=[[0.0, 0.1], [0.2]], t_eval_index=[0, 1])
    assert several.to_xarray()["grid"].to_numpy().tolist() == [0, 1]


def test_exact_missing_package_is_named(result, monkeypatch):
    import importlib.util

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(hdfast.MissingPackageError, match="pip install polars"):
        result.to_polars()


def test_exact_simulate_is_one_row_of_a_sweep():
    run = hdfast.simulate({"J_l": 0.4}, scenario=SHORT)
    assert run.t[0] == 0
    assert run.t[-1] == 1.4
    assert set(run.signals) == set(hdfast.signals())
    assert run.status == "finished"
    assert run.parameters["J_l"] == 0.4
    batch = hdfast.sweep({"J_l": [0.3, 0.4]}, scenario=SHORT, t_eval=run.t, signals=["te"])
    assert np.array_equal(run["te"], batch["te"][1])
    assert run.metrics["te_pp"] == batch["te_pp"][1]
    assert "finished" in str(run)


def test_exact_a_trajectory_is_sampled_again_at_other_times():
    row, times = {"J_l": 0.4, "te_scale": 1.2}, [0.1, 0.35, 1.3]
    run = hdfast.simulate(row, scenario=SHORT, t_eval=[0.0, 1.4], signals=["te"], metrics=["te_pp"])
    again = run.sampled(times, ["omega_l", "te"])
    direct = hdfast.sweep(row, scenario=SHORT, t_eval=times, signals=["omega_l", "te"], metrics=[])
    assert list(again) == ["omega_l", "te"]
    for name, values in again.items():
        assert np.array_equal(values, direct[name][0])
    assert (run.t.tolist(), list(run.signals)) == ([0.0, 1.4], ["te"])
    with pytest.raises(hdfast.InputError, match=r"t = 1\.5 s is out of range"):
        run.sampled([1.5], ["te"])


def test_exact_a_trajectory_is_sampled_again_from_the_start_it_had():
    start = np.array([[0.0, 10.0, 0.0, 0.0]])
    run = hdfast.simulate(initial_state=start, scenario=SHORT, t_eval=[0.0, 0.1], signals=["omega_m"])
    start[:] = -50.0
    assert run.sampled([0.0, 0.1], ["omega_m"])["omega_m"].tolist() == run["omega_m"].tolist()


def test_exact_simulate_takes_any_single_row():
    row = hdfast.defaults(1)
    assert np.array_equal(hdfast.simulate(row, scenario=SHORT)["te"], hdfast.simulate(scenario=SHORT)["te"])


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"row": {"J_l": [0.4, 0.5]}}, "row holds 2 rows"),
        ({"row": {"J_l": []}}, "row holds 0 rows"),
        ({"scenario": [SHORT]}, "scenario"),
        ({"signals": ["x"]}, "signals"),
        ({"t_eval": [9.0]}, "t_eval"),
        ({"threads": 1}, "option = 'threads' is not known"),
        ({"rtl": 1e-6}, "did you mean 'rtol'"),
    ],
)
def test_exact_wrong_simulate(arguments, text):
    with pytest.raises(hdfast.InputError, match=text):
        hdfast.simulate(**arguments)


def test_exact_unknown_signal_of_a_trajectory():
    run = hdfast.simulate(scenario=SHORT, signals=["te"])
    with pytest.raises(hdfast.InputError, match="holds no 'omega_m'"):
        run["omega_m"]


def test_exact_failed_row_has_a_trajectory_of_nan():
    run = hdfast.simulate({"J_m": float("nan")}, scenario=SHORT)
    assert run.status == "bad_parameters"
    assert np.isnan(run["te"]).all()
    assert run.plot()


def test_exact_plot_has_labels_with_units():
    figure = hdfast.simulate(scenario=SHORT).plot()
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert len(labels) == 5
    assert all("[" in label for label in labels)
    assert figure.axes[-1].get_xlabel() == "time [s]"
    assert (
        hdfast.simulate(scenario=SHORT, signals=["gear_torque"]).plot().axes[0].get_ylabel().startswith("gear_torque")
    )
