"""Acceptance (e) of the generator: file, header and timing statistics do not tell the label."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from hdfast.proof import making
from hdfast.proof.folders import Folders
from hdfast.proof.generator import strata
from hdfast.proof.generator.case import build
from hdfast.proof.generator.equipment import draw_chain
from hdfast.proof.generator.recipe import Bench, Recipe
from hdfast.proof.seal import LABELS
from tells import matrix, p_value, statistics

LEVEL = 0.01
BRIEF = Bench(motor_only=True, seconds=(0.5, 0.7), recordings=(4, 4))
PAIRS, WHOLE = 8, 60
FRICTION = ("coulomb", "stribeck", "load_dependent", "load_side", "position_dependent")


def test_exact_level_of_the_classifier_on_features_that_say_nothing():
    rng = np.random.default_rng(8)
    told = [
        p_value(rng.standard_normal((40, 25)), rng.permutation(np.arange(40) % 2).astype(float), rng) <= 0.1
        for _ in range(100)
    ]
    assert 0.03 <= np.mean(told) <= 0.18


def test_exact_a_header_field_that_leans_is_noticed():
    rng = np.random.default_rng(9)
    truth = np.arange(80) % 2 * 1.0
    cases = [{f"field {k}": rng.standard_normal() for k in range(25)} | {"lean": t + rng.normal(0, 0.7)} for t in truth]
    assert p_value(matrix(cases), truth, rng) <= LEVEL


def test_exact_a_leaning_bench_is_no_tell_within_benches():
    rng = np.random.default_rng(10)
    bench = rng.integers(0, 2, 120)
    truth = (rng.random(120) < 0.2 + 0.6 * bench).astype(float)
    cases = [{"bench": float(b), "noise": rng.standard_normal()} for b in bench]
    assert p_value(matrix(cases), truth, rng) <= LEVEL
    assert p_value(matrix(cases), truth, rng, bench) > LEVEL


def test_exact_no_bench_and_no_rate_belongs_to_one_label():
    """On each, several effects are concealed, and nothing; a campaign on any bench may get warm."""
    benches, rates = defaultdict(set), defaultdict(set)
    for recipe in strata.plan(300, 0):
        concealed = tuple(sorted(recipe.effects))
        benches[replace(recipe.bench, warm=False)].add(concealed)
        rate = draw_chain(np.random.default_rng(recipe.seed), recipe.bench).rate
        rates[recipe.bench.motor_only, rate].add(concealed)
    assert {rate for motor_only, rate in rates if not motor_only} == {100.0, 500.0, 1000.0}
    for labels in (*benches.values(), *rates.values()):
        assert () in labels
        assert len(labels) >= 3


@pytest.mark.long
def test_exact_cases_of_one_bench_do_not_tell_whether_something_is_missing(tmp_path):
    single = Recipe(("single",), {"torque_ripple": 3.0}, 0, BRIEF)
    null = Recipe(("null",), {}, 0, BRIEF, like=single)
    recipes = {f"{k:08x}": replace(null if k < PAIRS else single, seed=100 + k) for k in range(2 * PAIRS)}
    order = np.random.default_rng(11).permutation(list(recipes))
    folders = {name: tmp_path / f"{k:08x}" for k, name in zip(order.argsort(), recipes, strict=True)}
    for name, recipe in recipes.items():
        build(recipe, folders[name])
    truth = np.array([recipe.kinds[0] == "null" for recipe in recipes.values()], dtype=float)
    features = matrix([statistics(folder) for folder in folders.values()])
    assert p_value(features, truth, np.random.default_rng(12)) > LEVEL


@pytest.mark.long
def test_exact_a_whole_set_tells_nothing(tmp_path):
    folders = Folders(tmp_path)
    making.make(folders, WHOLE, 77, 2, lambda *_: None)
    labels = json.loads((folders.sealed / LABELS).read_text())
    features = matrix([statistics(folders.cases / name) for name in sorted(labels)])
    known = [labels[name] for name in sorted(labels)]
    benches = [(bool(label["motor_only"]), *label["kind"][1:]) for label in known]
    bench = np.array([sorted(set(benches)).index(one) for one in benches])
    rng = np.random.default_rng(13)
    null = np.array([label["kind"][0] == "null" for label in known], dtype=float)
    rubbing = np.array([any(e["id"].startswith(FRICTION) for e in label["effects"]) for label in known], dtype=float)
    assert p_value(features, null, rng) > LEVEL
    assert p_value(features, rubbing, rng, bench) > LEVEL
