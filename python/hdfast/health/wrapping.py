"""Wrapping: an angle that starts again after every turn, or after another period."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import REJECT
from hdfast.health.subject import ANGLES, Subject
from hdfast.recordings import Recording

NAME = "wrapping"
TURN, DEGREES = 2.0 * math.pi, 360.0
RANGE = 1.05
CLOSE, FARTHEST = 0.05, 0.3
STEADY = 1.5
GAP = 2.0
FEWEST, FEWEST_BETWEEN = 2, 8
PERIODS = {math.pi: "half a turn", 180.0: "half a turn in degrees", 400.0: "a turn in gon", 1.0: "a turn in turns"}
FEWEST_BITS = 6
NAMED = 0.01


@dataclass(frozen=True)
class Wraps:
    """How often an angle jumps back, and by how much: `period` in its own unit, None for a whole turn."""

    count: int
    period: float | None = None

    def told(self, name: str) -> str:
        """What is said of it."""
        if self.period is None:
            return f"{name} jumps by a whole turn {self.count} times: unwrap it (numpy.unwrap) before saving"
        return (
            f"{name} jumps by {self.period:.5g} ({_named(self.period)}) {self.count} times and starts again: unwrap it "
            "with that period (numpy.unwrap) before saving"
        )


def check(subject: Subject) -> None:
    """Reject an angle that is wrapped."""
    for name in ANGLES:
        found = wraps(subject.checked, name, subject.ratio)
        if found is not None:
            subject.find(NAME, REJECT, found.told(name), value=found.count)


def wraps(recording: Recording, name: str, ratio: float | None) -> Wraps | None:
    """The jumps of an angle that stays within one turn, or within another period, and starts again at its end.

    A turn is 2 pi or 360, also when it was multiplied by the ratio.
    """
    if name not in recording:
        return None
    known = np.isfinite(recording[name])
    t, angle = recording["t"][known], recording[name][known]
    if angle.size < FEWEST_BETWEEN:
        return None
    intervals, steps = np.diff(t), np.diff(angle)
    steps = np.where(intervals <= GAP * np.median(intervals), steps, 0.0)
    span = float(np.ptp(angle))
    turns = [whole * scale for whole in (TURN, DEGREES) for scale in (1.0, abs(ratio or 1.0))]
    count = next((found for turn in turns if span < RANGE * turn and (found := _jumps(np.abs(steps), turn))), 0)
    return Wraps(count) if count else _periodic(steps, span)


def _jumps(steps: Floats, turn: float) -> int:
    """How many steps are a turn off those around them; 0 when others are too large to be motion."""
    far = steps > 0.5 * turn
    usual = np.clip(STEADY * np.max(steps[~far], initial=0.0), CLOSE * turn, FARTHEST * turn)
    return int(far.sum()) if np.all(np.abs(steps[far] - turn) < usual) else 0


def _periodic(steps: Floats, span: float) -> Wraps | None:
    """Jumps against the motion from one end of the range to the other, which small steps go through in between."""
    far = np.flatnonzero(np.abs(steps) > 0.5 * span)
    inner = far[(far > 0) & (far < steps.size - 1)]
    near = np.delete(steps, far)
    if inner.size < FEWEST or np.unique(near).size < FEWEST_BETWEEN:
        return None
    usual = float(np.max(np.abs(near)))
    period = float(np.median(np.abs(steps[inner] - 0.5 * (steps[inner - 1] + steps[inner + 1]))))
    if usual > FARTHEST * period or np.any(np.abs(np.abs(steps[far]) - period) > STEADY * usual):
        return None
    onward = np.diff(far)[steps[far[:-1]] * steps[far[1:]] > 0.0]
    against = float(np.mean(steps[inner - 1] * steps[inner] < 0.0))
    whole = onward.size > 0 and np.all(onward > FEWEST_BETWEEN) and against > 0.5
    return Wraps(int(far.size), period) if whole and span < period + usual else None


def _named(period: float) -> str:
    """What a period is."""
    counts = float(2 ** max(FEWEST_BITS, round(math.log2(period))))
    known = PERIODS | {counts: f"{counts:.0f} counts"}
    other = f"{period / TURN:.4g} turns"
    return next((name for size, name in known.items() if abs(period / size - 1.0) < NAMED), other)
