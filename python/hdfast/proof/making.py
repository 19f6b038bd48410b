"""Make a set of cases in many processes; what was made before an interruption is kept."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing import get_context
from os import environ
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdfast import files
from hdfast.errors import InputError, require_package
from hdfast.proof import seal
from hdfast.proof.folders import Folders
from hdfast.proof.generator import VERSION
from hdfast.proof.generator.recipe import Bench, Recipe

if TYPE_CHECKING:
    from hdfast.proof.generator.case import Built

PARTS, INSTEAD_OF = "parts", "instead_of"
MOST_CASES = 300
LIBRARY_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def make(folders: Folders, count: int, seed: int, workers: int, step: Callable[[int, int], None]) -> None:
    """Make and seal a set of cases.

    Args:
        folders: where it goes.
        count: cases, 1 to 300.
        seed: of every draw.
        workers: processes.
        step: told after every case how many of how many are done.

    Raises:
        MissingPackageError: numba is not installed.
        SealError: the folder holds another set, or cases of none.
        InputError: a case cannot be made with this seed.
    """
    wanted = {"cases": count, "seed": seed, "version": VERSION}
    seal.same_plan(folders.cases, folders.sealed, folders.seal, wanted)
    if folders.seal.exists():
        return
    planned = recipes(count, seed)
    parts = folders.sealed / PARTS
    for folder in (folders.cases, parts):
        files.prepare(folder)
    made = {name for name in planned if (parts / f"{name}.json").exists() and (folders.cases / name).exists()}
    left = [(name, recipe) for name, recipe in planned.items() if name not in made]
    done = count - len(left)
    step(done, count)
    for finished in in_processes(workers, _make_one, [(folders, name, recipe) for name, recipe in left]):
        step(done + finished, count)
    labels = {name: json.loads((parts / f"{name}.json").read_text(encoding="utf-8")) for name in planned}
    seal.close(folders.cases, folders.sealed, folders.seal, labels)
    shutil.rmtree(parts)


def in_processes(workers: int, task: Callable[..., None], arguments: Sequence[tuple[Any, ...]]) -> Iterator[int]:
    """Run a task in processes of one thread each; tells how many are done after every one."""
    with single_threaded_libraries(), ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        try:
            for done, future in enumerate(as_completed([pool.submit(task, *each) for each in arguments]), 1):
                future.result()
                yield done
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def recipes(count: int, seed: int) -> dict[str, Recipe]:
    """What every case of a set is to hold, by the case's name.

    Raises:
        MissingPackageError: numba is not installed.
    """
    require_package("numba", "proof")
    from hdfast.proof.generator import strata

    rng = np.random.default_rng([seed, 1])
    names = [f"{x:08x}" for x in rng.choice(2**32, count, replace=False)]
    return dict(zip(names, strata.plan(count, seed), strict=True))


def _make_one(folders: Folders, name: str, recipe: Recipe) -> None:
    """One case and its part of the labels.

    Raises:
        InputError: it cannot be made.
    """
    target, scratch = folders.cases / name, folders.sealed / PARTS / name
    for leftover in (target, scratch):
        shutil.rmtree(leftover, ignore_errors=True)
    built = built_from(recipe, scratch)
    scratch.rename(target)
    files.write_json(folders.sealed / PARTS / f"{name}.json", built.label)


def built_from(recipe: Recipe, folder: Path) -> Built:
    """One case. Where no draw meets the recipe, its effects stand on an ordinary bench, and the label says so.

    They are not concealed there, and no longer undecidable: the label has the kind of what was made.

    Raises:
        InputError: no draw meets that either.
    """
    from hdfast.proof.generator.case import UnfitError, build

    try:
        return build(recipe, folder)
    except UnfitError as reason:
        try:
            built = build(_on_an_ordinary_bench(recipe), folder)
        except UnfitError as again:
            raise InputError(
                f"no draw makes a case of the set, not on an ordinary bench either ({again}): give another --seed"
            ) from None
        built.label[INSTEAD_OF] = str(reason)
        return built


def _on_an_ordinary_bench(recipe: Recipe) -> Recipe:
    kinds = ("single",) if recipe.kinds[0] == "undecidable" else recipe.kinds[:1]
    bench = Bench(motor_only=recipe.bench.motor_only, warm=recipe.bench.warm)
    like = None if recipe.like is None else _on_an_ordinary_bench(recipe.like)
    return replace(recipe, kinds=kinds, bench=bench, seed=recipe.seed + 1, like=like)


@contextmanager
def single_threaded_libraries() -> Iterator[None]:
    """Processes started inside use one thread of linear algebra each."""
    before: dict[str, Any] = {name: environ.get(name) for name in LIBRARY_THREADS}
    environ.update(dict.fromkeys(LIBRARY_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                environ.pop(name, None)
            else:
                environ[name] = value
