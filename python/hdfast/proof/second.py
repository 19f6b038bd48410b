"""The second round: what an undecided answer asks for is recorded, and the tool answers again.

Beside it stands an answer with a motion at random instead, as long and within the same limits.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hdfast import files
from hdfast.proof import making, seal
from hdfast.proof.folders import Folders
from hdfast.proof.generator.recipe import Recipe
from hdfast.proof.score import Case, second
from hdfast.proof.tool import answer_all, read_answers, unanswered

MOTIONS = ("asked", "drawn")
PATIENCE = 2.0


def tool_name(name: str, motion: str) -> str:
    """Of a tool's answers with a further recording of a kind of motion."""
    return f"{name}-{motion}"


def play(
    folders: Folders, name: str, recipes: Mapping[str, Recipe], workers: int, tool: Sequence[str], limit: float,
    step: Callable[[str, int, int], None],
) -> list[str]:  # fmt: skip
    """Record what a tool asks for, let it answer again, and return the cases; what is there already is kept.

    Args:
        folders: of a set that the tool has answered.
        name: of the tool.
        recipes: of the cases, by name.
        workers: processes at the same time.
        tool: command with the places {campaign} and {out}.
        limit: wall time per case [s]; of a second round, whose motions may be several times as long, twice that.
        step: told the part, and how many of how many cases are done.

    Raises:
        SealError: a case cannot be made again as it was sealed, or the second answers were opened before.
    """
    experiments = _experiments(folders, name)
    names = sorted(experiments)
    given = {tool_name(name, motion): folders.further(motion) for motion in MOTIONS}
    for own in given:
        seal.still_closed(folders.sealed, own, unanswered(names, folders.answers(own)))
    there = {one for one in experiments if all((folders.further(motion) / one).exists() for motion in MOTIONS)}
    left = [(folders, one, recipes[one], experiments[one]) for one in sorted(experiments.keys() - there)]
    for motion in MOTIONS:
        files.prepare(folders.further(motion))
    for done in making.in_processes(workers, _record, left):
        step("further recordings", len(there) + done, len(experiments))
    for own, cases in given.items():
        part = partial(step, f"answers, motion {cases.name}")
        answer_all(cases, names, folders.answers(own), workers, tool, PATIENCE * limit, part)
    return names


def _experiments(folders: Folders, name: str) -> dict[str, Any]:
    """The motions that undecided answers ask for, of those that can be run, by case."""
    from hdfast.proof.generator.further import runnable

    answers = read_answers(folders.cases, folders.answers(name))
    asked = {case: one.verdict["next_experiment"] for case, one in answers.items() if one.kind == "undecided"}
    return {case: experiment for case, experiment in asked.items() if runnable(experiment)}


def _record(folders: Folders, name: str, recipe: Recipe, experiment: Mapping[str, Any]) -> None:
    """Both further recordings of one case.

    Raises:
        SealError: the case comes out as another one than was sealed.
    """
    from hdfast.proof.generator import further

    sealed, again = folders.cases / name, folders.sealed / "again" / name
    shutil.rmtree(again, ignore_errors=True)
    built = making.built_from(recipe, again / "case")
    if seal.checksums(again / "case") != seal.checksums(sealed):
        raise seal.SealError(f"{sealed}: is made otherwise by this version; it records nothing further of it")
    for number, motion in enumerate(MOTIONS):
        rng = np.random.default_rng([recipe.seed, 2, number])
        move = further.asked(experiment) if motion == "asked" else further.drawn(experiment, rng)
        further.add(sealed, again / motion, built, move, rng)
        _replace(again / motion, folders.further(motion) / name)
    shutil.rmtree(again)


def _replace(made: Path, target: Path) -> None:
    shutil.rmtree(target, ignore_errors=True)
    made.rename(target)


def told(first: Sequence[Case], rounds: Mapping[str, Sequence[Case]]) -> dict[str, Any]:
    """Scores and answers of the second round, as `proof.json` holds them."""
    before = {case.name: case for case in first}
    scores = second.scores(rounds["asked"], rounds["drawn"])
    pairs = zip(rounds["asked"], rounds["drawn"], strict=True)
    return {
        "scores": [one.to_dict() for one in scores],
        "second": [second.line(before[asked.name], asked, drawn) for asked, drawn in pairs],
    }
