"""Study: the four dampers."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.studies import cases
from hdfast.studies.study import Study, parameter_study

PARAMETERS = ("B_sp", "B_ml", "B_m", "B_l")


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over each damping in all cases and at constant torque; `drive` holds what differs from the defaults."""
    return parameter_study(
        "damping",
        "Damping",
        "Each damper from a quarter to five times its default, at held set speed and at constant torque.",
        PARAMETERS,
        drive=drive,
        selected=(*cases.EVERY, "t"),
        threads=threads,
    )
