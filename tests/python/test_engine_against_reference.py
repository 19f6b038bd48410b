"""The engine against the plain-Python reference over the whole parameter space, and against SciPy on random rows."""

from __future__ import annotations

import math

import hdfast
import numpy as np
import pytest
from conftest import Engine, Reference
from drives import LABELS, MOTION, ORDERS, RPM, parameters
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from oracles import lagrange

MODELS = [
    hdfast.Model(),
    hdfast.Model(spring="piecewise", orders=[1, 2, 4, 6]),
    hdfast.Model(orders=["1/121", "120/121", 2, "240/121", "7/2"]),
    hdfast.Model(orders=range(1, 25), spring="piecewise"),
    hdfast.Model(orders=[]),
    hdfast.Model("one_inertia"),
    hdfast.Model("one_inertia", orders=[2, 0.5]),
]
SIGNALS = {  # size against which differences are measured
    "theta_m": 1.0,
    "omega_m": 1.0,
    "theta_l": 0.01,
    "omega_l": 0.01,
    "te": 2e-5,
    "windup": 2e-5,
    "windup_rate": 0.05,
    "theta_e": 2e-5,
    "tau_m": 0.05,
    "tau_drive": 0.05,
    "gear_torque": 2.0,
}
STEADFAST = {  # metrics whose conditioning does not depend on the row, with the size of their differences
    "peak_windup": 2e-5,
    "initial_te_peak": 2e-5,
    **{f"te_{kind}{phase}": 2e-5 for kind in ("mean", "peak", "pp", "rms") for phase in ("", "_start", "_stop")},
    "speed_ripple": 0.01,
    "speed_ripple_rms": 0.01,
    **{
        f"{name}{phase}": 0.1
        for name in ("energy_in", "loss_motor", "loss_wave_generator", "loss_load", "loss_mesh")
        for phase in ("", "_start", "_run", "_stop")
    },
    "upsilon_min": 0.01,
}
SPRINGS = [  # fits of the catalogue curve
    (3.102e4, 1.3445e10, -3.211e15, 1.465e-3),
    (3.542e4, 5.843e9, -5.980e14, 2.395e-3),
    (3.901e4, 3.027e9, -1.8125e14, 3.219e-3),
]


def between(low, high):
    return st.floats(low, high, allow_nan=False, width=64)


@st.composite
def drives(draw, model):
    """One row anywhere in the plausible ranges; polynomial springs are scaled fits, so their tangent is positive."""
    row = {}
    for parameter in hdfast.params(model):
        if parameter.name.startswith(("te_cos", "te_sin")):
            row[parameter.name] = draw(between(-4e-5, 4e-5))
        elif parameter.name == "s":
            row["s"] = draw(st.sampled_from([0.0, 1.0, 0.5]))
        elif parameter.low > 0 and parameter.high / parameter.low > 5:
            row[parameter.name] = math.exp(draw(between(math.log(parameter.low), math.log(parameter.high))))
        else:
            row[parameter.name] = draw(between(parameter.low, parameter.high))
    if model.spring == "polynomial":
        k1, k3, k5, phi_max = draw(st.sampled_from(SPRINGS))
        scale = draw(between(0.5, 1.5))
        even = draw(st.sampled_from([0.0, 2e5]))
        row.update(k1=k1 * scale, k2=even, k3=k3 * scale, k4=0.0, k5=k5 * scale, phi_max=phi_max)
    else:
        row["T2"] = row["T1"] + draw(between(1.0, 60.0))
    return row


@st.composite
def tables(draw):
    """A torque, a speed or a motion given by a short table, joined by lines or held."""
    t_end = draw(between(0.2, 0.6))
    corners = sorted(draw(st.lists(between(0.02, 0.95), min_size=4, max_size=7, unique_by=lambda x: round(x, 2))))
    t = t_end * np.array([0.0, *corners, 1.0])
    values = np.array(draw(st.lists(between(-1.0, 1.0), min_size=len(t), max_size=len(t))))
    options = {"t_end": t_end, "t_on": 0.0, "t_off": 0.7 * t_end, "load": draw(between(-60.0, 60.0))}
    kind = draw(st.sampled_from(["torque", "speed", "motion"]))
    options["hold"] = draw(st.booleans())
    if kind == "motion":
        return hdfast.Scenario.motion(t, 30.0 * t + 0.5 * values, torque=(t, 0.1 * values), **options)
    options["theta_m0"] = draw(between(-10.0, 10.0))
    if kind == "torque":
        return hdfast.Scenario.torque_profile(t, 0.1 * values, **options)
    return hdfast.Scenario.speed_profile(
        t, speed=30.0 * values, tau_max=draw(st.sampled_from([0.3, math.inf])), **options
    )


