"""Every claim of the article is decided by computation; what the decision is, is pinned here."""

from __future__ import annotations

import functools
import runpy
from pathlib import Path
from types import SimpleNamespace

import hdfast
import numpy as np
import pytest
from hdfast.identify.estimate import Estimates, estimate
from hdfast.identify.fit import Fit
from hdfast.params import params
from hdfast.studies import STUDIES, cases, speed
from hdfast.studies.claims import CONTRADICTORY, OPEN, PARTLY, REPRODUCED, trend, verdict
from hdfast.studies.claims_list import CLAIMS
from hdfast.studies.validation_claims import largest_error

EXPECTED = {
    "speed": {
        "S11 start A": REPRODUCED,
        "S11 start A, released": CONTRADICTORY,
        "S11 f": PARTLY,
        "S11 run A": PARTLY,
        "S11 stop A": PARTLY,
        "S11 lines": CONTRADICTORY,
        "S12": PARTLY,
    },
    "load-inertia": {
        "S13 start f": REPRODUCED,
        "S13 start A": PARTLY,
        "S13 stop f": REPRODUCED,
        "S13 stop A": REPRODUCED,
    },
    "motor-inertia": {
        "S14 start f": REPRODUCED,
        "S14 start A": PARTLY,
        "S14 stop f": PARTLY,
        "S14 stop A": PARTLY,
    },
    "stiffness": {
        "S15 start f": REPRODUCED,
        "S15 start A": PARTLY,
        "S15 stop f": REPRODUCED,
        "S15 stop A": PARTLY,
    },
    "damping": {
        "S16 text": CONTRADICTORY,
        "S16 abstract": REPRODUCED,
        "S16 f": CONTRADICTORY,
        "S17 start A": CONTRADICTORY,
        "S17 stop A": REPRODUCED,
        "S17 f": REPRODUCED,
        "S17 energy": REPRODUCED,
        "S17 kept torque": REPRODUCED,
        "S18 mode": REPRODUCED,
        "S18 rise time": CONTRADICTORY,
        "S18 mode, B_l": REPRODUCED,
    },
    "transmission-error": {
        "S19 start A": REPRODUCED,
        "S19 run A": REPRODUCED,
        "S19 stop A": PARTLY,
        "S19 f": REPRODUCED,
        "S20": PARTLY,
    },
    "validate": {
        "S1": REPRODUCED,
        "S2": OPEN,
        "S3": REPRODUCED,
        "S4": REPRODUCED,
        "S5": REPRODUCED,
        "S6": REPRODUCED,
        "S7, S8 p-p": REPRODUCED,
        "S7, S8 mean": REPRODUCED,
        "S7, S8 peak": PARTLY,
        "S8 initial peak": REPRODUCED,
        "S9 start": REPRODUCED,
        "S9 stop": REPRODUCED,
        "S10": OPEN,
    },
}


ROOT = Path(__file__).parents[2]


@functools.cache
def study(name):
    return STUDIES[name]()


def verdicts(text):
    """Item, what the article says and verdict of every line of the table."""
    return [line.split("|")[1:4] for line in text.splitlines() if line.startswith("| S")]


@pytest.mark.long
def test_regress_the_page_of_the_claims_is_current(monkeypatch):
    for name, done in [(name, study(name)) for name in STUDIES]:
        monkeypatch.setitem(STUDIES, name, lambda done=done: done)
    written = runpy.run_path(str(ROOT / "tools" / "article.py"))["claims"]()
    assert verdicts(written) == verdicts((ROOT / "docs" / "claims.md").read_text())


@pytest.mark.parametrize("name", STUDIES)
def test_regress_every_claim_is_decided(name):
    assert {claim.item: claim.verdict for claim in study(name).claims} == EXPECTED[name]


def test_exact_no_claim_is_left_out():
    decided = {claim.item for name in STUDIES for claim in study(name).claims}
    assert {claim.item for claim in CLAIMS} <= decided
    assert {f"S{n}" for n in range(1, 21)} <= {part for item in decided for part in item.replace(",", "").split()}


@pytest.mark.parametrize("name", [name for name in STUDIES if name != "validate"])
def test_exact_every_row_of_a_study_finishes(name):
    for grid in study(name).grids.values():
        assert grid.result.finished.all()
        assert grid.marked.sum() < len(grid.values)
        assert float(np.max(grid.result["energy_residual"])) < 1e-4


def test_exact_too_large_an_error_is_tried_beyond_where_the_local_ratio_turns():
    """S20: dtheta_l/dtheta_m = 1/i - f theta_e' of the default drive, in closed form."""
    theta = np.linspace(0.0, 2.0 * np.pi, 20_001)
    default = {row.name: row.default for row in params()}
    slope = sum(
        n * (default[f"te_sin_{n}"] * np.cos(n * theta) - default[f"te_cos_{n}"] * np.sin(n * theta))
        for n in range(1, 16)
    )
    turns = 1.0 / 121.0 / np.max(slope)
    claim = next(claim for claim in study("transmission-error").claims if claim.item == "S20")
    assert f"from {turns:.3g} times the error on the local ratio turns negative" in claim.reason
    assert study("transmission-error").grids["te_scale"].values[-1] > 3.0 * turns
    speeds = [item for item in claim.findings if "mean speed" in item.where]
    assert [item.agrees for item in speeds] == [False, False, True]
    assert not any(item.agrees for item in claim.findings if item not in speeds)


