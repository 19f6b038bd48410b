"""Time outside the spring's range: excursions that begin and end inside one step."""

import hdfast
import numpy as np
import pytest
from drives import SCENARIO, parameters
from hdfast import Scenario

LIMIT = parameters()["phi_max"]


@pytest.mark.parametrize("method", ["dop853", "tsit5"])
@pytest.mark.parametrize("terms", [[], ["coulomb_friction"]], ids=["plain", "terms"])
@pytest.mark.parametrize("torque", [0.87, 0.885, 0.895, 3.0])
def test_exact_time_outside_is_that_of_dense_samples(torque, terms, method):
    values = {"coulomb_friction_T_c": 1e-6} if terms else {}
    t = np.linspace(0.0, 0.5, 500_001)
    run = hdfast.simulate(
        {name: value for name, value in parameters(J_l=2.0, **values).items() if name not in SCENARIO},
        model=hdfast.Model(terms=terms),
        scenario=Scenario.start_stop(start="torque_step", torque=torque, t_off=0.4, t_end=0.5),
        t_eval=t,
        signals=["windup"],
        metrics=["time_outside_range", "peak_windup"],
        method=method,
    )
    outside = np.abs(run["windup"]) > LIMIT
    crossings = np.count_nonzero(np.diff(outside))
    assert crossings >= 2
    found = run.metrics["time_outside_range"]
    assert abs(found - np.mean(outside) * t[-1]) <= 1e-6 * (crossings + 1)


@pytest.mark.parametrize("torque", [0.8, 0.885])
def test_against_reference_time_outside(engine, reference, torque):
    options = {
        "scenario": Scenario.start_stop(start="torque_step", torque=torque, t_off=0.4, t_end=0.5),
        "metrics": ["time_outside_range"],
        "rtol": 1e-9,
    }
    rows = {"J_l": np.array([0.5, 2.0])}
    found, expected = (run(rows, **options).metrics["time_outside_range"] for run in (engine, reference))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7)
