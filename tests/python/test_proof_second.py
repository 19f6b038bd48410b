"""The second round: what is asked for is recorded, and answered again."""

from __future__ import annotations

import json
import shutil
import sys

import answers as made
import pytest
from hdfast.proof import making, run, seal, tool
from hdfast.proof.folders import Folders
from hdfast.proof.generator import further
from hdfast.proof.generator.recipe import Recipe
from hdfast.proof.score import Answer, second
from hdfast.proof.score.judge import judge
from hdfast.report import proof_page

TOOL = """
import json, pathlib, sys
campaign, out = map(pathlib.Path, sys.argv[1:])
verdicts = json.loads(pathlib.Path(__file__).with_name("verdicts.json").read_text())
out.mkdir()
(out / "verdict.json").write_text(json.dumps(verdicts[campaign.read_text().split()[-1]]))
"""
EXPERIMENT = {
    "manoeuvre": {"start_angle_rad": 0.0, "segments": [{"speed_rad_s": 1.0, "ramp_s": 0.1, "hold_s": 0.2}]},
    "limits": {"speed_rad_s": 1.0, "low_angle_rad": -1.0, "high_angle_rad": 1.0},
}
ASKS = made.verdict("undecided", ["ratio_error"], 0.5, ["clock_skew"]) | {"next_experiment": EXPERIMENT}
VERDICTS = {
    "open": ASKS,
    "vague": ASKS | {"next_experiment": {"segments": []}},
    "clear": made.verdict("no_evidence"),
    "asked": made.verdict("sensor", ["ratio_error"], 0.95),
    "drawn": ASKS,
}
LABELS = {
    "a1": made.label("undecidable", ["ratio_error"]),
    "b2": made.label("null"),
    "c3": made.label("single", ["ratio_error"]),
}
RECIPES = {name: Recipe(("single",), {}, number) for number, name in enumerate(LABELS)}


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """A sealed set of cases that are made again as they were, and recordings that say which motion they hold."""
    folders = Folders(tmp_path / "set")
    for name, role in zip(LABELS, ("open", "clear", "vague"), strict=True):
        (folders.cases / name).mkdir(parents=True)
        (folders.cases / name / "campaign.toml").write_text(f"# {role}\n")
    seal.close(folders.cases, folders.sealed, folders.seal, LABELS)
    (tmp_path / "verdicts.json").write_text(json.dumps(VERDICTS))
    (tmp_path / "tool.py").write_text(TOOL)

    def in_turn(_, task, arguments):
        for done, each in enumerate(arguments, 1):
            task(*each)
            yield done

    def add(case, folder, built, motion, rng):
        shutil.copytree(case, folder)
        (folder / "campaign.toml").write_text(f"# {motion}\n")

    monkeypatch.setattr(making, "in_processes", in_turn)
    monkeypatch.setattr(
        making, "built_from", lambda recipe, folder: shutil.copytree(folders.cases / list(LABELS)[recipe.seed], folder)
    )
    monkeypatch.setattr(further, "asked", lambda _: "asked")
    monkeypatch.setattr(further, "drawn", lambda *_: "drawn")
    monkeypatch.setattr(further, "add", add)
    return folders


def judged(folders, recipes=RECIPES):
    command = (sys.executable, str(folders.root.parent / "tool.py"), "{campaign}", "{out}")
    return run.judge(folders, 2, "mine", command, 30.0, lambda *_: None, recipes=recipes)


def test_exact_what_is_asked_for_is_answered_again(folders):
    proof = judged(folders)
    assert proof["second"] == [
        {
            "case": "a1",
            "truth": ["ratio_error"],
            "first": ["ratio_error"],
            "asked": {"answer": "sensor", "named": ["ratio_error"], "outcome": "right"},
            "drawn": {"answer": "undecided", "named": [], "outcome": "missed"},
        }
    ]
    scores = {one["name"]: one for one in proof["scores"]}
    assert scores["second round: right"]["value"] == 1.0
    assert scores["second round, motion at random: right"]["value"] == 0.0
    assert scores["experiment"]["value"] == pytest.approx(19.0)
    assert scores["experiment"]["passed"]
    assert "experiment" not in proof["unavailable"]
    assert run.NOT_ASKED_BACK not in proof["limitations"]
    assert "right: sensor ratio_error" in (folders.root / run.TABLE).read_text()
    assert "Second round" in proof_page.page(proof)
    assert judged(folders) == proof


def test_exact_a_case_that_is_made_otherwise_is_not_asked_further(folders, monkeypatch):
    def otherwise(recipe, folder):
        folder.mkdir(parents=True)
        (folder / "campaign.toml").write_text("# another\n")

    monkeypatch.setattr(making, "built_from", otherwise)
    with pytest.raises(seal.SealError, match="is made otherwise by this version"):
        judged(folders)


def test_exact_a_second_round_is_that_of_the_build_that_answered_first(folders, monkeypatch):
    assert run.NOT_ASKED_BACK in judged(folders, None)["limitations"]
    monkeypatch.setattr(tool, "fingerprint", lambda: "another")
    with pytest.raises(seal.SealError, match="of another build"):
        judged(folders)


@pytest.mark.parametrize(
    ("word", "ids", "stated", "expected"),
    [
        ("found", ["backlash"], {"backlash": 0.9}, 9.0),
        ("found", ["backlash"], {"hysteresis": 0.9}, 0.01 / 0.99),
        ("found", ["backlash", "hysteresis"], {"backlash": 0.9, "hysteresis": 0.5}, 1.0),
        ("undecided", [], {"backlash": 0.75}, 1.0 / 3.0),
        ("no_evidence", [], {}, 99.0),
        ("found", [], {"backlash": 0.75}, 0.01 / 0.99),
        ("depends_on", [], {}, 0.01 / 0.99),
        ("crashed", [], {}, 0.01 / 0.99),
    ],
)
def test_exact_odds_of_the_truth_are_those_of_its_least_probable_effect(word, ids, stated, expected):
    said = made.verdict(word, stated)
    for entry in said["effects"]:
        entry["probability"] = stated[entry["effect"]]
    answer = Answer(word) if word == "crashed" else Answer("", said)
    assert second.odds(judge("x", made.label("set" if ids else "null", ids), answer)) == pytest.approx(expected)


def test_exact_undecided_is_no_decision():
    still = judge("x", made.label("null"), Answer("", made.verdict("undecided", ["backlash"])))
    silent = judge("x", made.label("null"), Answer("", made.verdict("no_evidence")))
    asked, _, drawn, *_ = second.scores([still], [silent])
    assert (asked.value, drawn.value) == (0.0, 1.0)
