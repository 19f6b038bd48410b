"""Leakage: the same samples in a recording that calibrates and in one that is held out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hdfast.health.finding import REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.recordings.aside import parts, set_aside
from hdfast.recordings.campaign import ROLES

NAME = "leakage"
BLOCK = 16
FEWEST_MOVES = 8
FEWEST_SAMPLES = 50
SHARE, SHARE_OF_SAMPLES, DISTINCT = 0.05, 0.5, 0.9
REPEATED = (
    ", used to fit, and where none is held out it is set aside, or a part of it; take them out of one, or give another "
    'recording the role "heldout"'
)
Marks = NDArray[np.int64]


class Evidence:
    """Angle and torque of a recording, or of some of its samples, as marks: equal ones stand for equal bits."""

    def __init__(self, subject: Subject, rows: NDArray[np.bool_] | slice = slice(None)) -> None:
        self.subject = subject
        self._pairs = np.column_stack([subject.checked[name][rows] for name in ("motor_angle", "motor_torque")])

    @cached_property
    def parts(self) -> tuple[Evidence, Evidence]:
        """Of the samples that are fitted and of those that are set aside, where a part of every recording is."""
        first, last = parts(self.subject.checked["t"])
        return Evidence(self.subject, first), Evidence(self.subject, last)

    @cached_property
    def _moving(self) -> NDArray[np.intp]:
        """Begins of the blocks in which something moves and no number is missing.

        What is missing in both is not the same evidence.
        """
        moves = np.concatenate([[0], np.cumsum(np.any(np.diff(self._pairs, axis=0) != 0.0, axis=1))])
        holes = np.concatenate([[0], np.cumsum(np.any(np.isnan(self._pairs), axis=1))])
        begins = np.arange(max(len(self._pairs) - BLOCK + 1, 0))
        moving = moves[begins + BLOCK - 1] - moves[begins] >= FEWEST_MOVES
        found: NDArray[np.intp] = begins[moving & (holes[begins + BLOCK] == holes[begins])]
        return found

    @cached_property
    def _overlapping(self) -> Marks:
        return self._marks(self._moving, BLOCK)

    @cached_property
    def blocks(self) -> Marks:
        """Of blocks side by side."""
        found: Marks = self._overlapping[self._moving % BLOCK == 0]
        return found

    @cached_property
    def known_blocks(self) -> Marks:
        """Of blocks from every sample on, in rising order."""
        return np.unique(self._overlapping)

    @cached_property
    def samples(self) -> Marks:
        """Of single samples in which angle and torque are new, in rising order; none where they are few.

        Under a constant torque the first one alone is new.
        """
        fresh = np.concatenate([[True], np.all(np.diff(self._pairs, axis=0) != 0.0, axis=1)])
        chosen = np.flatnonzero(fresh & np.all(np.isfinite(self._pairs), axis=1))
        return np.sort(self._marks(chosen if len(chosen) >= FEWEST_SAMPLES else chosen[:0], 1))

    @cached_property
    def known_samples(self) -> Marks:
        """In rising order; none where coarse sensors repeat the same pairs of values within the recording."""
        known = np.unique(self.samples)
        return known if len(known) >= DISTINCT * len(self.samples) else known[:0]

    def _marks(self, begins: NDArray[np.intp], length: int) -> Marks:
        data, size = self._pairs.tobytes(), self._pairs.itemsize * self._pairs.shape[1]
        return np.array([hash(data[size * k : size * (k + length)]) for k in begins.tolist()], dtype=np.int64)


def check(subjects: Sequence[Subject]) -> None:
    """Reject what is held out, by its role or set aside, and repeats samples of a usable fit recording.

    Recordings to fit that are given twice are named.
    """
    usable = [Evidence(subject) for subject in subjects if not subject.rejected]
    fit, held = ([one for one in usable if one.subject.recording.role == role] for role in ROLES)
    for one in held:
        _compare(one, fit, REJECT, ", used to fit; take them out of one")
    if all(one.subject.rejected for one in held):
        _set_aside(fit)
    fit = _left(fit)
    for number, one in enumerate(fit):
        _compare(one, fit[:number], WARNING, "; the same evidence counts twice")


def _set_aside(fit: Sequence[Evidence]) -> None:
    """Judge the group that is set aside for the proof, or the last parts of all against the first ones of others."""
    group = set_aside(one.subject.recording.group for one in fit)
    if group is None:
        for number, one in enumerate(fit):
            for other in _left(fit[:number]):
                (first, last), (known, beyond) = one.parts, other.parts
                _tell(one, other, max(shared(last, known), shared(beyond, first)), REJECT, REPEATED)
        return
    others = [one for one in fit if one.subject.recording.group != group]
    held = [one for one in fit if one.subject.recording.group == group]
    for one in held:
        _compare(one, others, REJECT, REPEATED)
    if not _left(held):
        _set_aside(others)


def _left(evidence: Iterable[Evidence]) -> list[Evidence]:
    return [one for one in evidence if not one.subject.rejected]


def _compare(one: Evidence, others: Iterable[Evidence], severity: str, meaning: str) -> None:
    for other in others:
        _tell(one, other, shared(one, other), severity, meaning)


def _tell(one: Evidence, other: Evidence, share: float, severity: str, meaning: str) -> None:
    if share:
        sentence = f"{100.0 * share:.3g} % of its samples are also in {other.subject.recording.name}{meaning}"
        one.subject.find(NAME, severity, sentence, value=share, limit=SHARE)


def shared(one: Evidence, other: Evidence) -> float:
    """Share of the samples of one that the other has too: blocks in sequence, or single samples of a thinned copy."""
    blocks = _share(one.blocks, other.known_blocks)
    if blocks > SHARE:
        return blocks
    samples = _share(one.samples, other.known_samples)
    return samples if samples > SHARE_OF_SAMPLES else 0.0


def _share(found: Marks, known: Marks) -> float:
    if not found.size or not known.size:
        return 0.0
    places = np.minimum(np.searchsorted(known, found), len(known) - 1)
    return float(np.mean(known[places] == found))
