from __future__ import annotations

import math

import hdfast
import numpy as np
import pytest
from hdfast.params import layout

BRIEF = hdfast.Scenario.start_stop(t_off=0.01, t_end=0.02)

AMPLITUDES = [20e-6, 90e-6, 6e-6, 22e-6, 4e-6 / math.sqrt(5), 8e-6, *(4e-6 / math.sqrt(n) for n in range(7, 16))]
PHASES = [5.97, 0.91, 5.96, 1.96, 2.66, 5.20, 2.57, 3.45, 0.17, 4.73, 3.38, 2.07, 4.95, 1.91, 2.85]


def test_exact_column_order():
    drive = ["ratio", "J_m", "J_l", "B_m", "B_l", "B_ml", "B_sp", "s"]
    series = ["te_scale", *(f"te_cos_{n}" for n in range(1, 16)), *(f"te_sin_{n}" for n in range(1, 16))]
    assert hdfast.params().names == [*drive, "k1", "k2", "k3", "k4", "k5", "phi_max", *series]
    piecewise = hdfast.params(hdfast.Model(spring="piecewise", orders=[2, "120/121"])).names
    series = ["te_scale", "te_cos_2", "te_cos_120/121", "te_sin_2", "te_sin_120/121"]
    assert piecewise == [*drive, "K1", "K2", "K3", "T1", "T2", *series]


def test_exact_defaults_of_the_model_document():
    table = hdfast.params()
    expected = {"ratio": 121, "J_m": 3e-4, "J_l": 0.5, "B_m": 6e-4, "B_ml": 6e-4, "B_l": 0.5, "B_sp": 20, "s": 0}
    expected |= {"k1": 3.102e4, "k2": 0, "k3": 1.3445e10, "k4": 0, "k5": -3.211e15, "phi_max": 1.465e-3, "te_scale": 1}
    for name, value in expected.items():
        assert table[name].default == value, name
    for n, (a, psi) in enumerate(zip(AMPLITUDES, PHASES, strict=True), 1):
        assert table[f"te_cos_{n}"].default == pytest.approx(a * math.sin(psi), rel=1e-12)
        assert table[f"te_sin_{n}"].default == pytest.approx(a * math.cos(psi), rel=1e-12)


def test_exact_every_parameter_is_described():
    for model in (hdfast.Model(), hdfast.Model(spring="piecewise"), hdfast.Model(base="one_inertia", orders=["1/121"])):
        for parameter in hdfast.params(model):
            assert parameter.unit
            assert parameter.meaning
            assert parameter.source
            assert parameter.low <= parameter.default <= parameter.high, parameter.name


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
@pytest.mark.parametrize("spring", ["polynomial", "piecewise"])
def test_exact_rows_beyond_the_allowed_ranges_are_refused(base, spring):
    model = hdfast.Model(base=base, spring=spring, orders=[1, 2], terms=["torque_ripple", "coulomb_friction"])
    table = layout(model)
    for parameter in table:
        for bound, beyond in zip(parameter.allowed, (-math.inf, math.inf), strict=True):
            if math.isfinite(bound):
                row = {parameter.name: np.nextafter(bound, beyond)}
                found = hdfast.sweep(row, model=model, scenario=BRIEF, metrics=[])
                assert found.detail[0] == table.column(parameter.name), parameter.name
    inside = {p.name: p.allowed[0] for p in table if p.allowed[0] == 0.0}
    assert hdfast.sweep(inside, model=model, scenario=BRIEF, metrics=[]).finished.all()


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
def test_exact_infinity_is_named_where_it_is_allowed(base):
    for parameter in layout(hdfast.Model(base)):
        if parameter.name == "tau_max":
            assert parameter.limits.startswith("allowed: above 0, infinity too; plausible: ")
            assert hdfast.sweep(
                {"tau_max": math.inf}, model=hdfast.Model(base), metrics=[], scenario=BRIEF
            ).finished.all()
        else:
            assert "infinity" not in parameter.limits


def test_exact_defaults_array():
    X = hdfast.defaults(3)
    assert X.shape == (3, len(hdfast.params()))
    assert X.dtype == np.float64
    assert X.flags.writeable
    assert (hdfast.params().defaults == X).all()
    assert X[0, hdfast.column("J_l")] == 0.5
    assert hdfast.defaults(0).shape == (0, X.shape[1])


def test_exact_table_behaves_like_a_sequence():
    table = hdfast.params()
    assert [row.name for row in table] == table.names
    assert table[1].name == "J_m"
    assert "J_l" in table
    assert "omega_set" not in table
    assert len(table[:3]) == 3
    text = str(table)
    assert "kg m^2" in text
    assert text.count("\n") == len(table) + 1
    assert "<table>" in table._repr_html_()


@pytest.mark.parametrize("name", ["J_L", "jl", "te_cos_99", "", 3, None])
def test_exact_unknown_column(name):
    with pytest.raises(hdfast.ParameterError, match="not known"):
        hdfast.column(name)


def test_exact_nearest_name_is_offered():
    with pytest.raises(hdfast.ParameterError, match="did you mean 'J_l'"):
        hdfast.column("J_L")


@pytest.mark.parametrize("rows", [-1, 1.5, "3", None, True, 2**70, 10**11])
def test_exact_wrong_number_of_rows(rows):
    with pytest.raises(hdfast.InputError, match="rows"):
        hdfast.defaults(rows)


def test_exact_wrong_model():
    with pytest.raises(hdfast.InputError, match="model"):
        hdfast.params("two_inertia")
