"""The smallest step of a channel: as stated, else as its values show it."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.recordings import Recording


def resolution(recording: Recording, column: str, values: Floats, notes: list[str]) -> float:
    """Smallest step of a column in its unit; what is not stated is looked for in the values (n,) and noted.

    Returns:
        The step, 0 for values that are as good as continuous.
    """
    if column in recording.resolution:
        return recording.resolution[column]
    notes.append(f"{recording.name}: resolution of {column} is not stated: the smallest step found is taken")
    return smallest_step(values)


def smallest_step(values: Floats) -> float:
    """Smallest step between recorded values; 0 when they are as good as continuous."""
    distinct = np.unique(values)
    if len(distinct) > len(values) / 4:
        return 0.0
    steps = np.diff(distinct)
    real = steps[steps > 1e-6 * np.max(steps, initial=0.0)]
    return float(np.min(real)) if real.size else 0.0
