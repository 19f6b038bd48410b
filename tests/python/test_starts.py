"""A start under a load: what is in equilibrium with it stays at rest until the motion begins."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from termed import VALUES

Scenario = hdfast.Scenario
LOAD = 40.0
YIELDING = [
    [],
    ["load_compliance"],
    ["base_compliance"],
    ["viscoelastic"],
    ["input_compliance", "actuator_lag", "delay"],
    ["load_compliance", "base_compliance", "viscoelastic", "actuator_lag"],
]
SIGNALS = ["gear_torque", "omega_m", "te"]


def run(terms, scenario, t, base="two_inertia", signals=SIGNALS, **row):
    values = {name: value for term in terms for name, value in VALUES[term].items()}
    options = {
        "model": hdfast.Model(base, terms=terms),
        "scenario": scenario,
        "t_eval": t,
        "signals": signals,
        "rtol": 1e-10,
    }
    return hdfast.sweep(values | row, metrics=[], strict=True, **options).samples


def assert_at_rest(found, load):
    np.testing.assert_allclose(found["gear_torque"], np.broadcast_to(load, found["gear_torque"].shape), rtol=1e-6)
    np.testing.assert_allclose(found["te"], found["te"][:, :1] + 0.0 * found["te"], rtol=0, atol=1e-10)
    assert np.max(np.abs(found["omega_m"])) < 1e-6


@pytest.mark.parametrize("terms", YIELDING, ids="+".join)
def test_exact_a_drive_under_load_rests_until_its_motion_begins(terms):
    """Started by a step of torque or the controller, at any angle of the kinematic error, the load by row or table."""
    rows = {"tau_load": np.array([-LOAD, 0.0, LOAD, LOAD]), "theta_m0": np.array([0.3, 0.0, 2.0, -70.0])}
    t = np.linspace(0.0, 0.2, 41)
    for start in ("torque_step", "speed_ramp"):
        found = run(terms, Scenario.start_stop(start=start, t_on=0.2, t_end=1.0), t, **rows)
        assert_at_rest(found, rows["tau_load"][:, None])
    table = ([0.0, 1.0], [LOAD, LOAD])
    for scenario in (
        Scenario.start_stop(t_on=0.2, t_end=1.0, load=table),
        Scenario.speed_profile([0.2, 0.3], speed=[0.0, 5.0], load=table),
        Scenario.motion(np.linspace(0.0, 0.5, 9), np.full(9, 0.7), load=table),
    ):
        assert_at_rest(run(terms, scenario, t), LOAD)


@pytest.mark.parametrize("start", ["torque_step", "speed_ramp"])
def test_exact_a_rigid_drive_under_load_rests_until_its_motion_begins(start):
    scenario = Scenario.start_stop(start=start, t_on=0.2, t_end=1.0, theta_m0=2.0)
    terms = ["actuator_lag", "delay"]
    assert_at_rest(run(terms, scenario, np.linspace(0.0, 0.2, 41), "one_inertia", tau_load=LOAD), LOAD)


@pytest.mark.parametrize("terms", YIELDING, ids="+".join)
def test_exact_an_imposed_motion_at_speed_throws_no_load(terms):
    """Without damping of the load and kinematic error the gear carries the load torque alone."""
    t = np.linspace(0.0, 0.5, 101)
    drive = {"te_scale": 0.0, "B_l": 0.0, "tau_load": LOAD}
    found = run(terms, Scenario.motion(t, 10.0 * t), t, signals=["gear_torque"], **drive)
    np.testing.assert_allclose(found["gear_torque"][0], LOAD, rtol=1e-6)


@pytest.mark.parametrize("terms", YIELDING[1:4], ids="+".join)
def test_exact_a_given_start_in_equilibrium_stays_there(terms):
    """Of the hidden states none can be given."""
    scenario = Scenario.torque_profile([0.0, 0.5], [LOAD / 121.0] * 2, load=LOAD)
    drive = {"te_scale": 0.0, "k3": 0.0, "k5": 0.0}
    sagged = LOAD * (120.0 / 121.0) ** 2 / VALUES["base_compliance"]["k_b"] if "base_compliance" in terms else 0.0
    values = {name: value for term in terms for name, value in VALUES[term].items()}
    found = hdfast.sweep(
        drive | values,
        model=hdfast.Model(terms=terms),
        scenario=scenario,
        initial_state=[0.0, 0.0, -LOAD / 3.102e4 - sagged, 0.0],
        t_eval=np.linspace(0.0, 0.5, 101),
        signals=SIGNALS,
        metrics=[],
    )
    assert_at_rest(found.samples, LOAD)


def test_exact_the_integrator_of_a_given_start_holds_its_load():
    """That of a drive at rest goes on at rest; without it, or without integral action, nothing holds the load."""
    scenario = Scenario.start_stop(start="speed_ramp", t_on=0.2, t_end=1.0)
    resting = hdfast.sweep({"tau_load": LOAD}, scenario=scenario, t_eval=[0.0], signals=SIGNALS, metrics=[])
    angle = [0.0, 0.0, -resting.samples["te"][0, 0], 0.0]
    held = LOAD * local_ratio(hdfast.params()) / 0.8
    t = np.linspace(0.0, 0.2, 41)
    options = {"t_eval": t, "signals": SIGNALS, "metrics": [], "rtol": 1e-10}
    found = hdfast.sweep({"tau_load": LOAD}, scenario=scenario, initial_state=[*angle, held], **options)
    assert_at_rest(found.samples, LOAD)
    for start, K_i in ((angle, 0.8), ([*angle, held], 0.0)):
        moved = hdfast.sweep({"tau_load": LOAD, "K_i": K_i}, scenario=scenario, initial_state=start, **options)
        assert np.min(moved.samples["omega_m"]) < -1.0


def local_ratio(table):
    """Motor turns handed on to the output at motor angle 0, which the kinematic error changes."""
    return 1.0 / 121.0 - sum(n * table[f"te_sin_{n}"].default for n in range(1, 16))


@pytest.mark.parametrize("terms", YIELDING, ids="+".join)
def test_exact_a_start_from_zero_angles_bears_and_holds_nothing(terms):
    """The spring is wound by the kinematic error at angle 0."""
    scenario = Scenario.start_stop(initial="zero_angle", t_on=0.2, t_end=1.0, load=LOAD)
    found = run(terms, scenario, [0.0, 0.1], signals=["gear_torque", "windup", "tau_m", "theta_l"])
    nominal = run([], Scenario.start_stop(initial="zero_angle"), [0.0], signals=["gear_torque", "windup"])
    for name in ("gear_torque", "windup"):
        np.testing.assert_allclose(found[name][:, 0] - nominal[name][:, 0], stretched(terms, name, nominal), rtol=1e-9)
    assert found["theta_l"][0, 0] == 0.0
    assert np.all(found["tau_m"][:, 0] == 0.0)


def stretched(terms, name, nominal):
    """What two Maxwell branches that are not relaxed add to the gear torque."""
    branches = "viscoelastic" in terms and name == "gear_torque"
    return VALUES["viscoelastic"]["K_v"] * nominal["windup"][:, 0] if branches else 0.0


@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_exact_a_speed_ramp_starts_at_its_reference(load):
    """An empty integrator let 40 N m drive the motor back at first, by 4.9 rad/s; the stiffer spring is left."""
    scenario = Scenario.start_stop(start="speed_ramp", stop=None, load=load, t_end=0.1)
    speed = run([], scenario, np.linspace(0.0, 0.1, 101), te_scale=0.0)["omega_m"][0]
    free = run(
        [], Scenario.start_stop(start="speed_ramp", stop=None, t_end=0.1), np.linspace(0.0, 0.1, 101), te_scale=0.0
    )
    np.testing.assert_allclose(speed, free["omega_m"][0], rtol=0, atol=0.02)


def test_exact_a_ramp_of_torque_goes_from_the_holding_to_the_sustaining_torque():
    scenario = Scenario.start_stop(t_on=0.1, torque_ramp=0.2, t_end=2.0, load=LOAD)
    torque = run([], scenario, [0.0, 0.1, 0.2, 0.3, 0.9], signals=["tau_m"], te_scale=0.0)["tau_m"][0]
    hold = LOAD / 121.0
    sustain = hold + (1.2e-3 + 0.5 / 121.0**2) * scenario.values["omega_set"]
    np.testing.assert_allclose(torque, [hold, hold, 0.5 * (hold + sustain), sustain, sustain], rtol=1e-12)


def test_against_differences_of_a_start_under_load():
    terms = ["load_compliance", "base_compliance", "input_compliance", "actuator_lag"]
    values = {name: value for term in terms for name, value in VALUES[term].items()}
    row = values | {"tau_load": 20.0, "theta_m0": 0.4, "te_scale": 1.0}
    wrt = ["tau_load", "theta_m0", "te_scale", "K_c", "k_b", "k_ci", "k1"]
    sizes = np.array([20.0, 1.0, 1.0, 2e4, 1e5, 60.0, 3e4]) * 1e-3
    options = {
        "model": hdfast.Model(terms=terms),
        "scenario": [Scenario.start_stop(start=start, t_on=0.05, t_end=0.2, K_p=K_p) for start, K_p in
                     (("torque_step", None), ("speed_ramp", 0.05))],
        "t_eval": np.linspace(0.0, 0.2, 21),
        "signals": ["te", "omega_m", "tau_m"],
        "metrics": [],
        "rtol": 1e-11,
    }  # fmt: skip
    table = {name: np.full(2 * len(wrt) + 1, value) for name, value in row.items() | {("k1", 3.102e4)}}
    for k, (name, size) in enumerate(zip(wrt, sizes, strict=True)):
        table[name][2 * k : 2 * k + 2] += [size, -size]
    for which in (0, 1):
        index = np.full(len(table["k1"]), which)
        moved = hdfast.sweep(table, scenario_index=index, **options).samples
        found = hdfast.sweep(row, scenario_index=index[:1], sensitivities=wrt, **options).sample_sensitivities
        for name in options["signals"]:
            expected = (moved[name][:-1:2] - moved[name][1:-1:2]).T / (2.0 * sizes)
            error = np.max(np.abs(found[name][0] - expected), axis=0)
            assert np.all(error < 3e-4 * np.max(np.abs(expected), axis=0)), (name, dict(zip(wrt, error, strict=True)))
