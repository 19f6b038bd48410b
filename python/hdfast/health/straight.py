"""Straight lines: a channel that was recorded more slowly and joined by lines on the times of faster ones."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.health.stretches import stretches

BENT, USUAL = 0.01, 0.99  # of the usual bend, and what is usual
FEWEST = 20
LONGEST = 0.1
SHARE = 0.8
WHOLE = 0.1  # share of a bend that is left over two samples: a step of the sensor bends back


def knots(t: Floats, values: Floats) -> float | None:
    """How often lines between samples (n,) bend [1/s], None where they are not straight in between.

    A line bends in one sample, or in two where its end lies between them; what bends back at once is a step of the
    sensor or a held value.
    """
    known = np.isfinite(values)
    t, values = t[known], values[known]
    if t.size < FEWEST:
        return None
    bends = np.diff(np.diff(values) / np.diff(t))
    sizes = np.abs(bends)
    bent = sizes > BENT * np.sqrt(np.mean(np.minimum(sizes, np.quantile(sizes, USUAL)) ** 2))
    begins, ends = stretches(bent)
    if begins.size < FEWEST:
        return None
    spacing = np.diff(begins)
    near = spacing[np.abs(spacing - np.sort(spacing)[spacing.size // 2]) <= 1]
    usual = float(np.mean(near))
    regular = np.abs(spacing - usual) < 1.0
    onward = np.abs(np.add.reduceat(bends, begins)) > WHOLE * np.maximum.reduceat(sizes, begins)
    if min(np.mean(regular), np.mean(onward), np.mean(ends - begins <= min(2.0, usual - 1.0))) < SHARE:
        return None
    period = usual * float(np.median(np.diff(t)))
    return 1.0 / period if period < LONGEST else None
