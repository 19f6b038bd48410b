"""A row's result is its own: the same bits with every method on every CPU path, whatever its neighbours do."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest

BAD = 23
ROWS = 60
SCENARIO = hdfast.Scenario.start_stop(start="speed_ramp", t_end=1.0, t_off=0.6)
METHODS = [(terms, method) for terms in ((), ("hysteresis", "backlash")) for method in ("tsit5", "dop853", "rodas5p")]


def rows(count):
    rng = np.random.default_rng(3)
    default = {name: hdfast.params()[name].default for name in ("J_m", "J_l", "B_sp", "k1", "k3")}
    spread = {name: value * rng.uniform(0.9, 1.1, count) for name, value in default.items()}
    return spread | {"omega_set": rng.uniform(5.0, 30.0, count)}


def run(columns, **options):
    return hdfast.sweep(columns, scenario=SCENARIO, t_eval=np.linspace(0.0, 1.0, 21), rtol=1e-4, **options)


def same(one, other, chosen=slice(None)):
    """Every number of some rows (index or slice)."""
    np.testing.assert_array_equal(one.final_state[chosen], other.final_state[chosen])
    np.testing.assert_array_equal(one.steps[chosen], other.steps[chosen])
    for name in {**one.metrics, **one.samples}:
        np.testing.assert_array_equal(one[name][chosen], other[name][chosen])


@pytest.mark.parametrize(("terms", "method"), [((), "bs3"), ((), "dopri5"), *METHODS])
@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_bits_on_every_path_and_number_of_threads(base, terms, method, monkeypatch):
    on = terms if base == "two_inertia" else tuple("presliding_friction" for _ in terms[:1])
    options = {"model": hdfast.Model(base=base, terms=on), "method": method}
    columns = {name: own for name, own in rows(21).items() if name in hdfast.params(options["model"])}
    expected = run(columns, threads=1, **options)
    assert expected.finished.all()
    same(expected, run(columns, threads=3, **options))
    for path in hdfast.build_info()["simd_available"]:
        monkeypatch.setenv("HDFAST_SIMD", path)
        same(expected, run(columns, **options))


@pytest.mark.parametrize(
    ("method", "column", "value", "statuses"),
    [
        ("dop853", "J_l", np.nan, {"bad_parameters"}),
        ("dop853", "J_m", -1e-4, {"bad_parameters"}),
        ("dop853", "phi_max", 2.5e-3, {"bad_parameters"}),
        ("dop853", "J_l", 1e-9, {"max_steps"}),
        ("dop853", "B_sp", 1e300, {"not_finite", "step_too_small"}),
        ("rodas5p", "J_l", np.nan, {"bad_parameters"}),
        ("rodas5p", "k1", 1e300, {"not_finite", "step_too_small"}),
    ],
)
def test_exact_neighbours_of_a_bad_row_are_untouched(method, column, value, statuses):
    columns = {"phi_max": np.full(ROWS, hdfast.params()["phi_max"].default), **rows(ROWS)}
    options = {"method": method, "max_steps": 3_000}
    expected = run(columns, **options)
    columns[column] = columns[column].copy()
    columns[column][BAD] = value
    found = run(columns, **options)
    assert found.status_counts().keys() - {"finished"} <= statuses
    assert not found.finished[BAD]
    same(expected, found, np.arange(ROWS) != BAD)
