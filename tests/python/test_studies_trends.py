"""The analytic trends (a) to (e) in their limits, by the engine, within 2 %."""

from __future__ import annotations

import math

import drives
import hdfast
import numpy as np
import pytest
from hdfast.studies import cases, trends
from hdfast.studies.ring import ring

RPM = 2 * math.pi / 60
LINEAR = {"k3": 0.0, "k5": 0.0, "phi_max": 1.0, "B_sp": 2.0}
LOADS = np.array([0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 12.0])


def parameters(**changes):
    return {**drives.DRIVE, **drives.POLYNOMIAL, **changes}


def test_against_formula_a_torque_step():
    scenario = hdfast.Scenario.start_stop(speed_rpm=300.0)
    found = hdfast.sweep({**LINEAR, "te_scale": 0.0, "J_l": LOADS}, scenario=scenario)["mode_amplitude_start"]
    for load, value in zip(LOADS, found, strict=True):
        p = parameters(**LINEAR, J_l=load)
        assert value == pytest.approx(trends.torque_step(p, trends.sustaining_torque(p, 300 * RPM)), rel=0.02)


def test_against_formula_b_released_error():
    scenario = hdfast.Scenario.start_stop(torque=0.0, initial="zero_angle")
    found = hdfast.sweep({**LINEAR, "J_l": LOADS}, scenario=scenario)["mode_amplitude_start"]
    windup = sum(a * math.sin(p) for a, p in zip(drives.AMPLITUDES, drives.PHASES, strict=True))
    for load, value in zip(LOADS, found, strict=True):
        assert value == pytest.approx(trends.released_error(parameters(**LINEAR, J_l=load), windup), rel=0.02)


@pytest.mark.parametrize("rpm", [60.0, 300.0, 600.0])
def test_against_formula_c_held_speed(rpm):
    t = np.linspace(0.0, 12.0, 1201)
    scenario = hdfast.Scenario.motion(t, rpm * RPM * t, run_window=(10.0, 12.0))
    names = [f"speed_order_{n}" for n in (1, 2, 4, 6, 15)]
    rows = {**LINEAR, "B_sp": 20.0, "J_l": LOADS}
    state = np.tile([0.0, rpm * RPM, 0.0, rpm * RPM / 121.0], (len(LOADS), 1))
    found = hdfast.sweep(rows, scenario=scenario, initial_state=state, metrics=names, rtol=1e-9)
    for j, load in enumerate(LOADS):
        p = parameters(**LINEAR | {"B_sp": 20.0}, J_l=load)
        for n, name in zip((1, 2, 4, 6, 15), names, strict=True):
            expected = trends.held_ripple(p, drives.AMPLITUDES[n - 1], n, rpm * RPM)
            assert found[name][j] == pytest.approx(expected, rel=0.02), (load, n)


def test_against_formula_d_coast():
    """The stop takes the torque away: the mode of (a), and the tail of one inertia."""
    scenario = hdfast.Scenario.start_stop(speed_rpm=300.0, t_off=5.0, t_end=10.0)
    found = hdfast.sweep({**LINEAR, "te_scale": 0.0, "J_l": LOADS}, scenario=scenario)
    for j, load in enumerate(LOADS):
        p = parameters(**LINEAR, J_l=load)
        held = trends.sustaining_torque(p, found["steady_speed"][j])
        reached = 1.0 - math.exp(-5.0 / trends.rigid_time_constant(p))
        torque = trends.sustaining_torque(p, 300 * RPM)
        assert held == pytest.approx(torque * reached, rel=0.02)
        assert found["mode_amplitude_stop"][j] == pytest.approx(trends.torque_step(p, torque), rel=0.02)
        assert found["stop_time"][j] == pytest.approx(trends.rigid_time_constant(p) * math.log(19.0), rel=0.02)


