"""The whole benchmark: make, seal, answer, hash, open, score, publish."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from hdfast import catalogue, files
from hdfast.proof import making, seal, second
from hdfast.proof.bridge import cases as bridge
from hdfast.proof.folders import Folders
from hdfast.proof.generator.recipe import Recipe
from hdfast.proof.making import MOST_CASES
from hdfast.proof.rivals.table import Contender
from hdfast.proof.score import ScoreCard, comparison, score
from hdfast.proof.tool import (
    DIAGNOSE,
    LIMIT,
    answer_all,
    given_again,
    has_begun,
    read_answers,
    same_tool,
    startable,
    unanswered,
)

PROOF, TABLE, PAGE, ANSWERS, TOOL = "proof.json", "RESULTS.md", "index.html", "answers.json", "tool.json"
OWN = "diagnose"
LIMITATIONS = (
    "The generator has other inertias, another integrator and other laws than the engine, but it stands in the same "
    "repository as the diagnosis.",
    "Every case is synthetic; nothing here speaks about a real rig.",
    "There is no third simulator and there are no semi-synthetic cases in this set.",
    "Of the strategies to compare with, localisation in a clean regime by F-test, random-walk torques with the feature "
    "of highest correlation, and a human expert are missing.",
)
NOT_ASKED_BACK = "Experiments that were asked for are counted, not simulated (a second round was not played)."
Step = Callable[[str, int, int], None]


def prove(
    root: str | Path, *, cases: int, seed: int, workers: int, step: Step, name: str = OWN,
    tool: Sequence[str] = DIAGNOSE, limit: float = LIMIT, others: Sequence[Contender] = (),
    shared: int = MOST_CASES, second_round: bool = False,
) -> dict[str, Any]:  # fmt: skip
    """Run the benchmark in a folder, from wherever it stopped, and return what `proof.json` holds.

    Args:
        root: folder of the set.
        cases: 1 to 300.
        seed: of the set.
        workers: processes at the same time.
        step: told the part, and how many of how many cases are done.
        name: of the tool, for its folder of answers.
        tool: command with the places {campaign} and {out}.
        limit: wall time per case [s].
        others: who else answers.
        shared: cases that the others answer, the first by name.
        second_round: whether what undecided answers ask for is recorded, and the tool answers again.

    Raises:
        InputError: the tool cannot be started, or another run is at work in the folder.
        SealError: data, labels, salt or answers are not those that were sealed.
        MissingPackageError: numba is not installed.
    """
    tool = startable(tool)
    with files.alone_in(root) as path:
        folders = Folders(path)
        making.make(folders, cases, seed, workers, lambda done, total: step("cases", done, total))
        recipes = making.recipes(cases, seed) if second_round else None
        return judge(folders, workers, name, tool, limit, step, others, shared, recipes=recipes)


def prove_real(
    root: str | Path, campaigns: Sequence[Path], *, seed: int, workers: int, step: Step, name: str = OWN,
    tool: Sequence[str] = DIAGNOSE, limit: float = LIMIT, others: Sequence[Contender] = (),
    shared: int = MOST_CASES,
) -> dict[str, Any]:  # fmt: skip
    """As `prove`, on recordings of real machines into which effects are put.

    Args:
        root: folder of the set.
        campaigns: campaign files, each with something held out.
        seed, workers, step, name, tool, limit, others, shared: as in `prove`.

    Raises:
        InputError: a campaign cannot be used, the tool cannot be started, or another run is at work in the folder.
        SealError: data, labels, salt or answers are not those that were sealed.
    """
    tool = startable(tool)
    with files.alone_in(root) as path:
        folders = Folders(path)
        bridge.make(folders, campaigns, seed, lambda done, total: step("machines", done, total))
        return judge(folders, workers, name, tool, limit, step, others, shared, bridge.LIMITATIONS)


def judge(
    folders: Folders, workers: int, name: str, tool: Sequence[str], limit: float, step: Step,
    others: Sequence[Contender] = (), shared: int = MOST_CASES, limitations: Sequence[str] = LIMITATIONS,
    recipes: Mapping[str, Recipe] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Let everybody answer a sealed set, open it for these answers, score them and publish.

    With the recipes of its cases the tool answers again what it was undecided about.
    """
    tools = {name: tool} | {one.name: one.command for one in others}
    names = {each: folders.names if each == name else folders.names[:shared] for each in tools}
    seal.verify_data(folders.cases, folders.seal)
    for each, command in tools.items():
        if left := unanswered(names[each], folders.answers(each)):
            seal.still_closed(folders.sealed, each, left)
            note = files.prepare(folders.answers(each).parent) / f"{each}-{TOOL}"
            same_tool(note, command, limit, begun=has_begun(names[each], folders.answers(each)))
    for each, command in tools.items():
        part = "answers" if each == name else each
        answer_all(folders.cases, names[each], folders.answers(each), workers, command, limit, partial(step, part))
    again = {} if recipes is None else _second_round(folders, name, recipes, workers, tool, limit, step)
    seal.verify_data(folders.cases, folders.seal)
    for each in (*tools, *again):
        answers = folders.answers(each)
        files.write_json(answers.parent / f"{each}-{ANSWERS}", seal.checksums(answers))
    cards = {each: _opened(folders, each, names[each]) for each in tools}
    proof = {"tool": name, "machine": machine(), **_set_facts(folders, name, limitations), **cards[name].to_dict()}
    proof |= {"compared": [], "shared": 0}
    if others:
        beside = _opened(folders, name, folders.names[:shared])
        proof |= _compared(proof, beside, [(one, cards[one.name]) for one in others])
        proof["limitations"] += _later(folders, [one.name for one in others])
    proof |= _asked_back(folders, proof, cards[name], again)
    publish(folders.root, proof)
    return proof


