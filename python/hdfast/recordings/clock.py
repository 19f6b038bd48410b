"""The clock of a recording."""

from __future__ import annotations

import numpy as np
import scipy

from hdfast.checks import Floats

#: Largest share of samples out of order, or that repeat a time, in a recording that is used without them.
MOST_DISORDER = 0.2
AROUND = 51


def period(t: Floats) -> float:
    """Time from one sample to the next [s] of increasing times (n,), of which some may be missing or late.

    It is the whole span over the number of periods in it. The typical step is another one where steps vary: after a
    thousand samples that vary by 5 % it may be more than a sample off.
    """
    steps = np.diff(t)
    return float((t[-1] - t[0]) / np.rint(steps / np.median(steps)).sum())


def usual_steps(t: Floats) -> Floats:
    """What is usual [s] around each of the n - 1 steps of times (n,): a clock that slows down has no gaps."""
    steps = np.diff(t)
    usual: Floats = np.maximum(np.median(steps), scipy.ndimage.median_filter(steps, AROUND, mode="nearest"))
    return usual
