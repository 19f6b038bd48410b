"""Is the number of rows enough: running estimates with their band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.tolerance.intervals import Estimate, Groups, percentile, share

POINTS = 16
FIRST = 50


@dataclass(frozen=True)
class Course:
    """An estimate after more and more rows, in row order.

    Attributes:
        rows: numbers of rows, evenly spaced in the logarithm.
        estimates: one per entry of `rows`.
    """

    rows: list[int]
    estimates: list[Estimate]


def stations(rows: int) -> list[int]:
    """Numbers of rows at which a running estimate is looked at; none without rows."""
    if rows <= FIRST:
        return [rows] if rows else []
    return sorted({round(n) for n in np.geomspace(FIRST, rows, POINTS)})


def running_share(hits: NDArray[np.bool_], groups: Groups | None = None) -> Course:
    """A yield after more and more rows."""
    return _course(hits, groups, share)


def running_percentile(values: Floats, share_below: float, groups: Groups | None = None) -> Course:
    """A percentile after more and more rows."""

    def estimate(part: Floats, some: Groups | None) -> Estimate:
        return percentile(np.sort(part) if some is None else part, share_below, some)

    return _course(values, groups, estimate)


def _course(values: Any, groups: Groups | None, estimate: Callable[[Any, Groups | None], Estimate]) -> Course:
    rows = stations(len(values))
    found = [estimate(values[:n], None if groups is None else groups.take(slice(0, n))) for n in rows]
    return Course(rows, found)
