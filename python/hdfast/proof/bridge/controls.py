"""Real recordings into which nothing is put: whatever a tool claims of them beyond their model is an alarm.

The recordings as they are; held out and fitted ones exchanged; what the model leaves with random phases; what it leaves
of another recording.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.random import Generator

from hdfast.checks import Floats
from hdfast.proof.bridge.machine import Machine, Recorded

CHANNEL = "motor_torque"


def as_recorded(machine: Machine, _: Generator) -> list[Recorded]:
    """The recordings."""
    return list(machine.recordings)


def exchanged(machine: Machine, _: Generator) -> list[Recorded]:
    """Held-out recordings to fit, and the fitted ones held out."""
    other = {"fit": "heldout", "heldout": "fit"}
    return [replace(one, role=other[one.role]) for one in machine.recordings]


def shuffled(machine: Machine, rng: Generator) -> list[Recorded]:
    """The model's torque with what it leaves in random phases."""
    return [_with_rest(one, random_phases(one.rest[CHANNEL], rng)) for one in machine.recordings]


def transplanted(machine: Machine, _: Generator) -> list[Recorded]:
    """The model's torque with what it leaves of the next recording, backwards in time and repeated as need be."""
    ones = machine.recordings
    return [
        _with_rest(one, np.resize(other.rest[CHANNEL][::-1], len(one.t)))
        for one, other in zip(ones, (*ones[1:], ones[0]), strict=True)
    ]


CONTROLS: dict[str, Callable[[Machine, Generator], list[Recorded]]] = {
    "as_recorded": as_recorded,
    "exchanged": exchanged,
    "shuffled": shuffled,
    "transplanted": transplanted,
}


def random_phases(values: Floats, rng: Generator) -> Floats:
    """The same amplitude at every frequency of (n,), random phases."""
    spectrum = np.fft.rfft(values)
    turned = np.abs(spectrum) * np.exp(2j * np.pi * rng.uniform(size=len(spectrum)))
    turned[0] = spectrum[0]
    return np.asarray(np.fft.irfft(turned, len(values)))


def _with_rest(one: Recorded, rest: Floats) -> Recorded:
    torque = one.columns[CHANNEL] - one.rest[CHANNEL] + rest
    return replace(one, columns={**one.columns, CHANNEL: torque})
