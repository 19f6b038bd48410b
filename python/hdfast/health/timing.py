"""Time: gaps and jitter among the samples that stand in order."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.health import order
from hdfast.health.finding import NOTE, REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.printing import moment
from hdfast.recordings.clock import period, usual_steps

NAME = order.NAME
GAP, GAP_SIGMAS = 1.5, 6.0
MOST_MISSING = 0.2
MOST_JITTER = 0.05
NORMAL = 1.4826


def check(subject: Subject) -> None:
    """Find the samples that stand in order, then gaps and jitter among them."""
    subject.timed &= np.isfinite(subject.clean("t"))
    if not order.check(subject):
        return
    t = subject.clean("t")[subject.timed]
    steps = np.diff(t)
    median = float(np.median(steps))
    subject.facts.rate_hz = 1.0 / period(t)
    spread = NORMAL * float(np.median(np.abs(steps - median)))
    usual = usual_steps(t)
    _gaps(subject, t, steps, np.maximum(GAP * usual, usual + GAP_SIGMAS * spread))
    if spread / median > MOST_JITTER:
        subject.find(
            NAME,
            NOTE,
            f"samples are irregular: the step of {median:.4g} s varies by {100.0 * spread / median:.3g} %; "
            "times are used as they are",
            value=spread / median,
            limit=MOST_JITTER,
        )


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
