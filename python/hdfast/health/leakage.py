"""Leakage: the same samples in a recording that calibrates and in one that is held out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdfast.health.finding import REJECT, WARNING
from hdfast.health.subject import Subject

NAME = "leakage"
BLOCK = 16
FEWEST_MOVES = 8
SHARE, SHARE_OF_SAMPLES, DISTINCT = 0.05, 0.5, 0.9


def check(subjects: Sequence[Subject]) -> None:
    """Reject held-out recordings that repeat samples of a fit recording; name recordings given twice."""
    fit = [subject for subject in subjects if subject.recording.role == "fit"]
    for subject in subjects:
        heldout = subject.recording.role == "heldout"
        others = fit if heldout else fit[: fit.index(subject)]
        for other in others:
            share = shared(subject, other)
            if not share:
                continue
            name = other.recording.name
            if heldout:
                sentence = f"{100.0 * share:.3g} % of its samples are also in {name}, used to fit; take them out of one"
                subject.find(NAME, REJECT, sentence, value=share, limit=SHARE)
            else:
                sentence = f"{100.0 * share:.3g} % of its samples are also in {name}; the same evidence counts twice"
                subject.find(NAME, WARNING, sentence, value=share, limit=SHARE)


def shared(one: Subject, other: Subject) -> float:
    """Share of the samples of one that the other has too: blocks in sequence, or single samples of a thinned copy.

    Single samples tell nothing where coarse sensors repeat the same pairs of values within one recording.
    """
    blocks = _share(_blocks(one, BLOCK), _blocks(other, 1))
    if blocks > SHARE:
        return blocks
    found, known = _samples(one), _samples(other)
    if len(set(known)) < DISTINCT * len(known):
        return 0.0
    samples = _share(found, known)
    return samples if samples > SHARE_OF_SAMPLES else 0.0


def _share(found: list[bytes], known: list[bytes]) -> float:
    table = set(known)
    return sum(item in table for item in found) / len(found) if found else 0.0


def _pairs(subject: Subject) -> np.ndarray:
    """Angle and torque (n, 2) as they were read."""
    return np.column_stack([subject.checked["motor_angle"], subject.checked["motor_torque"]])


def _blocks(subject: Subject, stride: int) -> list[bytes]:
    """Blocks in which something moves and no number is missing: what is missing in both is not the same evidence."""
    pairs = _pairs(subject)
    moves = np.concatenate([[0], np.cumsum(np.any(np.diff(pairs, axis=0) != 0.0, axis=1))])
    holes = np.concatenate([[0], np.cumsum(np.any(np.isnan(pairs), axis=1))])
    return [
        pairs[k : k + BLOCK].tobytes()
        for k in range(0, len(pairs) - BLOCK + 1, stride)
        if moves[k + BLOCK - 1] - moves[k] >= FEWEST_MOVES and holes[k + BLOCK] == holes[k]
    ]


def _samples(subject: Subject) -> list[bytes]:
    pairs = _pairs(subject)
    fresh = np.concatenate([[True], np.all(np.diff(pairs, axis=0) != 0.0, axis=1)])
    return [row.tobytes() for row in pairs[fresh & np.all(np.isfinite(pairs), axis=1)]]
