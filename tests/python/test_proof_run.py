from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

import answers as made
import pytest
from hdfast import files
from hdfast.cli import main
from hdfast.errors import InputError, MissingPackageError
from hdfast.proof import making, run, seal, tool
from hdfast.proof.folders import Folders
from hdfast.proof.generator import case
from hdfast.proof.generator.recipe import Recipe
from hdfast.proof.rivals.table import Contender
from hdfast.report import proof_page
from processes import interruptible

TOOL = """
import json, pathlib, sys, time
campaign, out = map(pathlib.Path, sys.argv[1:])
seen = sorted(str(p.relative_to(campaign.parents[1])) for p in campaign.parents[1].rglob("*") if p.is_file())
name = campaign.read_text().split()[-1]
if name == "crash":
    sys.stderr.write("no such luck")
    raise SystemExit(3)
if name == "sleep":
    time.sleep(60)
out.mkdir()
verdict = json.loads(pathlib.Path(__file__).with_name("verdicts.json").read_text())[name]
(out / "verdict.json").write_text(json.dumps(verdict))
(out / "seen.json").write_text(json.dumps(seen))
"""
LABELS = {
    "a1": made.label("null"),
    "b2": made.label("single", ["backlash"], strength=8.0),
    "c3": made.label("single", ["hysteresis"]),
    "d4": made.label("null") | {"instead_of": "visibility 0.50"},
}
ROLES = {"a1": "quiet", "b2": "named", "c3": "quiet", "d4": "crash"}
LATE, SOON = ROLES | {"c3": "sleep"}, 1.5


