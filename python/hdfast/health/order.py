"""Order of time: rows written twice, times that repeat or run backward, a clock that was set back."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.finding import REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.printing import moment
from hdfast.recordings.clock import MOST_DISORDER
from hdfast.recordings.doubled import doubled

NAME = "time"
FEWEST = 8
AROUND, FEWEST_AROUND = 10, 3
FOR_GOOD = 0.5  # of a step


def check(subject: Subject) -> bool:
    """Drop what breaks the order of time; False when nothing useful is left."""
    _twice(subject)
    rows = np.flatnonzero(subject.timed)
    t = subject.clean("t")[rows]
    chosen = longest_increasing(t) if np.any(np.diff(t) <= 0.0) else np.arange(t.size)
    subject.timed[:] = False
    subject.timed[rows[chosen]] = True
    if chosen.size < FEWEST:
        sentence = f"{chosen.size} samples with increasing time (allowed: at least {FEWEST})"
        subject.find(NAME, REJECT, sentence, value=chosen.size, limit=FEWEST)
        return False
    share = 1.0 - chosen.size / t.size
    ordered = _backward(subject, rows, t, share)
    return _repeated(subject, rows, t, share) and ordered


def _twice(subject: Subject) -> None:
    again = subject.timed & doubled(subject.recording)
    if not again.any():
        return
    subject.timed &= ~again
    first = int(np.argmax(again))
    at = float(subject.recording["t"][first])
    count = int(again.sum())
    sentence = f"{count} rows are written twice, first in sample {first} at {moment(at)} s; one of each is left out"
    subject.find(NAME, WARNING, sentence, value=count, t0=at, t1=at)


def _backward(subject: Subject, rows: NDArray[np.intp], t: Floats, share: float) -> bool:
    """Name times that run backward; False when the recording cannot be used for that."""
    places = np.flatnonzero(np.diff(t) < 0.0)
    if not places.size:
        return True
    sizes = [set_back(t, int(place)) for place in places]
    first = next((number for number, size in enumerate(sizes) if size), 0)
    place, size = places[first], sizes[first]
    at = float(t[place])
    sentence = f"time runs backward {places.size} times, first after {moment(at)} s"
    if size:
        sentence = (
            f"the clock was set back by {size:.4g} s after sample {rows[place]} at {moment(at)} s while the "
            "recording went on; add that to the later times, or split the file there"
        )
    elif share > MOST_DISORDER:
        sentence += "; split the file where a new run begins, or name another column in [columns] t"
    else:
        sentence += f"; {round(share * t.size)} samples are left out"
    severity = REJECT if size or share > MOST_DISORDER else WARNING
    subject.find(NAME, severity, sentence, value=size or share, limit=0.0 if size else MOST_DISORDER, t0=at, t1=at)
    return severity == WARNING


def set_back(t: Floats, place: int) -> float:
    """By how much a clock runs behind for good [s] from the sample after `place` on; 0 where single samples stray."""
    around = min(AROUND, place + 1, len(t) - place - 1)
    if around < FEWEST_AROUND:
        return 0.0
    steps = np.diff(t)
    step = float(np.median(steps[steps > 0.0]))
    apart = np.arange(around)
    behind = float(np.median((2 * apart + 1) * step - t[place + 1 + apart] + t[place - apart]))
    return behind if behind > FOR_GOOD * step else 0.0


def _repeated(subject: Subject, rows: NDArray[np.intp], t: Floats, share: float) -> bool:
    """Name times that repeat; False when the recording cannot be used for that."""
    places = np.flatnonzero(np.diff(t) == 0.0) + 1
    if not places.size:
        return True
    few, at = share <= MOST_DISORDER, float(t[places[0]])
    remedy = "they are left out" if few else "write the time with more digits"
    where = f"first in sample {rows[places[0]]} at {moment(at)} s"
    sentence = f"{places.size} samples repeat the time before them, {where}; {remedy}"
    subject.find(NAME, WARNING if few else REJECT, sentence, value=share, limit=MOST_DISORDER, t0=at, t1=at)
    return few


def longest_increasing(values: Floats) -> NDArray[np.intp]:
    """Positions of a longest strictly increasing subsequence."""
    tails: list[float] = []
    last: list[int] = []
    before = np.full(len(values), -1, dtype=np.intp)
    for position, value in enumerate(values.tolist()):
        place = bisect_left(tails, value)
        if place:
            before[position] = last[place - 1]
        if place == len(tails):
            tails.append(value)
            last.append(position)
        else:
            tails[place], last[place] = value, position
    chain = [last[-1]] if last else []
    while chain and before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1], dtype=np.intp)
