from __future__ import annotations

import json

import answers as made
import numpy as np
import pytest
from hdfast.proof.bridge.injections import INJECTIONS
from hdfast.proof.generator.effects import EFFECTS
from hdfast.proof.score import Answer, read_answer, score
from hdfast.proof.score.identification import GROUPS
from hdfast.proof.score.intervals import bootstrap, calibration_floor, reliability_slope, wilson
from hdfast.proof.score.judge import judge
from hdfast.proof.score.localisation import overlap
from hdfast.report.proof_page import effect_rows
from scipy import stats


@pytest.mark.parametrize(("hits", "count"), [(0, 100), (1, 100), (4, 200), (80, 100), (300, 300), (17, 23)])
def test_against_scipy_wilson(hits, count):
    expected = stats.binomtest(hits, count).proportion_ci(method="wilson")
    assert wilson(hits, count) == pytest.approx((expected.low, expected.high), abs=1e-12)


@pytest.mark.parametrize(
    ("count", "half"), [(10, 23), (20, 17), (50, 11), (100, 8), (200, 5.5), (300, 4.5), (1000, 2.5)]
)
def test_against_planned_half_widths_at_80_percent(count, half):
    low, high = wilson(round(0.8 * count), count)
    assert 50 * (high - low) == pytest.approx(half, abs=0.55)


def test_against_normal_theory_the_bootstrap_of_a_mean():
    values = list(np.random.default_rng(1).normal(3.0, 2.0, 400))
    low, high = bootstrap(values, lambda x: float(np.mean(x)))
    half = 1.96 * np.std(values) / 20
    assert (low, high) == pytest.approx((np.mean(values) - half, np.mean(values) + half), abs=0.03)


@pytest.mark.parametrize(("count", "floor"), [(100, 0.123), (300, 0.071), (1000, 0.039)])
def test_against_planned_floors_of_the_calibration_error(count, floor):
    confidence = np.random.default_rng(2).beta(4, 1.2, count)
    assert calibration_floor(confidence) == pytest.approx(floor, abs=0.008)


def test_exact_slope_of_a_calibrated_line():
    confidence = np.repeat([0.2, 0.6], 10)
    right = np.concatenate([np.arange(10) < 2, np.arange(10) < 6]).astype(float)
    assert reliability_slope(confidence, right) == pytest.approx(1.0)


def test_exact_full_marks_for_perfect_answers():
    labels = made.campaign()
    card = score(labels, made.perfect(labels))
    scores = made.by_name(card)
    assert card.failures == []
    for name in (
        "identification",
        "selective accuracy",
        "sets: precision",
        "sets: recall",
        "place",
        "windows: overlap",
    ):
        assert scores[name].value == 1.0
        assert scores[name].passed is not False
    assert scores["false alarms"].value == scores["orders: error"].value == 0.0
    assert scores["outside the list: variable and memory"].value == 1.0
    assert scores["undecidable: right class"].value == scores["undecidable: asks"].value == 1.0
    assert scores["effect parameter"].value == pytest.approx(np.log(1.05))
    assert scores["displaced parameters"].value == pytest.approx(np.log(1.02))
    assert scores["held-out gap closed"].value == pytest.approx(0.098 / 0.1)
    assert scores["held-out fit made worse"].passed
    assert scores["utility per case"].value == pytest.approx((12 + 3 + 1 + 2) / 30)


def test_exact_the_gap_is_that_to_the_true_structure_in_the_band_and_scale_of_the_answer():
    spectra = {"te": [[1.0, 1e-6], [100.0, 3e-6]], "motor_torque": [[1.0, 0.01], [100.0, 0.01]]}
    noise = {name: [[corner, 0.5 * rms] for corner, rms in own] for name, own in spectra.items()}
    labels = {"one": made.label("single", ["backlash"], oracle_heldout=spectra, noise_heldout=noise)}
    answers = made.perfect(labels)
    answers["one"].verdict["fit"]["heldout"]["channels"] = {
        "te": {"band_hz": 10.0, "measured_std": 1e-4},
        "motor_torque": {"band_hz": 5.0, "measured_std": 0.5},
    }
    found = made.by_name(score(labels, answers))
    assert found["held-out gap closed"].value == pytest.approx(0.098 / (0.11 - 0.02))
    assert found["held-out gap closed, to the noise"].value == pytest.approx(0.098 / (0.11 - 0.01))


