from __future__ import annotations

import math

import hdfast
import numpy as np
import pytest
from hdfast.segments import COLUMN, KIND, MOTION_COLUMN
from hypothesis import given, settings
from hypothesis import strategies as st

Scenario = hdfast.Scenario


def value(scenario, name, t):
    """A signal of the segment table at time t."""
    row = scenario.segments[np.searchsorted(scenario.segments[:, 0], t, side="right") - 1]
    return row[COLUMN[name]] + row[COLUMN[name] + 1] * (t - row[0])


def test_exact_default_is_torque_step_and_coast():
    scenario = Scenario.start_stop()
    assert scenario.segments[:, 0].tolist() == [0, 3]
    assert [value(scenario, "sustain", t) for t in (0, 2.9, 3, 5)] == [1, 1, 0, 0]
    assert [value(scenario, "set_load", t) for t in (0, 5)] == [1, 1]
    assert (scenario.segments[:, KIND] == 0).all()
    assert (scenario.t_on, scenario.t_off, scenario.t_end) == (0, 3, 6)
    assert math.isnan(scenario.t_run)
    assert (scenario.ring_delay, scenario.ring_width, scenario.ring_on_load) == (1.5, 1.4, False)
    assert scenario.values["omega_set"] == pytest.approx(100 * 2 * math.pi / 60)


def test_exact_ramp_and_brake():
    scenario = Scenario.start_stop(start="speed_ramp", stop="brake", t_on=0.5, t_off=2, t_end=4)
    times = [0.25, 0.5, 0.6, 0.7, 1.9, 2.01, 2.02, 3]
    assert [value(scenario, "set_speed", t) for t in times] == pytest.approx([0, 0, 0.5, 1, 1, 0.5, 0, 0])
    assert (scenario.segments[:, KIND] == 1).all()
    assert (scenario.segments[:, 2] == 0).all()
    assert scenario.ring_on_load


def test_exact_ramps_nobody_gave_end_with_the_time_there_is():
    late = Scenario.start_stop(stop="brake", t_off=5.99)
    assert np.array_equal(late.segments, Scenario.start_stop(stop="brake", t_off=5.99, t_brake=6 - 5.99).segments)
    assert hdfast.sweep({}, scenario=Scenario.start_stop(stop="brake", t_off=6.0), metrics=[]).finished.all()
    brief = Scenario.start_stop(start="speed_ramp", t_off=0.1, t_end=0.2)
    assert np.array_equal(
        brief.segments, Scenario.start_stop(start="speed_ramp", t_off=0.1, t_end=0.2, t_ramp=0.1).segments
    )


def test_exact_brake_after_open_loop_is_bumpless():
    scenario = Scenario.start_stop(stop="brake")
    assert scenario.segments[:, 0].tolist() == [0, 3, 3.02]
    assert scenario.segments[:, KIND].tolist() == [0, 1, 1]
    assert scenario.segments[:, 2].tolist() == [0, 1, 0]
    assert value(scenario, "sustain", 3.01) == 0


def test_exact_torque_override_and_ramp():
    scenario = Scenario.start_stop(torque=0.4, torque_ramp=0.5, t_on=1)
    assert [value(scenario, "torque", t) for t in (0.5, 1.25, 1.5, 2.9, 3.1)] == pytest.approx([0, 0.2, 0.4, 0.4, 0])
    assert value(scenario, "sustain", 2) == 0


def test_exact_no_stop_runs_to_the_end():
    scenario = Scenario.start_stop(stop=None, t_end=2)
    assert scenario.t_off == 2
    assert value(scenario, "sustain", 1.99) == 1


def test_exact_load_number_and_table():
    assert Scenario.start_stop(load=12.5).values["tau_load"] == 12.5
    scenario = Scenario.start_stop(load=([0, 1, 1, 2], [0, 0, 5, 7]))
    assert scenario.values["tau_load"] == 0
    assert [value(scenario, "load", t) for t in (0.5, 1, 1.5, 2.5)] == [0, 5, 6, 7]


def test_exact_benchmark_profile():
    scenario = Scenario.speed_profile(
        [0, 0.5, 2, 2.5, 3], relative=[0, 1, 1, 0, 0], tau_max=math.inf, run_window=(1, 2)
    )
    assert scenario.segments[:, 0].tolist() == [0, 0.5, 2, 2.5]
    assert [value(scenario, "set_speed", t) for t in (0.25, 1, 2.25, 2.7)] == [0.5, 1, 0.5, 0]
    assert (scenario.t_run, scenario.t_off, scenario.t_end) == (1, 2, 3)
    assert scenario.values["tau_max"] == math.inf


