"""Study: transmission error."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.studies.study import ARTICLE_FACTORS, Study, parameter_study

POINTS = (*ARTICLE_FACTORS, 2.0)


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over `te_scale` in all cases; `drive` holds what differs from the defaults."""
    return parameter_study(
        "transmission-error",
        "Transmission error",
        "Kinematic error times one factor.",
        ["te_scale"],
        marks=POINTS,
        drive=drive,
        threads=threads,
    )
