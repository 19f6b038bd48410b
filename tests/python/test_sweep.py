"""What `hdfast.sweep` accepts, and how it refuses the rest before anything runs."""

from __future__ import annotations

import os
import subprocess
import sys

import hdfast
import numpy as np
import pyarrow as pa
import pytest
from hdfast import _core
from hypothesis import given, settings
from hypothesis import strategies as st

SHORT = hdfast.Scenario.start_stop(t_end=0.6, t_off=0.3)
CONTROLLED = hdfast.Scenario.start_stop(t_end=0.6, t_off=0.3, stop="brake")
METRICS = ["te_pp", "peak_windup", "order_2", "speed_order_2"]


def run(rows, **options):
    return hdfast.sweep(rows, **{"scenario": SHORT, "metrics": METRICS, "threads": 1, **options})


def bits(result):
    return np.vstack([*result.metrics.values(), result.final_state.T]).tobytes()


@pytest.fixture(scope="module")
def rows():
    X = hdfast.defaults(5)
    X[:, hdfast.column("J_l")] = np.linspace(0.3, 0.9, 5)
    X[:, hdfast.column("te_scale")] = np.linspace(0.8, 1.2, 5)
    return X


@pytest.fixture(scope="module")
def expected(rows):
    return bits(run(rows))


def test_exact_layouts_of_an_array_give_the_same_bits(rows, expected):
    read_only = rows.copy()
    read_only.flags.writeable = False
    wide = np.zeros((10, 2 * rows.shape[1]))
    wide[::2, ::2] = rows
    layouts = [read_only, np.asfortranarray(rows), wide[::2, ::2], rows.astype(">f8"), rows.tolist()]
    for array in layouts:
        assert bits(run(array)) == expected
    assert bits(run(rows[::-1][::-1])) == expected
    backwards = run(rows[::-1])
    assert np.array_equal(backwards["te_pp"][::-1], run(rows)["te_pp"])


def test_exact_named_columns_give_the_same_bits(rows, expected):
    import pandas as pd
    import polars as pl

    named = {"te_scale": rows[:, hdfast.column("te_scale")], "J_l": rows[:, hdfast.column("J_l")]}
    packed = np.zeros(5, dtype=[("flag", "u1"), ("J_l", "f8"), ("te_scale", "f8"), ("s", "f4")])
    packed["J_l"], packed["te_scale"] = named["J_l"], named["te_scale"]
    tables = [named, {**named, "ratio": 121, "s": np.float32(0)}, packed[["J_l", "te_scale", "s"]]]
    tables += [pd.DataFrame(named), pl.DataFrame(named), pa.table(named), {k: v.tolist() for k, v in named.items()}]
    tables += [pd.DataFrame(named).convert_dtypes(), {k: pd.Series(v) for k, v in named.items()}]
    for table in tables:
        assert bits(run(table)) == expected


def test_exact_what_is_no_table_is_refused():
    import pandas as pd
    import polars as pl

    for value in (pd.Series({"J_l": 0.5}), pl.LazyFrame({"J_l": [0.5]})):
        with pytest.raises(hdfast.InputError, match=r"(?s)rows = .* cannot be read \(allowed: a float64 array"):
            run(value)
    with pytest.raises(hdfast.ParameterError, match="rows has two columns of one name"):
        run(pa.table([[0.5], [0.6]], names=["J_l", "J_l"]))


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_exact_a_matrix_is_an_array(rows, expected):
    assert bits(run(np.matrix(rows))) == expected


def test_exact_float32_is_converted():
    X = hdfast.defaults(2).astype(np.float32)
    assert bits(run(X)) == bits(run(X.astype(np.float64)))


def test_exact_scalars_only_make_one_row():
    assert len(run({"J_l": 0.7})) == 1
    assert len(run({})) == 1


def test_exact_empty_batches():
    for empty in (hdfast.defaults(0), {"J_l": []}):
        result = run(empty, t_eval=[0.0, 0.1])
        assert len(result) == 0
        assert result["te"].shape == (0, 2)
        assert result["te_pp"].shape == (0,)
        assert str(result)


