"""The command `hdfast proof`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from tqdm import tqdm

from hdfast.errors import InputError
from hdfast.printing import json_text
from hdfast.proof.making import MOST_CASES
from hdfast.proof.rivals.table import ablations, rivals
from hdfast.proof.run import PAGE, prove, prove_real
from hdfast.threads import MAX_THREADS, available_threads

NAME = "proof"
TEXT = "Prove the diagnosis on blind cases in which one effect is concealed."
EXAMPLE = "hdfast proof --cases 300 --out out/proof"
DONE, SAYS_NO = 0, 1


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    command.add_argument("--out", metavar="DIR", required=True, help="folder of cases, answers and results")
    command.add_argument(
        "--cases",
        type=whole("--cases", 1, MOST_CASES),
        help=f"number of cases (default: {MOST_CASES}; not with --real)",
    )
    command.add_argument("--seed", type=whole("--seed", 0, 2**31 - 1), default=0, help="seed of the set (default: 0)")
    command.add_argument("--workers", type=whole("--workers", 1, MAX_THREADS), help="processes (default: all cores)")
    command.add_argument(
        "--real", metavar="CAMPAIGN.toml", nargs="+", type=Path, help="put effects into these recordings instead"
    )
    command.add_argument("--rivals", action="store_true", help="let simpler strategies answer the same cases")
    command.add_argument(
        "--second-round", action="store_true",
        help="record what undecided answers ask for, and let the diagnosis answer again (not with --real)",
    )  # fmt: skip
    command.add_argument("--ablations", action="store_true", help="let the diagnosis answer without each of its parts")
    command.add_argument(
        "--shared", metavar="CASES", type=whole("--shared", 1, MOST_CASES), default=MOST_CASES,
        help="cases that --rivals and --ablations answer, the first by name (default: all)",
    )  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Run the command; 0 when every mark is met, else 1. The same command again goes on where it stopped."""
    if options.real and options.cases is not None:
        raise InputError(f"--cases = {options.cases} is not for --real: its recordings say how many cases there are")
    if options.real and options.second_round:
        raise InputError("--second-round is not for --real: nothing more can be recorded of its machines")
    with closing(_Bars(not options.quiet and not options.json)) as bars:
        run = {
            "seed": options.seed,
            "workers": options.workers or available_threads(),
            "step": bars,
            "others": [*(rivals() if options.rivals else ()), *(ablations() if options.ablations else ())],
            "shared": options.shared,
        }
        if options.real:
            proof = prove_real(options.out, options.real, **run)
        else:
            second = options.second_round
            proof = prove(options.out, cases=options.cases or MOST_CASES, second_round=second, **run)
    if options.json:
        print(json_text(proof))
    elif not options.quiet:
        from hdfast.report.proof_page import markdown

        print(f"{markdown(proof)}\n{options.out}/{PAGE}")
    missed = any(s["passed"] is False for s in proof["scores"])
    return SAYS_NO if missed else DONE


class _Bars:
    """One progress bar per part of the run."""

    def __init__(self, shown: bool) -> None:
        self.shown = shown
        self.bar: Any = None
        self.part = ""

    def __call__(self, part: str, done: int, total: int) -> None:
        if not self.shown:
            return
        if part != self.part:
            self.close()
            self.part, self.bar = part, tqdm(total=total, desc=part, unit="case", file=sys.stderr, dynamic_ncols=True)
        self.bar.n = done
        self.bar.refresh()

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()
            self.bar = None
