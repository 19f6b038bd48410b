"""One thing a health check has to say."""

from __future__ import annotations

from dataclasses import dataclass

NOTE, WARNING, REJECT = "note", "warning", "reject"


@dataclass(frozen=True)
class Finding:
    """A sentence with the numbers behind it.

    Attributes:
        check: which check speaks.
        severity: "note" (good to know), "warning" (taken into account or to be mended) or "reject" (not usable).
        sentence: what was found and what to do about it.
        value: the statistic, or None.
        limit: its threshold, or None.
        t0, t1: the time it concerns [s], or None for the whole recording.
    """

    check: str
    severity: str
    sentence: str
    value: float | None = None
    limit: float | None = None
    t0: float | None = None
    t1: float | None = None