def test_exact_absolute_profile_sets_the_speed():
    scenario = Scenario.speed_profile([0, 1, 2, 3], [0, 60, 60, 0])
    assert value(scenario, "reference", 0.5) == pytest.approx(math.pi)
    assert scenario.values["omega_set"] == pytest.approx(2 * math.pi)
    assert scenario.t_off == 2


def test_exact_held_samples():
    scenario = Scenario.torque_profile([0.1, 0.2, 0.4], [1, 2, 3], hold=True, t_end=1)
    assert [value(scenario, "torque", t) for t in (0, 0.15, 0.2, 0.39, 0.9)] == [1, 1, 2, 2, 3]


@pytest.mark.parametrize(
    ("t", "speed", "t_end", "t_off"),
    [
        ([0, 1, 4, 6], [0, 100, 0, 0], None, 4),
        ([0, 1, 2, 4, 6], [0, 100, 100, -50, 0], None, 4),
        ([0, 1, 4], [0, 100, 100], None, 4),
        ([0, 1], [0, 100], 3, 3),
        ([0, 1, 4, 6], [0, 100, 0, 0], 3, 3),
    ],
)
def test_exact_run_phase_lasts_as_long_as_the_largest_speed_is_held(t, speed, t_end, t_off):
    assert Scenario.speed_profile(t, speed, hold=True, t_end=t_end).t_off == t_off


def test_exact_motion_is_one_spline():
    t = np.linspace(0, 2, 41)
    scenario = Scenario.motion(t, 3 * t**3 - t + 0.5, load=([0.0, 0.033], [0.0, 1.0]))
    assert scenario.values["theta_m0"] == 0.5
    for moment in (0, 0.01, 0.04, 0.777, 1.99):
        row = scenario.segments[np.searchsorted(scenario.segments[:, 0], moment, side="right") - 1]
        s = moment - row[0]
        c = row[MOTION_COLUMN:]
        assert c @ [1, s, s**2, s**3] == pytest.approx(3 * moment**3 - moment + 0.5, abs=1e-12)
        assert c @ [0, 1, 2 * s, 3 * s**2] == pytest.approx(9 * moment**2 - 1, abs=1e-10)
        assert c @ [0, 0, 2, 6 * s] == pytest.approx(18 * moment, abs=1e-8)


def test_against_scipy_smoothing_reduces_the_acceleration():
    rng = np.random.default_rng(3)
    t = np.linspace(0, 1, 201)
    noisy = 5 * t + 1e-3 * rng.standard_normal(201)
    rough = Scenario.motion(t, noisy).segments[:, MOTION_COLUMN + 2]
    for smoothing in ("auto", 1e-3):
        smooth = Scenario.motion(t, noisy, smoothing=smoothing).segments[:, MOTION_COLUMN + 2]
        assert np.std(smooth) < 0.1 * np.std(rough)


RECORDING = {
    "t": np.arange(200) * 0.01 + 7.0,
    "motor_torque": np.linspace(0, 1, 200),
    "motor_angle": 10 * np.arange(200) * 0.01 + 2.0,
    "speed_reference": np.full(200, 10.0),
    "load_torque": np.full(200, 3.0),
}


def test_exact_replay_of_torque():
    scenario = Scenario.replay(RECORDING)
    assert scenario.t_end == pytest.approx(1.99)
    assert value(scenario, "torque", 0.5) == pytest.approx(50 / 199)
    assert value(scenario, "load", 1.0) == 3
    assert scenario.values["theta_m0"] == 2
    assert scenario.values["omega_set"] == pytest.approx(10)
    assert Scenario.replay(RECORDING, initial="zero_angle").values["theta_m0"] == 0


def test_exact_replay_of_motion_and_reference():
    scenario = Scenario.replay(RECORDING, input="motor_motion")
    assert scenario.segments[50, MOTION_COLUMN + 1] == pytest.approx(10)
    assert value(scenario, "torque", 0.505) == pytest.approx(0.505 / 1.99)
    held = Scenario.replay(RECORDING, input="motor_motion", hold=True)
    assert value(held, "torque", 0.505) == pytest.approx(50 / 199)
    silent = {name: values for name, values in RECORDING.items() if name != "motor_torque"}
    assert value(Scenario.replay(silent, input="motor_motion"), "torque", 0.505) == 0
    scenario = Scenario.replay(RECORDING, input="reference", hold=True)
    assert value(scenario, "reference", 1.234) == 10


