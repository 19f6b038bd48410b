"""Other strategies and ablations on the same cases."""

from __future__ import annotations

import json
import threading
from dataclasses import replace
from importlib import import_module

import answers as made
import diagnosed
import numpy as np
import pytest
import small_campaign
from hdfast.diagnosis import diagnose
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.projector import Projector
from hdfast.diagnosis.score import Gain
from hdfast.diagnosis.session import nominal, set_up_usable
from hdfast.proof.rivals import ablations, forward_bic, sparse_regression, table, whiteness
from hdfast.proof.rivals.said import as_dict
from hdfast.proof.score import comparison, score
from hdfast.proof.score.answer import complain
from hdfast.proof.tool import answer
from hdfast.recordings import load_campaign
from scipy.signal import lfilter

PATIENCE_S = 300.0


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A drive with dry friction that its campaign leaves out."""
    folder = tmp_path_factory.mktemp("dry") / "case"
    return diagnosed.write(folder, ["coulomb_friction"], {"coulomb_friction_T_c": 0.03}, motor_only=True)


@pytest.fixture(scope="module")
def calibrated(campaign):
    setup = set_up_usable(load_campaign(campaign), None)
    return setup, fit(setup.replay, nominal(setup))


def test_exact_size_of_the_residual_tests():
    rng = np.random.default_rng(4)
    white = rng.standard_normal((400, 500))
    driven = lfilter([1.0], [1.0, -0.9], rng.standard_normal((400, 500)), axis=1)
    alone = [whiteness.whiteness(one) < 0.05 for one in white]
    crossed = [whiteness.independence(one, other) < 0.05 for one, other in zip(white, driven, strict=True)]
    for rejected in (np.mean(alone), np.mean(crossed)):
        assert 0.02 < rejected < 0.08


def test_exact_the_residual_tests_see_colour_and_what_an_input_left_behind():
    rng = np.random.default_rng(5)
    white, driven = rng.standard_normal((2, 2000))
    assert whiteness.whiteness(lfilter([1.0], [1.0, -0.5], white)) < 1e-6
    assert whiteness.independence(white + 0.3 * np.roll(driven, 3), driven) < 1e-6


def test_exact_resampled_regressions_keep_the_columns_that_made_the_target():
    rng = np.random.default_rng(6)
    columns = rng.standard_normal((2000, 8)) * np.geomspace(1e-3, 1e3, 8)
    shares = np.array([0.0, 1.0, 0.0, 0.0, 0.0, -0.7, 0.0, 0.0])
    target = columns / columns.std(axis=0) @ shares + 0.5 * rng.standard_normal(2000)
    assert np.flatnonzero(sparse_regression.inclusion(columns, target) > 0.75).tolist() == [1, 5]


def test_exact_criterion_grows_by_the_logarithm_of_the_samples_for_a_parameter_that_does_nothing(calibrated):
    setup, known = calibrated
    layout, structure = setup.replay.layout, known.structure
    wider = structure.with_terms((), (), (), {}, (structure.free[0],))
    idle = replace(known, structure=wider, coordinates=np.append(known.coordinates, 0.0))
    grown = forward_bic.bic(layout, idle) - forward_bic.bic(layout, known)
    assert grown == pytest.approx(np.log(layout.size))


@pytest.mark.parametrize(
    ("name", "verdict", "named"),
    [
        ("refit", "no_evidence", set()),
        ("whiteness", "undecided", set()),
        pytest.param("forward_bic", "found", {"coulomb_friction"}, marks=pytest.mark.long),
        ("sparse_regression", "found", {"coulomb_friction", "stribeck_friction", "presliding_friction"}),
    ],
)
def test_regress_every_rival_answers_in_the_schema(calibrated, monkeypatch, name, verdict, named):
    monkeypatch.setattr(forward_bic, "MOST_EFFECTS", 1)
    setup, known = calibrated
    said = as_dict(import_module(f"hdfast.proof.rivals.{name}").answer(setup, known), setup, known)
    assert complain(json.loads(json.dumps(said, allow_nan=False))) == ""
    assert said["verdict"] == verdict
    assert {effect["effect"] for effect in said["effects"]} == named
    proven = said["fit"]["heldout"]
    assert proven["extended_nrmse"] <= (0.5 if named else 1.0) * proven["baseline_nrmse"]


def test_exact_sparse_regression_names_what_no_other_column_resembles(tmp_path):
    values = {"T_gravity": 4.0, "psi": 0.3}
    loaded = load_campaign(diagnosed.write(tmp_path / "case", ["gravity_unbalance"], values, motor_only=True))
    setup = set_up_usable(loaded, None)
    said = sparse_regression.answer(setup, fit(setup.replay, nominal(setup)))
    assert [one.candidate.effect for one in said.named] == ["gravity_unbalance"]
    assert said.final.value("gravity_unbalance_T_gravity") == pytest.approx(4.0, rel=0.1)


def test_exact_a_rival_answers_a_case_as_a_process_of_its_own(campaign, tmp_path):
    answer(campaign.parent, tmp_path / "out", table.command("refit"), PATIENCE_S, threading.Event())
    assert json.loads((tmp_path / "out" / "outcome.json").read_text())["fault"] == ""
    assert json.loads((tmp_path / "out" / "verdict.json").read_text())["verdict"] == "no_evidence"


@pytest.mark.parametrize("name", ablations.ABLATIONS)
def test_exact_an_ablation_takes_its_part_out_and_brings_it_back(name):
    one = ablations.ABLATIONS[name]
    before = getattr(one.owner, one.part)
    with ablations.without(name):
        assert getattr(one.owner, one.part) is one.instead
    assert getattr(one.owner, one.part) is before


@pytest.mark.long
@pytest.mark.parametrize("name", ablations.ABLATIONS)
def test_exact_an_ablated_diagnosis_of_a_small_campaign_ends_with_a_verdict(name, tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch)
    campaign = small_campaign.write(tmp_path, ["coulomb_friction"], {"coulomb_friction_T_c": 0.03})
    with ablations.without(name):
        assert "coulomb_friction" in [one["effect"] for one in diagnose(campaign).effects]


def test_exact_without_projection_signatures_are_whole_and_without_a_proof_nothing_is_refused():
    class Half(Projector):
        def __init__(self):
            self.A, self.inverse = np.eye(2), 0.5 * np.eye(2)

    signal = np.ones((2, 1))
    assert Half().left(signal, Half().absorbed(signal)) == pytest.approx(0.5 * signal)
    with ablations.without("no_projection"):
        assert Half().left(signal, Half().absorbed(signal)) is signal
    refused = Proof(0.1, 0.3, 0.05, Gain(np.full(4, -9.0), (0.3, 0.1)), Gain(np.full(4, 9.0), (0.3, 0.1)), 0.0, ())
    assert refused.refutes
    with ablations.without("no_holdout"):
        assert refused.holds
        assert not refused.refutes


def test_exact_lead_in_utility_is_paired_over_cases():
    labels = made.campaign()
    own = score(labels, made.perfect(labels))
    always = score(labels, made.always(labels, "found", ["coulomb_friction"]))
    silent = score(labels, made.always(labels, "no_evidence"))
    leads = {"always": comparison.ahead(own, always), "silent": comparison.ahead(own, silent)}
    assert leads["always"].value == pytest.approx((18 - (1 - 87)) / 30)
    assert leads["silent"].value == pytest.approx((18 + 20) / 30)
    mark = comparison.beaten(leads)
    assert mark.passed
    assert mark.note.endswith("silent")
    assert not comparison.beaten({"itself": comparison.ahead(own, own)}).passed
