"""The torque of the default start: a drive with friction of any kind settles at the speed it was set to."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import RPM, linear
from termed import VALUES, simulate

Scenario = hdfast.Scenario
COVERED = {
    "coulomb_friction": {},
    "coulomb_friction_smooth": {},
    "stribeck_friction": {},
    "presliding_friction": {},
    "load_dependent_friction": {},
    "nonlinear_viscous": {},
    "thermal_viscous": {"heat_capacity": 1e9},
    "wear_run_in": {},
    "load_side_friction": {},
}


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
@pytest.mark.parametrize("load", [0.0, 20.0, -20.0])
@pytest.mark.parametrize("term", ["load_side_friction", "load_dependent_friction"])
def test_exact_friction_beyond_the_motor_does_not_cost_speed(term, load, base):
    """From rest, with the load helping or resisting."""
    found = hdfast.sweep(
        {"te_scale": 0.0, "tau_load": load, "omega_set": np.array([-300.0, 30.0, 300.0]) * RPM},
        model=hdfast.Model(base, terms=[term]),
        scenario=Scenario.start_stop(t_off=8.0, t_end=9.0),
        metrics=["steady_speed"],
        strict=True,
    )
    np.testing.assert_allclose(found["steady_speed"], np.array([-300.0, 30.0, 300.0]) * RPM, rtol=1e-8)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("term", COVERED)
def test_exact_a_drive_at_its_set_speed_stays_there(term, way):
    """Also where friction falls with speed, whose unevenness asymmetry adds to."""
    speed = way * 100 * RPM
    terms, values = [term], VALUES[term] | COVERED[term]
    if term != "load_side_friction":
        terms, values = [term, "asymmetric_friction"], values | VALUES["asymmetric_friction"]
    scenario = Scenario.start_stop(speed_rpm=way * 100, stop=None, t_end=9.0, load=way * 5.0)
    start = [0.0, speed, 0.0, speed / 121, 0.0]
    omega_m = simulate(linear(s=0.4, **values), terms, scenario, np.array([0.0, 8.0, 9.0]), ["omega_m"], start)[0]
    np.testing.assert_allclose(omega_m[1:], speed, rtol=1e-6)


def test_exact_dry_friction_asks_for_nothing_at_rest():
    """What is left holds the load; without friction it would."""
    terms = ["coulomb_friction", "load_side_friction", "load_dependent_friction", "asymmetric_friction"]
    found = hdfast.sweep(
        {"omega_set": 0.0, "tau_load": np.array([-6.0, 0.0, 6.0])},
        model=hdfast.Model(terms=terms),
        scenario=Scenario.start_stop(),
        metrics=[],
        t_eval=[1.0],
        signals=["tau_m", "omega_m"],
    )
    np.testing.assert_allclose(found["tau_m"][:, 0], np.array([-6.0, 0.0, 6.0]) / 121, rtol=1e-14)
    assert np.all(found["omega_m"] == 0.0)


def test_exact_what_the_drive_makes_of_the_command_is_not_made_up_for():
    found = hdfast.sweep(
        {"te_scale": 0.0, "gain_error": 0.1},
        model=hdfast.Model(terms=["torque_gain"]),
        scenario=Scenario.start_stop(t_off=8.0, t_end=9.0),
        metrics=["steady_speed"],
    )
    np.testing.assert_allclose(found["steady_speed"], 1.1 * 100 * RPM, rtol=1e-8)
