"""The result folder of a study: page, claims, table of every row, JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hdfast import catalogue
from hdfast.files import CLAIMS, PAGE, prepare_own, write_json, write_text
from hdfast.printing import html_table
from hdfast.report import folder, html, identify_plots, speed_plots, study_plots
from hdfast.report.html import Picture, Section
from hdfast.studies.cases import Grid
from hdfast.studies.claims import HEADER, Verdict
from hdfast.studies.jump import gap
from hdfast.studies.study import Study


def page(study: Study) -> str:
    """The page of a study."""
    sections = [Section("The article's claims", tables=[html_table(HEADER, [claim.row() for claim in study.claims])])]
    if study.name == "validate":
        sections.append(Section("Pictures", figures=_validation(study)))
    sections += [
        Section(f"Trends over {study_plots.axis(grid)}", figures=_trends(grid)) for grid in study.grids.values()
    ]
    if study.name == "speed":
        sections.append(Section("Orders and mode", figures=_speed(study)))
    sections += [Section(name, tables=[html_table(*table)]) for name, table in study.tables.items()]
    rows = sum(len(grid.result) for grid in study.grids.values())
    facts = [("rows simulated", f"{rows:,}")] if rows else []
    return html.render(f"Study: {study.title.lower()}", study.lead, facts, sections, "", None)


def _trends(grid: Grid) -> list[Picture]:
    first = grid.loads[0]
    note = f"load inertia {first:g} kg m²" if grid.parameter != "J_l" else "factors of 0.5 kg m²"
    pictures = [
        html.picture(
            study_plots.trends(grid, first),
            f"Start, run and stop apart, {note}. Dots: the article's points. "
            "(a) torque step, (b) released TE, (c) held speed, (d) coast, (e) brake.",
        ),
        html.picture(
            study_plots.spectra(grid, first),
            "Amplitude-frequency diagrams over the first second after the event, windup's share of the load speed.",
        ),
    ]
    pictures += [
        html.picture(study_plots.trends(grid, load), f"The same with a load inertia of {load:g} kg m².")
        for load in grid.loads[1:]
    ]
    if grid.parameter.startswith("B_"):
        pictures.append(
            html.picture(study_plots.energies(grid, first), "Energy each damper takes in a run of 6 s at 300 r/min.")
        )
    return pictures


def _speed(study: Study) -> list[Picture]:
    return [
        html.picture(
            speed_plots.crossings(study),
            "Amplitude of every order of the load speed at held speed; dashed: where an order meets the free mode. "
            "Dots: the article's speeds.",
        ),
        html.picture(
            speed_plots.time_frequency(study),
            "Start, run and stop at 300 r/min: short-time spectrum over time (0.5 s Hann window) and over the motor "
            "angle. Lines move with the speed, the mode stays.",
        ),
        html.picture(speed_plots.phase_planes(study.curves["run"], 3.0), "Phase planes of start and run at 300 r/min."),
        html.picture(
            speed_plots.speed_jump(study),
            "A slow rise and fall of the speed, which part where the motion jumps: by no more than "
            f"{100 * gap(study.curves['jump']):.2g} %.",
        ),
    ]


def _validation(study: Study) -> list[Picture]:
    return [
        html.picture(identify_plots.stiffness_loop(study.curves["loop"]), "Torque loop at the locked input, its law."),
        html.picture(speed_plots.held_runs(study), "Transmission error at the article's speeds, and its spectrum."),
        html.picture(speed_plots.te_over_speed(study), "Transmission error over speed for three load inertias."),
        html.picture(
            speed_plots.rmse_curve(study),
            "Fourier fit of the run at 15 r/min with 1.36 µrad noise, by number of orders.",
        ),
        html.picture(speed_plots.released(study), "The high-frequency part of a simulated start is the released mode."),
        html.picture(speed_plots.start_stop(study), "Start by a torque step and coast to rest at 100 r/min."),
        html.picture(
            speed_plots.phase_planes(study.curves["runs"][15.0], 10.0),
            "Phase planes of 10 s from rest at 15 r/min: the unwrapped angle grows, the wrapped one closes.",
        ),
    ]


def claims_json(claims: Sequence[Verdict]) -> list[dict[str, Any]]:
    """Verdicts ready for JSON."""
    return [
        {
            "claim": claim.item,
            "article": claim.text,
            "verdict": claim.verdict,
            "reason": claim.reason,
            "findings": [
                {
                    "where": item.where,
                    "sign": item.sign,
                    "relative_change": item.change if math.isfinite(item.change) else None,
                    "agrees": bool(item.agrees),
                }
                for item in claim.findings
            ],
        }
        for claim in claims
    ]


def write(study: Study, out: str | Path) -> Path:
    """Write everything, the claims last, and return the page."""
    target = prepare_own(out, (CLAIMS,))
    version = catalogue.build_info()["version"]
    for name, grid in study.grids.items():
        folder.write_table(target / f"rows_{name}.parquet", grid.result.to_arrow(), None, version)
    write_text(target / PAGE, page(study))
    write_json(target / CLAIMS, {"study": study.name, "version": version, "claims": claims_json(study.claims)})
    return target / PAGE


def write_overview(studies: Sequence[Study], out: str | Path) -> Path:
    """One page with the claims of several studies, each study in a folder beside it."""
    target = prepare_own(out, (CLAIMS,))
    sections = []
    for study in studies:
        study.report(target / study.name)
        table = html_table(HEADER, [claim.row() for claim in study.claims])
        sections.append(Section(study.title, texts=[f"Pictures: {study.name}/{PAGE}"], tables=[table]))
    every = [claim for study in studies for claim in study.claims]
    counts: dict[str, int] = {}
    for claim in every:
        counts[claim.verdict] = counts.get(claim.verdict, 0) + 1
    facts = [(word, str(number)) for word, number in counts.items()]
    lead = "Every claim of the article, decided by computation."
    write_text(target / PAGE, html.render("Studies", lead, facts, sections, "", None))
    write_json(target / CLAIMS, {"version": catalogue.build_info()["version"], "claims": claims_json(every)})
    return target / PAGE
