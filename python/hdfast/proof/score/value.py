"""One published figure with its interval and its mark."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from hdfast.proof.score.intervals import bootstrap, wilson


@dataclass(frozen=True)
class Score:
    """A figure.

    Attributes:
        name: of the score.
        value: point estimate, nan where no case carries it.
        low: lower end of the 95 % interval.
        high: upper end.
        count: cases behind it.
        mark: the pass mark in words, or "".
        passed: True when the point estimate meets the mark, None without mark or without cases.
        note: what the figure is.
    """

    name: str
    value: float
    low: float
    high: float
    count: int
    mark: str = ""
    passed: bool | None = None
    note: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values; nan becomes None."""
        return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(self).items()}


def share(
    name: str, hits: Sequence[bool], mark: str = "", meets: Callable[[float], bool] | None = None, note: str = ""
) -> Score:
    """A proportion with its Wilson interval."""
    count = len(hits)
    value = sum(hits) / count if count else float("nan")
    low, high = wilson(sum(hits), count)
    return Score(name, value, low, high, count, mark, meets(value) if meets and count else None, note)


def statistic(
    name: str,
    cases: Sequence[Any],
    of: Callable[[list[Any]], float],
    mark: str = "",
    meets: Callable[[float], bool] | None = None,
    note: str = "",
) -> Score:
    """Any figure with its bootstrap interval."""
    value = of(list(cases)) if cases else float("nan")
    low, high = bootstrap(cases, of)
    passed = meets(value) if meets and math.isfinite(value) else None
    return Score(name, value, low, high, len(cases), mark, passed, note)
