"""Run or continue a tolerance study."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from hdfast import checks, config
from hdfast.catalogue import build_info
from hdfast.config import Config
from hdfast.errors import InputError, choose, shorten
from hdfast.files import alone_in, prepare_study, retract
from hdfast.threads import MAX_THREADS
from hdfast.tolerance.chunks import ranges, run_here
from hdfast.tolerance.cluster import LOCAL, MAX_WORKERS, run_on_cluster
from hdfast.tolerance.designs import DESIGNS
from hdfast.tolerance.policy import POLICIES
from hdfast.tolerance.progress import meter
from hdfast.tolerance.sample import MAX_ROWS, Plan
from hdfast.tolerance.simulation import study_metrics
from hdfast.tolerance.store import CHUNK, FolderStore, MemoryStore
from hdfast.tolerance.study import Study
from hdfast.tolerance.task import Task

FIRST = 64  # rows whose drawn values stand for how rows are drawn
GROUPS = {"latin_hypercube": "Latin hypercube (block of [run])", "sobol": "Sobol sequence (replicates of [run])"}


def tolerance(
    file: str | Path | Config,
    *,
    n: int | None = None,
    seed: int | None = None,
    sampling: str | None = None,
    failed: str | None = None,
    out: str | Path | None = None,
    resume: bool = False,
    cluster: str | None = None,
    workers: int | None = None,
    threads: int | None = None,
    chunk: int = CHUNK,
    progress: bool | Callable[[int, int], None] = False,
) -> Study:
    """Run a tolerance study.

    Args:
        file: configuration file, or one that is read already.
        n: number of rows, instead of the file's; a worst-case sampling has its own.
        seed: instead of the file's.
        sampling: "monte_carlo", "latin_hypercube", "sobol", "corners", "one_at_a_time" or "factorial".
        failed: "refuse" (default: no statistic over rows that failed), "exclude" or "worst".
        out: folder for the rows; without it they stay in memory.
        resume: continue the study in `out`, with more rows if `n` is larger; its page, tables and summary go first.
        cluster: run on Dask distributed: "local", or the address of a scheduler.
        workers: processes of a local cluster; default one per CPU.
        threads: of a local run, or of each worker (default 1 there).
        chunk: rows per chunk and file; changes nothing in the result.
        progress: True shows a bar on stderr; a function is called with (rows done, rows in total).

    Returns:
        The study; every statistic is computed when asked for.

    Raises:
        InputError: naming argument, value and allowed range, or another run is at work in `out`; nothing was run.
        FailedRowsError: from the statistics, when rows failed under "refuse". The rows are kept.
    """
    settings = file if isinstance(file, Config) else config.load(file)
    if out is None:
        settings = replace(settings, trajectories=None)
    plan = settings.plan(
        None if seed is None else checks.whole("seed", seed, 0, checks.MAX_SEED),
        None if sampling is None else choose("sampling", sampling, DESIGNS),
    )
    policy = choose("failed", settings.run.failed if failed is None else failed, POLICIES)
    rows = plan.rows(checks.whole("n", settings.run.rows if n is None else n, 1, MAX_ROWS))
    if resume and out is None:
        raise InputError("resume = True needs out, the folder of the study to continue")
    _require_two_groups(plan, rows)
    size = checks.whole("chunk", chunk, 1, MAX_ROWS)
    if threads is not None:
        checks.whole("threads", threads, 1, MAX_THREADS)
    task = Task(settings, plan, tuple(study_metrics(settings)), threads)
    if cluster is not None and not (isinstance(cluster, str) and cluster):
        raise InputError(f"cluster = {shorten(cluster)} is neither 'local' nor the address of a scheduler")
    if workers is not None:
        checks.whole("workers", workers, 1, MAX_WORKERS)
        if cluster != LOCAL:
            raise InputError(f"workers = {workers} has a meaning with cluster = {LOCAL!r} only (--cluster)")
    with nullcontext() if out is None else alone_in(out):
        store = _store(task, out, size, resume=resume)
        if isinstance(store, FolderStore):
            store.check_rows(rows)
        todo = [part for part in ranges(rows, store.chunk) if not store.done(*part)]
        with meter(progress, rows, rows - sum(stop - start for start, stop in todo)) as watch:
            if isinstance(store, FolderStore) and todo:
                retract(store.folder, settings.inputs)
            if cluster is None:
                run_here(replace(task, progress=watch.within), todo, store, watch.chunk)
            else:
                lean = replace(settings, tables={})  # their values are in the plan, and every chunk is sent the task
                work = replace(task, config=lean, threads=1 if threads is None else threads)
                run_on_cluster(work, todo, store, watch.chunk, address=cluster or LOCAL, workers=workers)
    return Study(settings, plan, rows, store, policy, task)


def _require_two_groups(plan: Plan, rows: int) -> None:
    """Refuse a random sample whose rows all depend on each other: its verdict would be undecided for ever."""
    groups = plan.groups(0, rows)
    if plan.design.random and groups is not None and groups.count < 2:
        kind = "batch (size of [batches])" if plan.batched else GROUPS[plan.sampling]
        raise InputError(f"n = {rows} rows are a single {kind}, which shows no interval (allowed: two or more of them)")


def fingerprint(task: Task) -> dict[str, Any]:
    """What decides the content of a study's rows, ready for JSON; a difference is told by the first that differs."""
    settings, info = task.config, build_info()
    drawn = task.plan.draw(0, min(FIRST, task.plan.rows(FIRST)))
    return {
        "sampling": task.plan.sampling,
        "seed": task.plan.seed,
        **settings.checksums,
        "plan_sha256": hashlib.sha256(repr(task.plan).encode()).hexdigest(),
        "draws_sha256": hashlib.sha256(b"".join(values.tobytes() for values in drawn.values())).hexdigest(),
        "settings_sha256": hashlib.sha256(_settings(settings)).hexdigest(),
        "metrics": list(task.metrics),
        "hdfast_version": info["version"],
        "simd": info["simd"],
    }


def _settings(settings: Config) -> bytes:
    """Everything besides the plan that a row depends on; a `Config` may differ from its text."""
    run, scenario = settings.run, settings.scenario
    numerical = run.method, run.rtol, run.atol, run.max_steps
    stated = sorted(settings.nominal().items()), settings.model, scenario, numerical, settings.trajectories
    return repr(stated).encode() + scenario.segments.tobytes()


def _store(task: Task, out: str | Path | None, chunk: int, *, resume: bool) -> MemoryStore | FolderStore:
    if out is None:
        store = MemoryStore()
        store.chunk = chunk
        return store
    wanted = task.config.trajectories
    return FolderStore(
        prepare_study(out, task.config.inputs),
        fingerprint(task),
        chunk=chunk,
        resume=resume,
        signals=wanted.signals if wanted else (),
        times=wanted.times(task.config.scenario.t_end) if wanted else None,
    )
