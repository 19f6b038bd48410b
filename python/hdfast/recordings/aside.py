"""What is set aside for the proof where no recording is held out."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats

FEWEST_GROUPS = 3
LAST_SHARE = 0.3
GUARD = 0.05


def set_aside(groups: Iterable[str]) -> str | None:
    """The last of three or more groups; of fewer none, but a part of every recording."""
    named = list(dict.fromkeys(groups))
    return named[-1] if len(named) >= FEWEST_GROUPS else None


def parts(t: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Samples (n,) of increasing times (n,) [s] that are fitted, and those of the last share, which are set aside."""
    span = t[-1] - t[0]
    edge = t[0] + (1.0 - LAST_SHARE) * span
    return t < edge - GUARD * span, t >= edge
