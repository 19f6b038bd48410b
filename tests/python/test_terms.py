from __future__ import annotations

import runpy
from pathlib import Path

import hdfast
import numpy as np
import pytest
from hdfast import config

ROOT = Path(__file__).parents[2]


def test_regress_docs_are_current(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    written = runpy.run_path(str(ROOT / "tools" / "terms.py"))
    docs, hint = ROOT / "docs", "run python tools/terms.py"
    assert (docs / "terms.md").read_text() == written["index"](), hint
    for term in hdfast.terms():
        assert (docs / "terms" / f"{term.id}.md").read_text() == written["page"](term), hint
        picture = (docs / "images" / "terms" / f"{term.id}.png").read_bytes()
        assert picture.startswith(b"\x89PNG"), hint
        assert len(picture) < 40_000, term.id
    for folder in (docs / "terms", docs / "images" / "terms"):
        assert {path.stem for path in folder.iterdir()} == set(hdfast.terms().ids), hint


@pytest.mark.parametrize("term", ["load_dependent_friction", "te_harmonic", "sensor_delay"])
def test_exact_a_signature_shows_the_term(term, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    from signatures import SIGNATURES

    without, on = (dict(zip(*curve, strict=True)) for curve in SIGNATURES[term].curves().values())
    assert set(without) <= set(on)
    assert max(abs(y - without.get(x, 0.0)) for x, y in on.items()) > 1.0


def test_exact_columns_of_a_term_are_prefixed_only_where_shared():
    alone = hdfast.params(hdfast.Model(terms=["coulomb_friction"])).names
    both = hdfast.params(hdfast.Model(terms=["coulomb_friction", "stribeck_friction"])).names
    assert "T_c" in alone
    assert {"coulomb_friction_T_c", "stribeck_friction_T_c"} <= set(both)
    assert hdfast.params(hdfast.Model(terms=["coulomb_friction"])).column("coulomb_friction_T_c") == alone.index("T_c")


def test_exact_stop_under_friction_is_for_ever():
    model = hdfast.Model(terms=["coulomb_friction"])
    scenario = hdfast.Scenario.start_stop(speed_rpm=100)
    t = np.linspace(3.3, 6.0, 50)
    result = hdfast.sweep(
        {"T_c": np.array([0.02, 0.05]), "te_scale": 0.0},
        model=model,
        scenario=scenario,
        t_eval=t,
        signals=["omega_m"],
        metrics=["stop_time"],
    )
    assert np.all(result.samples["omega_m"] == 0.0)
    np.testing.assert_allclose(result["stop_time"], [0.121, 0.056], atol=6e-4)


def test_exact_toml_switches_terms_on(tmp_path):
    text = '[[terms]]\neffect = "coulomb_friction"\nparameters = { T_c = { value = 0.04, sigma = 0.2 } }\n'
    path = tmp_path / "drive.toml"
    path.write_text(text)
    settings = config.load(path)
    assert settings.model.terms == ("coulomb_friction",)
    assert settings.drive["T_c"] == 0.04


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"terms": ["coulomb"]}, "coulomb_friction"),
        ({"terms": ["coulomb_friction", "coulomb_friction"]}, "twice"),
        ({"terms": ["coulomb_friction", "backlash"], "base": "one_inertia"}, "'backlash'.*two_inertia"),
        ({"terms": [term.id for term in hdfast.terms() if term.states and not term.channels]}, "at most 8"),
        ({"terms": ["clock_skew"]}, r"hdfast.sensors.SensorStage\(\[\('clock_skew', 'motor_angle'\)\]\)"),
    ],
)
def test_exact_wrong_terms_are_named(options, named):
    with pytest.raises(hdfast.InputError, match=named):
        hdfast.Model(**options)


def test_exact_parameter_out_of_its_range_is_a_bad_row():
    result = hdfast.sweep({"T_c": np.array([0.02, -1.0])}, model=hdfast.Model(terms=["coulomb_friction"]))
    assert list(result.status) == [0, 5]
    assert "T_c" in result.message(1)