def test_exact_masked_and_null_entries_are_bad_rows():
    values = np.ma.masked_array([0.5, 0.6, 0.7], [False, True, False])
    nulls = {"J_l": pa.array([0.5, None, 0.7])}
    for table in ({"J_l": values}, pa.table(nulls), pa.RecordBatch.from_pydict(nulls)):
        result = run(table)
        assert result.status_counts() == {"finished": 2, "bad_parameters": 1}
        assert "J_l = nan" in result.message(1)


def test_exact_scenario_columns_override_row_by_row():
    result = run({"omega_set": [3.0, 6.0]}, metrics=["steady_speed"])
    single = [run({"omega_set": w}, metrics=["steady_speed"])["steady_speed"][0] for w in (3.0, 6.0)]
    assert result["steady_speed"].tolist() == single
    fast = hdfast.Scenario.start_stop(t_end=0.6, t_off=0.3, speed_rpm=6.0 * 60 / (2 * np.pi))
    assert run({}, scenario=fast, metrics=["steady_speed"])["steady_speed"][0] == pytest.approx(single[1], rel=1e-12)


def test_exact_columns_that_change_nothing_may_be_there():
    """A table of all columns with a controller of its own runs without control as well, and where some rows have it."""
    varied = {"K_p": [0.02, 0.04], "theta_m0": [0.0, 1.0]}
    whole = run(varied, scenario=CONTROLLED)
    assert run(whole.parameters(1) | {"J_l": [0.4, 0.5]}).finished.all()
    assert run({"tau_max": np.full(3, 1.0)}).finished.all()
    assert run(varied, scenario=[SHORT, CONTROLLED], scenario_index=np.array([0, 1])).finished.all()


def test_exact_rows_may_differ_in_scenario_grid_and_start(rows):
    other = hdfast.Scenario.start_stop(t_end=0.5, t_off=0.25, speed_rpm=50, start="speed_ramp", stop="brake")
    grids = [np.linspace(0, 0.5, 6), np.linspace(0, 0.4, 9)]
    which, grid = np.array([0, 1, 0, 1, 1]), np.array([0, 0, 1, 1, 0])
    start = np.array([[0.1 * k, 0.0, 0.1 * k / 121, 0.0] for k in range(5)])
    options = {"scenario_index": which, "t_eval": grids, "t_eval_index": grid, "initial_state": start}
    batch = run(rows, scenario=[SHORT, other], **options)
    assert batch["te"].shape == (5, 9)
    for k in range(5):
        scenario = [SHORT, other][which[k]]
        alone = run(rows[k : k + 1], scenario=scenario, t_eval=grids[grid[k]], initial_state=start[k])
        assert np.array_equal(batch.final_state[k], alone.final_state[0])
        size = len(grids[grid[k]])
        assert np.array_equal(batch["te"][k, :size], alone["te"][0])
        assert np.isnan(batch["te"][k, size:]).all()


def test_exact_bad_rows_are_data_and_strict_raises(rows):
    bad = rows.copy()
    bad[2, hdfast.column("J_m")] = -1.0
    result = run(bad)
    assert result.status_counts() == {"finished": 4, "bad_parameters": 1}
    assert np.isnan(result["te_pp"][2])
    assert np.array_equal(np.delete(result["te_pp"], 2), np.delete(run(rows)["te_pp"], 2))
    with pytest.raises(hdfast.RowError, match=r"row 2: J_m = -1 kg m\^2") as caught:
        run(bad, strict=True)
    assert (caught.value.row, caught.value.parameter) == (2, "J_m")


def test_exact_strict_raises_before_a_row_is_run():
    told = []

    def run_strictly(inertias):
        options = {"metrics": ["te_pp"], "sensitivities": ["J_l"], "t_eval": [0.1], "threads": 1}
        return run({"J_l": inertias}, strict=True, progress=lambda done, total: told.append(done), **options)

    with pytest.raises(hdfast.RowError, match="row 50: J_l = -1"):
        run_strictly(np.where(np.arange(51) == 50, -1.0, 0.5))
    assert told == []
    assert run_strictly([0.5, 0.6]).finished.all()
    assert told[-1] == 2


