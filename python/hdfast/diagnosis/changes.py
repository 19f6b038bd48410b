"""What each candidate changes in the simulated signals, and how the noise sounds that none of them explains."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.evidence import Index, inner
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.slopes import ACCELERATED
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.together import Found, Part, side_by_side
from hdfast.diagnosis.whiten import whiten

LEAST_FREEDOM = 0.5
INDEPENDENT = 1e-6


@dataclass(frozen=True, eq=False)
class Change:
    """What a candidate adds to the simulated signals, per typical amplitude.

    Attributes:
        candidate: the hypothesis.
        times: at how many typical amplitudes it was taken.
        values: in the channels' units, shape (N, d).
    """

    candidate: Candidate
    times: float
    values: Floats = field(repr=False)


@dataclass(frozen=True, eq=False)
class Changer:
    """Adds candidates to a fitted model."""

    replay: Replay
    fit: Fit

    @cached_property
    def _here(self) -> Floats:
        return np.asarray(self.replay.mismatch(self.fit.structure, self.fit.coordinates[None])[0])

    @cached_property
    def _steady(self) -> Floats:
        return np.asarray(self.replay.steady(self.fit.structure, self.fit.coordinates[None])[0])

    def changes(self, wanted: Sequence[tuple[Candidate, float]]) -> list[Change]:
        """Taken at so many typical amplitudes, also beyond a bound; candidates of one form are simulated together."""
        return self._together(self._changes, wanted, [candidate for candidate, _ in wanted])

    def noises(self, changed: Sequence[Change]) -> list[Floats]:
        """What more noise of the angle adds to changes on the load side, per typical amplitude, each (N, d)."""
        return self._together(self._noises, changed, [one.candidate for one in changed])

    def _together(
        self,
        work: Callable[[Replay, Sequence[Part]], list[Found]],
        wanted: Sequence[Part],
        candidates: Sequence[Candidate],
    ) -> list[Found]:
        alike: dict[Hashable, list[int]] = {}
        for index, candidate in enumerate(candidates):
            alike.setdefault(candidate.unbounded.form, []).append(index)
        groups = [[wanted[index] for index in rows] for rows in alike.values()]
        worked = chain(*side_by_side(self.replay, work, groups))
        found = dict(zip(chain(*alike.values()), worked, strict=True))
        return [found[index] for index in range(len(wanted))]

    def _changes(self, replay: Replay, wanted: Sequence[tuple[Candidate, float]]) -> list[Change]:
        structure, coordinates, ends = self._rows(wanted)
        steady = any(name in ACCELERATED for name in structure.names[len(self.fit.coordinates) :])
        found = (replay.steady if steady else replay.mismatch)(structure, coordinates)
        parts = np.split((self._steady if steady else self._here) - found, ends)
        return [Change(one, times, part.T / times) for part, (one, times) in zip(parts, wanted, strict=True)]

    def _noises(self, replay: Replay, changed: Sequence[Change]) -> list[Floats]:
        structure, coordinates, ends = self._rows([(one.candidate, one.times) for one in changed])
        if structure.rattles:
            return [np.zeros_like(one.values) for one in changed]
        still = self._here - np.concatenate([one.times * one.values.T for one in changed])
        parts = np.split(self.fit.stir.noise - replay.noise_on_load(structure, coordinates, still), ends)
        return [part.T / one.times for part, one in zip(parts, changed, strict=True)]

    def _rows(self, wanted: Sequence[tuple[Candidate, float]]) -> tuple[Structure, Floats, Index]:
        """Structure and coordinates (M, P) of candidates of one form, and where the rows of each but the last end."""
        wide = [candidate.unbounded for candidate, _ in wanted]
        settings = [one.scaled(times).settings() for one, (_, times) in zip(wide, wanted, strict=True)]
        own = [[float(free.coordinate(row[free.name])) for free in wide[0].free] for rows in settings for row in rows]
        coordinates = np.stack([np.concatenate([self.fit.coordinates, row]) for row in own])
        return wide[0].added_to(self.fit.structure), coordinates, np.cumsum([len(rows) for rows in settings])[:-1]


def changes(replay: Replay, fit: Fit, candidates: Sequence[Candidate]) -> list[Change]:
    """Changes by all candidates that could be simulated."""
    every = Changer(replay, fit).changes([(candidate, 1.0) for candidate in candidates])
    return [one for one in every if np.isfinite(one.values).all()]


def attentive(replay: Replay, fit: Fit, changed: Sequence[Floats]) -> Fit:
    """The fit with the whitening filter of what neither changes (N, d) nor a refit explain of its mismatch.

    The filter of the mismatch itself would take a slow effect for noise and filter it away. Of a channel with hardly
    more samples than there are changes these explain the noise as well: its filter is that of the whole mismatch.
    """
    layout, weights = replay.layout, fit.weights
    columns = weights.normalise(layout, np.concatenate([fit.slopes.T, *(one.T for one in changed)])).T
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    grams = np.zeros((len(layout.channels), columns.shape[1], columns.shape[1]))
    for _, channel, where in layout.pieces:
        grams[layout.channels.index(channel)] += inner(columns[where], columns[where])
    values, vectors = np.linalg.eigh(grams.sum(axis=0))
    kept = values > INDEPENDENT * values[-1]
    root = vectors[:, kept] / np.sqrt(values[kept])
    normal = weights.normalise(layout, fit.mismatch)
    unit = weights.normalise(layout, np.ones(layout.size))
    explained = columns @ (root @ (root.T @ (columns.T @ normal)))
    samples = np.bincount(layout.channel, minlength=len(grams))
    few = samples - np.einsum("cij,ik,jk->c", grams, root, root, optimize=True) < LEAST_FREEDOM * samples
    explained[few[layout.channel]] = 0.0
    unexplained = (normal - explained) / unit
    return replace(fit, white=whiten(layout, unexplained, replay.floor))
