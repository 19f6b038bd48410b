from __future__ import annotations

from fractions import Fraction

import hdfast
import pytest
from hypothesis import given
from hypothesis import strategies as st


def test_exact_orders_keep_their_names():
    model = hdfast.Model(orders=[1, 2.0, 0.5, "120/121", Fraction(240, 121), 362 / 121, "1.25"])
    assert model.order_labels == ["1", "2", "1/2", "120/121", "240/121", "362/121", "5/4"]
    assert model.order_values == [float(Fraction(label)) for label in model.order_labels]


def test_exact_models_compare_by_meaning():
    assert hdfast.Model(orders=[1, 2]) == hdfast.Model(orders=("1", 2.0))
    assert hash(hdfast.Model()) == hash(hdfast.Model())
    assert hdfast.Model() != hdfast.Model(spring="piecewise")


def test_exact_terms_of_an_iterator_are_kept():
    assert hdfast.Model(terms=(name for name in ["delay"])).terms == ("delay",)


def test_exact_states():
    assert hdfast.Model().states == ("theta_m", "omega_m", "theta_l", "omega_l", "z")
    assert hdfast.Model(base="one_inertia").states == ("theta_m", "omega_m", "z")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"base": "two_inertias"}, "did you mean 'two_inertia'"),
        ({"base": None}, "base"),
        ({"spring": "linear"}, "polynomial, piecewise"),
        ({"orders": 3}, "orders"),
        ({"orders": "12"}, "orders"),
        ({"orders": [0]}, "order 0"),
        ({"orders": [-1]}, "order -1"),
        ({"orders": [float("nan")]}, "nan"),
        ({"orders": [float("inf")]}, "inf"),
        ({"orders": ["1/0"]}, "1/0"),
        ({"orders": ["abc"]}, "abc"),
        ({"orders": [True]}, "True"),
        ({"orders": [None]}, "None"),
        ({"orders": [2, 2.0]}, "twice"),
        ({"orders": range(1, 2000)}, "at most 64"),
        ({"terms": "coulomb_friction"}, "not a list"),
        ({"terms": ["coulomb_fricton"]}, "no term 'coulomb_fricton' exists"),
        ({"terms": [3]}, "no term 3 exists"),
        ({"terms": {"coulomb_friction"}}, "not a list"),
        ({"orders": {1, 2}}, "not a list"),
    ],
)
def test_exact_wrong_models(arguments, text):
    with pytest.raises(hdfast.InputError, match=text):
        hdfast.Model(**arguments)


@given(st.lists(st.one_of(st.integers(), st.floats(), st.text(max_size=8), st.none(), st.fractions()), max_size=5))
def test_exact_any_orders_work_or_are_refused(orders):
    try:
        model = hdfast.Model(orders=orders)
    except hdfast.InputError:
        return
    assert all(0 < value <= 1e4 for value in model.order_values)
    assert len(hdfast.params(model)) == 15 + 2 * len(orders)
