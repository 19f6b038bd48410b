"""Derivatives of drives that rest: their values have no error, so nothing but stability keeps steps short."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from differentiated import INITIAL, PRECISE, assert_close, random_row
from termed import VALUES, with_company

LOAD = 20.0
SETTLED = ["te_rms", "peak_windup", "steady_speed"]


def resting(start, t_on):
    """A loaded drive that stands still, then moves."""
    return hdfast.Scenario.start_stop(start=start, t_on=t_on, t_off=t_on + 0.5, t_end=t_on + 1.0, load=LOAD)


@pytest.mark.parametrize("start", ["speed_ramp", "torque_step"])
@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_against_differences_after_a_rest(base, start):
    metrics = ["te_rms", "steady_speed"] if base == "one_inertia" else SETTLED
    options = PRECISE | {"scenario": resting(start, 1.0), "metrics": metrics, "t_eval": [0.5, 1.0, 1.5]}
    row = random_row(2, tau_load=LOAD)
    wrt, steps = ["J_l", "k1", "k3", "tau_load", "B_m"], (1e-4, 1e-5, 1e-6)
    assert_close(row, wrt, 1e-6, steps=steps, model=hdfast.Model(base), **options)


BY_DEFAULT = ["load_compliance", "input_compliance", "presliding_friction", "coupling_slip"]


@pytest.mark.parametrize(
    "term", [*BY_DEFAULT, *(pytest.param(term, marks=pytest.mark.long) for term in VALUES if term not in BY_DEFAULT)]
)
def test_against_differences_in_a_rest_with_terms(term):
    """Whatever a term adds to the fastest motion of a drive is taken in, and what slips at the start as well."""
    on, values = with_company([term])
    options = {"scenario": resting("speed_ramp", 0.15), "t_eval": [0.1, 0.15], "signals": ["te"]}
    row, wrt = random_row(2, tau_load=LOAD, **values), [*values, "J_l", "k1", "tau_load"]
    assert_close(row, wrt, 1e-6, steps=(1e-4, 1e-5, 1e-6), model=hdfast.Model(terms=on), **PRECISE, **options)


def test_against_a_precise_run_of_a_drive_pushed_out_of_its_rest():
    """Values rest, derivatives by the initial state swing: steps follow what swings."""
    scenario = resting("speed_ramp", 1.0)
    options = {"scenario": scenario, "t_eval": np.linspace(0.0, 1.5, 61), "metrics": []}
    rested = hdfast.sweep({}, scenario=scenario, t_eval=[0.0], signals=["theta_m", "omega_m", "theta_l", "omega_l"])
    start = np.array([[*(rested[name][0, 0] for name in rested.samples), 0.0]])
    found, precise = (
        hdfast.sweep({}, initial_state=start, sensitivities=INITIAL[:4], rtol=1e-6, max_step=longest, **options)
        for longest in (np.inf, 2e-4)
    )
    assert found.steps[0] < 0.2 * precise.steps[0]
    for name, expected in precise.sample_sensitivities.items():
        error = np.max(np.abs(found.sample_sensitivities[name] - expected), axis=1)
        assert np.all(error < 1e-3 * np.max(np.abs(expected), axis=1)), name


def test_exact_values_after_a_rest_stay_within_the_tolerance():
    """Steps of a rest are others with derivatives than without, and values as right."""
    options = {"scenario": resting("speed_ramp", 1.0), "metrics": SETTLED}
    precise = hdfast.sweep({}, rtol=1e-12, **options)
    for result in (hdfast.sweep({}, **options), hdfast.sweep({}, sensitivities=["k1"], **options)):
        for name, value in precise.metrics.items():
            assert abs(result[name][0] / value[0] - 1) < 1e-5, name
