from __future__ import annotations

import hashlib
import json
import shutil

import pytest
from hdfast.proof import seal

LABELS = {"ab12": {"effects": []}}


@pytest.fixture
def sealed(tmp_path):
    cases = tmp_path / "cases"
    (cases / "ab12").mkdir(parents=True)
    (cases / "ab12" / "campaign.toml").write_text("[drive]\nratio = 121\n")
    answers = tmp_path / "answers"
    answers.mkdir()
    (answers / "verdict.json").write_text("{}")
    seal.close(cases, tmp_path / "sealed", tmp_path / "seal.json", LABELS)
    return tmp_path


def open_(root):
    return seal.open_for(root / "sealed", root / "seal.json", "tool", root / "answers")


def same_plan(root, seed):
    seal.same_plan(root / "cases", root / "sealed", root / "seal.json", {"cases": 1, "seed": seed})


def test_against_hashlib_the_commitment(sealed):
    salt, labels = (sealed / "sealed" / "salt").read_bytes(), (sealed / "sealed" / "labels.json").read_bytes()
    assert json.loads((sealed / "seal.json").read_text())["labels"] == hashlib.sha256(salt + labels).hexdigest()
    assert "effects" not in (sealed / "seal.json").read_text()


def test_exact_untouched_set_opens_and_scores_again(sealed):
    seal.verify_data(sealed / "cases", sealed / "seal.json")
    assert open_(sealed) == LABELS == open_(sealed)


@pytest.mark.parametrize("name", ["salt", "labels.json"])
def test_exact_altered_secret_is_detected(sealed, name):
    path = sealed / "sealed" / name
    path.write_bytes(path.read_bytes() + b" ")
    with pytest.raises(seal.SealError, match="not those that were sealed"):
        open_(sealed)


def test_exact_a_set_without_its_labels_is_not_answered(sealed):
    shutil.rmtree(sealed / "sealed")
    with pytest.raises(seal.SealError, match="without its labels"):
        same_plan(sealed, 1)
    assert not (sealed / "sealed").exists()
    with pytest.raises(seal.SealError, match=r"labels\.json: not found"):
        open_(sealed)


@pytest.mark.parametrize("change", ["altered", "added", "removed"])
def test_exact_changed_data_is_detected(sealed, change):
    path = sealed / "cases" / "ab12" / "campaign.toml"
    if change == "altered":
        path.write_text("[drive]\nratio = 101\n")
    elif change == "added":
        path.with_name("hint.txt").write_text("coulomb_friction")
    else:
        path.unlink()
    with pytest.raises(seal.SealError, match="not as sealed"):
        seal.verify_data(sealed / "cases", sealed / "seal.json")


def test_exact_further_cases_are_opened_beside_those_that_were(sealed):
    for case in ("ab12", "cd34"):
        answer = sealed / "answers" / case / "verdict.json"
        answer.parent.mkdir()
        answer.write_text("{}")
        open_(sealed)
    assert seal.opened_later(sealed / "sealed", "tool") == 1
    seal.still_closed(sealed / "sealed", "tool", ["ef56"])
    with pytest.raises(seal.SealError, match="to cd34; they take no further"):
        seal.still_closed(sealed / "sealed", "tool", ["cd34", "ef56"])


@pytest.mark.parametrize("change", ["altered", "added", "removed"])
def test_exact_an_opened_case_keeps_its_answer(sealed, change):
    answer = sealed / "answers" / "ab12" / "verdict.json"
    answer.parent.mkdir()
    answer.write_text("{}")
    open_(sealed)
    if change == "altered":
        answer.write_text('{"verdict": "found"}')
    elif change == "added":
        answer.with_name("late.json").write_text("{}")
    else:
        answer.unlink()
    with pytest.raises(seal.SealError, match="for other answers"):
        open_(sealed)


def test_exact_a_kill_while_sealing_leaves_a_set_that_can_be_sealed(tmp_path, monkeypatch):
    """The public file comes last: as long as it is not there, nothing is committed to."""

    def killed(*_):
        raise KeyboardInterrupt

    cases = tmp_path / "cases"
    (cases / "ab12").mkdir(parents=True)
    (tmp_path / "answers").mkdir()
    with monkeypatch.context() as patch:
        patch.setattr(seal.files, "write_json", killed)
        with pytest.raises(KeyboardInterrupt):
            seal.close(cases, tmp_path / "sealed", tmp_path / "seal.json", LABELS)
    seal.close(cases, tmp_path / "sealed", tmp_path / "seal.json", LABELS)
    assert open_(tmp_path) == LABELS


def test_exact_a_plan_of_which_nothing_was_made_gives_way(tmp_path):
    same_plan(tmp_path, 1)
    same_plan(tmp_path, 2)
    (tmp_path / "cases" / "ab12").mkdir(parents=True)
    same_plan(tmp_path, 2)
    with pytest.raises(seal.SealError, match="another set"):
        same_plan(tmp_path, 1)


def test_exact_cases_of_no_plan_are_not_taken_over(tmp_path):
    (tmp_path / "cases" / "ab12").mkdir(parents=True)
    with pytest.raises(seal.SealError, match="not of a set of cases"):
        same_plan(tmp_path, 1)
    assert not (tmp_path / "sealed").exists()


@pytest.mark.parametrize("names", [(), ("ab12", "cd34")])
def test_exact_other_cases_than_the_labels_are_of_are_not_sealed(tmp_path, names):
    cases = tmp_path / "cases"
    cases.mkdir()
    for name in names:
        (cases / name).mkdir()
    with pytest.raises(seal.SealError, match="not the cases of this set"):
        seal.close(cases, tmp_path / "sealed", tmp_path / "seal.json", LABELS)
    assert not (tmp_path / "seal.json").exists()


def test_exact_a_set_is_sealed_once(sealed):
    with pytest.raises(seal.SealError, match="sealed already"):
        seal.close(sealed / "cases", sealed / "sealed", sealed / "seal.json", LABELS)
