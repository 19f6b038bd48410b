"""The command `hdfast diagnose`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from hdfast import files
from hdfast.checks import MAX_SEED
from hdfast.diagnosis.diagnose import RESULTS, diagnose
from hdfast.printing import json_text
from hdfast.recordings import recorded
from hdfast.threads import MAX_THREADS

NAME = "diagnose"
TEXT = "Find the physics that a drive's model leaves out, from recordings."
EXAMPLE = "hdfast diagnose examples/concealed-friction/campaign.toml --out out/diagnosis"
REJECTED = 1


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    command.add_argument("campaign", metavar="CAMPAIGN.toml", help="nominal drive, sensors and recordings")
    command.add_argument("--out", metavar="DIR", help="folder for verdict.json, report.html and extended_model.toml")
    command.add_argument("--no-report", action="store_true", help="leave out report.html, a fifth of the time")
    command.add_argument(
        "--seed", type=whole("--seed", 0, MAX_SEED), default=0, help="seed of the random draws (default: 0)"
    )
    command.add_argument(
        "--threads", type=whole("--threads", 1, MAX_THREADS), help="number of threads (default: all cores)"
    )


def run(options: argparse.Namespace) -> int:
    """Run the command; 1 when the recordings were rejected."""
    campaign = recorded(options.campaign)
    if options.out:
        files.prepare_results(options.out, campaign.text, RESULTS, campaign.folder)
    found = diagnose(
        campaign, seed=options.seed, threads=options.threads, progress=not options.quiet and sys.stderr.isatty()
    )
    written = None
    if options.out:
        written = found.save(options.out) if options.no_report else found.report(options.out)
    if options.json:
        print(json_text(found.to_dict()))
    elif not options.quiet:
        print(f"{found.verdict.replace('_', ' ')}: {found.content['sentence']}")
        if written is not None:
            print(written)
    return REJECTED if found.verdict == "data_rejected" else 0
