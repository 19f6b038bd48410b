"""The command `hdfast tolerance`."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable
from typing import Any

from hdfast.checks import MAX_SEED
from hdfast.config import load
from hdfast.errors import InputError, choose
from hdfast.notes import notes_on_rows
from hdfast.printing import json_text, text_table
from hdfast.threads import MAX_THREADS
from hdfast.tolerance.cluster import MAX_WORKERS
from hdfast.tolerance.designs import DESIGNS
from hdfast.tolerance.intervals import Estimate
from hdfast.tolerance.policy import POLICIES, FailedRowsError
from hdfast.tolerance.run import tolerance
from hdfast.tolerance.sample import MAX_ROWS
from hdfast.tolerance.store import CHUNK
from hdfast.tolerance.study import Study

NAME = "tolerance"
TEXT = "Hold the spread of many drives against a specification, with confidence."
EXAMPLE = "hdfast tolerance examples/shf-25-120.toml --out out/tolerance --rows 100000"
DONE, SAYS_NO = 0, 1


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    command.add_argument("file", metavar="FILE.toml", help="drive, tolerances, scenario and specification")
    command.add_argument("--out", metavar="DIR", help="folder for rows, page, tables, summary and input")
    command.add_argument("--resume", action="store_true", help="continue the study in DIR, with more rows if asked")
    command.add_argument(
        "--cluster", metavar="ADDRESS", nargs="?", const="local", help="run on Dask; without ADDRESS on this machine"
    )
    command.add_argument(
        "--workers", type=whole("--workers", 1, MAX_WORKERS), help="processes of a cluster on this machine"
    )
    command.add_argument("--rows", type=whole("--rows", 1, MAX_ROWS), help="number of drives instead of the file's")
    command.add_argument("--seed", type=whole("--seed", 0, MAX_SEED), help="seed instead of the file's")
    command.add_argument("--sampling", choices=DESIGNS, help="how the drives are drawn, instead of the file's way")
    command.add_argument(
        "--failed", choices=POLICIES, help="what rows that failed mean (default: the file's, else refuse)"
    )
    command.add_argument(
        "--rare", metavar="METRIC", action="append", default=[], help="subset simulation of what is outside this limit"
    )
    command.add_argument(
        "--threads",
        type=whole("--threads", 1, MAX_THREADS),
        help="number of threads (default: the file's, else all cores; per worker 1)",
    )
    command.add_argument(
        "--chunk", type=whole("--chunk", 1, MAX_ROWS), default=CHUNK, help=f"rows per stored file (default: {CHUNK})"
    )
    command.add_argument("--progress", action="store_true", help="show progress even when stderr is not a terminal")


def run(options: argparse.Namespace) -> int:
    """Run the command; 0 when the outcome of every specification is "met", else 1."""
    settings = load(options.file)
    if not options.quiet:
        sys.stderr.writelines(f"{note}\n" for note in notes_on_rows(settings))
    for metric in options.rare:
        choose("--rare", metric, settings.specs)
        if not settings.tolerances:
            raise InputError(f"--rare = {metric!r} needs parameters that vary: the file has no [tolerance.<name>]")
    try:
        study = tolerance(
            settings,
            n=options.rows,
            seed=options.seed,
            sampling=options.sampling,
            failed=options.failed,
            out=options.out,
            resume=options.resume,
            cluster=options.cluster,
            workers=options.workers,
            threads=options.threads,
            chunk=options.chunk,
            progress=options.progress or (sys.stderr.isatty() and not options.quiet),
        )
    except KeyboardInterrupt:
        where = f": finished chunks are in {options.out}, continue with --resume" if options.out else ""
        raise KeyboardInterrupt(f"interrupted{where}") from None
    try:
        for metric in options.rare:
            study.rare(metric)
        page = study.report(options.out) if options.out else None
        _print(study, options, page)
        return DONE if study.met else SAYS_NO
    except FailedRowsError as error:
        hint = "; with --resume --failed the rows are not run again" if options.out else ""
        print(f"hdfast: {error}{hint}", file=sys.stderr)
        return SAYS_NO


def _print(study: Study, options: argparse.Namespace, page: Any) -> None:
    if options.json:
        from hdfast.report.tolerance import summary

        print(json_text(summary(study)))
    elif not options.quiet:
        print(f"{study.config.title}\n{study!r}\n")
        print(_table(study))
        for metric, found in study.rare_events.items():
            ppm = found.ppm
            outside = f"{ppm.value:.3g} ppm outside ({ppm.low:.3g} .. {ppm.high:.3g})"
            print(f"\n{metric}: {outside} by subset simulation{found.note}")
        if page is not None:
            print(f"\n{page}")


def _limits(found: Estimate) -> str:
    return "not known" if math.isnan(found.low) else f"{found.low:.4g} .. {found.high:.4g}"


def _table(study: Study) -> str:
    rows = [
        [metric, found.unit, *(f"{found.percentiles[q].value:.4g}" for q in (1.0, 50.0, 99.0)),
         _limits(found.percentiles[99.0]), found.note]
        for metric, found in study.summaries.items()
    ]  # fmt: skip
    return text_table(["metric", "unit", "P1", "P50", "P99", "95 % limits of P99", ""], rows, right=(2, 3, 4, 5))
