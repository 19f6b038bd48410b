"""What each candidate changes in the simulated signals, and how the noise sounds that none of them explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.fit import ACCELERATED, Bench, Fit
from hdfast.diagnosis.whiten import whiten

INDEPENDENT = 1e-6


@dataclass(frozen=True, eq=False)
class Change:
    """What a candidate adds to the simulated signals, per typical amplitude, in the channels' units, (N, d)."""

    candidate: Candidate
    values: Floats = field(repr=False)


@dataclass(frozen=True, eq=False)
class Changer:
    """Adds candidates to a fitted model."""

    bench: Bench
    fit: Fit

    @cached_property
    def _here(self) -> Floats:
        return np.asarray(self.bench.mismatch(self.fit.structure, self.fit.coordinates[None])[0])

    @cached_property
    def _steady(self) -> Floats:
        return np.asarray(self.bench.steady(self.fit.structure, self.fit.coordinates[None])[0])

    def change(self, candidate: Candidate, times: float = 1.0) -> Change:
        """Taken at so many typical amplitudes, also beyond a bound."""
        wide = candidate.unbounded
        structure = wide.added_to(self.fit.structure)
        values = np.array([[one[name] for name in wide.names] for one in wide.scaled(times).settings()])
        own = [[float(f.coordinate(v)) for f, v in zip(wide.free, row, strict=True)] for row in values]
        coordinates = np.stack([np.concatenate([self.fit.coordinates, row]) for row in own])
        if any(name in ACCELERATED for name in candidate.names):
            return Change(candidate, (self._steady - self.bench.steady(structure, coordinates)).T / times)
        return Change(candidate, (self._here - self.bench.mismatch(structure, coordinates)).T / times)


def changes(bench: Bench, fit: Fit, candidates: Sequence[Candidate]) -> list[Change]:
    """Changes by all candidates that could be simulated."""
    changer = Changer(bench, fit)
    every = [changer.change(candidate) for candidate in candidates]
    return [one for one in every if np.isfinite(one.values).all()]


def attentive(bench: Bench, fit: Fit, changed: Sequence[Floats]) -> Fit:
    """The fit with the whitening filter of what neither changes (N, d) nor a refit explain of its mismatch.

    The filter of the mismatch itself would take a slow effect for noise and filter it away.
    """
    layout, weights = bench.layout, fit.weights
    columns = weights.normalise(layout, np.concatenate([fit.slopes.T, *(one.T for one in changed)])).T
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    values, vectors = np.linalg.eigh(columns.T @ columns)
    kept = values > INDEPENDENT * values[-1]
    basis = columns @ (vectors[:, kept] / np.sqrt(values[kept]))
    normal = weights.normalise(layout, fit.mismatch)
    unit = weights.normalise(layout, np.ones(layout.size))
    unexplained = (normal - basis @ (basis.T @ normal)) / unit
    return replace(fit, white=whiten(layout, unexplained, bench.floor))
