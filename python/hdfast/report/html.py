"""The page to look at: one HTML file that needs nothing else."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import jinja2
from matplotlib.figure import Figure

from hdfast import catalogue
from hdfast.config import Config
from hdfast.printing import html_table
from hdfast.report import plots, tables
from hdfast.result import SweepResult
from hdfast.simulate import Trajectory
from hdfast.tolerance.limits import Verdict

PAGE = "page.html.j2"


@dataclass(frozen=True)
class Picture:
    """A figure and what it shows."""

    svg: str
    caption: str


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    title: str
    texts: list[str] = field(default_factory=list)
    figures: list[Picture] = field(default_factory=list)
    tables: list[str] = field(default_factory=list)


def render(
    title: str,
    lead: str,
    facts: list[tuple[str, str]],
    sections: list[Section],
    source: str,
    verdict: bool | None,
    headline: str = "",
) -> str:
    """Fill the page; `headline` words the verdict."""
    if not headline:
        headline = "Every specification is met." if verdict else "At least one specification is not met."
    return fill(
        PAGE,
        title=title,
        lead=lead,
        facts=facts,
        sections=sections,
        source=source,
        verdict=verdict,
        headline=headline,
    )


def fill(template: str, **content: Any) -> str:
    """Fill a template of this room; version and build are added."""
    room = resources.files("hdfast.report")
    loader = jinja2.FunctionLoader(lambda name: room.joinpath(name).read_text(encoding="utf-8"))
    environment = jinja2.Environment(loader=loader, autoescape=True, undefined=jinja2.StrictUndefined)
    info = catalogue.build_info()
    return environment.get_template(template).render(
        **content, version=info["version"], build=f"{info['profile']} build"
    )


def picture(figure: Figure, caption: str) -> Picture:
    """A figure for the page."""
    return Picture(plots.svg(figure), caption)


def nominal_section(run: Trajectory) -> Section:
    """Figures of the nominal drive."""
    return Section(
        "One drive: the nominal unit",
        figures=[
            picture(plots.speeds(run), "Input and output speed of the nominal drive. Dashed: begin of the stop."),
            picture(
                plots.transmission_error(run),
                "Transmission error over the last whole motor revolutions before the stop, and its amplitudes "
                "by order. Grey: what the gear would show unloaded and infinitely slowly; the difference is the "
                "windup of the spring.",
            ),
            picture(
                plots.trajectory(run, ("windup", "te", "tau_m")),
                "Windup, transmission error and motor torque over the whole run of the nominal drive.",
            ),
        ],
        texts=[] if run.status == catalogue.FINISHED else [run.message],
    )


def sweep_page(config: Config, result: SweepResult, verdicts: list[Verdict], nominal: Trajectory, seed: int) -> str:
    """Page of a sweep."""
    finished = int(result.finished.sum())
    facts = [
        ("rows", f"{len(result):,}"),
        ("finished", f"{finished:,}"),
        ("seed", str(seed)),
        ("rows per second", f"{result.rows_per_second:,.0f}"),
        ("threads", str(result.threads)),
        ("vector code", result.simd),
    ]
    sections = []
    if verdicts:
        rows = tables.spec_rows(verdicts, result.units)
        sections.append(Section("Specification", tables=[html_table(tables.SPEC_HEADER, rows, right=(2, 3, 4, 5, 6))]))
    sections.append(
        Section(
            "Distributions",
            figures=[
                picture(
                    plots.histograms(result, config.specs),
                    f"Histograms over the {finished:,} finished rows. "
                    "Dotted: 5 % and 95 %; solid: median; dashed red: limits.",
                )
            ],
        )
    )
    sections.append(nominal_section(nominal))
    metric_table = html_table(
        tables.METRIC_HEADER, tables.metric_rows(result), right=range(2, len(tables.METRIC_HEADER))
    )
    sections.append(Section("Percentiles of every metric", tables=[metric_table]))
    failed = [result.message(row) for row in (~result.finished).nonzero()[0][:10].tolist()]
    if failed:
        counts = ", ".join(f"{name}: {count}" for name, count in result.status_counts().items())
        sections.append(Section("Rows that did not finish", texts=[counts, *failed]))
    if config.tolerances:
        table = html_table(tables.TOLERANCE_HEADER, tables.tolerance_rows(config), right=(2,))
        sections.append(Section("What varies", tables=[table]))
    parameters = html_table(["parameter", "nominal", "unit", "meaning"], tables.nominal_rows(config), right=(1,))
    sections.append(Section("Nominal parameters", tables=[parameters]))
    sampling = config.run.sampling.replace("_", " ")
    lead = f"Sweep of {len(result):,} drives ({sampling}), {config.scenario.name}, {config.scenario.t_end:g} s each."
    verdict = all(item.met for item in verdicts) if verdicts else None
    return render(config.title, lead, facts, sections, config.text, verdict)


def simulate_page(config: Config, run: Trajectory) -> str:
    """Page of a single simulated drive."""
    facts = [("outcome", run.status), ("steps", str(int(run.result.steps[0])))]
    rows = [[name, tables.number(value), run.units[name]] for name, value in run.metrics.items()]
    sections = [
        nominal_section(run),
        Section("Metrics", tables=[html_table(["metric", "value", "unit"], rows, right=(1,))]),
        Section(
            "Parameters",
            tables=[html_table(["parameter", "nominal", "unit", "meaning"], tables.nominal_rows(config), right=(1,))],
        ),
    ]
    lead = f"One drive, {config.scenario.name}, {config.scenario.t_end:g} s."
    return render(config.title, lead, facts, sections, config.text, None)