def test_exact_an_interrupt_before_a_strict_sweep_leaves_every_row_cancelled(monkeypatch):
    core = _core.sweep
    monkeypatch.setattr(_core, "sweep", lambda **asked: core(**asked) | {"interrupted": True})
    with pytest.raises(hdfast.Interrupted, match="0 of 2 rows finished") as caught:
        run({"J_l": [0.5, 0.6]}, strict=True)
    assert caught.value.result.status_counts() == {"cancelled": 2}


def test_exact_rejected_steps_count_towards_max_steps():
    result = hdfast.sweep({}, metrics=[], max_steps=50)
    assert result.rejected[0] > 0
    assert result.steps[0] + result.rejected[0] == 50


def test_exact_a_result_keeps_what_it_was_made_for():
    X, t = hdfast.defaults(2), np.array([0.0, 0.1])
    named = {"J_l": np.array([0.5, 0.6])}
    found = [run(X, t_eval=t), run(named, t_eval=t)]
    X[:, hdfast.column("J_l")] = named["J_l"][:] = 9.0
    t[:] = 7.0
    assert [result.parameters(0)["J_l"] for result in found] == [0.5, 0.5]
    assert found[1].to_arrow()["J_l"].to_pylist() == [0.5, 0.6]
    assert [result.t_eval[0].tolist() for result in found] == [[0.0, 0.1]] * 2


def test_exact_nothing_is_copied_that_need_not_be():
    from hdfast.request import prepare

    X = hdfast.defaults(1000)
    request = prepare(X)
    assert all(np.shares_memory(column, X) for column in request.rows.columns.values())
    request = prepare({"J_l": X[:, 2]})
    assert np.shares_memory(request.rows.columns["J_l"], X)


