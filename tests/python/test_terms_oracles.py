"""Every term, alone and in company, against the catalogue's equations solved by SciPy."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from drives import RPM, parameters
from oracles import left_out
from termed import COMBINATIONS, LOAD, RUN, VALUES, assert_close, simulate, torque_steps, with_company


def test_every_term_has_an_oracle():
    assert {term.id for term in hdfast.terms() if not term.channels} == set(VALUES)
    for term, values in VALUES.items():
        table = hdfast.params(hdfast.Model(terms=[term]))
        plain = hdfast.params(hdfast.Model())
        assert {table.canonical(name) for name in values} == set(table.names) - set(plain.names), term


@pytest.mark.parametrize("terms", [[term] for term in VALUES] + COMBINATIONS, ids="+".join)
def test_against_scipy(terms, long):
    """Trajectories with reversals, stops and breakaways, for every term alone and in company."""
    on, values = with_company(terms)
    p = parameters(**values)
    pieces = [(2.0 * end, torque) for end, torque in RUN] if long else RUN
    t = np.linspace(0.0, pieces[-1][0], 91)
    found = simulate(p, on, torque_steps(pieces, LOAD), t)
    expected = left_out.LeftOut(p, on, LOAD).solve(t, pieces, rtol=1e-11 if long else 1e-9)
    assert_close(found, expected, 1e-6)
    rest = [term for term in on if term not in terms]
    p = parameters(**{name: value for term in rest for name, value in VALUES[term].items()})
    without = simulate(p, rest, torque_steps(pieces, LOAD), t)
    assert np.max(np.abs(found[1] - without[1])) > 1e-4, "the term changes nothing"


def test_against_scipy_radau_bristles():
    """LuGre at 300 r/min against an implicit method."""
    terms = ["presliding_friction"]
    values = VALUES["presliding_friction"]
    p = parameters(**values)
    pieces = [(0.06, 0.25), (0.12, 0.07)]
    t = np.linspace(0.0, pieces[-1][0], 31)
    found = simulate(p, terms, torque_steps(pieces), t)
    expected = left_out.LeftOut(p, terms).solve(t, pieces, method="Radau", rtol=1e-10, max_step=1e-3)
    assert expected[1, -1] > 300 * RPM
    assert_close(found, expected, 1e-7)