@pytest.mark.parametrize(
    "channels", [None, {}, {"te": {"band_hz": 0.0, "measured_std": 1e-4}}, {"te": {"band_hz": 10.0}}]
)
def test_exact_an_answer_without_band_or_scale_is_held_against_the_smaller_floor(channels):
    labels = {"one": made.label("single", ["backlash"], oracle_heldout={"te": [[1.0, 1e-6], [100.0, 3e-6]]})}
    answers = made.perfect(labels)
    answers["one"].verdict["fit"]["heldout"]["channels"] = channels
    found = made.by_name(score(labels, answers))["held-out gap closed"].value
    assert found == pytest.approx(0.098 / (0.11 - 0.01))


def test_exact_abstaining_everywhere_costs_only_the_misses():
    labels = made.campaign()
    labels["weak"] = made.label("single", ["backlash"], strength=0.7)
    card = score(labels, made.always(labels, "no_evidence"))
    scores = made.by_name(card)
    assert scores["false alarms"].value == scores["coverage"].value == scores["identification"].value == 0.0
    missed = 12 + 3 + 1 + 2 + 2
    assert scores["utility per case"].value == pytest.approx(-missed / len(labels))
    assert {f["failure"] for f in card.failures} == {"missed"}
    assert len(card.failures) == missed


def test_exact_always_coulomb_has_negative_utility():
    labels = made.campaign()
    scores = made.by_name(score(labels, made.always(labels, "found", ["coulomb_friction"])))
    assert scores["utility per case"].value == pytest.approx((1 - 3 * 29) / 30)
    assert scores["false alarms"].value == 1.0
    assert not scores["false alarms"].passed


def test_exact_a_name_beside_the_right_one_is_wrong():
    case = judge("x", made.label("single", ["backlash"]), Answer("", made.verdict("found", ["backlash", "delay"])))
    assert (case.outcome, case.utility) == ("wrong", -3.0)


def test_exact_part_of_a_set_earns_its_share():
    label = made.label("set", ["hysteresis", "backlash"])
    case = judge("x", label, Answer("", made.verdict("found", ["backlash"])))
    assert (case.outcome, case.utility) == ("partly", 0.5)


def test_exact_what_a_set_leaves_unnamed_is_a_failure_and_a_name_counts_once():
    label = made.label("set", ["hysteresis", "backlash"])
    card = score({"x": label}, {"x": Answer("", made.verdict("found", ["backlash", "backlash"]))})
    assert [f["failure"] for f in card.failures] == ["hysteresis missed"]
    assert made.by_name(card)["sets: precision"].value == 1.0
    weak = made.label("set", ["hysteresis", "backlash"], strength=1.2)
    assert score({"x": weak}, {"x": Answer("", made.verdict("found", ["backlash"]))}).failures == []


@pytest.mark.parametrize(
    ("orders", "outcome", "precision"),
    [([5.0], "right", 1.0), ([4.95], "right", 1.0), ([7.0], "wrong", 0.0), ([5.0, 7.0], "wrong", 0.5),
     ([5.0, 5.0], "wrong", 0.5), ([None], "right", 1.0)],
)  # fmt: skip
def test_exact_a_line_is_right_once_and_at_its_order(orders, outcome, precision):
    label = made.label("single", ["te_harmonic"])
    label["effects"][0]["true_parameters"] = {"order": 5.0}
    said = made.verdict("found", ["te_harmonic"] * len(orders))
    for entry, order in zip(said["effects"], orders, strict=True):
        entry["parameters"] = {} if order is None else {"order": {"value": order}}
    assert judge("x", label, Answer("", said)).outcome == outcome
    card = score({"x": {**label, "kind": ["set"]}}, {"x": Answer("", said)})
    assert made.by_name(card)["sets: precision"].value == precision


@pytest.mark.parametrize(("where", "outcome"), [({}, "right"), ({"memory": "fading"}, "missed")])
def test_exact_a_dependence_is_right_in_variable_and_memory(where, outcome):
    said = made.verdict("depends_on", ["unknown"], **{"memory": "none", "depends_on": ["load_phase"], **where})
    assert judge("x", made.label("outside", ["outside_detent"]), Answer("", said)).outcome == outcome


