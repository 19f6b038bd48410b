"""Laws with corners keep the order of the method: every step ends at a corner or stays on one piece."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import linear, parameters
from oracles import bent_springs
from same_rows import same, same_on_every_path
from termed import SCENARIO, torque_steps

#: Forward, back, then free: (until, motor torque). Hard enough to pass every corner.
PIECES = [(0.1, 0.25), (0.28, -0.24), (0.8, 0.0)]
LOAD = 4.0
TIMES = np.linspace(0.0, 0.8, 401)
GAP = 5e-5
CASES = {
    "gap": (linear(half_gap=GAP), {"terms": ["backlash"]}, {"gap": GAP}),
    "knees": (parameters("piecewise", T1=5.0, T2=20.0), {"spring": "piecewise"}, {}),
}
#: Largest error in units of rtol; the same drives with a straight spring reach 10 and 19.
LIMITS = {"gap": 6.0, "knees": 15.0}


def attempts_and_error(p, model, exact, rtol, method="dop853"):
    """Attempted steps, and the largest error of the transmission error over its range."""
    row = {name: value for name, value in p.items() if name not in SCENARIO}
    result = hdfast.sweep(
        row,
        model=model,
        scenario=torque_steps(PIECES, load=LOAD),
        t_eval=TIMES,
        signals=["te"],
        metrics=[],
        initial_state=np.zeros((1, len(model.states))),
        rtol=rtol,
        method=method,
    )
    assert result.finished.all()
    return int(result.steps[0] + result.rejected[0]), np.max(np.abs(result["te"][0] - exact)) / np.ptp(exact)


@pytest.mark.parametrize("name", CASES)
def test_against_scipy_piece_by_piece(name):
    """Errors stay near rtol, and the work-precision line is as steep as without corners."""
    p, changes, law = CASES[name]
    model = hdfast.Model(**changes)
    orders = [] if name == "gap" else list(range(1, 16))
    exact = bent_springs.te_on(TIMES, p, PIECES, LOAD, bent_springs.law(p, **law), orders)
    for method, smallest, steepness in (("dop853", 11, 7.5), ("tsit5", 9, 5.0), ("rodas5p", 9, 5.0)):
        rtols = 10.0 ** -np.arange(5, smallest)
        found = [attempts_and_error(p, model, exact, rtol, method) for rtol in rtols]
        work, errors = np.array(found).T
        slope = np.polyfit(np.log(work), np.log(errors), 1)[0]
        assert slope <= -steepness, (method, slope, work, errors)
        assert np.all(errors < LIMITS[name] * rtols), (method, errors / rtols)


@pytest.mark.parametrize("method", ["dop853", "tsit5", "rodas5p"])
def test_exact_no_knee_is_run_over(method):
    """Steps of a free swing, far beyond the knees, that enter the soft piece and leave it again at once."""
    rng, count = np.random.default_rng(0), 400
    rows = {
        "J_l": 10 ** rng.uniform(-1.3, 0.7, count),
        "B_sp": 10 ** rng.uniform(0.3, 1.7, count),
        "T1": 10 ** rng.uniform(0.0, 1.15, count),
    }
    pulse = ([0.0, 0.2, 0.2, 0.203, 0.203, 0.206, 0.206, 1.0], [0.0, 0.0, 100.0, 100.0, -100.0, -100.0, 0.0, 0.0])
    scenario = hdfast.Scenario.torque_profile([0.0, 1.0], [0.0, 0.0], load=pulse)
    options = {"model": hdfast.Model(spring="piecewise", orders=[]), "metrics": ["energy_residual"]}
    found = hdfast.sweep(rows, scenario=scenario, method=method, **options)
    assert found.finished.all()
    assert np.max(np.abs(found["energy_residual"])) < 1e-3


ON_EVERY_PATH = {
    "knees": (hdfast.Model(spring="piecewise"), {"tau_load": 14.0, "T1": 5.0}),
    "limit": (hdfast.Model(), {"tau_max": 0.1}),
    "rigid limit": (hdfast.Model(base="one_inertia"), {"tau_max": 0.1}),
    "gap and stops": (hdfast.Model(terms=["backlash", "coulomb_friction"]), {"T_c": 0.03}),
    "many": (hdfast.Model(terms=["hysteresis", "backlash", "load_dependent_friction", "torque_saturation"]), {}),
    "rigid": (hdfast.Model(base="one_inertia", terms=["load_dependent_friction", "presliding_friction"]), {}),
}


@pytest.mark.parametrize("name", ON_EVERY_PATH)
def test_exact_bits_on_every_path_and_in_any_company(name, monkeypatch):
    """Rows that turn corners at different times do not see each other."""
    model, row = ON_EVERY_PATH[name]
    rng = np.random.default_rng(2)
    rows = {"J_l": rng.uniform(0.3, 0.7, 21), "omega_set": rng.uniform(5.0, 30.0, 21)}
    rows |= {column: value * rng.uniform(0.9, 1.1, 21) for column, value in row.items()}
    scenario = hdfast.Scenario.start_stop(start="speed_ramp", stop="brake", t_end=1.0, t_off=0.5)
    options = {"model": model, "scenario": scenario, "t_eval": np.linspace(0.0, 1.0, 50)}
    expected = hdfast.sweep(rows, threads=1, **options)
    assert expected.finished.all()
    assert expected.rejected.sum() > 0
    same(expected, hdfast.sweep(rows, threads=2, **options))
    same_on_every_path(expected, lambda: hdfast.sweep(rows, **options), monkeypatch)
    alone = hdfast.sweep({column: values[13:14] for column, values in rows.items()}, **options)
    np.testing.assert_array_equal(alone["te"][0], expected["te"][13])