POLYNOMIAL, PIECEWISE = {"k1": 1e4, "k3": 0.0, "k5": 0.0}, {"K1": 3e4, "K2": 1e4}


@pytest.mark.parametrize(
    ("spring", "row", "most"),
    [
        ("polynomial", POLYNOMIAL, 1e4),
        ("polynomial", POLYNOMIAL | {"k3": 1e10, "k5": -1e15, "phi_max": 1e-3}, 1e4),
        ("polynomial", {"k1": 3e4, "k3": 0.0, "k5": -5e15, "phi_max": 1e-3, "phi_0": 1.0}, 5e3 * np.cosh(1e-3) ** 2),
        ("polynomial", {"k1": 3e4, "k3": -2e10, "k5": 1.1e16, "phi_max": 1e-3, "phi_0": 1.0}, 3e4 - 3.6e21 / 2.2e17),
        ("piecewise", PIECEWISE, 3e4),
        ("piecewise", PIECEWISE | {"phi_0": 1e-3}, 1e4 * np.cosh(14.0 / 30.0) ** 2),
    ],
)
def test_exact_a_spring_that_softness_turns_over_is_a_bad_row(spring, row, most):
    """Where the tangent of spring and softness together is not positive, the windup would jump."""
    columns = row | {"delta_K": most * np.array([0.999, 1.001])}
    result = hdfast.sweep(columns, model=hdfast.Model(spring=spring, terms=["soft_windup"]), metrics=[])
    assert list(result.status == 5) == [False, True]
    assert "delta_K" in result.message(1)


@pytest.mark.parametrize(
    ("model", "row"),
    [
        (hdfast.Model(spring="piecewise"), {"tau_load": 14.0}),
        (hdfast.Model(terms=["backlash"]), {}),
        (hdfast.Model(terms=["backlash", "coulomb_friction"]), {"T_c": 0.03}),
    ],
    ids=["knots", "gap", "gap and stops"],
)
def test_against_a_tight_run_corners_of_the_spring(model, row):
    """Where the spring law has corners the error still falls with the tolerance."""
    rows = {"J_l": np.linspace(0.4, 0.7, 8)} | {name: np.full(8, value) for name, value in row.items()}
    scenario = hdfast.Scenario.start_stop(speed_rpm=120, start="speed_ramp", stop="brake", t_end=2.0)
    options = {"model": model, "scenario": scenario, "t_eval": np.linspace(0.0, 2.0, 201), "metrics": []}
    exact = hdfast.sweep(rows, rtol=1e-12, **options)["te"]
    for rtol in (1e-5, 1e-7, 1e-9):
        found = hdfast.sweep(rows, rtol=rtol, **options)["te"]
        errors = np.max(np.abs(found - exact), axis=1) / np.ptp(exact, axis=1)
        assert np.median(errors) < 20 * rtol, (rtol, errors)


def test_exact_eight_hidden_states_at_rest_underflow_no_tolerance():
    model = hdfast.Model(terms=["viscoelastic", "base_compliance", "load_compliance", "input_compliance"])
    scenario = hdfast.Scenario.start_stop(t_on=0.1, t_off=0.3, t_end=0.6)
    result = hdfast.sweep({"J_l": 0.5}, model=model, scenario=scenario, metrics=["te_pp"], atol=1e-9)
    assert result.status_counts() == {"finished": 1}


@pytest.mark.parametrize("load", [0.0, 20.0])
@pytest.mark.parametrize("term", [term.id for term in hdfast.terms() if not term.channels])
def test_exact_default_parameters_leave_a_controlled_drive_its_speed(term, load):
    """Whoever switches a term on with nothing else gets a drive that runs as asked."""
    scenario = hdfast.Scenario.start_stop(start="speed_ramp", load=load)
    result = hdfast.sweep({}, model=hdfast.Model(terms=[term]), scenario=scenario, metrics=["steady_speed"])
    assert result.finished.all()
    assert abs(result["steady_speed"][0] / scenario.values["omega_set"] - 1) < 1e-3
