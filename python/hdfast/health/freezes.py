"""Freezes: an angle that keeps its value while the other side of the gear moves."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import REJECT, WARNING
from hdfast.health.sides import WINDUP
from hdfast.health.steps import hold
from hdfast.health.subject import ANGLES, Subject
from hdfast.printing import moment

NAME = "freezes"
FEWEST, FEWEST_CHANGES = 5, 20
TIMES_USUAL = 10.0
STEPS = 3.0
MOST = 0.2


def check(subject: Subject) -> None:
    """Leave out what is frozen; reject an angle that goes on as if nothing had moved.

    The other side moves by more than the gear winds up and than a coarse sensor hides. A dropout, which begins with a
    jump, is no freeze.
    """
    motor, load = ANGLES
    if subject.ratio and subject.known(motor).size and subject.known(load).size:
        _of(subject, motor, load, abs(subject.ratio))
        _of(subject, load, motor, 1.0 / abs(subject.ratio))


def _of(subject: Subject, name: str, other: str, gear: float) -> None:
    rows, others, t = subject.known(name), subject.known(other), subject.recording["t"]
    values, step = subject.recording[name][rows], subject.recording.resolution.get(name, 0.0)
    moved = gear * np.interp(t[rows], t[others], subject.recording[other][others])
    allowed = WINDUP * max(gear, 1.0) + STEPS * step
    found = [
        (begin, end)
        for begin, end in stays(values)
        if np.ptp(moved[begin:end]) > max(allowed, abs(values[begin] - values[max(begin - 1, 0)]))
    ]
    if not found or hold(t[rows], values, step) is not None:
        return
    frozen = np.concatenate([rows[begin:end] for begin, end in found])
    share, at = frozen.size / rows.size, float(t[frozen[0]])
    behind = max((_behind(values, moved, begin, end) for begin, end in found if end < values.size), default=0.0)
    usable = behind <= allowed and share <= MOST
    if usable:
        remedy = "they are left out"
    elif behind > allowed:
        remedy = f"after it {behind:.3g} rad are missing: split the file there"
    else:
        remedy = "mend the sensor"
    sentence = (
        f"{name} keeps its value in {frozen.size} samples while {other} moves, {len(found)} times, first in sample "
        f"{frozen[0]} at {moment(at)} s; {remedy}"
    )
    subject.find(NAME, WARNING if usable else REJECT, sentence, value=share, limit=MOST, t0=at, t1=at)
    subject.leave_out(name, frozen)


def stays(values: Floats) -> list[tuple[int, int]]:
    """Begins and ends of stretches of one value that are long beside the others; none of a channel that is dead."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    if edges.size < FEWEST_CHANGES:
        return []
    begins, ends = np.concatenate([[0], edges]), np.concatenate([edges, [values.size]])
    lengths = ends - begins
    long = lengths >= max(FEWEST, TIMES_USUAL * float(np.median(lengths)))
    return list(zip(begins[long].tolist(), ends[long].tolist(), strict=True))


def _behind(values: Floats, moved: Floats, begin: int, end: int) -> float:
    """By how much less than the other side an angle has moved over a stretch and the step that ends it [rad]."""
    return float(abs(moved[end] - moved[begin]) - abs(values[end] - values[begin]))
