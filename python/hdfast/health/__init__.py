"""Health of recordings: what is wrong with them before anything is fitted, and how to mend it."""

from hdfast.health.check import check
from hdfast.health.coverage import Coverage
from hdfast.health.finding import NOTE, REJECT, WARNING, Finding
from hdfast.health.repeats import Repeat
from hdfast.health.result import Health, RecordingHealth
from hdfast.health.subject import Facts

__all__ = [
    "NOTE",
    "REJECT",
    "WARNING",
    "Coverage",
    "Facts",
    "Finding",
    "Health",
    "RecordingHealth",
    "Repeat",
    "check",
]