def test_exact_the_size_of_a_line_is_its_amplitude_and_no_order():
    label = made.label("single", ["te_harmonic"])
    label["effects"][0] |= {"amplitude": 5e-5, "true_parameters": {"order": 6.0}}
    said = made.verdict("found", ["te_harmonic"])
    waves = {"te_cos_6": {"value": 3.3e-5, "sigma": 1e-6}, "te_sin_6": {"value": 4.4e-5, "sigma": 1e-6}}
    said["effects"][0]["parameters"] = {"order": {"value": 6.0, "sigma": 0.0}, **waves}
    found = made.by_name(score({"x": label}, {"x": Answer("", said)}))
    assert found["effect parameter"].value == pytest.approx(np.log(1.1))
    assert found["effect parameter: 90 % interval"].value == 0.0


def test_exact_below_detection_nothing_is_missed():
    case = judge("x", made.label("single", ["backlash"], strength=0.7), Answer("", made.verdict("no_evidence")))
    assert (case.outcome, case.utility) == ("abstained", 0.0)


@pytest.mark.parametrize("fault", ["missing", "invalid", "late", "crashed"])
def test_exact_no_answer_is_a_wrong_answer(fault):
    labels = {"n": made.label("null"), "s": made.label("single", ["backlash"])}
    card = score(labels, {name: Answer(fault) for name in labels})
    assert made.by_name(card)["false alarms"].value == 1.0
    assert [f["answer"] for f in card.failures] == [fault, fault]
    assert made.by_name(card)["utility per case"].value == -3.0


def test_exact_a_named_nuisance_is_listed():
    label = made.label("null", nuisance=[{"id": "cogging", "amplitude_over_mda": 0.2}])
    card = score({"n": label}, {"n": Answer("", made.verdict("found", ["cogging"]))})
    assert card.failures[0]["named_nuisance"] == ["cogging"]


def test_exact_overlap_of_windows():
    assert overlap([(0.0, 2.0, "a")], [(1.0, 3.0, "a")]) == pytest.approx(1 / 3)
    assert overlap([(0.0, 2.0, "a")], [(0.0, 2.0, "b")]) == 0.0
    assert overlap([(0.0, 2.0, "a"), (1.0, 3.0, "a"), (5.0, 4.0, "a")], [(0.0, 3.0, "a")]) == 1.0
    assert overlap([(0.0, 9e5, "a")], [(0.0, 4.5e5, "a")]) == 0.5
    assert overlap([], []) == 1.0


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"verdict": "perhaps"}, "verdict"),
        ({"effects": [{"effect": "delay", "probability": 1.5}]}, "probability"),
        ({"effects": []}, "without an effect"),
        ({"effects": None}, "effects = None"),
        ({"where": "motor"}, "where = 'motor'"),
        ({"where": {"orders": [None]}}, "orders = [None]"),
        ({"where": {"windows": [["a", 1, "x"]]}}, "windows = [['a', 1, 'x']]"),
        ({"where": {"windows": [[0.0, 1.0]]}}, "windows = [[0.0, 1.0]]"),
        ({"where": {"orders": [float("nan")]}}, "NaN"),
        ({"where": {"orders": [10**400]}}, "orders"),
        ({"where": {"windows": [[0.0, 1e7, "x"]]}}, "windows"),
        ({"where": {"depends_on": "load_phase"}}, "depends_on = 'load_phase'"),
        ({"where": {"depends_on": [["load_phase"]]}}, "depends_on"),
        ({"fit": {"heldout": {"noise_floor_nrmse": "low"}}}, "heldout"),
        ({"fit": {"heldout": {"baseline_nrmse": 10**400}}}, "heldout"),
        ({"fit": {"heldout": {"channels": {"te": {"band_hz": "all"}}}}}, "heldout"),
        ({"masking": [{"parameter": "B_m", "extended": 10**400}]}, "masking"),
        ({"effects": [{"effect": "delay", "probability": 10**400}]}, "probability"),
        ({"effects": [{"effect": "\ud800", "probability": 0.9}]}, "without id"),
        ({"effects": [{"effect": "delay", "probability": 0.9, "parameters": {"x": {"value": "1"}}}]}, "parameters"),
        ({"effects": [{"effect": "delay", "probability": 0.9, "parameters": {"x": {"sigma": [1]}}}]}, "parameters"),
        ({"fit": {"heldout": ["x"]}}, "heldout = ['x']"),
        ({"fit": {"heldout": {"channels": {"te": 1.0}}}}, "heldout"),
        ({"masking": [{"parameter": ["B_m"]}]}, "masking"),
        ({"masking": None}, "masking = None"),
        ({"masking": ["B_m"]}, "masking = ['B_m']"),
        ({"effects": [{"effect": "delay", "probability": 0.9, "rivals": None}]}, "rivals = None"),
        ({"effects": [{"effect": "delay", "probability": 0.9, "rivals": [[]]}]}, "rivals = [[]]"),
        ({"effects": [{"effect": "delay", "probability": 0.9, "parameters": 3}]}, "parameters = 3"),
        ({"effects": [{"effect": "delay", "probability": 0.9, "place": "moon"}]}, "place"),
    ],
)
def test_exact_schema_violations_are_invalid_answers(tmp_path, change, complaint):
    (tmp_path / "verdict.json").write_text(json.dumps({**made.verdict("found", ["delay"]), **change}))
    answer = read_answer(tmp_path)
    assert answer.fault == "invalid"
    assert complaint in answer.detail