def test_exact_replay_starts_at_the_recorded_angle():
    for name in ("motor_torque", "motor_motion", "reference"):
        assert Scenario.replay(RECORDING, input=name).values["theta_m0"] == 2
    assert Scenario.replay(RECORDING, input="reference", theta_m0=3).values["theta_m0"] == 3
    silent = {name: values for name, values in RECORDING.items() if name != "motor_angle"}
    assert Scenario.replay(silent, input="reference").values["theta_m0"] == 0


def test_exact_replay_bridges_nan_and_checks_gaps():
    torque = RECORDING["motor_torque"].copy()
    torque[50:55] = np.nan
    scenario = Scenario.replay({**RECORDING, "motor_torque": torque})
    assert value(scenario, "torque", 0.52) == pytest.approx(52 / 199)
    torque[50:90] = np.nan
    with pytest.raises(hdfast.InputError, match=r"motor_torque.*0\.41 s.*max_gap"):
        Scenario.replay({**RECORDING, "motor_torque": torque})
    Scenario.replay({**RECORDING, "motor_torque": torque}, max_gap=0.5)


def test_exact_replay_takes_tables():
    import pandas as pd
    import polars as pl

    expected = Scenario.replay(RECORDING).segments
    for frame in (pd.DataFrame(RECORDING), pl.DataFrame(RECORDING), pl.DataFrame(RECORDING).to_arrow()):
        assert np.array_equal(Scenario.replay(frame).segments, expected)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Scenario.start_stop(start="torque"), "start = 'torque'.*torque_step"),
        (lambda: Scenario.start_stop(stop="break"), "did you mean 'brake'"),
        (lambda: Scenario.start_stop(t_end=0), "t_end"),
        (lambda: Scenario.start_stop(t_end=1e9), "t_end"),
        (lambda: Scenario.start_stop(t_end=float("nan")), "t_end"),
        (lambda: Scenario.start_stop(t_end="6"), "t_end = '6' is not a number"),
        (lambda: Scenario.start_stop(t_off=7), "t_off = 7 s is out of range"),
        (lambda: Scenario.start_stop(t_on=4), "t_off"),
        (lambda: Scenario.start_stop(speed_rpm=1e9), "speed_rpm"),
        (lambda: Scenario.start_stop(speed_rpm=None), "speed_rpm"),
        (lambda: Scenario.start_stop(K_p=-1, stop="brake"), "K_p = -1 .* is out of range"),
        (lambda: Scenario.start_stop(tau_max=0, start="speed_ramp"), "tau_max = 0 "),
        (lambda: Scenario.start_stop(K_p=0.05), "K_p = 0.05 has no meaning with start='torque_step', stop='coast'"),
        (lambda: Scenario.start_stop(K_i=1, stop=None), "K_i = 1 has no meaning with start='torque_step', stop=None"),
        (lambda: Scenario.start_stop(tau_max=1), "tau_max = 1 has no meaning"),
        (lambda: Scenario.start_stop(t_ramp=5, start="speed_ramp"), "t_ramp"),
        (lambda: Scenario.start_stop(t_brake=5, stop="brake"), "t_brake"),
        (lambda: Scenario.start_stop(torque=1, start="speed_ramp"), "torque = 1 has no meaning with start"),
        (lambda: Scenario.start_stop(torque_ramp=1, start="speed_ramp"), "torque_ramp = 1 has no meaning"),
        (lambda: Scenario.start_stop(t_ramp=-5), "t_ramp = -5 has no meaning with start='torque_step'"),
        (lambda: Scenario.start_stop(t_brake=1), "t_brake = 1 has no meaning with stop='coast'"),
        (lambda: Scenario.start_stop(t_brake=1, stop=None), "t_brake = 1 has no meaning with stop=None"),
        (lambda: Scenario.start_stop(load=float("nan")), "load"),
        (lambda: Scenario.start_stop(load=([0, 1],)), "load"),
        (lambda: Scenario.start_stop(load=([0, 1], [0])), "load torque has 1 samples"),
        (lambda: Scenario.start_stop(initial="rest"), "initial"),
        (lambda: Scenario.start_stop(initial="zero_angle", theta_m0=1), "theta_m0 = 1 rad has no meaning with init"),
        (lambda: Scenario.torque_profile([0, 1], [0, 1], initial="zero_angle", theta_m0=-2), "theta_m0 = -2 rad"),
        (lambda: Scenario.start_stop(run_window=(1, 2), t_off=3), "run_window"),
        (lambda: Scenario.start_stop(run_window=5), "run_window"),
        (lambda: Scenario.start_stop(run_window=(2, 3), t_off="x"), "t_off = 'x' is not a number"),
        (lambda: Scenario.start_stop(t_end=10**400), "t_end = 1000+.* is out of range"),
        (lambda: Scenario.speed_profile([0, 1], [0, 1], hold="no"), "hold = 'no' is not true or false"),
        (lambda: Scenario.torque_profile([0, 1], [0, 1], hold=1), "hold = 1 is not"),
        (lambda: Scenario.replay(RECORDING, input="motor_motion", hold="yes"), "hold = 'yes'"),
        (lambda: Scenario.replay(RECORDING, t_ende=1.0), "option of replay = 't_ende' .*; did you mean 't_end'"),
        (lambda: Scenario.start_stop(run_window=(2, 1)), "run_window"),
        (lambda: Scenario.start_stop(ring_width=0), "ring_width"),
        (lambda: Scenario.speed_profile([0, 1]), "exactly one"),
        (lambda: Scenario.speed_profile([0, 1], [0, 1], speed=[0, 1]), "exactly one"),
        (lambda: Scenario.speed_profile([0, 1], [0, 1, 2]), "speed_rpm has 3 samples"),
        (lambda: Scenario.speed_profile([1, 0], [0, 1]), "t must not decrease"),
        (lambda: Scenario.speed_profile([-1, 0], [0, 1]), "out of range"),
        (lambda: Scenario.speed_profile([], []), "shape"),
        (lambda: Scenario.torque_profile([0, 1], [0, np.nan]), "torque.1. = nan"),
        (lambda: Scenario.torque_profile([0, 1], [0, 1e9]), "torque.1. = 1e.09"),
        (lambda: Scenario.torque_profile([0, 1], ["a", "b"]), "dtype"),
        (lambda: Scenario.motion([0, 1, 2], [0, 1, 2]), "5 or more"),
        (lambda: Scenario.motion([1, 2, 3, 4, 5, 6], range(6)), "from 0 s"),
        (lambda: Scenario.motion(range(6), range(6), t_end=9), "t_end"),
        (lambda: Scenario.motion(range(6), range(6), smoothing="lots"), "smoothing"),
        (lambda: Scenario.replay({"t": [0, 1]}), "no column 'motor_torque'"),
        (lambda: Scenario.replay(RECORDING, input="torque"), "did you mean 'motor_torque'"),
        (lambda: Scenario.motion(range(6), range(6), torque=0.2), "torque = 0.2 is not a pair"),
        (lambda: Scenario.replay({**RECORDING, "motor_torque": [1.0]}), "shape"),
        (lambda: Scenario.replay({**RECORDING, "motor_torque": np.full(200, np.nan)}), "no finite"),
        (lambda: Scenario.replay(17), "recording"),
    ],
)
def test_exact_wrong_scenarios(make, text):
    with pytest.raises(hdfast.InputError, match=text):
        make()


@settings(max_examples=60)
@given(
    st.dictionaries(
        st.sampled_from(
            ["speed_rpm", "t_on", "t_off", "t_end", "t_ramp", "t_brake", "torque", "load", "K_p", "tau_max"]
        ),
        st.one_of(st.floats(), st.none(), st.text(max_size=3), st.lists(st.floats(), max_size=2), st.booleans()),
        max_size=4,
    ),
    st.sampled_from(["torque_step", "speed_ramp"]),
    st.sampled_from(["coast", "brake", None]),
)
def test_exact_any_arguments_work_or_are_refused(arguments, start, stop):
    try:
        scenario = Scenario.start_stop(**arguments, start=start, stop=stop)
    except hdfast.InputError:
        return
    assert scenario.segments[0, 0] == 0
    assert np.isfinite(scenario.segments).all()
    assert (np.diff(scenario.segments[:, 0]) > 0).all()
    assert scenario.segments[-1, 0] < scenario.t_end