@st.composite
def starts_and_stops(draw):
    """A short start, run and stop of any kind."""
    t_end = draw(between(0.15, 0.7))
    t_on = draw(st.sampled_from([0.0, 0.0, 0.05]))
    stop = draw(st.sampled_from(["coast", "brake", None]))
    options = {
        "start": draw(st.sampled_from(["torque_step", "speed_ramp"])),
        "stop": stop,
        "t_on": t_on,
        "t_end": t_end,
        "t_off": t_on + draw(between(0.2, 0.9)) * (t_end - t_on) if stop else None,
        "speed_rpm": draw(between(-600.0, 600.0)),
        "load": draw(st.one_of(between(-100.0, 100.0), st.just(([0.0, 0.1, 0.2], [0.0, 40.0, -20.0])))),
        "initial": draw(st.sampled_from(["relaxed", "zero_angle"])),
    }
    if options["initial"] == "relaxed":
        options["theta_m0"] = draw(between(-1000.0, 1000.0))
    t_off = options["t_off"] or t_end
    if options["start"] == "speed_ramp" or stop == "brake":
        options["K_p"] = draw(st.one_of(st.just(0.0), between(0.005, 0.3)))
        options["K_i"] = draw(st.one_of(st.just(0.0), between(0.02, 5.0)))
        options["tau_max"] = draw(st.sampled_from([0.1, 2.0, math.inf]))
    if options["start"] == "speed_ramp":
        options["t_ramp"] = draw(between(0.05, 0.9)) * (t_off - t_on)
    if stop == "brake":
        options["t_brake"] = draw(between(0.05, 0.9)) * (t_end - t_off)
    return hdfast.Scenario.start_stop(**options)


@st.composite
def calls(draw):
    model = draw(st.sampled_from(MODELS))
    row, scenario = draw(drives(model)), draw(st.one_of(starts_and_stops(), starts_and_stops(), tables()))
    options = {"model": model, "scenario": scenario}
    shares = sorted(draw(st.lists(between(0.001, 0.999), min_size=3, max_size=6, unique=True)))
    options["t_eval"] = [share * scenario.t_end for share in shares]
    options["method"] = draw(st.sampled_from(["dop853", "dopri5", "tsit5", "bs3"]))
    options["rtol"] = 1e-5 if options["method"] == "bs3" else draw(st.sampled_from([1e-6, 1e-8]))
    if scenario.segments[0, 1] != MOTION and draw(st.booleans()):
        theta, omega = draw(between(-100.0, 100.0)), draw(between(-60.0, 60.0))
        state = [theta, omega]
        if model.base == "two_inertia":
            state += [theta / row["ratio"] + draw(between(-1e-3, 1e-3)), omega / row["ratio"]]
        options["initial_state"] = np.array([[*state, draw(between(-0.05, 0.05))]])
    return row, options


def compare(found, expected, truth, size, rtol, message):
    """The engine errs no more than the reference does, give or take a multiple of rtol of the size of the signal."""
    found, expected, truth = (np.asarray(values, dtype=float) for values in (found, expected, truth))
    np.testing.assert_array_equal(np.isnan(found), np.isnan(truth), err_msg=message)
    known = ~np.isnan(truth)
    scale = size + np.max(np.abs(truth[known]), initial=0.0)
    allowed = 10 * np.max(np.abs(expected - truth)[known], initial=0.0) + (100 * rtol + 1e-9) * scale
    worst = np.max(np.abs(found - truth)[known], initial=0.0)
    assert worst <= allowed, f"{message}: off by {worst / scale:.2e} of its size, allowed {allowed / scale:.2e}"


def check(row, options):
    """One row through the engine, the reference with the same method and tolerance, and the reference at 1e-10."""
    columns = {name: np.array([value]) for name, value in row.items()}
    call = {**options, "signals": list(SIGNALS), "metrics": list(STEADFAST)}
    found, expected = Engine()(columns, **call), Reference()(columns, **call)
    truth = Reference()(columns, **{**call, "method": "dop853", "rtol": 1e-10})
    assert found.finished[0], found.result.message(0)
    assert truth.finished[0], truth.result.status
    rtol = options["rtol"]
    for name, size in SIGNALS.items():
        compare(found.samples[name], expected.samples[name], truth.samples[name], size, rtol, name)
    sizes = [1.0, 1.0, 0.01, 0.01, 0.1] if options["model"].base == "two_inertia" else [1.0, 1.0, 0.1]
    for k, size in enumerate(sizes):
        states = (run.final_state[:, k] for run in (found, expected, truth))
        compare(*states, size, rtol, f"final state {k}")
    for name, size in STEADFAST.items():
        compare(*(run.metrics[name] for run in (found, expected, truth)), size, rtol, name)


QUIET = {
    "deadline": None,
    "database": None,
    "suppress_health_check": list(HealthCheck),
    "phases": [Phase.explicit, Phase.generate, Phase.shrink],
}


