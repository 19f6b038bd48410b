"""Study: the article's validation at 15, 50 and 100 r/min, its static fits, and start and stop at 100 r/min."""

from __future__ import annotations

from collections.abc import Mapping

from hdfast.result import SweepResult
from hdfast.studies import validation_claims, validation_runs
from hdfast.studies.cases import LOADS
from hdfast.studies.study import Study
from hdfast.studies.validation_runs import SPEEDS, te


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Runs held at 15, 50 and 100 r/min (300 and 600 beside them); `drive` holds what differs from the defaults."""
    found = validation_runs.runs(drive, threads)
    return Study(
        "validate",
        "Validation",
        "Stiffness, transmission error at 15, 50 and 100 r/min with its Fourier fit, and start and stop at 100 r/min.",
        {},
        validation_claims.decide(found),
        {
            "held": found.held,
            "runs": found.from_rest,
            "released": found.released,
            "stop": found.stop,
            "fit": found.fit,
            "loop": found.loop,
        },
        {"Transmission error of runs at held speed": _table(found.held)},
    )


def _table(held: SweepResult) -> tuple[list[str], list[list[str]]]:
    rows = []
    for load in LOADS:
        for j, speed in enumerate(SPEEDS):
            cells = [f"{1e6 * te(held, name, load)[j]:.4g}" for name in ("te_mean", "te_peak", "te_pp", "te_rms")]
            rows.append([f"{load:g}", f"{speed:g}", *cells])
    return ["J_l [kg m^2]", "speed [r/min]", *(f"TE {name} [µrad]" for name in ("mean", "peak", "p-p", "rms"))], rows