def test_exact_a_verdict_nested_beyond_reading_is_invalid(tmp_path):
    (tmp_path / "verdict.json").write_text("[" * 100_000)
    assert read_answer(tmp_path).fault == "invalid"


def test_exact_numbers_beyond_every_float_are_invalid(tmp_path):
    said = made.verdict("found", ["delay"], windows=[[0.0, 12345.0, "x"]])
    (tmp_path / "verdict.json").write_text(json.dumps(said).replace("12345.0", "1e400"))
    assert read_answer(tmp_path).fault == "invalid"


def test_exact_a_name_where_a_law_outside_the_list_is_concealed_counts_against_calibration():
    labels = {"law": made.label("outside", ["outside_detent"]), "told": made.label("outside", ["outside_detent"])}
    answers = {
        "law": Answer("", made.verdict("found", ["cogging"], 0.9)),
        "told": Answer("", made.verdict("depends_on", ["unknown"], 0.98)),
    }
    found = made.by_name(score(labels, answers))["calibration error"]
    assert found.count == 1
    assert found.value == pytest.approx(0.9)


@pytest.mark.parametrize("word", ["found", "undecided"])
def test_exact_a_line_at_another_order_counts_against_calibration(word):
    label = made.label("single", ["te_harmonic"])
    label["effects"][0]["true_parameters"] = {"order": 6.0}
    said = made.verdict(word, ["te_harmonic"], 0.95)
    for order, error in ((6.0, 0.05), (13.0, 0.95)):
        said["effects"][0]["parameters"] = {"order": {"value": order}}
        found = made.by_name(score({"x": label}, {"x": Answer("", said)}))["calibration error"]
        assert found.value == pytest.approx(error)


def test_exact_half_each_for_two_that_nothing_tells_apart_is_calibrated():
    labels = {
        name: made.label("undecidable", [truth], rivals=[{"id": twin, "abs_cos": 0.999}])
        for name, truth, twin in (("a", "ratio_error", "clock_skew"), ("b", "clock_skew", "ratio_error"))
    }
    said = Answer("", made.verdict("undecided", ["ratio_error"], 0.5, ["clock_skew"]))
    assert made.by_name(score(labels, dict.fromkeys(labels, said)))["calibration error"].value == 0.0


def test_exact_the_size_of_breakaway_is_what_exceeds_sliding():
    label = made.label("single", ["stribeck_friction"])
    label["effects"][0]["true_parameters"] = {"omega_s": 3.0, "breakaway_ratio": 1.2}
    said = made.verdict("found", ["stribeck_friction"])
    said["effects"][0]["parameters"] = {
        "omega_s": {"value": 9.0, "sigma": 1.0}, "breakaway_ratio": {"value": 1.22, "sigma": 0.02},
    }  # fmt: skip
    found = made.by_name(score({"x": label}, {"x": Answer("", said)}))
    for name in ("effect parameter", "effect parameter, friction"):
        assert found[name].value == pytest.approx(np.log(0.22 / 0.2))
    assert found["effect parameter: 90 % interval"].value == 1.0
    assert found["effect parameter, actuator"].count == 0
    label["effects"][0]["true_parameters"] = {"omega_s": 3.0}
    assert made.by_name(score({"x": label}, {"x": Answer("", said)}))["effect parameter"].count == 0


def test_exact_a_parameter_held_at_zero_is_no_size():
    """Of a stiffness that varies once per load turn nothing is said of its second order."""
    label = made.label("single", ["mesh_stiffness_variation"])
    label["effects"][0]["true_parameters"] = {"eps_2": 0.03}
    said = made.verdict("found", ["mesh_stiffness_variation"])
    said["effects"][0]["parameters"] = {"eps_o": {"value": 0.03, "sigma": 0.01}, "eps_2": {"value": 0.0, "sigma": 0.0}}
    found = made.by_name(score({"x": label}, {"x": Answer("", said)}))
    assert found["effect parameter"].count == found["effect parameter: 90 % interval"].count == 0


