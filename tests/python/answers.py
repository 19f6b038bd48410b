"""Hand-made labels and answers for the tests of the benchmark."""

from __future__ import annotations

import math

from hdfast.proof.generator.effects import EFFECTS, TWELVE
from hdfast.proof.score import Answer

WINDOW = [0.5, 2.0, "a.csv"]


def label(kind, ids=(), strength=3.0, **changes):
    effects = [
        {"id": i, "place": EFFECTS[i].place, "amplitude_over_mda": strength, "true_parameters": {"size": 2.0}}
        for i in ids
    ]
    filled = {
        "kind": [kind], "effects": effects, "closest_rival": {"id": "delay", "abs_cos": 0.3}, "rivals": [],
        "separable_place": True, "windows": [WINDOW], "orders": [2.0], "depends_on": ["load_phase"], "memory": "none",
        "nuisance": [], "baseline_true": {"B_m": 1e-3}, "oracle_heldout_nrmse": 0.01,
        "visibility": 0.5, "refit_nrmse_over_noise": 1.5,
    }  # fmt: skip
    return {**filled, **changes}


def verdict(word, effects=(), probability=0.9, rivals=(), **where):
    entries = [
        {
            "effect": i,
            "place": EFFECTS[i].place if i in EFFECTS else None,
            "probability": probability,
            "parameters": {"size": {"value": 2.0 * 1.05, "sigma": 0.1, "unit": ""}},
            "rivals": list(rivals),
            "evidence": {},
        }
        for i in effects
    ]
    spot = {"place": entries[0]["place"] if entries else None, "windows": [WINDOW], "orders": [2.0], **where}
    return {
        "verdict": word,
        "effects": entries,
        "where": spot,
        "fit": {
            "fit": {"baseline_nrmse": 0.1, "extended_nrmse": 0.02},
            "heldout": {"baseline_nrmse": 0.11, "extended_nrmse": 0.012, "noise_floor_nrmse": 0.01},
        },
        "masking": [{"parameter": "B_m", "baseline": 2e-3, "extended": 1.02e-3, "prior": 1e-3, "unit": "N m s/rad"}],
        "not_showable": [],
        "next_experiment": {"segments": []} if word == "undecided" else None,
        "seed": 0,
        "version": "0",
    }


def campaign():
    """Labels in the proportions of the first release, a tenth of its size."""
    labels = {f"null{k}": label("null") for k in range(10)}
    labels |= {f"one{k}": label("single", [i]) for k, i in enumerate(TWELVE)}
    labels |= {f"set{k}": label("set", ["hysteresis", "stribeck_friction"]) for k in range(3)}
    labels["sensor"] = label("sensor_only", ["clock_skew"])
    labels |= {f"law{k}": label("outside", ["outside_detent"]) for k in range(2)}
    labels |= {
        f"twin{k}": label("undecidable", ["ratio_error"], rivals=[{"id": "clock_skew", "abs_cos": 0.999}])
        for k in range(2)
    }
    return labels


def perfect(labels):
    answers = {}
    for name, entry in labels.items():
        kind, ids = entry["kind"][0], [e["id"] for e in entry["effects"]]
        if kind == "null":
            found = verdict("no_evidence")
        elif kind == "outside":
            found = verdict("depends_on", ["unknown"], memory="none", depends_on=["load_phase"])
        elif kind == "undecidable":
            found = verdict("undecided", ids, probability=0.5, rivals=[entry["rivals"][0]["id"]])
        else:
            found = verdict("sensor" if kind == "sensor_only" else "found", ids, probability=0.99)
        answers[name] = Answer("", found, seconds=30.0)
    return answers


def always(labels, word, effects=()):
    return {name: Answer("", verdict(word, effects), seconds=1.0) for name in labels}


def by_name(card):
    return {s.name: s for s in card.scores}


def missing(value):
    return value is None or math.isnan(value)
