"""Study: stiffness."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.studies.study import ARTICLE_FACTORS, Study, parameter_study

POINTS = ARTICLE_FACTORS


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over `K` in all cases; `drive` holds what differs from the defaults."""
    return parameter_study(
        "stiffness",
        "Stiffness",
        "All spring coefficients times one factor; the range of the spring stays.",
        ["K"],
        marks=POINTS,
        drive=drive,
        threads=threads,
    )