def test_exact_declared_dry_friction_is_among_the_displaced_parameters():
    label = made.label("single", ["backlash"], baseline_true={"T_c": 0.02})
    answers = made.perfect({"x": label})
    answers["x"].verdict["masking"] = [{"parameter": "coulomb_friction_T_c", "extended": 0.022}]
    assert made.by_name(score({"x": label}, answers))["displaced parameters"].value == pytest.approx(np.log(1.1))


def test_exact_displaced_parameters_are_counted_and_drawn_again_by_case():
    labels = {name: made.label("single", ["backlash"], baseline_true={"B_m": 1e-3, "k1": 1.0}) for name in "ab"}
    answers = made.perfect(labels)
    for name, factors in (("a", (1.1, 1.1)), ("b", (1.3, 1.3))):
        answers[name].verdict["masking"] = [
            {"parameter": "B_m", "extended": 1e-3 * factors[0]}, {"parameter": "k1", "extended": factors[1]},
        ]  # fmt: skip
    found = made.by_name(score(labels, answers))["displaced parameters"]
    assert found.count == 2
    assert found.value == pytest.approx(np.log([1.1, 1.3]).mean())
    alone = {"a": labels["a"]}
    found = made.by_name(score(alone, {"a": answers["a"]}))["displaced parameters"]
    assert (found.low, found.high) == pytest.approx((np.log(1.1), np.log(1.1)))


def test_exact_every_effect_is_in_one_group():
    grouped = [effect for ids in GROUPS.values() for effect in ids]
    assert len(grouped) == len(set(grouped))
    named = {i for i in EFFECTS if not i.startswith(("outside_", "minor_"))} | {one.effect for one in INJECTIONS}
    assert named <= set(grouped)


def test_exact_single_effects_are_counted_by_kind_and_size():
    labels = {
        "a": made.label("single", ["hysteresis"], 3.0),
        "b": made.label("single", ["hysteresis"], 4.0),
        "c": made.label("single", ["backlash"], 1.5),
        "d": made.label("set", ["backlash", "hysteresis"], 3.0),
    }
    answers = made.perfect(labels) | {"b": Answer("", made.verdict("no_evidence"))}
    card = score(labels, answers).to_dict()
    assert effect_rows(card) == [("backlash", "", "1 of 1", "", ""), ("hysteresis", "", "", "1 of 2", "")]


def test_exact_the_card_is_plain_json():
    labels = made.campaign()
    card = score(labels, made.perfect(labels)).to_dict()
    assert json.loads(json.dumps(card, allow_nan=False)) == card


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [
        (made.verdict("undecided", ["ratio_error"], 0.5, ["clock_skew"]), "right_class"),
        (made.verdict("sensor", ["clock_skew"], 0.9, ["ratio_error"]), "right_class"),
        (made.verdict("sensor", ["ratio_error"], 0.9, ["clock_skew"]), "right"),
        (made.verdict("sensor", ["clock_skew"], 0.9), "wrong"),
        (made.verdict("undecided", ["clock_skew"], 0.5), "missed"),
        (made.verdict("sensor", ["sensor_delay"], 0.9, ["ratio_error", "clock_skew"]), "wrong"),
        (made.verdict("undecided", ["ratio_error"], 0.5, ["clock_skew", "delay"]), "right_class"),
        (made.verdict("undecided", ["ratio_error"], 0.5, ["clock_skew", "delay", "backlash"]), "missed"),
        (made.verdict("no_evidence", ["ratio_error"], 0.5, ["clock_skew"]), "missed"),
        (made.verdict("depends_on", ["ratio_error"], 0.5, ["clock_skew"]), "missed"),
    ],
)
def test_exact_classes_of_twins(answer, outcome):
    label = made.label("undecidable", ["ratio_error"], rivals=[{"id": "clock_skew", "abs_cos": 0.999}])
    assert judge("x", label, Answer("", answer)).outcome == outcome


def test_exact_a_class_is_no_answer_to_a_set():
    label = made.label("set", ["ratio_error", "backlash"], rivals=[{"id": "clock_skew", "abs_cos": 0.999}])
    said = made.verdict("undecided", ["ratio_error"], 0.5, ["clock_skew"])
    assert judge("x", label, Answer("", said)).outcome == "missed"
