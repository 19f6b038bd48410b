"""What each candidate changes in the simulated signals, and how the noise sounds that none of them explains."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.slopes import ACCELERATED
from hdfast.diagnosis.together import side_by_side
from hdfast.diagnosis.whiten import whiten

INDEPENDENT = 1e-6


@dataclass(frozen=True, eq=False)
class Change:
    """What a candidate adds to the simulated signals, per typical amplitude.

    Attributes:
        candidate: the hypothesis.
        values: in the channels' units, shape (N, d).
        feigned: what more noise of the angle adds to that on the load side, shape (N, d).
    """

    candidate: Candidate
    values: Floats = field(repr=False)
    feigned: Floats = field(repr=False)


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
        alike: dict[Hashable, list[int]] = {}
        for index, (candidate, _) in enumerate(wanted):
            alike.setdefault(candidate.unbounded.form, []).append(index)
        groups = [[wanted[index] for index in rows] for rows in alike.values()]
        changed = chain(*side_by_side(self.replay, self._of_one_form, groups))
        found = dict(zip(chain(*alike.values()), changed, strict=True))
        return [found[index] for index in range(len(wanted))]

    def _of_one_form(self, replay: Replay, wanted: Sequence[tuple[Candidate, float]]) -> list[Change]:
        wide = [candidate.unbounded for candidate, _ in wanted]
        structure = wide[0].added_to(self.fit.structure)
        settings = [one.scaled(times).settings() for one, (_, times) in zip(wide, wanted, strict=True)]
        own = [[float(free.coordinate(row[free.name])) for free in wide[0].free] for rows in settings for row in rows]
        coordinates = np.stack([np.concatenate([self.fit.coordinates, row]) for row in own])
        steady = any(name in ACCELERATED for name in wide[0].names)
        found = (replay.steady if steady else replay.mismatch)(structure, coordinates)
        moved = (self._steady if steady else self._here) - found
        feigned = np.zeros_like(moved)
        if self.fit.stir.loud and not structure.rattles and moved[:, replay.load_side].any():
            feigned = self.fit.stir.noise - replay.noise_on_load(structure, coordinates, found)
        ends = np.cumsum([len(rows) for rows in settings])
        parts = [np.split(each, ends[:-1]) for each in (moved, feigned)]
        return [
            Change(one, part.T / times, noise.T / times)
            for part, noise, (one, times) in zip(*parts, wanted, strict=True)
        ]


def changes(replay: Replay, fit: Fit, candidates: Sequence[Candidate]) -> list[Change]:
    """Changes by all candidates that could be simulated."""
    every = Changer(replay, fit).changes([(candidate, 1.0) for candidate in candidates])
    return [one for one in every if np.isfinite(one.values).all()]


def attentive(replay: Replay, fit: Fit, changed: Sequence[Floats]) -> Fit:
    """The fit with the whitening filter of what neither changes (N, d) nor a refit explain of its mismatch.

    The filter of the mismatch itself would take a slow effect for noise and filter it away.
    """
    layout, weights = replay.layout, fit.weights
    columns = weights.normalise(layout, np.concatenate([fit.slopes.T, *(one.T for one in changed)])).T
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    values, vectors = np.linalg.eigh(columns.T @ columns)
    kept = values > INDEPENDENT * values[-1]
    basis = columns @ (vectors[:, kept] / np.sqrt(values[kept]))
    normal = weights.normalise(layout, fit.mismatch)
    unit = weights.normalise(layout, np.ones(layout.size))
    unexplained = (normal - basis @ (basis.T @ normal)) / unit
    return replace(fit, white=whiten(layout, unexplained, replay.floor))
