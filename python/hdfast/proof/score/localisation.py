"""Where the mismatch was said to be: place, windows, orders."""

from __future__ import annotations

import numpy as np

from hdfast.proof.score.identification import SINGLE
from hdfast.proof.score.judge import NAMED_FROM, Case
from hdfast.proof.score.value import Score, share, statistic

STEP = 0.01
TOLERANCE = 0.02

Window = tuple[float, float, str]


def scores(cases: list[Case]) -> list[Score]:
    """Scores of the answers that claim or consider something, single effects of 1.5 detectable amplitudes or more."""
    told = [
        c
        for c in cases
        if c.stratum in SINGLE and c.strength >= NAMED_FROM and c.answer.listed and c.answer.verdict["where"]
    ]
    placed = [c for c in told if c.label.get("separable_place")]
    overlaps = [overlap(_windows(c.answer.verdict["where"]), _windows(c.label)) for c in told if c.label["windows"]]
    errors = [order_error(c) for c in told if c.label["orders"]]
    return [
        share("place", [c.answer.verdict["where"].get("place") == c.label["effects"][0]["place"] for c in placed],
              ">= 90 %", lambda v: v >= 0.9, "where the certificate calls the place separable"),
        statistic("windows: overlap", overlaps, _median, ">= 0.6", lambda v: v >= 0.6, "median over cases"),
        statistic("orders: error", errors, _median, "<= 2 %", lambda v: v <= TOLERANCE, "median relative error"),
    ]  # fmt: skip


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _windows(where: dict[str, object]) -> list[Window]:
    found = where.get("windows")
    return [(float(w[0]), float(w[1]), str(w[2])) for w in found] if isinstance(found, list) else []


def overlap(said: list[Window], true: list[Window]) -> float:
    """Intersection over union of two sets of time windows, over all files."""
    both = _steps(said + true)
    return (_steps(said) + _steps(true) - both) / both if both else 1.0


def _steps(windows: list[Window]) -> int:
    """Steps of `STEP` seconds in a union of windows."""
    count, reached = 0, dict[str, int]()
    for file, first, end in sorted((file, round(a / STEP), round(b / STEP)) for a, b, file in windows):
        begin = max(first, reached.get(file, first))
        count += max(end - begin, 0)
        reached[file] = max(begin, end)
    return count


def order_error(case: Case) -> float:
    """Relative distance of the nearest stated order to the true one; 1 without any."""
    said = [float(x) for x in case.answer.verdict["where"].get("orders") or []]
    true = float(case.label["orders"][0])
    return min((abs(x / true - 1.0) for x in said), default=1.0)
