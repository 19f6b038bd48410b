"""The one gate before every statistic: what happens to rows that failed or lack a metric."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.errors import Carrying

POLICIES = ("refuse", "exclude", "worst")


SAY = (
    "say what that means with failed='exclude' (leave them out, the count stays on every figure) or failed='worst' "
    "(count them as out of limits)"
)
#: Where a design of rows is used whole.
WHOLE = "none of these rows can be left out: narrow the tolerances that lead there"


class FailedRowsError(Carrying, RuntimeError):
    """Rows failed or lack a metric and nobody said what that means.

    Attributes:
        metric: the metric that is missing.
        rows: numbers of the first rows concerned.
        count: how many there are.
    """

    def __init__(
        self, metric: str, rows: list[int], count: int, total: int, reason: str = "", remedy: str = SAY
    ) -> None:
        listed = ", ".join(map(str, rows)) + (", ..." if count > len(rows) else "")
        first = f"; {reason.removesuffix('.')};" if reason else ":"
        super().__init__(f"{count} of {total} rows have no {metric} (rows {listed}){first} {remedy}")
        self.metric, self.rows, self.count = metric, rows, count


@dataclass(frozen=True)
class Usable:
    """Values of one metric after the gate.

    Attributes:
        values: (n,) the values used; under "worst" a missing one is infinite on the bad side.
        index: (n,) number of the row of each value.
        missing: how many rows failed or lack the metric.
        policy: what was done about them.
    """

    values: Floats
    index: NDArray[np.int64]
    missing: int
    policy: str

    @property
    def note(self) -> str:
        """What a figure has to say, empty when no row is missing."""
        if not self.missing:
            return ""
        return f"{self.missing} rows " + ("left out" if self.policy == "exclude" else "counted as worst case")

    @property
    def measured(self) -> Floats:
        """The values that exist."""
        return self.values[np.isfinite(self.values)] if self.missing else self.values


def gate(
    values: Floats,
    finished: NDArray[np.bool_],
    policy: str,
    metric: str,
    bad_side: float = np.inf,
    reason: Callable[[int], str] = lambda _: "",
    remedy: str = SAY,
) -> Usable:
    """Let the values of a metric through to statistics.

    Args:
        values: (n,) one per row; anything that is not finite counts as missing.
        finished: (n,) False where the row failed.
        policy: "refuse", "exclude" or "worst".
        metric: its name, for messages.
        bad_side: what stands for a missing value under "worst": +inf or -inf.
        reason: what became of a row, asked of the first that is missing.
        remedy: what to do about it.

    Raises:
        FailedRowsError: under "refuse", when a row is missing.
    """
    good = finished & np.isfinite(values)
    missing = int(len(values) - np.count_nonzero(good))
    if missing and policy == "refuse":
        rows = np.flatnonzero(~good)[:5].tolist()
        raise FailedRowsError(metric, rows, missing, len(values), reason(rows[0]), remedy)
    if missing and policy == "worst":
        return Usable(np.where(good, values, bad_side), np.arange(len(values)), missing, policy)
    index = np.flatnonzero(good)
    return Usable(values[index] if missing else values, index, missing, policy)
