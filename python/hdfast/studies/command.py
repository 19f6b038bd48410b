"""The command `hdfast study`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from hdfast.config import load
from hdfast.errors import InputError
from hdfast.files import CLAIMS, prepare_own
from hdfast.printing import json_text, text_table
from hdfast.scenario import Scenario
from hdfast.simulate import simulate
from hdfast.studies import STUDIES, Study, validation_runs
from hdfast.studies.cases import LOADS
from hdfast.threads import MAX_THREADS

NAME = "study"
TEXT = "Run the article's studies and decide its claims."
EXAMPLE = "hdfast study speed examples/shf-25-120.toml --out out/speed"
ALL = "all"
DAMPING = ("B_m", "B_ml", "B_l")


def arguments(command: argparse.ArgumentParser, whole: Callable[[str, int, int], Any]) -> None:
    """Declare the arguments; `whole` makes a reader of whole numbers."""
    command.add_argument("name", choices=[*STUDIES, ALL], metavar="NAME", help=f"{', '.join(STUDIES)} or {ALL}")
    command.add_argument("file", nargs="?", metavar="FILE.toml", help="the drive; default the SHF-25-120")
    command.add_argument("--out", metavar="DIR", help="folder for the page, the rows and the claims")
    command.add_argument(
        "--threads", type=whole("--threads", 1, MAX_THREADS), help="number of threads (default: all cores)"
    )


def run(options: argparse.Namespace) -> int:
    """Run the command; 0 whatever the verdicts are."""
    from hdfast.report import study_page

    if options.out:
        prepare_own(options.out, (CLAIMS,))
    names = list(STUDIES) if options.name == ALL else [options.name]
    drive = _drive(options.file) if options.file else None
    if drive and "validate" in names:
        validation_runs.require(drive)
    found = [STUDIES[name](drive, options.threads) for name in names]
    page = None
    if options.out:
        page = study_page.write_overview(found, options.out) if len(found) > 1 else found[0].report(options.out)
    if options.json:
        listed = [claim for study in found for claim in study_page.claims_json(study.claims)]
        print(json_text({"studies": names, "claims": listed}))
    elif not options.quiet:
        print("\n\n".join(_text(study) for study in found))
        if page is not None:
            print(f"\n{page}\n{page.parent / CLAIMS}")
    return 0


def _text(study: Study) -> str:
    rows = [[claim.item, claim.text, claim.verdict] for claim in study.claims]
    return f"{study.title}: {study.lead}\n{text_table(['claim', 'article says', 'verdict'], rows)}"


def _drive(path: str) -> dict[str, float]:
    """Parameters of a file as the studies take them: two inertias, no terms, polynomial spring, orders 1 to 15.

    The studies simulate all fifteen orders: those that the file's list lacks are zero, as in a sweep of the file.

    Raises:
        InputError: the file asks for what the studies do not hold, or for a drive that cannot be simulated.
    """
    settings = load(path)
    if settings.model.base != "two_inertia" or settings.model.spring != "polynomial":
        raise InputError(
            f"{path}: base {settings.model.base!r} with spring {settings.model.spring!r} "
            "(allowed for a study: 'two_inertia' with 'polynomial')"
        )
    if settings.model.terms:
        raise InputError(f"{path}: terms {', '.join(settings.model.terms)} (allowed for a study: none)")
    moving = [name for name in settings.drive if settings.table[name].group == "scenario"]
    if moving:
        raise InputError(f"{path}: {', '.join(moving)} in [drive] (allowed for a study: none, its motions are its own)")
    inertia = settings.drive.get("J_l", LOADS[0])
    if inertia != LOADS[0]:
        listed = ", ".join(f"{value:g}" for value in LOADS)
        raise InputError(
            f"{path}: J_l = {inertia:g} kg m^2 (allowed for a study: {LOADS[0]:g} or left out; its loads are {listed})"
        )
    most, own = [str(n) for n in range(1, 16)], settings.model.order_labels
    foreign = [name for name in own if name not in most]
    if foreign:
        raise InputError(f"{path}: orders {', '.join(foreign)} (allowed for a study: 1 to 15)")
    nominal = settings.nominal()
    if not any(nominal[name] for name in DAMPING):
        raise InputError(f"{path}: {', '.join(DAMPING)} are 0 (allowed for a study: one of them, to slow the drive)")
    absent = {f"te_{part}_{n}": 0.0 for part in ("cos", "sin") for n in most if n not in own}
    drive = absent | settings.drive
    simulate(drive, scenario=Scenario.start_stop(t_end=1e-3), signals=[], metrics=[], strict=True)
    return drive
