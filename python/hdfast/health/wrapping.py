"""Wrapping: an angle that starts again after every turn."""

from __future__ import annotations

import math

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import REJECT
from hdfast.health.subject import Subject

NAME = "wrapping"
ANGLES = ("motor_angle", "load_angle")
RANGE = 1.05
CLOSE, FARTHEST = 0.05, 0.3
STEADY = 1.5
GAP = 2.0


def check(subject: Subject) -> None:
    """Reject an angle that stays within one turn and jumps by a whole one between neighbouring samples.

    A turn is 2 pi or 360, also when it was multiplied by the ratio.
    """
    intervals = np.diff(subject.checked["t"])
    near = intervals <= GAP * np.median(intervals)
    for name in ANGLES:
        if name not in subject.checked:
            continue
        angle = subject.checked[name]
        steps = np.abs(np.diff(angle))[near]
        steps = steps[np.isfinite(steps)]
        if not steps.size:
            continue
        span = float(np.ptp(angle[np.isfinite(angle)]))
        turns = [whole * scale for whole in (2.0 * math.pi, 360.0) for scale in (1.0, abs(subject.ratio or 1.0))]
        count = next((found for turn in turns if span < RANGE * turn and (found := _jumps(steps, turn))), 0)
        if count:
            sentence = f"{name} jumps by a whole turn {count} times: unwrap it (numpy.unwrap) before saving"
            subject.find(NAME, REJECT, sentence, value=count)


def _jumps(steps: Floats, turn: float) -> int:
    """How many steps are a turn off those around them; 0 when others are too large to be motion."""
    far = steps > 0.5 * turn
    usual = np.clip(STEADY * np.max(steps[~far], initial=0.0), CLOSE * turn, FARTHEST * turn)
    return int(far.sum()) if np.all(np.abs(steps[far] - turn) < usual) else 0
