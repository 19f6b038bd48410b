"""Oscillations of the recorded signals themselves that keep their frequency at different speeds.

A servo's own swing stands in motion and torque alike: a replay of the motion explains it, and no mismatch shows it. At
one speed it may as well be locked to the angle. What stands at one frequency at several speeds is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.accept import ALARM, NOTICED
from hdfast.diagnosis.lines import HIGHEST_ORDER, INSIDE
from hdfast.diagnosis.peaks import Spectrum
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.steady import SPEED, STEADY, Stretch, stretches

LONGEST_S = 4.0
PER_CELL = 4
MOST_ORDERS = 20_000


@dataclass(frozen=True)
class Swing:
    """An oscillation that is fixed in time.

    Attributes:
        frequency: [Hz].
        resolution: [Hz].
        channel: in which it is most certain; `SPEED` for the motor speed.
        p: family-wise probability of one as strong where there is none.
    """

    frequency: float
    resolution: float
    channel: str
    p: float


@dataclass(frozen=True, eq=False)
class _Seen:
    """Spectra of one signal in one steady stretch."""

    stretch: Stretch
    time: Spectrum
    angle: Spectrum


def swings(plants: Sequence[Plant]) -> list[Swing]:
    """What keeps its frequency at several speeds in the steady stretches of all recordings, the most certain first.

    Where a stretch may have an order, a whole one per motor turn or another that stands at several speeds, it says
    nothing.
    """
    speeds = _by_speed([one for plant in plants for unit in plant.units for one in stretches(unit)])
    channels = list(dict.fromkeys(name for own in speeds for one in own for name in one.signals))
    found = []
    for channel in channels if len(speeds) > 1 else ():
        band = plants[0].band
        highest = INSIDE * (band.motion if channel == SPEED else band.of(channel))
        groups = [
            [
                _Seen(one, spectrum_of(one.t, one, channel), spectrum_of(one.turns, one, channel))
                for one in own
                if channel in one.signals
            ]
            for own in speeds
        ]
        found += _standing([own for own in groups if own], channel, highest, len(channels))
    return _apart(found)


def _by_speed(found: Sequence[Stretch]) -> list[list[Stretch]]:
    """Stretches of about one speed, which cannot tell an order from a frequency."""
    groups: list[list[Stretch]] = []
    for one in sorted(found, key=lambda own: own.speed):
        if groups and one.speed <= STEADY * groups[-1][0].speed:
            groups[-1].append(one)
        else:
            groups.append([one])
    return groups


def spectrum_of(x: Floats, one: Stretch, channel: str) -> Spectrum:
    """Spectrum of a signal of a stretch over its time or its turns (n,)."""
    return Spectrum(x, one.signals[channel], max(1, int(one.t[-1] / LONGEST_S)))


def _standing(groups: Sequence[Sequence[_Seen]], channel: str, highest: float, channels: int) -> list[Swing]:
    """What is fixed in time in one channel."""
    every = [one for own in groups for one in own]
    finest = min(one.angle.cell for one in every) / PER_CELL
    most = min(HIGHEST_ORDER, highest / every[0].stretch.speed)
    orders = np.arange(finest, max(most, 2.0 * finest), max(finest, most / MOST_ORDERS))
    geared = [[one.angle.unlikely(orders, highest / one.stretch.speed) for one in own] for own in groups]
    p = len(orders) * channels * _together(geared)
    standing = np.concatenate([np.arange(1.0, HIGHEST_ORDER + 1.0), orders[p <= NOTICED]])
    step = min(one.time.cell for one in every) / PER_CELL
    places = np.arange(step, highest, step)
    free = [
        [np.where(_occupied(one, standing, places), np.nan, one.time.unlikely(places, highest)) for one in own]
        for own in groups
    ]
    p = len(places) * channels * _together(free)
    return [Swing(float(places[j]), PER_CELL * step, channel, float(p[j])) for j in np.flatnonzero(p <= ALARM)]


def _occupied(one: _Seen, orders: Floats, places: Floats) -> Floats:
    """At which places [Hz] one of the orders may stand, (d,)."""
    stands = orders * one.stretch.speed
    reach = 0.5 * one.time.cell + one.stretch.varied * stands
    return np.asarray(np.any(np.abs(places[:, None] - stands) < reach, axis=1))


def _together(groups: Sequence[Sequence[Floats]]) -> Floats:
    """Probability that something stands at no more than one speed, (d,), by the others' sum of logarithms (Fisher).

    Args:
        groups: of each speed, the probabilities of each stretch, (d,); NaN says nothing.
    """
    said = np.array([_fisher(np.array(own)) for own in groups])
    best = np.argmin(np.where(np.isnan(said), np.inf, said), axis=0)
    others = np.where(np.arange(len(said))[:, None] == best, np.nan, said)
    return np.nan_to_num(_fisher(others), nan=1.0)


def _fisher(p: Floats) -> Floats:
    """Joint probability of independent ones (k, d), NaN where none is known, (d,)."""
    known = np.sum(~np.isnan(p), axis=0)
    joint = scipy.stats.chi2.sf(-2.0 * np.nansum(np.log(p), axis=0), 2 * np.maximum(known, 1))
    return np.where(known > 0, joint, np.nan)


def _apart(found: Sequence[Swing]) -> list[Swing]:
    """The most certain of those that are closer together than they are resolved."""
    kept: list[Swing] = []
    for one in sorted(found, key=lambda own: own.p):
        if all(abs(one.frequency - other.frequency) > max(one.resolution, other.resolution) for other in kept):
            kept.append(one)
    return kept