@pytest.mark.parametrize(("top", "sign"), [(1.0, "const"), (1.1, "up")])
def test_exact_a_mode_that_moves_with_the_speed_is_not_called_constant(top, sign):
    """Of a line at one order, whose frequency goes with the speed."""
    speeds = np.array([60.0, 120.0])
    of = {"mode_frequency_start": np.array([40.0, 40.0 * top]), "speed_order_2": np.ones(2)}
    grid = SimpleNamespace(values=speeds, marked=speeds > 0.0, of=lambda name, case: of.get(name, np.zeros(2)))
    claim = speed._forced_lines(grid)
    assert [(item.sign, item.agrees) for item in claim.findings] == [("up", False), (sign, top == 1.0)]
    assert ("only the mode is constant" in claim.reason) == (top == 1.0)
    assert claim.verdict == CONTRADICTORY


@pytest.mark.parametrize(("te_scale", "heaviest"), [(1.0, "mixed"), (0.0, "down")])
def test_exact_the_tail_of_a_coast_is_no_fluctuation(te_scale, heaviest):
    """Without kinematic error nothing excites the mode, and the windup relaxes with the coast."""
    scenario = hdfast.Scenario.start_stop(speed_rpm=300.0)
    stops = {
        load: hdfast.simulate({"J_l": load, "te_scale": te_scale}, scenario=scenario, rtol=cases.RTOL)
        for load in cases.LOADS
    }
    claim = speed._tail(stops)
    assert [item.sign for item in claim.findings] == ["down", "down", "down", heaviest]
    assert [item.agrees for item in claim.findings] == [True, False, False, heaviest == "mixed"]


def test_exact_a_claim_has_a_reason_and_needs_numbers_to_be_reproduced():
    for name in STUDIES:
        for claim in study(name).claims:
            assert bool(claim.findings) == (claim.verdict != OPEN)
            assert claim.reason


def test_regress_the_reason_of_a_claim_is_that_of_the_default_drive():
    claim = next(claim for claim in CLAIMS if claim.item == "S14 start f")
    for drive, said in (({}, ""), ({"J_m": 3.0002e-4}, ""), ({"J_m": 3e-5}, "default drive: ")):
        grid = cases.run("J_m", (0.5, 1.25), (0.5, 1.25), cases=("a", "b"), loads=(0.5, 12.0), drive=drive)
        assert verdict(claim, {"J_m": grid}).reason == said + claim.reason


@pytest.mark.parametrize(
    ("values", "sign"),
    [([1, 2, 3], "up"), ([3, 2, 1], "down"), ([1, 1.01, 1], "const"), ([1, 2, 1], "mixed"), ([1, np.nan, 2], "mixed")],
)
def test_exact_signs(values, sign):
    assert trend(values)[0] == sign


def test_exact_an_order_that_the_drive_lacks_has_no_relative_error():
    found = [estimate(f"te_{n}", value, "rad", 1e-9) for n, value in ((1, 0.0), (2, 2.02e-4), (3, 1e-9))]
    fit = Fit("kinematic_error", "", Estimates(found), {}, [], {"suggested": 3})
    none = {f"te_{part}_{n}": 0.0 for part in ("cos", "sin") for n in range(1, 16)} | {"te_scale": 2.0}
    assert largest_error(fit, none) == 0.0
    assert largest_error(fit, none | {"te_cos_2": 6e-5, "te_sin_2": 8e-5}) == pytest.approx(0.01)
    assert largest_error(fit, none | {"te_cos_2": 6e-5, "te_sin_2": 8e-5, "te_sin_9": 1e-6}) == 1.0


def test_against_design_table_transmission_error_over_speed():
    """p-p and rms in µrad at 15, 50, 100, 300, 600 r/min."""
    table = {
        0.5: [(222.1, 67.5), (222.9, 67.6), (225.9, 68.1), (242.3, 73.8), (395.5, 111)],
        2.0: [(222.3, 67.5), (225.9, 68.1), (236.2, 70.2), (348.5, 100), (610, 207)],
        12.0: [(224.1, 67.8), (235.7, 71.5), (268.7, 83.7), (279.5, 87.4), (125.6, 38.5)],
    }
    from hdfast.studies.validation_runs import te

    held = study("validate").curves["held"]
    for load, pairs in table.items():
        found = zip(te(held, "te_pp", load), te(held, "te_rms", load), strict=True)
        for measured, expected in zip(found, pairs, strict=True):
            np.testing.assert_allclose(1e6 * np.array(measured), expected, rtol=5e-3)


def test_against_design_brake_torques():
    """2.8, 12 and 39 N m at load inertias of 0.5, 2 and 12 kg m^2 for 100 r/min in 20 ms."""
    grid = study("motor-inertia").grids["J_m"]
    nominal = int(np.flatnonzero(grid.values == 1.0)[0])
    found = [grid.of("spring_torque", "e", load)[nominal] for load in grid.loads]
    np.testing.assert_allclose(found, [2.8, 12.0, 39.0], rtol=0.02)


def test_against_design_energy_and_speed_of_b_ml():
    """Constant torque: 396, 341, 300, 267 r/min for B_ml times 0.5 to 1.25."""
    grid = study("damping").grids["B_ml"]
    speed = grid.of("steady_speed", "t")[grid.marked] * 60 / (2 * np.pi)
    np.testing.assert_allclose(speed / speed[2] * 300.0, [396, 341, 300, 267], rtol=0.01)
