"""The article's claims, each with our sign and size under every scenario that could show it, and a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.studies import cases
from hdfast.studies.cases import Grid
from hdfast.studies.claims_list import CLAIMS, Claim, Look

REPRODUCED, PARTLY, CONTRADICTORY, OPEN = (
    "reproduced",
    "reproduced under some scenarios",
    "contradictory",
    "not reproducible",
)
SMALL = 0.02
UP, DOWN, SAME, MIXED = "up", "down", "const", "mixed"
ARROWS = {UP: "↑", DOWN: "↓", SAME: "const", MIXED: "mixed"}
HEADER = ["claim", "article says", "verdict", "our sign and size", "reason"]


@dataclass(frozen=True)
class Finding:
    """Sign and size of one metric over the article's points under one scenario."""

    where: str
    sign: str
    change: float
    agrees: bool

    def __str__(self) -> str:
        return f"{self.where}: {ARROWS[self.sign]} {100 * self.change:+.3g} %"


@dataclass(frozen=True)
class Verdict:
    """A claim held against the computation."""

    item: str
    text: str
    verdict: str
    findings: list[Finding] = field(default_factory=list)
    reason: str = ""

    def row(self) -> list[str]:
        """Cells under `HEADER`."""
        return [self.item, self.text, self.verdict, "; ".join(map(str, self.findings)) or "-", self.reason]


def decide(study: str, grids: Mapping[str, Grid]) -> list[Verdict]:
    """Decide every claim of a study from its sweeps."""
    return [verdict(claim, grids) for claim in CLAIMS if claim.study == study]


def verdict(claim: Claim, grids: Mapping[str, Grid]) -> Verdict:
    """Decide one claim: all, some or none of the scenarios agree with the article's sign.

    Its reason was found on the default drive, which is said where the sweep is of another.
    """
    grid = grids[claim.parameter]
    findings = [finding(claim, look, grid) for look in claim.looks]
    reason = f"default drive: {claim.reason}" if claim.reason and grid.own else claim.reason
    return Verdict(claim.item, claim.text, word(findings), findings, reason)


def word(findings: Sequence[Finding]) -> str:
    """What all, some or none of the scenarios agreeing is called."""
    agreeing = sum(item.agrees for item in findings)
    return REPRODUCED if agreeing == len(findings) else PARTLY if agreeing else CONTRADICTORY


def finding(claim: Claim, look: Look, grid: Grid) -> Finding:
    """Sign and relative change of a metric from the first to the last of the article's points."""
    values = grid.of(look.metric, look.case, look.load)[grid.marked]
    sign, change = trend(values)
    inertia = "" if grid.parameter == "J_l" else f", J_l {look.load:g}"
    where = f"{cases.CASES[look.case].label}{inertia}, {look.metric.replace('_', ' ')}"
    return Finding(where, sign, change, sign == claim.sign)


def trend(values: Floats | Sequence[float]) -> tuple[str, float]:
    """(sign, relative change from first to last): "const" within 2 %, "mixed" when it turns back by more than that."""
    v = np.asarray(values, dtype=np.float64)
    if not np.all(np.isfinite(v)) or v[0] == 0.0:
        return MIXED, float("nan")
    change = float(v[-1] / v[0] - 1.0)
    steps = np.diff(v) / np.abs(v[0])
    if np.ptp(v) <= SMALL * np.abs(v[0]):
        return SAME, change
    if change > 0.0 and np.all(steps >= -SMALL):
        return UP, change
    if change < 0.0 and np.all(steps <= SMALL):
        return DOWN, change
    return MIXED, change