def test_exact_progress_is_called_to_the_end(rows):
    calls = []
    run(rows, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (5, 5)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


WRONG = [
    ({"rows": np.zeros((2, 3))}, r"rows has shape \(2, 3\), allowed: \(M, 45\)"),
    ({"rows": hdfast.defaults(1)[0]}, r"rows\[None, :\]"),
    ({"rows": np.zeros((2, 2, 2))}, "shape"),
    ({"rows": np.zeros((2, 10**6), dtype=np.int8)}, "1000000"),
    ({"rows": np.zeros((2, 45), dtype=complex)}, "complex128"),
    ({"rows": np.zeros((2, 45), dtype=bool)}, "bool"),
    ({"rows": np.full((2, 45), "a")}, "dtype"),
    ({"rows": np.full((2, 45), None)}, "dtype object"),
    ({"rows": 5}, "shape"),
    ({"rows": "J_l"}, "rows = 'J_l'"),
    ({"rows": None}, "rows = None"),
    ({"rows": {"J_L": [1.0]}}, "did you mean 'J_l'"),
    ({"rows": {5: [1.0]}}, "parameter 5"),
    ({"rows": {"k1": [1.0]}, "model": hdfast.Model(spring="piecewise")}, r"k1 belongs to Model\(spring='polynomial'\)"),
    ({"rows": {"K1": [1.0]}}, r"'K1' is not known; K1 belongs to Model\(spring='piecewise'\)"),
    ({"rows": {"T_c": [1.0]}}, "T_c belongs to the terms coulomb_friction, coulomb_friction_smooth, stribeck"),
    ({"rows": {"cogging_T_cog": [1.0]}}, r"cogging_T_cog belongs to the term cogging \(see"),
    ({"rows": {"J_l": [1.0, 2.0], "J_m": [1.0]}}, r"rows\['J_m'\] has 1 values, rows\['J_l'\] has 2"),
    ({"rows": {"J_l": [[1.0]]}}, "shape"),
    ({"rows": {"J_l": ["a"]}}, "dtype"),
    ({"rows": {"J_l": [1.0, None]}}, "dtype"),
    ({"rows": {f"p{j}": 1.0 for j in range(10**6)}}, "'p0' is not known"),
    ({"model": "two_inertia"}, "model"),
    ({"scenario": "start_stop"}, "scenario"),
    ({"scenario": []}, "scenario"),
    ({"scenario": [SHORT, 3]}, "scenario"),
    ({"scenario": [SHORT, SHORT]}, "scenario_index"),
    ({"scenario_index": [0, 1]}, r"scenario_index.*\(1,\)"),
    ({"scenario_index": [1]}, r"scenario_index\[0\] = 1"),
    ({"scenario_index": [0.0]}, "scenario_index"),
    ({"signals": ["te"]}, "t_eval"),
    ({"t_eval": []}, "t_eval"),
    ({"t_eval": [0.2, 0.1]}, "t_eval must not decrease"),
    ({"t_eval": [0.0, 7.0]}, "t_eval = 7 s is out of range"),
    ({"t_eval": [-1.0]}, "t_eval"),
    ({"t_eval": [np.nan]}, "t_eval"),
    ({"t_eval": [[0.0], [0.1]]}, "t_eval_index"),
    ({"t_eval": [0.1], "t_eval_index": [1]}, "t_eval_index"),
    ({"t_eval": [0.1], "signals": ["omega"]}, "signals = 'omega'"),
    ({"t_eval": [0.1], "signals": "te"}, "not a list"),
    ({"t_eval": [0.1], "signals": ["te", "te"]}, "twice"),
    ({"metrics": ["te_p"]}, "did you mean 'te_pp'"),
    ({"metrics": "te_pp"}, "not a list"),
    ({"metrics": ["order_0"]}, "order '0'"),
    ({"metrics": ["order_2", "order_2.0"]}, "twice"),
    ({"metrics": [3]}, "metrics = 3"),
    ({"method": "rk4"}, "method"),
    ({"method": None}, "method"),
    ({"method": "dopri5", "model": hdfast.Model(terms=["backlash"])}, r"'dopri5' with terms \(allowed: auto, tsit5"),
    ({"rtol": 0.0}, "rtol = 0 is out of range"),
    ({"rtol": 1e-16}, "rtol"),
    ({"rtol": 1.0}, "rtol"),
    ({"rtol": float("nan")}, "rtol"),
    ({"rtol": "1e-6"}, "rtol"),
    ({"atol": 0.0}, "atol"),
    ({"max_steps": 0}, "max_steps"),
    ({"max_steps": 1.5}, "max_steps"),
    ({"max_step": 0.0}, "max_step"),
    ({"max_step": -1.0}, "max_step"),
    ({"threads": 0}, "threads"),
    ({"threads": 10**6}, "threads"),
    ({"threads": 1.0}, "threads"),
    ({"initial_state": [0.0, 0.0]}, "initial_state"),
    ({"initial_state": np.zeros((3, 4))}, "initial_state"),
    ({"initial_state": [0.0, 0.0, -2e9, 0.0]}, r"theta_l = -2e\+09 in row 0 \(allowed: -1e\+09 to 1e\+09 rad"),
    ({"initial_state": [np.nan, 0.0, 0.0, 0.0]}, r"theta_m = nan in row 0 \(allowed: -1e\+09 to 1e\+09 rad\)"),
    (
        {"rows": {"J_l": [0.5, 0.6]}, "initial_state": [[0.0] * 4, [0.0, np.inf, 0.0, 0.0]]},
        r"omega_m = inf in row 1 \(allowed: a finite number\)",
    ),
    ({"progress": "yes"}, "progress"),
    ({"metrics": np.array("te_pp")}, r"metrics = array\('te_pp', .*\) is not a list \(allowed: names\)"),
    ({"signals": {"te"}, "t_eval": [0.1]}, "signals = {'te'} is not a list"),
    ({"sensitivities": "J_l"}, "sensitivities = 'J_l' is not a list"),
    (
        {"rows": {"K_p": [0.01, 0.05]}},
        r"rows differ in K_p, which has no meaning in start_stop\(torque_step, coast\), .*: left out",
    ),
    (
        {"rows": {"theta_m0": [0.0, 1.0]}, "scenario": hdfast.Scenario.start_stop(initial="zero_angle")},
        "rows differ in theta_m0, which has no meaning with initial = 'zero_angle'",
    ),
    (
        {"rows": {"theta_m0": [0.0, 1.0]}, "scenario": hdfast.Scenario.motion(np.arange(5.0), np.arange(5.0))},
        "rows differ in theta_m0, which has no meaning in motion, which prescribes the angle",
    ),
    (
        {"rows": {"theta_m0": [0.0, 1.0]}, "initial_state": np.zeros(5)},
        r"rows differ in theta_m0, which has no meaning with initial_state, which has the angle \(allowed: left out",
    ),
]


@pytest.mark.parametrize(("arguments", "text"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_exact_wrong_calls_are_refused(arguments, text):
    options = {"rows": {}, **arguments}
    with pytest.raises(hdfast.InputError, match=text):
        hdfast.sweep(options.pop("rows"), **options)


def test_exact_angles_without_a_sine_are_refused():
    result = run({"theta_m0": [0.0, 1e9, -1e9, 1e15, -1e17]})
    assert result.finished.tolist() == [True] * 3 + [False] * 2
    assert "theta_m0 = 1e+15 rad" in result.message(3)
    assert run({}, initial_state=[1e9, 0.0, 1e9 / 121.0, 0.0]).finished.all()


def test_exact_absurd_output_is_refused():
    with pytest.raises(hdfast.InputError, match="GB"):
        hdfast.sweep({"J_l": np.broadcast_to(0.5, 10**8)}, t_eval=np.linspace(0, 6, 10**5), metrics=[])


JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=5),
    st.binary(max_size=3),
    st.lists(st.floats(), max_size=3),
    st.dictionaries(st.text(max_size=3), st.floats(), max_size=2),
    st.just(np.array(["x"])),
    st.just(object()),
)
KEYWORDS = ["model", "scenario", "scenario_index", "t_eval", "t_eval_index", "signals", "metrics", "initial_state"]
KEYWORDS += ["method", "rtol", "atol", "max_steps", "max_step", "threads"]


@settings(max_examples=150, deadline=None)
@given(st.booleans(), JUNK, st.dictionaries(st.sampled_from(KEYWORDS), JUNK, max_size=3))
def test_exact_junk_is_refused_or_runs(good, junk, options):
    """Whatever is passed ends as a result or as a typed error, never as another exception or a crash.

    Rows are read before most options, so every other call has good ones.
    """
    if isinstance(options.get("threads"), int) and options["threads"] > 4:
        return
    rows = {} if good else junk
    try:
        result = hdfast.sweep(rows, **{"scenario": SHORT, "metrics": ["te_pp"], "max_steps": 5000, **options})
    except hdfast.InputError:
        return
    assert result.status.shape == (1,)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(hdfast.params().names), st.floats()), min_size=1, max_size=4))
