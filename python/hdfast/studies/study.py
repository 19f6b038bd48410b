"""What a study returns, and the sweep that most studies are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hdfast.studies import cases
from hdfast.studies.cases import Grid
from hdfast.studies.claims import Verdict

FACTORS = tuple(np.geomspace(0.25, 5.0, 25).tolist())
ARTICLE_FACTORS = (0.5, 0.75, 1.0, 1.25)
TIMES = np.linspace(0.0, 6.0, 6001)
SHOWN = (
    ("a", "mode_frequency_start"),
    ("a", "mode_amplitude_start"),
    ("b", "mode_frequency_start"),
    ("b", "mode_amplitude_start"),
    ("b", "mode_decay_start"),
    ("c", "te_pp"),
    ("c", "te_rms"),
    ("c", "speed_ripple"),
    ("d0", "mode_frequency_stop"),
    ("d0", "mode_amplitude_stop"),
    ("d", "residual_ring"),
    ("e0", "brake_frequency"),
    ("e0", "brake_decay"),
    ("e", "residual_ring"),
    ("e", "spring_torque"),
    ("d", "rise_time"),
    ("d", "stop_time"),
)


@dataclass(frozen=True, eq=False)
class Study:
    """Result of a study.

    Attributes:
        name: as on the command line.
        title, lead: for the page.
        grids: sweeps by parameter.
        claims: verdicts on the article's statements.
        curves: arrays for the figures.
        tables: name -> (header, rows of text).
    """

    name: str
    title: str
    lead: str
    grids: dict[str, Grid]
    claims: list[Verdict]
    curves: dict[str, Any] = field(default_factory=dict, repr=False)
    tables: dict[str, tuple[list[str], list[list[str]]]] = field(default_factory=dict, repr=False)

    def report(self, folder: str | Path) -> Path:
        """Write page, table and JSON; returns the page."""
        from hdfast.report.study_page import write

        return write(self, folder)


def parameter_study(
    name: str,
    title: str,
    lead: str,
    parameters: Sequence[str],
    *,
    marks: Sequence[float] = ARTICLE_FACTORS,
    factors: Sequence[float] = FACTORS,
    drive: Mapping[str, float] | None = None,
    selected: Sequence[str] = cases.EVERY,
    threads: int | None = None,
) -> Study:
    """Sweep each parameter over factors of its default in every case."""
    from hdfast.studies.claims import decide

    grids = {
        parameter: cases.run(
            parameter,
            factors,
            marks,
            cases=selected,
            loads=(cases.LOADS[0],) if parameter == "J_l" else cases.LOADS,
            drive=drive,
            signals=("omega_m", "omega_l"),
            t_eval=TIMES,
            threads=threads,
        )
        for parameter in parameters
    }
    tables = {f"Article's points, {parameter}": marked_table(grid) for parameter, grid in grids.items()}
    return Study(name, title, lead, grids, decide(name, grids), {}, tables)


def marked_table(grid: Grid, shown: Sequence[tuple[str, str]] = SHOWN) -> tuple[list[str], list[list[str]]]:
    """The article's points: one line for each case, metric and load inertia."""
    header = ["case", "metric", "unit", "J_l [kg m^2]", *(f"{value:g}" for value in grid.values[grid.marked])]
    rows = []
    for load in grid.loads:
        for case, metric in shown:
            if case in grid.cases:
                values = grid.of(metric, case, load)[grid.marked]
                inertia = "-" if grid.parameter == "J_l" else f"{load:g}"
                rows.append(
                    [cases.CASES[case].label, metric, grid.unit(metric), inertia, *(f"{value:.4g}" for value in values)]
                )
    return header, rows
