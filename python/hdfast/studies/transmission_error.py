"""Study: transmission error, up to sizes that no gear has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdfast.checks import Floats
from hdfast.params import params
from hdfast.scenario_parts import RPM
from hdfast.studies.cases import CASES, Grid
from hdfast.studies.claims import DOWN, SAME, SMALL, UP, Finding, Verdict, word
from hdfast.studies.jump import gap, rise_and_fall
from hdfast.studies.study import ARTICLE_FACTORS, FACTORS, Study, parameter_study

POINTS = (*ARTICLE_FACTORS, 2.0)
EXCESSIVE = tuple(np.geomspace(FACTORS[-1], 100.0, 9)[1:].tolist())
HELD = "c"
GROWS, JUMPS = 0.5, 0.5


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over `te_scale` in all cases; `drive` holds what differs from the defaults."""
    found = parameter_study(
        "transmission-error",
        "Transmission error",
        "Kinematic error times one factor, up to a hundred.",
        ["te_scale"],
        marks=POINTS,
        factors=(*FACTORS, *EXCESSIVE),
        drive=drive,
        threads=threads,
    )
    grid = found.grids["te_scale"]
    nominal = {row.name: row.default for row in params()} | dict(drive or {})
    jump = rise_and_fall(nominal | {"te_scale": nominal["te_scale"] * float(grid.values[-1])})
    return replace(found, claims=[*found.claims, _stability(grid, jump)])


def _stability(grid: Grid, jump: Mapping[str, Floats]) -> Verdict:
    """Whether runs end early or grow at any size, and whether they jump or leave their set speed at the largest."""
    ended = 1.0 - float(np.mean(grid.result.finished))
    grown = max(_growth(grid, row) for load in grid.loads for row in grid.rows(HELD, load))
    torn = gap(jump)
    asked = CASES[HELD].speed_rpm * RPM
    missed = {load: float(grid.of("steady_speed", HELD, load)[-1] / asked - 1.0) for load in grid.loads}
    label, times = CASES[HELD].label, f"{grid.values[-1]:g} times"
    findings = [
        _finding("rows that end early", ended, 0.0),
        _finding(f"{label}, ripple of the last second over that before", grown, GROWS),
        _finding(f"{times}, ripple with rising against falling speed", torn, JUMPS),
        *(_finding(f"{label}, {times}, J_l {load:g}, mean speed", miss, SMALL) for load, miss in missed.items()),
    ]
    lost = ", ".join(f"{load:g}" for load, miss in missed.items() if abs(miss) > SMALL)
    steady = "a run ends early or grows" if findings[0].agrees or findings[1].agrees else "no run ends early or grows"
    speed = f"the set speed is lost at {lost} kg m²" if lost else "the set speed is held"
    return Verdict(
        "S20",
        "too large a transmission error may destabilise",
        word(findings),
        findings,
        f"{steady}, the model only loses energy; {_turn(grid)}, and at {times} {speed}",
    )


def _finding(where: str, change: float, limit: float) -> Finding:
    """A change that speaks for the claim when it is beyond a limit."""
    beyond = abs(change) > limit
    return Finding(where, (UP if change > 0.0 else DOWN) if beyond else SAME, change, beyond)


def _growth(grid: Grid, row: int) -> float:
    t, samples = grid.result.t_eval[0], grid.result.samples
    twist = samples["omega_l"][row] - samples["omega_m"][row] / grid.result.parameters(row)["ratio"]
    before, last = (float(np.std(twist[(t >= begin) & (t < begin + 1.0)])) for begin in (t[-1] - 2.0, t[-1] - 1.0))
    return last / before - 1.0 if before > 0.0 and np.isfinite(last) else 0.0


def _turn(grid: Grid) -> str:
    """From which factor on a motor that turns forward carries the load backward somewhere in its revolution."""
    ratio = grid.of("upsilon_min", HELD)
    if ratio[-1] > 0.0:
        return "the local ratio stays positive"
    return f"from {np.interp(0.0, -ratio, grid.values):.3g} times the error on the local ratio turns negative"
