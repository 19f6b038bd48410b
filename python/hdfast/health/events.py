"""Events: times in which something outside the drive acts, such as a collision or a fault.

The torque that a rigid drive leaves unexplained changes its scale there, and at the onset the motion has changed while
the motor torque has not. A step of the torque leaves a residual too, but there the torque comes first; a standstill
leaves one as well, but there the motor does not turn. Where a rigid drive explains little, nothing is said.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.finding import WARNING
from hdfast.health.motion import Motion
from hdfast.health.subject import Subject
from hdfast.printing import moment

NAME = "events"
TIMES_USUAL = 8.0
SHARE_OF_TORQUE = 0.3
EXPLAINED = 0.05
MERGE = 0.2
LONGEST, MOST = 0.2, 3
BEFORE, CHANGE, CAUSE = 0.15, 0.5, 0.2
TURNING = 0.2


def check(subject: Subject) -> None:
    """Find stretches where the residual stands far out; they are left out of calibration."""
    motion = subject.motion
    fit = subject.rigid
    if fit is None:
        return
    residual = np.where(motion.valid, fit.residual, 0.0)
    usual = 1.4826 * float(np.median(np.abs(residual[motion.valid])))
    torque = motion.torque[motion.valid]
    largest = float(np.quantile(np.abs(torque), 0.98))
    limit = max(TIMES_USUAL * usual, SHARE_OF_TORQUE * largest)
    stretches = _stretches(motion, np.abs(residual) > limit)
    if usual > EXPLAINED * largest or not stretches or len(stretches) > MOST:
        return
    if sum(motion.t[last] - motion.t[first] for first, last in stretches) > LONGEST * (motion.t[-1] - motion.t[0]):
        return
    for first, last in stretches:
        if not _from_outside(motion, residual, first, last):
            continue
        peak = float(np.max(np.abs(residual[first : last + 1])))
        begin, end = float(motion.t[first] - motion.width), float(motion.t[last] + MERGE)
        subject.facts.events.append((begin, end))
        subject.find(
            NAME,
            WARNING,
            f"from {moment(begin)} to {moment(end)} s up to {peak:.3g} N m of the motor torque come from outside "
            f"(usual: {usual:.3g} N m), as in a collision or a fault; the window is left out of calibration",
            value=peak,
            limit=limit,
            t0=begin,
            t1=end,
        )


def _stretches(motion: Motion, loud: NDArray[np.bool_]) -> list[tuple[int, int]]:
    places = np.flatnonzero(loud)
    if not places.size:
        return []
    breaks = np.flatnonzero(np.diff(motion.t[places]) > MERGE)
    firsts, lasts = places[np.append(0, breaks + 1)], places[np.append(breaks, places.size - 1)]
    return list(zip(firsts.tolist(), lasts.tolist(), strict=True))


def _from_outside(motion: Motion, residual: Floats, first: int, last: int) -> bool:
    """The motor turned, and at the onset its motion changed without a torque of its own to cause it."""
    edge, back = round(motion.width / 2.0 / motion.step), round(BEFORE / motion.step)
    onset = first - edge
    if back < 1 or onset - back < 0 or last + edge >= len(motion.t):
        return False
    before = slice(onset - back, onset)
    needed = motion.torque - residual
    early = slice(first, first + edge + 1)
    cause = motion.torque[early] - np.median(motion.torque[before])
    change = needed[early] - np.median(needed[before])
    moved = np.abs(change) > CHANGE * np.abs(cause - change)
    unasked = cause * np.sign(change) < CAUSE * np.abs(change)
    turning = np.min(np.abs(motion.speed[before])) > TURNING * np.max(np.abs(motion.speed))
    return bool(turning and np.any(moved & unasked))
