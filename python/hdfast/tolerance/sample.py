"""Rows of parameters by number: design, dependence, batches and distributions put together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.tolerance.correlation import Correlation
from hdfast.tolerance.designs import DESIGNS, Design
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.intervals import Groups
from hdfast.tolerance.laws import normal_scores
from hdfast.tolerance.streams import stream

MAX_ROWS = 10**9
CORRELATED_BLOCK = 20


@dataclass(frozen=True)
class Plan:
    """What is drawn; a row is a function of the plan and its number.

    Attributes:
        tolerances: the d parameters that vary.
        sampling: a key of `DESIGNS`.
        seed: of every stream.
        replicates: number of Sobol sequences that take turns.
        block: rows of one Latin hypercube; with a correlation so many that no reordering of them is singular.
        levels: of a full factorial design.
        correlation: dependence between parameters.
        batch_size: rows that share what `batch_share` of their tolerances says.
    """

    tolerances: tuple[Tolerance, ...]
    sampling: str = "monte_carlo"
    seed: int = 1
    replicates: int = 16
    block: int = 100
    levels: int = 3
    correlation: Correlation | None = None
    batch_size: int = 1

    def __post_init__(self) -> None:
        dependence = self.parts
        if dependence is None or self.sampling != "latin_hypercube":
            return
        least = CORRELATED_BLOCK + len(dependence.names)
        if self.block < least:
            raise InputError(
                f"block = {self.block} is too small to correlate {len(dependence.names)} parameters "
                f"by sampling = {self.sampling!r} (allowed: at least {least})"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that vary."""
        return tuple(tolerance.name for tolerance in self.tolerances)

    @property
    def design(self) -> Design:
        """How rows are placed."""
        return DESIGNS[self.sampling]

    @property
    def batched(self) -> bool:
        """True when rows of a batch have something in common."""
        return self.batch_size > 1 and any(tolerance.batch_share > 0.0 for tolerance in self.tolerances)

    def rows(self, asked: int) -> int:
        """Number of rows to run: `asked`, or the size of a finite design.

        Raises:
            InputError: the finite design is too large.
        """
        if self.design.size is None:
            return asked
        size = self.design.size(self)
        if size > MAX_ROWS:
            raise InputError(
                f"sampling = {self.sampling!r} of {len(self.names)} tolerances has {size:.3g} rows "
                f"(allowed: at most {MAX_ROWS}); vary fewer parameters or take a random sampling"
            )
        return size

    def draw(self, start: int, stop: int) -> dict[str, Floats]:
        """Columns (stop - start,) of the rows start to stop."""
        if not self.tolerances or stop <= start:
            return {name: np.empty(0) for name in self.names}
        points = self.design.points(self, start, stop)
        if not self.design.random:
            return {tol.name: _at_level(tol, points[:, j]) for j, tol in enumerate(self.tolerances)}
        dependent = self._dependent(points, start, stop)
        return {tolerance.name: tolerance.quantile(dependent[:, j]) for j, tolerance in enumerate(self.tolerances)}

    @property
    def parts(self) -> Correlation | None:
        """Dependence of what the design draws, and of what batches have in common; the scores then have `correlation`.

        Raises:
            InputError: batch shares so different that they cannot.
        """
        if self.correlation is None or not self.batched:
            return self.correlation
        shares = {tolerance.name: tolerance.batch_share for tolerance in self.tolerances}
        return self.correlation.of_parts([shares[name] for name in self.correlation.names])

    def dependent_scores(self, scores: Floats) -> Floats:
        """(m, d) normal scores with the correlation of the plan from independent ones."""
        return self._mixed(scores, self.correlation)

    def _mixed(self, scores: Floats, dependence: Correlation | None) -> Floats:
        if dependence is None:
            return scores
        columns = [self.names.index(name) for name in dependence.names]
        mixed = np.array(scores)
        mixed[:, columns] = dependence.mix(scores[:, columns])
        return mixed

    def from_scores(self, scores: Floats) -> dict[str, Floats]:
        """Columns (m,) at (m, d) normal scores."""
        return {
            tolerance.name: tolerance.quantile(scipy.special.ndtr(scores[:, j]))
            for j, tolerance in enumerate(self.tolerances)
        }

    def _dependent(self, points: Floats, start: int, stop: int) -> Floats:
        mixing = self.correlation is not None and self.sampling != "latin_hypercube"
        if not mixing and not self.batched:
            return points

        scores, parts = normal_scores(points), self.parts
        if mixing:
            scores = self._mixed(scores, parts)
        if self.batched:
            share = np.array([tolerance.batch_share for tolerance in self.tolerances])
            common = self._mixed(self._batch_scores(start, stop), parts)
            scores = np.sqrt(share) * common + np.sqrt(1.0 - share) * scores
        return np.asarray(scipy.special.ndtr(scores))

    def _batch_scores(self, start: int, stop: int) -> Floats:
        """(stop - start, d) independent normal scores, the same for all rows of a batch."""
        first, last = start // self.batch_size, (stop - 1) // self.batch_size
        levels = [stream(self.seed, f"batch of {name}", first, last - first + 1) for name in self.names]
        return normal_scores(np.column_stack(levels)[np.arange(start, stop) // self.batch_size - first])

    def groups(self, start: int, stop: int) -> Groups | None:
        """Which of the rows depend on each other; None when none do."""
        if not self.design.random:
            return Groups(np.zeros(stop - start, dtype=np.int64), alike=True)
        if self.batched:
            return Groups(np.arange(start, stop) // self.batch_size, alike=True)
        if self.design.groups is None:
            return None
        return Groups(self.design.groups(self, start, stop).astype(np.int64), alike=False)

    def widest(self, allowed: Mapping[str, tuple[float, float]]) -> dict[str, float]:
        """Largest factor on each spread within the allowed ranges; infinite where there is none."""
        return {t.name: t.widest(allowed.get(t.name, (-np.inf, np.inf))) for t in self.tolerances}

    def scaled(self, factors: Mapping[str, float]) -> Plan:
        """The same plan with the spread of some tolerances multiplied."""
        return replace(self, tolerances=tuple(t.scaled(factors.get(t.name, 1.0)) for t in self.tolerances))


def _at_level(tolerance: Tolerance, level: Floats) -> Floats:
    """Value between the worst cases: -1 lower, 0 middle, 1 upper, straight lines or the nearest value between."""
    low, high = tolerance.extremes()
    return tolerance.nearest(np.interp(level, (-1.0, 0.0, 1.0), (low, tolerance.middle, high)))
