"""The command `hdfast calibrate`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from typing import Any

from hdfast import files
from hdfast.calibration.calibrate import RESULTS, calibrate
from hdfast.printing import json_text, text_table
from hdfast.recordings import recorded
from hdfast.threads import MAX_THREADS

NAME = "calibrate"
TEXT = "Fit the parameters of a campaign's drive to its recordings, within their tolerances."
EXAMPLE = "hdfast calibrate examples/concealed-friction/campaign.toml --out out/calibration"


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    command.add_argument("campaign", metavar="CAMPAIGN.toml", help="nominal drive, sensors and recordings")
    command.add_argument("--out", metavar="DIR", help="folder for report.html, model.toml and calibration.json")
    command.add_argument(
        "--threads", type=whole("--threads", 1, MAX_THREADS), help="number of threads (default: all cores)"
    )


def run(options: argparse.Namespace) -> int:
    """Run the command; 0 when the drive was fitted."""
    campaign = recorded(options.campaign)
    if options.out:
        files.prepare_results(options.out, campaign.text, RESULTS, campaign.folder)
    found = calibrate(campaign, threads=options.threads)
    page = found.report(options.out) if options.out else None
    if options.json:
        print(json_text(found.to_dict()))
    elif not options.quiet:
        rows = [
            [row["parameter"], *(f"{row[key]:.5g}" for key in ("prior", "value", "sigma", "pull")), row["unit"]]
            for row in found.parameters
        ]
        print(f"{found}\n")
        print(text_table(["parameter", "prior", "estimate", "sigma", "pull", "unit"], rows, right=(1, 2, 3, 4)))
        if page is not None:
            print(f"\n{page}\n{page.parent / 'model.toml'}")
    if not options.quiet:
        for sentence in found.warnings:
            print(f"hdfast: warning: {sentence}", file=sys.stderr)
    return 0
