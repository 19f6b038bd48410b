"""Time: order, duplicates, gaps, jitter."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.finding import NOTE, REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.printing import moment
from hdfast.recordings.clock import MOST_DISORDER, period, usual_steps

NAME = "time"
FEWEST = 8
GAP, GAP_SIGMAS = 1.5, 6.0
MOST_MISSING = 0.2
MOST_JITTER = 0.05
NORMAL = 1.4826


def check(subject: Subject) -> None:
    """Find the samples that stand in order, then gaps and jitter among them."""
    t = subject.clean("t")
    finite = np.isfinite(t)
    subject.timed &= finite
    if not _order(subject, t, finite):
        return
    steps = np.diff(t[subject.timed])
    median = float(np.median(steps))
    subject.facts.rate_hz = 1.0 / period(t[subject.timed])
    spread = NORMAL * float(np.median(np.abs(steps - median)))
    usual = usual_steps(t[subject.timed])
    _gaps(subject, t[subject.timed], steps, np.maximum(GAP * usual, usual + GAP_SIGMAS * spread))
    if spread / median > MOST_JITTER:
        subject.find(
            NAME,
            NOTE,
            f"samples are irregular: the step of {median:.4g} s varies by {100.0 * spread / median:.3g} %; "
            "times are used as they are",
            value=spread / median,
            limit=MOST_JITTER,
        )


def _order(subject: Subject, t: Floats, finite: NDArray[np.bool_]) -> bool:
    """Drop what breaks the order of time; False when nothing useful is left."""
    total = int(finite.sum())
    steps = np.diff(t[finite])
    repeated, backward = int((steps == 0.0).sum()), int((steps < 0.0).sum())
    if repeated or backward:
        chosen = np.flatnonzero(finite)[longest_increasing(t[finite])]
        subject.timed[:] = False
        subject.timed[chosen] = True
    left = int(subject.timed.sum())
    if left < FEWEST:
        subject.find(
            NAME, REJECT, f"{left} samples with increasing time (allowed: at least {FEWEST})", value=left, limit=FEWEST
        )
        return False
    share = 1.0 - left / total
    severity = REJECT if share > MOST_DISORDER else WARNING
    if backward:
        at = float(t[finite][np.argmax(steps < 0.0)])
        subject.find(
            NAME,
            severity,
            f"time runs backward {backward} times, first after {moment(at)} s; {total - left} samples are left out"
            if severity == WARNING
            else f"time runs backward {backward} times, first after {moment(at)} s; "
            "split the file where a new run begins, or name another column in [columns] t",
            value=share,
            limit=MOST_DISORDER,
            t0=at,
            t1=at,
        )
    if repeated:
        subject.find(
            NAME,
            severity,
            f"{repeated} samples repeat the time before them; "
            + ("they are left out" if severity == WARNING else "write the time with more digits"),
            value=share,
            limit=MOST_DISORDER,
        )
    return severity == WARNING or not (backward or repeated)


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


def _gaps(subject: Subject, t: Floats, steps: Floats, limit: Floats) -> None:
    found = np.flatnonzero(steps > limit * (1.0 + 1e-6))
    if not found.size:
        return
    subject.facts.gaps = [(float(t[k]), float(t[k + 1])) for k in found]
    missing = float(np.sum(steps[found]) - found.size * np.median(steps)) / float(t[-1] - t[0])
    worst = int(found[np.argmax(steps[found])])
    severity = REJECT if missing > MOST_MISSING else WARNING
    several = f"{found.size} gaps, together {100.0 * missing:.3g} % of the duration, the longest of"
    subject.find(
        NAME,
        severity,
        f"{several if found.size > 1 else 'a gap of'} {steps[worst]:.4g} s after {moment(t[worst])} s; "
        + ("record again without them" if severity == REJECT else "nothing is judged near wide ones"),
        value=missing,
        limit=MOST_MISSING,
        t0=float(t[worst]),
        t1=float(t[worst + 1]),
    )
