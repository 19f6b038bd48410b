"""What lies between the ends of steps: samples, extrema, crossings and turning points, however long the steps are."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest

Scenario = hdfast.Scenario
RIGID = {"J_m": 1.7e-4, "J_l": 0.4552, "B_m": 1.52e-3, "ratio": 44.4}
SPEEDY = {"J_m": 1.1975e-4, "J_l": 0.9439, "B_m": 6.6673e-4, "ratio": 90.06866}
SWING = [-0.98, -4.31, -11.52, -11.24, -4.73, -2.82, -4.96, 1.64, -0.09, -2.57]


@pytest.mark.parametrize(("rtol", "inside"), [(1e-4, 1e-3), (1e-6, 1e-5), (1e-9, 2e-7)])
def test_against_a_stiff_method_where_stability_bounds_the_steps(rtol, inside):
    """A rigid gear held at a speed: nothing but the decay of the loop keeps the steps short."""
    options = {
        "model": hdfast.Model("one_inertia", orders=[1, 2]),
        "scenario": Scenario.start_stop(t_end=2.6, start="speed_ramp", stop=None, speed_rpm=60.0, load=10.0),
        "t_eval": np.linspace(1.0, 2.6, 1601),
        "signals": ["omega_m"],
        "metrics": ["speed_ripple"],
    }
    right = hdfast.sweep(RIGID, method="rodas5p", rtol=1e-10, **options)
    found = hdfast.sweep(RIGID, method="dop853", rtol=rtol, **options)
    np.testing.assert_allclose(found.samples["omega_m"], right.samples["omega_m"], rtol=inside)
    ripple = RIGID["ratio"] * np.array([found["speed_ripple"], right["speed_ripple"]])
    np.testing.assert_allclose(*ripple, rtol=0.0, atol=10.0 * inside)


@pytest.mark.parametrize("rtol", [1e-6, 1e-8, 1e-9, 1e-10])
def test_against_dense_samples_of_a_peak(rtol):
    """Fifteen orders on a spring with knees: which peak is the highest, tenths of a thousandth decide."""
    scenario = Scenario.start_stop(t_end=2.6, t_off=1.6, speed_rpm=400.0, load=10.0)
    options = {"model": hdfast.Model(spring="piecewise"), "scenario": scenario}
    dense = hdfast.sweep(SPEEDY, rtol=1e-10, t_eval=np.linspace(1.0, 1.6, 300_001), signals=["te"], **options)
    found = hdfast.sweep(SPEEDY, rtol=rtol, metrics=["te_peak"], **options)
    np.testing.assert_allclose(found["te_peak"], np.abs(dense.samples["te"]).max(), rtol=max(10.0 * rtol, 1e-8))


def test_exact_steady_speed_of_one_motion_whatever_the_load():
    """The motor turns back inside a step, wherever that ends."""
    scenario = Scenario.motion(np.linspace(0.0, 2.5, 10), SWING, t_off=2.0)
    found = hdfast.sweep({"J_l": np.linspace(0.5, 1.5, 41)}, scenario=scenario, metrics=["steady_speed"])
    np.testing.assert_allclose(found["steady_speed"], 11.17644549, rtol=1e-8)


def test_against_short_steps_the_last_fall_past_a_level():
    """A wave that a coasting motor rides on passes the level once more, for less than a thousandth of it."""
    options = {
        "model": hdfast.Model("one_inertia", terms=["external_periodic_torque"]),
        "scenario": Scenario.start_stop(t_end=2.0, t_off=0.8, start="speed_ramp", stop="coast", speed_rpm=60.0),
        "metrics": ["stop_time"],
    }
    row = {"T_external": 1.368761715425752, "f_external": 76.67350055310928, "J_m": 1.5258449336457648e-4}
    right = hdfast.sweep(row, max_step=1e-4, rtol=1e-9, **options)["stop_time"]
    for rtol in (1e-6, 1e-8):
        np.testing.assert_allclose(hdfast.sweep(row, rtol=rtol, **options)["stop_time"], right, rtol=1e-4)
