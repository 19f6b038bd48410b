"""Lines in a mismatch: sharp in the motor angle (orders) or in time (frequencies)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.replay import Replay

PROMINENCE = 20.0
NEIGHBOURS = 61
HIGHEST_ORDER = 64.0
FEWEST_CYCLES = 4.0
INSIDE = 0.85  # of the band: its edge looks like a line
MOST = 10
CELLS = 16.0  # per cycle of the highest line


@dataclass(frozen=True)
class Line:
    """A line of a spectrum.

    Attributes:
        position: cycles per motor revolution or per second.
        prominence: power over the continuum, summed over recordings.
        resolution: of the sharpest recording, in the unit of the position.
        recordings: in how many recordings it stands.
    """

    position: float
    prominence: float
    resolution: float
    recordings: int = 1


def order_lines(replay: Replay, mismatch: Floats) -> list[Line]:
    """Lines per motor revolution in a stacked mismatch (N,), strongest first."""
    found = []
    for unit, channel, where in replay.layout.pieces:
        source = replay.plant.units[unit]
        turns = source.angle[replay.layout.sample[where]] / (2.0 * math.pi)
        speed = float(np.median(np.abs(source.speed[replay.layout.sample[where]]))) / (2.0 * math.pi)
        highest = min(HIGHEST_ORDER, INSIDE * replay.plant.band.of(channel) / max(speed, 1e-9))
        found += [(unit, line) for line in _lines(turns, mismatch[where], highest)]
    return _merged(found)


def torque_lines(replay: Replay) -> list[Line]:
    """Lines per motor revolution in the motor torque above the band of the motion, strongest first."""
    found = []
    for number, unit in enumerate(replay.plant.units):
        fast = float(np.quantile(np.abs(unit.speed), 0.9)) / (2.0 * math.pi)
        highest = min(HIGHEST_ORDER, INSIDE * replay.plant.band.sensed / max(fast, 1e-9))
        lines = _lines(unit.angle / (2.0 * math.pi), unit.beyond, highest)
        found += [(number, line) for line in lines if line.position * fast > replay.plant.band.motion]
    return _merged(found)


def tone_lines(replay: Replay, mismatch: Floats) -> list[Line]:
    """Lines per second in a stacked mismatch (N,), strongest first."""
    found = []
    for unit, channel, where in replay.layout.pieces:
        t = replay.plant.units[unit].t[replay.layout.sample[where]]
        lines = _lines(t, mismatch[where], INSIDE * replay.plant.band.of(channel))
        found += [(unit, line) for line in lines]
    return _merged(found)


def several(replay: Replay) -> int:
    """In how many recordings a line has to stand: in two where there are so many."""
    return min(2, len(replay.plant.units))


def snapped(line: Line, expected: Sequence[float]) -> float:
    """The nearest expected position within half a resolution or 1 %, else the line's own."""
    best = min(expected, key=lambda value: abs(value - line.position), default=line.position)
    near = abs(best - line.position) <= max(0.5 * line.resolution, 0.01 * line.position)
    return best if near else line.position


def _lines(x: Floats, values: Floats, highest: float) -> list[Line]:
    """Peaks of the spectrum of values over x that stand out of their surroundings."""
    span = float(np.ptp(x))
    if span <= 0.0 or highest * span < 2.0 * FEWEST_CYCLES:
        return []
    position, size = fourier_sums(x, values, highest)
    power = size**2
    used = (position <= highest) & (position * span >= FEWEST_CYCLES)
    power, position = power[used], position[used]
    if len(power) < NEIGHBOURS:
        return []
    ratio = power / np.maximum(scipy.ndimage.median_filter(power, size=NEIGHBOURS, mode="nearest"), 1e-300)
    inner = np.arange(1, len(ratio) - 1)
    peaks = inner[(ratio[inner] > PROMINENCE) & (power[inner] >= power[inner - 1]) & (power[inner] > power[inner + 1])]
    strongest = peaks[np.argsort(-power[peaks])][:MOST]
    return [Line(_peak(position, power, j), float(ratio[j]), 1.0 / span) for j in strongest]


def fourier_sums(x: Floats, values: Floats, highest: float, fewest: int = 0) -> tuple[Floats, Floats]:
    """Sizes of the Fourier sums of unevenly spaced values about their mean.

    Each value is summed in the cells on both sides of its place, in shares: a whole cell would mirror lines.

    Args:
        x: places (n,).
        values: at them, (n,).
        highest: cycles per unit of x up to which the sums count; those beyond are of no use.
        fewest: of the sums up to there.

    Returns:
        Cycles per unit of x and sizes in the unit of the values, each (m,).
    """
    width = 1.0 / (CELLS * highest)
    places = (x - x.min()) / width
    cell = places.astype(np.int64)
    share = places - cell
    about = values - values.mean()
    sums = np.bincount(np.concatenate([cell, cell + 1]), np.concatenate([(1.0 - share) * about, share * about]))
    count = 1 << (max(2 * len(sums), int(CELLS) * fewest) - 1).bit_length()
    size = np.abs(np.fft.rfft(sums, count))
    return np.arange(len(size)) / (count * width), size


def _peak(position: Floats, power: Floats, j: int) -> float:
    """Vertex of the parabola through a peak and its neighbours."""
    left, middle, right = np.sqrt(power[j - 1 : j + 2])
    curve = left - 2.0 * middle + right
    shift = 0.0 if curve == 0.0 else 0.5 * (left - right) / curve
    return float(position[j] + shift * (position[1] - position[0]))


def _merged(found: Sequence[tuple[int, Line]]) -> list[Line]:
    """One line of several (recording, line) that agree within their resolutions; the sharpest says where it is."""
    groups: list[list[tuple[int, Line]]] = []
    for owner, line in sorted(found, key=lambda one: one[1].resolution):
        for group in groups:
            sharpest = group[0][1]
            if abs(sharpest.position - line.position) <= max(sharpest.resolution, line.resolution):
                group.append((owner, line))
                break
        else:
            groups.append([(owner, line)])
    merged = [
        replace(
            group[0][1],
            prominence=sum(line.prominence for _, line in group),
            recordings=len({owner for owner, _ in group}),
        )
        for group in groups
    ]
    return sorted(merged, key=lambda one: -one.prominence)[:MOST]