@pytest.fixture
def folders(tmp_path):
    return prepare(tmp_path)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A whole run: its folders and what it returned."""
    folders = prepare(tmp_path_factory.mktemp("finished"), LATE)
    return folders, judge(folders, [Contender("other", "the same again", command(folders), rival=True)], SOON)


def prepare(tmp_path, roles=ROLES):
    made_set = Folders(tmp_path / "set")
    for name, role in roles.items():
        (made_set.cases / name).mkdir(parents=True)
        (made_set.cases / name / "campaign.toml").write_text(f"# {role}\n")
    seal.close(made_set.cases, made_set.sealed, made_set.seal, LABELS)
    verdicts = {"quiet": made.verdict("no_evidence"), "named": made.verdict("found", ["backlash"])}
    (tmp_path / "verdicts.json").write_text(json.dumps(verdicts))
    (tmp_path / "tool.py").write_text(TOOL)
    return made_set


def judge(folders, others=(), limit=3.0, **more):
    return run.judge(folders, 4, "diagnose", command(folders), limit, lambda *_: None, others, **more)


def command(folders):
    return (sys.executable, str(folders.root.parent / "tool.py"), "{campaign}", "{out}")


def test_exact_outcomes_of_a_whole_run(finished):
    _, proof = finished
    outcomes = {c["case"]: (c["answer"], c["outcome"]) for c in proof["cases"]}
    assert outcomes == {
        "a1": ("no_evidence", "right"),
        "b2": ("found", "right"),
        "c3": ("late", "wrong"),
        "d4": ("crashed", "wrong"),
    }
    assert {f["failure"] for f in proof["failures"]} == {"time-out", "crash"}
    assert "no such luck" in next(f["detail"] for f in proof["failures"] if f["case"] == "d4")


def test_exact_late_beside_others_is_tried_again_alone(tmp_path):
    """A case that is late only the first time: the limit is for the whole machine, and the page says how often."""
    folders = prepare(tmp_path, LATE)
    (folders.root.parent / "tool.py").write_text(
        TOOL.replace('if name == "sleep":', 'first = pathlib.Path(__file__).with_name("first")\n'
                     'if name == "sleep" and not first.exists():\n    first.touch()')
    )  # fmt: skip
    proof = judge(folders, limit=SOON)
    outcome = json.loads((folders.answers("diagnose") / "c3" / tool.OUTCOME).read_text())
    assert (outcome["fault"], outcome["again"]) == ("crashed", True)
    assert "1 of the 4 answers were late beside other cases" in " ".join(proof["limitations"])


def test_exact_a_late_case_is_not_tried_beside_others_again_after_an_interruption(tmp_path, monkeypatch):
    """It goes to the lone pass, and its answer is one given again."""
    (tmp_path / "cases" / "c3").mkdir(parents=True)
    ends = [(tool.LATE, ""), KeyboardInterrupt(), ("crashed", "")]

    def end(*_):
        found = ends.pop(0)
        if isinstance(found, BaseException):
            raise found
        return found

    monkeypatch.setattr(tool, "_run", end)
    given = (tmp_path / "cases", ["c3"], tmp_path / "answers", 2, ["any"], 1.0, lambda *_: None)
    with pytest.raises(KeyboardInterrupt):
        tool.answer_all(*given)
    assert tool.has_begun(["c3"], tmp_path / "answers")
    tool.answer_all(*given)
    assert json.loads((tmp_path / "answers" / "c3" / tool.OUTCOME).read_text())["again"] is True
    assert tool.given_again(tmp_path / "answers") == 1
    assert [path.name for path in (tmp_path / "answers").iterdir()] == ["c3"]


@pytest.mark.parametrize("prove", [run.prove, run.prove_real])
def test_exact_a_tool_that_is_not_there_is_told_before_cases_are_made(tmp_path, prove):
    made_from = {"cases": 2} if prove is run.prove else {"campaigns": [tmp_path / "campaign.toml"]}
    with pytest.raises(InputError, match="'no-such-tool' cannot be started"):
        prove(tmp_path / "set", **made_from, seed=1, workers=1, step=lambda *_: None, tool=["no-such-tool", "{out}"])
    assert not (tmp_path / "set").exists()


def test_exact_a_tool_is_started_in_another_folder(tmp_path, monkeypatch):
    program = tmp_path / "mytool"
    program.touch(0o755)
    monkeypatch.chdir(tmp_path)
    assert tool.startable(["./mytool", "{out}"]) == (str(program), "{out}")


def test_exact_a_tool_that_is_no_program_is_told(folders):
    program = folders.root / "mytool"
    program.touch(0o755)
    with pytest.raises(InputError, match="mytool' cannot be started: "):
        run.judge(folders, 4, "diagnose", [str(program)], 3.0, lambda *_: None)


def test_exact_a_brace_in_a_command_is_a_brace(folders):
    own = [sys.executable, "-c", "import sys; sys.exit(sys.argv[1])", "{{campaign}} {x}"]
    tool.answer(folders.cases / "a1", folders.answers("own") / "a1", own, 20.0, threading.Event())
    detail = json.loads((folders.answers("own") / "a1" / tool.OUTCOME).read_text())["detail"]
    assert re.search(r"\{/.*campaign\.toml\} \{x\}$", detail)


@pytest.mark.parametrize("prove", [run.prove, run.prove_real])
def test_exact_a_folder_that_another_run_is_at_work_in_is_left_alone(tmp_path, prove):
    made_from = {"cases": 2} if prove is run.prove else {"campaigns": [tmp_path / "campaign.toml"]}
    root = tmp_path / "set"
    with files.alone_in(root), pytest.raises(InputError, match="another run is at work there"):
        prove(root, **made_from, seed=1, workers=1, step=lambda *_: None)
    with files.alone_in(root):
        assert not list(root.iterdir())


def test_exact_a_file_system_without_locks_is_worked_on(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EBADF, "Bad file descriptor")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with files.alone_in(tmp_path / "set") as path:
        assert path == tmp_path / "set"


def test_exact_tools_side_by_side_share_the_threads(folders, monkeypatch):
    monkeypatch.setenv("HDFAST_NUM_THREADS", "5")
    told = [sys.executable, "-c", "import os, sys; sys.exit('threads ' + os.environ['HDFAST_NUM_THREADS'])"]
    for side_by_side, threads in ((1, 5), (2, 2), (8, 1)):
        out = folders.answers("own") / "a1"
        tool.answer(folders.cases / "a1", out, told, 20.0, threading.Event(), side_by_side)
        assert json.loads((out / tool.OUTCOME).read_text())["detail"] == f"exit code 1: threads {threads}"


@pytest.mark.parametrize(("word", "fault"), [("data_rejected", ""), ("no_evidence", "crashed"), (None, "crashed")])
def test_exact_exit_code_1_is_an_answer_that_rejects_the_data_and_else_a_crash(word, fault, folders):
    """As of a Python tool that fails after it has written its verdict."""
    written = "" if word is None else json.dumps({"verdict": word})
    code = "import pathlib, sys; out = pathlib.Path(sys.argv[1]); out.mkdir(); "
    code += f"(out / 'verdict.json').write_text({written!r}); sys.exit('in vain')"
    out = folders.answers("own") / "a1"
    tool.answer(folders.cases / "a1", out, [sys.executable, "-c", code, "{out}"], 20.0, threading.Event())
    assert json.loads((out / tool.OUTCOME).read_text())["fault"] == fault


@pytest.mark.parametrize("writes", ["out.touch()", "out.mkdir(); (out / 'verdict.json').symlink_to('nowhere')"])
def test_exact_a_folder_that_cannot_be_copied_ends_its_case_alone(writes, folders, tmp_path):
    (tmp_path / "tool.py").write_text(f"import pathlib, sys\nout = pathlib.Path(sys.argv[2])\n{writes}\n")
    assert {case["answer"] for case in judge(folders)["cases"]} == {"missing"}


def test_exact_the_tool_sees_nothing_but_its_case(finished):
    folders, _ = finished
    assert json.loads((folders.answers("diagnose") / "b2" / "seen.json").read_text()) == ["case/campaign.toml"]


def test_exact_others_stand_beside_the_tool_with_its_lead(finished):
    folders, proof = finished
    own, other = proof["compared"]
    assert (own["tool"], other["tool"]) == ("diagnose", "other")
    assert own["scores"] == other["scores"]
    assert other["ahead"]["value"] == 0.0
    assert proof["scores"][-1]["passed"] is False
    assert "the same again" in (folders.root / run.PAGE).read_text()
    assert "the same again" in (folders.root / run.TABLE).read_text()


def test_exact_others_are_compared_on_the_cases_that_they_share(folders):
    proof = judge(folders, [Contender("other", "the same again", command(folders), rival=True)], shared=2)
    own, other = proof["compared"]
    assert sorted(path.name for path in folders.answers("other").iterdir()) == ["a1", "b2"]
    assert own["scores"] == other["scores"]
    assert other["ahead"]["count"] == proof["shared"] == 2
    assert len(proof["cases"]) == 4
    assert "the same 2 of 4 cases" in (folders.root / run.TABLE).read_text()


def test_exact_page_and_table_are_rebuilt_from_the_json(finished):
    folders, _ = finished
    proof = json.loads((folders.root / run.PROOF).read_text())
    assert proof_page.page(proof) == (folders.root / run.PAGE).read_text()
    assert proof_page.markdown(proof) == (folders.root / run.TABLE).read_text()
    assert "MISSED" in proof_page.markdown(proof)
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", (folders.root / run.PAGE).read_text())


def test_exact_a_killed_run_goes_on_with_the_cases_that_are_left(folders):
    first = judge(folders)
    answers = folders.answers("diagnose")
    kept = (answers / "b2" / tool.OUTCOME).read_text()
    for path in (answers / "a1").iterdir():
        path.unlink()
    (folders.sealed / seal.OPENED).unlink()
    again = judge(folders)
    assert (answers / "b2" / tool.OUTCOME).read_text() == kept
    assert [c["outcome"] for c in again["cases"]] == [c["outcome"] for c in first["cases"]]


@pytest.mark.parametrize("changed", ["limit", "build"])
def test_exact_another_tool_does_not_go_on(folders, monkeypatch, changed):
    judge(folders)
    (folders.answers("diagnose") / "a1" / tool.OUTCOME).unlink()
    (folders.sealed / seal.OPENED).unlink()
    if changed == "build":
        monkeypatch.setattr(tool, "fingerprint", lambda: "another")
    with pytest.raises(seal.SealError, match="of another build, command or time limit"):
        judge(folders, limit=4.0 if changed == "limit" else 3.0)
    assert not (folders.answers("diagnose") / "a1" / tool.OUTCOME).exists()


def test_exact_the_same_build_answers_further_cases_of_an_opened_set(folders, monkeypatch):
    others = [Contender("other", "the same again", command(folders), rival=True)]
    judge(folders, others, shared=2)
    with monkeypatch.context() as patch:
        patch.setattr(tool, "fingerprint", lambda: "another")
        with pytest.raises(seal.SealError, match="of another build"):
            judge(folders, others)
    proof = judge(folders, others)
    assert proof["shared"] == 4
    assert "Answered after other cases had been opened, by the same build: 2 of other." in proof["limitations"]
    assert proof["limitations"] == judge(folders, others)["limitations"]


def test_exact_an_opened_case_takes_no_further_answer(folders):
    judge(folders)
    shutil.rmtree(folders.answers("diagnose") / "b2")
    with pytest.raises(seal.SealError, match="to b2; they take no further ones"):
        judge(folders)
    assert not (folders.answers("diagnose") / "b2").exists()


def test_exact_changed_data_stops_the_run(folders):
    (folders.cases / "a1" / "campaign.toml").write_text("# named\n")
    with pytest.raises(seal.SealError):
        judge(folders)


def test_exact_another_set_in_the_folder_is_refused(folders):
    (folders.sealed / seal.PLAN).write_text('{"cases": 4, "seed": 1}')
    with pytest.raises(seal.SealError, match="another set"):
        making.make(folders, 4, 2, 1, lambda *_: None)


def test_exact_cases_of_another_set_are_not_sealed_along(tmp_path):
    (tmp_path / "cases" / "0a1b2c3d").mkdir(parents=True)
    with pytest.raises(seal.SealError, match="not of a set of cases"):
        making.make(Folders(tmp_path), 4, 2, 1, lambda *_: None)
    assert not (tmp_path / "sealed").exists()


def test_exact_what_was_asked_for_in_vain_may_be_asked_for_otherwise(tmp_path, monkeypatch):
    """Without numba nothing is made, and the next --cases is not refused as another set."""

    def missing(*_):
        raise MissingPackageError("numba is not installed")

    monkeypatch.setattr(making, "recipes", missing)
    for cases in (300, 20):
        with pytest.raises(MissingPackageError):
            making.make(Folders(tmp_path), cases, 1, 1, lambda *_: None)


def test_exact_the_number_of_real_cases_is_not_asked_for(tmp_path, capsys):
    campaign = tmp_path / "campaign.toml"
    campaign.touch()
    assert main(["proof", "--real", str(campaign), "--cases", "20", "--out", str(tmp_path / "out")]) == 2
    assert "--cases = 20 is not for --real" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_exact_a_recipe_that_no_draw_meets_is_told(finished, tmp_path, monkeypatch):
    """The effects of an absorbed case stand on an ordinary bench instead, or the seed makes no set."""
    met = [[False, True], [False, False]]

    def build(recipe, folder):
        if not met[0].pop(0):
            raise case.UnfitError("visibility 0.50")
        folder.mkdir()
        return case.Built({"kind": list(recipe.kinds)}, None, None)

    monkeypatch.setattr(case, "build", build)
    folders, recipe = Folders(tmp_path), Recipe(("single", "absorbed"), {"hysteresis": 3.0}, 1)
    folders.cases.mkdir()
    (folders.sealed / making.PARTS).mkdir(parents=True)
    making._make_one(folders, "a1", recipe)
    label = json.loads((folders.sealed / making.PARTS / "a1.json").read_text())
    assert label == {"kind": ["single"], "instead_of": "visibility 0.50"}
    del met[0]
    with pytest.raises(InputError, match="give another --seed"):
        making._make_one(folders, "a1", recipe)
    sentence = "No draw met the recipe of 1 of the 4 cases: their effects are on an ordinary bench."
    assert sentence in finished[1]["limitations"]


SLEEPER = "import os, pathlib, sys, time; pathlib.Path(sys.argv[2]).write_text(str(os.getpid())); time.sleep(60)"
ANSWER = """import pathlib, sys
from hdfast.proof.tool import answer_all

root = pathlib.Path(sys.argv[1])
tool = [sys.executable, "-c", sys.argv[2], "{campaign}", str(root / "pid")]
answer_all(root / "cases", ["a1", "b2", "c3"], root / "answers", 1, tool, 60.0, lambda *_: None)
"""


def test_exact_ctrl_c_ends_the_tools_and_leaves_their_cases_open(tmp_path):
    for name in ("a1", "b2", "c3"):
        (tmp_path / "cases" / name).mkdir(parents=True)
        (tmp_path / "cases" / name / "campaign.toml").touch()
    process = interruptible([sys.executable, "-c", ANSWER, str(tmp_path), SLEEPER], stderr=subprocess.PIPE)
    deadline = time.monotonic() + 60
    while not (tmp_path / "pid").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)
    assert not list(tmp_path.rglob(tool.OUTCOME))
