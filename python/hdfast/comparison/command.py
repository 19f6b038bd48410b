"""The command `hdfast compare`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from hdfast import files
from hdfast.comparison.compare import RESULTS, compare
from hdfast.printing import json_text, percent, text_table
from hdfast.recordings import recorded
from hdfast.threads import MAX_THREADS

NAME = "compare"
TEXT = "Simulate the drive of a campaign as given and compare it with the recordings."
EXAMPLE = "hdfast compare examples/concealed-friction/campaign.toml --out out/comparison"


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    command.add_argument("campaign", metavar="CAMPAIGN.toml", help="nominal drive, sensors and recordings")
    command.add_argument("--out", metavar="DIR", help="folder for report.html and comparison.json")
    command.add_argument(
        "--threads", type=whole("--threads", 1, MAX_THREADS), help="number of threads (default: all cores)"
    )


def run(options: argparse.Namespace) -> int:
    """Run the command; 0 however large the mismatch is."""
    campaign = recorded(options.campaign)
    if options.out:
        files.prepare_results(options.out, campaign.text, RESULTS, campaign.folder)
    found = compare(campaign, threads=options.threads)
    page = found.report(options.out) if options.out else None
    if options.json:
        print(json_text(found.to_dict()))
    elif not options.quiet:
        rows = [[row["recording"], row["role"], row["channel"], percent(row["nrmse"])] for row in found.errors]
        print(f"{found}\n")
        print(text_table(["recording", "role", "channel", "error"], rows, right=(3,)))
        if page is not None:
            print(f"\n{page}")
    if not options.quiet:
        for sentence in found.warnings:
            print(f"hdfast: warning: {sentence}", file=sys.stderr)
    return 0
