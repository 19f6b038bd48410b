"""Study: motor inertia."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.studies.study import ARTICLE_FACTORS, Study, parameter_study

POINTS = ARTICLE_FACTORS


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over `J_m` in all cases; `drive` holds what differs from the defaults."""
    return parameter_study(
        "motor-inertia",
        "Motor inertia",
        "Motor inertia from a quarter to five times its default.",
        ["J_m"],
        marks=POINTS,
        drive=drive,
        threads=threads,
    )
