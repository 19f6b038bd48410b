"""Jumps of an angle that no motion makes: dropouts and spikes, which come back, and lost counts, which stay.

A step between neighbouring samples is compared with the median of those around it. It is a jump where it is off by many
times what other steps are off by, by many times what the speed changes by from one sample to the next anywhere, and by
several of the steps around it, and where none of its size is beside it: neither noise nor an impact, nor what rings
after it, nor a sample that is missing is one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.finding import REJECT, WARNING
from hdfast.health.steps import hold, lattice
from hdfast.health.subject import ANGLES, Subject
from hdfast.printing import moment
from hdfast.recordings import COLUMNS, Table

NAME = "jumps"
AROUND, BESIDE = 9, 4
USUAL, TIMES_USUAL, TIMES_CHANGE, STEPS, MISSING = 0.95, 12.0, 8.0, 3.0, 4.0
GAP = 2.0
LONGEST = 0.25  # of a dropout of several samples [s]
ALIKE = 0.25  # share of a jump: by so much its return may miss, and the speed may change at lost counts
MOST = 0.2
MOST_LOST = 10


@dataclass(frozen=True)
class Angle:
    """An angle where it is known, each (n,), and what is off in it.

    Attributes:
        rows: the samples of the recording.
        t: time [s].
        values: angle [rad].
        off: by how much each of the n - 1 steps is off those around it [rad].
        limit: (n - 1,) what no motion is off by [rad].
    """

    rows: NDArray[np.intp]
    t: Floats
    values: Floats
    off: Floats
    limit: Floats

    @classmethod
    def of(cls, recording: Table, name: str, rows: NDArray[np.intp]) -> Angle | None:
        """A column at the samples where it is known; None where they are few or it holds its values."""
        if rows.size < 2 * AROUND:
            return None
        t, values = recording["t"][rows], recording[name][rows]
        step = recording.resolution.get(name, 0.0)
        if hold(t, values, step) is not None:
            return None
        intervals, steps = np.diff(t), np.diff(values)
        usual = scipy.ndimage.median_filter(steps, AROUND, mode="nearest")
        off = np.where(intervals <= GAP * np.median(intervals), steps - usual, 0.0)
        scatter = TIMES_USUAL * float(np.quantile(np.abs(off[steps != 0.0]), USUAL)) if steps.any() else np.inf
        change = TIMES_CHANGE * float(np.max(np.abs(np.diff(usual))))
        least = max(scatter, change, STEPS * max(step, lattice(steps)))
        return cls(rows, t, values, off, np.maximum(least, MISSING * np.abs(usual)))

    def speed(self, begin: int, end: int) -> float:
        """Usual step from sample `begin` to sample `end` [rad]."""
        inside = self.values[max(begin, 0) : end + 1]
        return float(np.median(np.diff(inside))) if inside.size > 1 else 0.0

    def back(self, jump: int, later: NDArray[np.intp]) -> int | None:
        """The later jump after which the angle goes on as before this one."""
        speed = self.speed(jump - BESIDE, jump)
        end = max(jump + 2, int(np.searchsorted(self.t, self.t[jump] + LONGEST, side="right")))
        for other in later[: np.searchsorted(later, end)].tolist():
            expected = self.values[jump] + speed * (other + 1 - jump)
            if abs(self.values[other + 1] - expected) <= ALIKE * abs(self.off[jump]):
                return int(other)
        return None

    def alone(self, first: int, last: int) -> bool:
        """Whether nothing rings beside the jumps at which an angle leaves and returns."""
        beside = np.concatenate([self.off[max(first - BESIDE, 0) : first], self.off[last + 1 : last + 1 + BESIDE]])
        return bool(np.all(np.abs(beside) <= ALIKE * abs(self.off[first])))

    def stays(self, jump: int) -> bool:
        """Whether the angle moves after a jump as before it."""
        before, after = self.speed(jump - BESIDE, jump), self.speed(jump + 1, jump + 1 + BESIDE)
        return bool(abs(after - before) <= ALIKE * abs(self.off[jump]))


@dataclass(frozen=True)
class Away:
    """Samples of a column that are elsewhere for a moment.

    Attributes:
        rows: the samples of the recording.
        share: of the samples that are known.
        sentence: what is said of them.
    """

    rows: NDArray[np.intp]
    share: float
    sentence: str


def check(subject: Subject) -> None:
    """Leave dropouts and spikes out; reject an angle that has lost counts, and a clock at which both angles jump."""
    found: dict[str, dict[int, float]] = {}
    for name in ANGLES:
        angle = Angle.of(subject.recording, name, subject.known(name))
        if angle is not None:
            slices, lost = _sorted(angle)
            for away in _away(subject.recording, name, angle, slices):
                severity, at = WARNING if away.share <= MOST else REJECT, float(subject.recording["t"][away.rows[0]])
                subject.find(NAME, severity, away.sentence, value=away.share, limit=MOST, t0=at, t1=at)
                subject.leave_out(name, away.rows)
            if 0 < len(lost) <= MOST_LOST:
                found[name] = {int(angle.rows[place + 1]): float(angle.off[place]) for place in lost}
    together = set(found.get(ANGLES[0], ())) & set(found.get(ANGLES[1], ()))
    if together:
        sentence = "both angles jump at once in {where}: samples are missing there, or the clock was set"
        _reject(subject, "time", sentence, dict.fromkeys(sorted(together), float(len(together))))
    for name, places in found.items():
        alone = {row: size for row, size in places.items() if row not in together}
        if alone:
            size = next(iter(alone.values()))
            sentence = f"{name} jumps by {size:.4g} rad for good in {{where}}, as nothing moves: counts are lost"
            _reject(subject, NAME, sentence, alone)


def elsewhere(recording: Table, name: str) -> list[Away]:
    """Dropouts and spikes of a column."""
    angle = Angle.of(recording, name, np.flatnonzero(np.isfinite(recording[name])))
    return [] if angle is None else _away(recording, name, angle, _sorted(angle)[0])


def _reject(subject: Subject, check: str, sentence: str, places: dict[int, float]) -> None:
    first = next(iter(places))
    at = float(subject.recording["t"][first])
    more = f", and {len(places) - 1} times more" if len(places) > 1 else ""
    where = f"sample {first} at {moment(at)} s{more}"
    split = f"{sentence.format(where=where)}; split the file there"
    subject.find(check, REJECT, split, value=places[first], t0=at, t1=at)


def _sorted(angle: Angle) -> tuple[list[slice], list[int]]:
    """Samples that are elsewhere for a moment, and jumps that stay."""
    places = np.flatnonzero(np.abs(angle.off) > angle.limit)
    away, lost = [], []
    while places.size:
        jump, places = int(places[0]), places[1:]
        other = angle.back(jump, places)
        if other is not None:
            if angle.alone(jump, other):
                away.append(slice(jump + 1, other + 1))
            places = places[np.searchsorted(places, other, side="right") :]
        elif angle.alone(jump, jump) and angle.stays(jump):
            lost.append(jump)
    return away, lost


def _away(recording: Table, name: str, angle: Angle, slices: list[slice]) -> list[Away]:
    """What is elsewhere: dropouts where it stays at 0 or comes back to one level, and spikes."""
    parts = [angle.values[at] for at in slices]
    levels = [float(part[0]) if np.ptp(part) == 0.0 else None for part in parts]
    fallen = [
        level is not None and (level == 0.0 or part.size > 1 or levels.count(level) > 1)
        for level, part in zip(levels, parts, strict=True)
    ]
    found = []
    for kind, wanted in (("drops out", True), ("has spikes", False)):
        chosen = [at for at, dropout in zip(slices, fallen, strict=True) if dropout is wanted]
        if not chosen:
            continue
        rows = np.concatenate([angle.rows[at] for at in chosen])
        share = rows.size / angle.rows.size
        at = float(recording["t"][rows[0]])
        where = f"in {rows.size} samples, {len(chosen)} times, first in sample {rows[0]} at {moment(at)} s"
        reads = f"{float(recording[name][rows[0]]):.4g} {COLUMNS[name][0]}"
        remedy = "they are left out" if share <= MOST else "mend the sensor"
        found.append(Away(rows, share, f"{name} {kind} {where}, where it reads {reads}; {remedy}"))
    return found