@settings(max_examples=12, derandomize=True, **QUIET)
@given(call=calls())
def test_against_reference_anywhere(call):
    check(*call)


@pytest.mark.long
@settings(max_examples=1500, **QUIET)
@given(call=calls())
def test_against_reference_anywhere_long(call):
    check(*call)


ORDINARY = [
    ({}, {}),
    ({"start": "speed_ramp", "stop": "brake", "J_l": 6.0, "speed_rpm": 200.0}, {}),
    ({"stop": "brake", "speed_rpm": 300.0}, {}),
    ({"start": "speed_ramp", "speed_rpm": -60.0, "load": -20.0}, {}),
    ({"initial": "zero_angle", "t_end": 4.0}, {"spring": "piecewise"}),
    ({"torque": 0.006}, {}),
    ({"stop": None, "t_end": 2.0}, {}),
    ({"start": "speed_ramp", "speed_rpm": 200.0}, {"base": "one_inertia"}),
]
LOOSE = {
    "order_2": 1e-4,
    "order_15": 1e-3,
    "speed_order_4": 1e-3,
    "time_outside_range": 1e-4,
    "residual_ring": 1e-4,
    "peak_windup": 2e-5,
}


@pytest.mark.parametrize(
    ("scenario", "model"), ORDINARY, ids=lambda value: ",".join(map(str, value.values())) or "default"
)
def test_against_reference_all_metrics(engine, reference, scenario, model, long):
    """Every metric on rows near the default drive; the modes have a test of their own."""
    scenario = dict(scenario)
    model = hdfast.Model(**model)
    rng = np.random.default_rng(7)
    default = {parameter.name: parameter.default for parameter in hdfast.params(model)}
    default["J_l"] = scenario.pop("J_l", 0.5)
    names = ["J_m", "J_l", "B_m", "B_l", "B_ml", "B_sp", "te_scale", "k1" if model.spring == "polynomial" else "K1"]
    rows = {name: default[name] * rng.uniform(0.8, 1.2, 12 if long else 1) for name in names}
    metrics = [name for name in hdfast.metrics() if not name.startswith("mode_")]
    metrics += ["order_2", "order_15", "speed_order_4"]
    options = {"model": model, "scenario": hdfast.Scenario.start_stop(**scenario), "metrics": metrics, "rtol": 1e-8}
    found, expected = engine(rows, **options).metrics, reference(rows, **options).metrics
    assert np.all(found.pop("energy_residual") < 1e-6)
    wrong = [name for name in found if not close(found[name], expected[name], LOOSE.get(name, 2e-6))]
    assert not wrong, {name: (found[name].tolist(), expected[name].tolist()) for name in wrong}


def close(found, expected, rtol):
    return np.allclose(found, expected, rtol=rtol, atol=1e-12, equal_nan=True)


@pytest.mark.parametrize(
    ("scenario", "te_scale", "fits"),
    [
        ({"t_off": 0.4, "t_end": 0.7}, 0.0, "start stop"),
        ({"t_off": 0.4, "t_end": 0.7}, 1.0, "start stop"),
        ({"t_off": 0.4, "t_end": 0.7, "speed_rpm": 150.0}, 1.0, "start stop"),
        ({"t_off": 0.4, "t_end": 0.7, "speed_rpm": 450.0}, 1.0, ""),
        ({"t_off": 0.6, "t_end": 0.9, "start": "speed_ramp", "t_ramp": 0.3}, 1.0, "stop"),
    ],
    ids=["no lines", "lines", "turning", "sweeping", "ramp"],
)
def test_against_reference_modes(engine, reference, scenario, te_scale, fits, long):
    """The mode after start and stop, among lines of the kinematic error; NaN where a single damped wave is not all."""
    events = ("start", "stop")
    metrics = [f"mode_{kind}_{event}" for event in events for kind in ("frequency", "decay", "amplitude")]
    inertias = np.array([0.25, 0.5, 0.6] if long else [0.5])
    rows = {"J_l": inertias, "te_scale": np.full_like(inertias, te_scale)}
    options = {"scenario": hdfast.Scenario.start_stop(**scenario), "metrics": metrics, "rtol": 1e-8}
    found, expected = (run(rows, **options).metrics for run in (engine, reference))
    for name in metrics:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-5, err_msg=name)
    if not long:
        assert [event for event in events if np.isfinite(found[f"mode_decay_{event}"][0])] == fits.split()


def test_against_reference_speed_crossing_twice_in_a_step(engine, reference):
    """The speed passes 95 % upward, falls back 1.6 ms later and passes again: the first passage counts."""
    options = {
        "scenario": hdfast.Scenario.start_stop(torque=0.03),
        "metrics": ["rise_time", "rise_shape"],
        "rtol": 1e-8,
    }
    found, expected = (run({"J_l": np.array([0.7])}, **options).metrics for run in (engine, reference))
    for name in found:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-6, err_msg=name)


