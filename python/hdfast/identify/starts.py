"""Starts from rest under a slowly rising torque."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.health.stretches import stretches
from hdfast.identify.angles import refuse_wrapped
from hdfast.identify.resolution import resolution
from hdfast.recordings import Recording

WINDOW = 0.02  # s, over which speed is taken
WEAK, STRONG = 3.0, 30.0  # standard deviations of that speed
LEAST_REST = 0.5  # s
SLOW = 0.5  # share of the starting torque that has to stand LEAST_REST before the start
LINE, MEAN = 2.0, 0.1  # s, over which the torque is read at most, and judged
RISEN = 0.1  # share of its rise at which the torque has left its rest
CLEAR = 5.0  # standard deviations
FAST = (
    f"less than {SLOW:g} of the torque stood {LEAST_REST:g} s before: moves between angles, or ramps of less than "
    f"{LEAST_REST / (1.0 - SLOW):g} s, which need a slower torque"
)
UNCLEAR = "the torque does not push the way the motor goes, or its noise hides it"
SPARSE = f"less than two samples in {MEAN:g} s"


@dataclass(frozen=True, eq=False)
class Starts:
    """Starts of all recordings, each (n,).

    Attributes:
        torque: motor torque at the start [N m], positive in both directions.
        noise: standard deviation of that reading [N m].
        angle: motor angle at rest [rad].
        direction: +1 or -1.
        recording: number of the recording.
    """

    torque: Floats
    noise: Floats
    angle: Floats
    direction: Floats
    recording: Floats


def starts(recordings: list[Recording], notes: list[str]) -> Starts:
    """Collect the starts: speed leaves its noise after half a second of rest or more, the torque rising slowly.

    Moves that begin with a fast torque are passed over. How many starts are, and what is not stated of the encoder, is
    noted.

    Raises:
        InputError: a column is missing, the motor angle is wrapped, or no start is found.
    """
    passed: Counter[str] = Counter()
    rows = [(*row, float(j)) for j, recording in enumerate(recordings) for row in _of(recording, passed, notes)]
    why = [f"{count} {'starts are' if count > 1 else 'start is'} passed over: {text}" for text, count in passed.items()]
    if not rows:
        allowed = "allowed: rest of at least 0.5 s, then a torque that rises slowly until the motor moves"
        raise InputError("; ".join([f"no start found ({allowed})", *why]))
    notes += why
    return Starts(*np.array(rows).T)


def _of(recording: Recording, passed: Counter[str], notes: list[str]) -> list[tuple[float, float, float, float]]:
    t, angle, torque = recording.need("a starting-torque test", "t", "motor_angle", "motor_torque")
    refuse_wrapped(recording, "motor_angle")
    span = max(1, round(WINDOW / float(np.median(np.diff(t)))))
    speed = (angle[span:] - angle[:-span]) / (t[span:] - t[:-span])
    jitter = float(np.median(np.abs(np.diff(angle, 2)))) / 0.6745 / math.sqrt(6.0)
    step = resolution(recording, "motor_angle", angle, notes)
    noise = math.sqrt(2.0) * max(jitter, 0.5 * step, 1e-12) / WINDOW
    found, rested = [], float(t[0])
    for first, surely, last in _moving(np.abs(speed), noise):
        begin = first + span
        if t[begin] - rested > LEAST_REST:
            row = _start(t, angle, torque, rested, begin, float(np.sign(speed[surely])))
            if isinstance(row, str):
                passed[row] += 1
            else:
                found.append(row)
        rested = float(t[min(last + span, len(t) - 1)])
    return found


def _moving(speed: Floats, noise: float) -> list[tuple[int, int, int]]:
    """Stretches [first, last) of motion above the weak threshold, and where inside the strong one is reached."""
    moving = zip(*stretches(speed > WEAK * noise), strict=True)
    strong = speed > STRONG * noise
    return [(int(a), int(a + np.argmax(strong[a:b])), int(b)) for a, b in moving if strong[a:b].any()]


def _start(
    t: Floats, angle: Floats, torque: Floats, rested: float, begin: int, direction: float
) -> tuple[float, float, float, float] | str:
    """(torque, its standard deviation, angle, direction) from a straight line through the rise before the start.

    Returns:
        Where it is no start that counts, why.
    """
    late = (t > t[begin] - MEAN) & (t <= t[begin])
    early = np.abs(t - t[begin] + LEAST_REST) < 0.5 * MEAN
    if min(late.sum(), early.sum()) < 2:
        return SPARSE
    line = (t > max(rested, t[begin] - LINE)) & (t <= t[begin])
    line = np.flatnonzero(line)[_rise(t[line] - t[begin], direction * torque[line]) :]
    x = t[line] - t[begin]
    (slope, level), covariance = np.polyfit(x, torque[line], 1, cov="unscaled")
    scatter = float(np.std(torque[line] - level - slope * x))
    held, reached = direction * float(np.mean(torque[early])), direction * float(np.mean(torque[late]))
    if reached <= CLEAR * scatter / math.sqrt(late.sum()):
        return UNCLEAR
    if held < SLOW * reached:
        return FAST
    reading = scatter * math.sqrt(float(covariance[1, 1]))
    return direction * float(level), reading, float(np.median(angle[line])), direction


def _rise(before: Floats, torque: Floats) -> int:
    """First sample of the rise out of rest, at least LEAST_REST before the start at time 0; 0 where all is rise."""
    size = max(1, round(MEAN / float(np.median(np.diff(before)))))
    smooth = scipy.ndimage.uniform_filter1d(torque, size)
    least, most = float(np.min(smooth)), float(smooth[-1])
    if least > SLOW * most:
        return 0
    resting = (smooth < least + RISEN * (most - least)) & (before < -LEAST_REST)
    return int(np.flatnonzero(resting)[-1]) + 1 if resting.any() else 0