def _second_round(
    folders: Folders, name: str, recipes: Mapping[str, Recipe], workers: int, tool: Sequence[str], limit: float,
    step: Step,
) -> dict[str, list[str]]:  # fmt: skip
    """The tool's answers with one more recording, by the names that they are kept under, and their cases.

    Raises:
        SealError: the first answers are of another build, command or limit, or the second were opened before.
    """
    same_tool(folders.answers(name).parent / f"{name}-{TOOL}", tool, limit, begun=True)
    names = second.play(folders, name, recipes, workers, tool, limit, step)
    return dict.fromkeys((second.tool_name(name, motion) for motion in second.MOTIONS), names)


def _asked_back(
    folders: Folders, proof: dict[str, Any], own: ScoreCard, again: Mapping[str, list[str]]
) -> dict[str, Any]:  # fmt: skip
    """What the second round adds to a proof."""
    if not again:
        return {"second": [], "limitations": [*proof["limitations"], NOT_ASKED_BACK]}
    cards = [_opened(folders, each, names) for each, names in again.items()]
    found = second.told(own.cases, dict(zip(second.MOTIONS, (card.cases for card in cards), strict=True)))
    unavailable = {key: reason for key, reason in proof["unavailable"].items() if key != "experiment"}
    return {**found, "scores": [*proof["scores"], *found["scores"]], "unavailable": unavailable}


def _opened(folders: Folders, name: str, cases: Sequence[str]) -> ScoreCard:
    labels = seal.open_for(folders.sealed, folders.seal, name, folders.answers(name))
    return score({case: labels[case] for case in cases}, read_answers(folders.cases, folders.answers(name)))


def _later(folders: Folders, others: Sequence[str]) -> list[str]:
    """Who answered cases when others had been opened already."""
    late = {name: many for name in others if (many := seal.opened_later(folders.sealed, name))}
    listed = ", ".join(f"{many} of {name}" for name, many in late.items())
    return [f"Answered after other cases had been opened, by the same build: {listed}."] if late else []


def _compared(proof: dict[str, Any], own: ScoreCard, others: Sequence[tuple[Contender, ScoreCard]]) -> dict[str, Any]:
    """The others beside the own tool, all on the same cases, and the mark that every rival is beaten."""
    leads = {one.name: comparison.ahead(own, card) for one, card in others}
    lines = [{"tool": proof["tool"], "text": "", "rival": False, **comparison.line(own, None)}]
    lines += [
        {"tool": one.name, "text": one.text, "rival": one.rival, **comparison.line(card, leads[one.name])}
        for one, card in others
    ]
    rivals = {one.name: leads[one.name] for one, _ in others if one.rival}
    more = [comparison.beaten(rivals).to_dict()] if rivals else []
    return {"scores": [*proof["scores"], *more], "compared": lines, "shared": len(own.cases)}


def machine() -> dict[str, Any]:
    """What the run was made on and with."""
    return {
        "version": catalogue.build_info()["version"],
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
        "cores": os.cpu_count(),
    }


def _set_facts(folders: Folders, name: str, limitations: Sequence[str]) -> dict[str, Any]:
    labels = seal.verify_labels(folders.sealed, folders.seal)
    replaced = sum(making.INSTEAD_OF in label for label in labels.values())
    again = given_again(folders.answers(name))
    of = f"of the {len(labels)}"
    more = {
        f"No draw met the recipe of {replaced} {of} cases: their effects are on an ordinary bench.": replaced,
        f"{again} {of} answers were late beside other cases and were given again, alone on the machine.": again,
    }
    told = [sentence for sentence, many in more.items() if many]
    return {"seal": files.sha256(folders.seal), "limitations": [*limitations, *told]}


def publish(root: Path, proof: dict[str, Any]) -> None:
    """Write JSON, table and page; the page is a function of the JSON alone."""
    from hdfast.report import proof_page

    files.write_json(root / PROOF, proof)
    files.write_text(root / TABLE, proof_page.markdown(proof))
    files.write_text(root / PAGE, proof_page.page(proof))
