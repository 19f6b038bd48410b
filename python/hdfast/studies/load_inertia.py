"""Study: load inertia."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.studies.study import ARTICLE_FACTORS, Study, parameter_study

POINTS = (*ARTICLE_FACTORS, 2.0, 5.0)


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over `J_l` in all cases; `drive` holds what differs from the defaults."""
    return parameter_study(
        "load-inertia",
        "Load inertia",
        "Load inertia from a quarter to five times its default; start, run and stop apart.",
        ["J_l"],
        marks=POINTS,
        drive=drive,
        threads=threads,
    )
