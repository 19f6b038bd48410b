"""Refusals of angles that start again after every turn, and of a load that does not follow the motor."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.health.alignment import slope
from hdfast.health.sides import still, unlike
from hdfast.health.wrapping import wraps
from hdfast.recordings import Recording


def refuse_wrapped(recording: Recording, *names: str, ratio: float | None = None) -> None:
    """Refuse named angles that start again after a turn or another period.

    Raises:
        InputError: naming the recording and the column.
    """
    for name in names:
        found = wraps(recording, name, ratio)
        if found is not None:
            raise InputError(f"{recording.name}: {found.told(name)}")


def refuse_apart(recording: Recording, motor: Floats, load: Floats, ratio: float) -> None:
    """Refuse a load angle (n,) that is not the motor angle (n,) over the ratio but for windup.

    Raises:
        InputError: naming the recording and what may be wrong.
    """
    travel = float(np.ptp(motor))
    sentence = still(load, travel) or unlike(slope(motor, load) * ratio, ratio, travel / ratio)
    if sentence:
        raise InputError(f"{recording.name}: {sentence}")
