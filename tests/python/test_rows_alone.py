"""A row's result is its own: the same bits with every method on every CPU path, whatever its neighbours do."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from same_rows import same, same_on_every_path

BAD = 23
ROWS = 60
SCENARIO = hdfast.Scenario.start_stop(start="speed_ramp", t_end=1.0, t_off=0.6)
METHODS = ["bs3", "dopri5", "tsit5", "dop853", "rodas5p"]
WITH_TERMS = METHODS[2:]
TERMS = {"two_inertia": ("hysteresis", "backlash"), "one_inertia": ("presliding_friction",)}
MODELS = [(base, (), method) for base in TERMS for method in METHODS]
MODELS += [(base, terms, method) for base, terms in TERMS.items() for method in WITH_TERMS]


def rows(count):
    rng = np.random.default_rng(3)
    default = {name: hdfast.params()[name].default for name in ("J_m", "J_l", "B_sp", "k1", "k3")}
    spread = {name: value * rng.uniform(0.9, 1.1, count) for name, value in default.items()}
    return spread | {"omega_set": rng.uniform(5.0, 30.0, count)}


def run(columns, **options):
    return hdfast.sweep(columns, scenario=SCENARIO, t_eval=np.linspace(0.0, 1.0, 21), rtol=1e-4, **options)


@pytest.mark.parametrize(("base", "terms", "method"), MODELS)
def test_exact_bits_on_every_path_and_number_of_threads(base, terms, method, monkeypatch):
    options = {"model": hdfast.Model(base=base, terms=terms), "method": method}
    columns = {name: own for name, own in rows(21).items() if name in hdfast.params(options["model"])}
    expected = run(columns, threads=1, **options)
    assert expected.finished.all()
    same(expected, run(columns, threads=3, **options))
    same_on_every_path(expected, lambda: run(columns, **options), monkeypatch)


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