def test_against_formula_e_spring_torque_of_an_instant_stop():
    """The limit of a brake that is much faster than the mode: the motor stands still at once."""
    t = np.concatenate([np.linspace(0.0, 2.0, 2001), np.linspace(2.0, 3.0, 10_001)[1:]])
    angle = 100 * RPM * np.where(t < 2.0, t, 2.0)
    scenario = hdfast.Scenario.motion(t, angle, t_off=2.0)
    rows = {**LINEAR, "B_sp": 0.5, "B_l": 0.0, "te_scale": 0.0, "J_l": LOADS[2:]}
    load_speed = 100 * RPM / 121.0
    state = np.tile([0.0, 100 * RPM, 0.0, load_speed], (len(LOADS[2:]), 1))
    found = hdfast.sweep(rows, scenario=scenario, initial_state=state, metrics=["peak_windup"])["peak_windup"]
    for load, windup in zip(LOADS[2:], found, strict=True):
        p = parameters(**LINEAR, J_l=load)
        assert p["k1"] * windup == pytest.approx(trends.brake_torque(p, load_speed), rel=0.02)


@pytest.mark.parametrize("load", [0.5, 1.0, 2.0, 5.0])
def test_against_formula_e_mode_under_control(load):
    """The ring after a brake is the eigenvalue with the controller in it, within 2 %."""
    factors = np.array([0.5, 0.75, 1.0, 1.25])
    scenario = hdfast.Scenario.start_stop(speed_rpm=5.0, start="speed_ramp", stop="brake")
    t = np.linspace(0.0, 6.0, 12_001)
    rows = {"J_m": 3e-4 * factors, "J_l": load, "te_scale": 0.0}
    found = hdfast.sweep(rows, scenario=scenario, t_eval=t, signals=["omega_m", "omega_l"], metrics=[], rtol=1e-9)
    inside = (t > 3.03) & (t < 3.6)
    for j, factor in enumerate(factors):
        value = trends.controlled_mode(parameters(J_m=3e-4 * factor, J_l=load), 0.05, 0.8)
        twist = found.samples["omega_l"][j] - found.samples["omega_m"][j] / 121.0
        frequency, decay, _ = ring(t[inside], twist[inside], value.imag / (2 * math.pi))
        assert frequency == pytest.approx(value.imag / (2 * math.pi), rel=0.02)
        assert decay == pytest.approx(-value.real, rel=0.02)


def test_against_design_table_of_controlled_modes():
    """40.6 to 40.8 Hz at 0.5, 28.7 to 29.5 at 1, 20.0 to 21.5 at 2, 11.8 to 13.9 at 5 for J_m times 0.5 to 1.25."""
    table = {0.5: (40.6, 40.8), 1.0: (28.7, 29.5), 2.0: (20.0, 21.5), 5.0: (11.8, 13.9)}
    for load, ends in table.items():
        for factor, value in zip((0.5, 1.25), ends, strict=True):
            mode = trends.controlled_mode(parameters(J_m=3e-4 * factor, J_l=load), 0.05, 0.8)
            assert mode.imag / (2 * math.pi) == pytest.approx(value, abs=0.06)


def test_exact_ring_of_two_decaying_oscillations():
    t = np.linspace(0.0, 0.6, 601)
    signal = 0.3 * np.exp(-9.0 * t) * np.cos(2 * math.pi * 21.0 * t + 0.4) + 0.8 * np.exp(-30.0 * t)
    assert ring(t, signal, 20.0) == pytest.approx((21.0, 9.0, 0.3), rel=1e-3)


def test_exact_no_ring_of_an_overdamped_mode_or_a_run_that_ended_early():
    """B_sp sixty times as large: the mode under control does not swing."""
    assert trends.controlled_mode(parameters(B_sp=60 * 5 * 20.0), 0.05, 0.8).imag == 0.0
    t = np.linspace(0.0, 0.6, 601)
    for signal, guess in ((np.exp(-30.0 * t), 0.0), (np.exp(-30.0 * t), 0.1), (np.where(t < 0.3, t, np.nan), 20.0)):
        assert np.isnan(ring(t, signal, guess)).all()


def test_exact_cases_cover_start_run_and_stop():
    grid = cases.run("J_l", [1.0, 2.0], [1.0], loads=(0.5,))
    assert grid.result.finished.all()
    assert grid.marked.tolist() == [True, False]
    assert grid.of("mode_frequency_start", "a").shape == (2,)