def test_exact_metrics_do_not_depend_on_company(engine):
    """The amplitude of an order is the same whatever else is asked for."""
    row = {"J_l": np.array([0.5])}
    alone = engine(row, metrics=["order_2"]).metrics["order_2"]
    together = engine(row, metrics=["order_2", "order_7/2", "order_15", "te_pp"]).metrics["order_2"]
    np.testing.assert_allclose(alone, together, rtol=1e-9)


@pytest.mark.parametrize("spring", ["polynomial", "piecewise"])
@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_against_reference_impossible_rows(engine, reference, base, spring):
    """The same rows are refused, and for the same parameter."""
    model = hdfast.Model(base, spring)
    table = hdfast.params(model)
    names = [name for name in table.names if not name.startswith("te_")] + ["te_scale", "te_cos_1", "te_sin_15"]
    cases = [(name, value) for name in names for value in (math.nan, -1.0, 0.0, math.inf)]
    cases = [case for case in cases if case != ("te_sin_15", -1.0)]
    cases += [(name, value) for name in ("tau_max", "K_p", "omega_set") for value in (math.nan, -1.0, 0.0, math.inf)]
    cases += [("theta_m0", value) for value in (-1e9, 1.1e9, -1e15)]
    cases += [(name, value) for name in ("K_p", "K_i") for value in (1e-13, 1e-12)]
    for name, value in cases:
        row = {name: np.array([value])}
        options = {"model": model, "scenario": hdfast.Scenario.start_stop(t_end=0.02), "metrics": ["te_pp"]}
        found, expected = engine(row, **options), reference(row, **options)
        refused = expected.result.status[0] == "bad_parameters"
        assert (hdfast.statuses()[int(found.result.status[0])].name == "bad_parameters") == refused, (name, value)
        if refused:
            assert table_name(model, found.result.detail[0]) == expected.result.detail[0], (name, value)


def table_name(model, index):
    from hdfast.params import layout

    return layout(model)[int(index)].name


def random_rows(count, seed=12345):
    """Rows around the default drive with independent factors, and set speeds of 50 to 300 r/min."""
    rng = np.random.default_rng(seed)
    default = parameters()
    names = ["J_m", "J_l", "B_m", "B_l", "B_ml", "B_sp", "k1", "te_scale"]
    columns = {name: default[name] * rng.uniform(0.7, 1.3, count) for name in names}
    columns["omega_set"] = rng.uniform(50.0, 300.0, count) * RPM
    columns["theta_m0"] = rng.uniform(0.0, 6.0, count)
    return columns


def test_against_scipy_errors_scale_with_rtol(engine, long):
    """Windup and speed errors on random rows against DOP853 at rtol 1e-12 fall with rtol from 1e-4 to 1e-10."""
    count = 100 if long else 3
    rows = random_rows(count)
    scenario = hdfast.Scenario.start_stop(
        start="speed_ramp", stop="brake", t_ramp=0.2, t_off=1.0, t_end=1.5, speed_rpm=100
    )
    t = np.linspace(0.0, 1.5, 601)[1:]
    exact_windup, exact_speed = [], []
    for k in range(count):
        p = {**parameters(), **scenario.values, **{name: values[k] for name, values in rows.items()}}
        start = lagrange.relaxed_start(p, ORDERS, LABELS, "polynomial", scenario.segments)
        truth = lagrange.solve(p, ORDERS, LABELS, "polynomial", scenario.segments, scenario.t_end, start).at(t)
        exact_windup.append(lagrange.Lagrangian(p, ORDERS, LABELS, "polynomial").windup(truth[[0, 2]]))
        exact_speed.append(truth[3])
    tolerances = np.array([1e-4, 1e-6, 1e-8, 1e-10])
    for method in ("dop853", "tsit5", "dopri5"):
        errors = []
        for rtol in tolerances:
            found = engine(
                rows,
                scenario=scenario,
                t_eval=t,
                signals=["windup", "omega_l"],
                metrics=["te_pp"],
                rtol=float(rtol),
                method=method,
            ).samples
            errors.append([relative(found["windup"], exact_windup), relative(found["omega_l"], exact_speed)])
        errors = np.array(errors)
        assert np.all(errors < 300 * tolerances[:, None, None]), (method, errors.max(axis=2))
        for kind in range(2):
            slope = np.polyfit(np.log(tolerances), np.log(np.median(errors[:, kind], axis=1)), 1)[0]
            assert 0.75 < slope < 1.25, (method, np.median(errors[:, kind], axis=1))


def relative(found, exact):
    """Largest error of each row over the row's largest value."""
    exact = np.array(exact)
    return np.max(np.abs(found - exact), axis=1) / np.max(np.abs(exact), axis=1)