def test_exact_any_values_give_a_status(changes):
    columns = {name: [value, hdfast.params()[name].default] for name, value in changes}
    result = hdfast.sweep(columns, scenario=SHORT, metrics=["te_pp"], max_steps=3000)
    assert result.status[1] == 0
    assert result.message(0)


@pytest.mark.parametrize(
    ("environment", "expected"),
    [({"HDFAST_NUM_THREADS": "3", "RAYON_NUM_THREADS": "5"}, "3"), ({"RAYON_NUM_THREADS": "5"}, "5")],
)
def test_exact_threads_from_the_environment(environment, expected):
    code = "from hdfast.threads import resolve_threads as r; print(r(), r(2))"
    inherited = {name: value for name, value in os.environ.items() if name != "HDFAST_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=inherited | environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [expected, "2"]


def test_exact_threads_from_a_wrong_environment(monkeypatch):
    monkeypatch.setenv("HDFAST_NUM_THREADS", "many")
    with pytest.raises(hdfast.InputError, match="HDFAST_NUM_THREADS = 'many'"):
        run({}, threads=None)


def test_exact_cgroup_quota(tmp_path):
    from hdfast.threads import cgroup_quota

    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "membership").write_text("0::/a/b\n")
    assert cgroup_quota(tmp_path, tmp_path / "membership") == 1024
    (tmp_path / "a" / "cpu.max").write_text("250000 100000\n")
    (tmp_path / "a" / "b" / "cpu.max").write_text("max 100000\n")
    assert cgroup_quota(tmp_path, tmp_path / "membership") == 3
    (tmp_path / "cpu").mkdir()
    (tmp_path / "cpu" / "cpu.cfs_quota_us").write_text("50000")
    (tmp_path / "cpu" / "cpu.cfs_period_us").write_text("100000")
    (tmp_path / "membership").write_text("4:cpu,cpuacct:/x\n0::/a/b\n")
    assert cgroup_quota(tmp_path, tmp_path / "membership") == 1
