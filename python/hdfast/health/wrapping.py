"""Wrapping: an angle that starts again after every turn."""

from __future__ import annotations

import math

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import REJECT
from hdfast.health.subject import Subject
from hdfast.recordings import Recording

NAME = "wrapping"
ANGLES = ("motor_angle", "load_angle")
RANGE = 1.05
CLOSE, FARTHEST = 0.05, 0.3
STEADY = 1.5
GAP = 2.0


def check(subject: Subject) -> None:
    """Reject an angle that is wrapped."""
    for name in ANGLES:
        count = wraps(subject.checked, name, subject.ratio)
        if count:
            subject.find(NAME, REJECT, told(name, count), value=count)


def wraps(recording: Recording, name: str, ratio: float | None) -> int:
    """How often an angle that stays within one turn jumps by a whole one between neighbouring samples.

    A turn is 2 pi or 360, also when it was multiplied by the ratio. Without that column 0.
    """
    if name not in recording:
        return 0
    intervals, angle = np.diff(recording["t"]), recording[name]
    steps = np.abs(np.diff(angle))[intervals <= GAP * np.median(intervals)]
    steps = steps[np.isfinite(steps)]
    if not steps.size:
        return 0
    span = float(np.ptp(angle[np.isfinite(angle)]))
    turns = [whole * scale for whole in (2.0 * math.pi, 360.0) for scale in (1.0, abs(ratio or 1.0))]
    return next((found for turn in turns if span < RANGE * turn and (found := _jumps(steps, turn))), 0)


def told(name: str, count: int) -> str:
    """What is said of an angle that is wrapped so many times."""
    return f"{name} jumps by a whole turn {count} times: unwrap it (numpy.unwrap) before saving"


def _jumps(steps: Floats, turn: float) -> int:
    """How many steps are a turn off those around them; 0 when others are too large to be motion."""
    far = steps > 0.5 * turn
    usual = np.clip(STEADY * np.max(steps[~far], initial=0.0), CLOSE * turn, FARTHEST * turn)
    return int(far.sum()) if np.all(np.abs(steps[far] - turn) < usual) else 0
