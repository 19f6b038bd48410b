"""Dependence between parameters: Gaussian copula, or Iman-Conover for the blocks of a Latin hypercube."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose

KINDS = ("scores", "rank")


@dataclass(frozen=True)
class Correlation:
    """Dependence of some parameters.

    Attributes:
        names: the d parameters that depend on each other.
        matrix: (d, d) correlation of their normal scores, as nested tuples.
        kind: how it was given: "scores" (correlation of the normal scores) or "rank" (Spearman's).
        pairs: what was given.
    """

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
    kind: str
    pairs: tuple[tuple[str, str, float], ...]

    @property
    def factor(self) -> Floats:
        """(d, d) lower Cholesky factor."""
        return np.linalg.cholesky(np.array(self.matrix))

    def mix(self, scores: Floats) -> Floats:
        """(n, d) dependent normal scores from independent ones."""
        lower = self.factor
        mixed = np.empty_like(scores)
        for j in range(len(self.names)):  # written out: the bits of a row must not depend on the shape of the call
            mixed[:, j] = sum(lower[j, k] * scores[:, k] for k in range(j + 1))
        return mixed

    def reorder(self, u: Floats) -> Floats:
        """(n, d) columns of u, reordered so that their normal scores correlate as asked (Iman and Conover 1982)."""
        from scipy.special import ndtri
        from scipy.stats import rankdata

        scores = ndtri((rankdata(u, axis=0) - 0.5) / len(u))
        present = np.corrcoef(scores, rowvar=False)
        target = scores @ np.linalg.inv(np.linalg.cholesky(present)).T @ self.factor.T
        ranks = rankdata(target, method="ordinal", axis=0) - 1
        return np.take_along_axis(np.sort(u, axis=0), ranks, axis=0)


def correlation(pairs: Sequence[Sequence[Any]], kind: str, names: Sequence[str]) -> Correlation | None:
    """Correlation from pairs [name, name, value]; None without pairs.

    Raises:
        InputError: an unknown name, a value outside -1 to 1, or pairs that no joint distribution has.
    """
    if not pairs:
        return None
    values: dict[frozenset[str], float] = {}
    for first, second, value in pairs:
        pair = frozenset((choose("pairs", first, names), choose("pairs", second, names)))
        if len(pair) < 2 or pair in values:
            raise InputError(f"pairs: {first}, {second} is given twice or is no pair of different parameters")
        number = checks.number(f"correlation of {first} and {second}", value, -1.0, 1.0)
        values[pair] = 2.0 * math.sin(math.pi * number / 6.0) if kind == "rank" else number
    used = [name for name in names if any(name in pair for pair in values)]
    matrix = np.eye(len(used))
    for pair, number in values.items():
        i, j = (used.index(name) for name in pair)
        matrix[i, j] = matrix[j, i] = number
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    if smallest < 1e-9:
        raise InputError(
            f"pairs: no distribution has these correlations together (smallest eigenvalue {smallest:.3g}, "
            "allowed: above 1e-9); weaken the strongest of them"
        )
    given = tuple((str(first), str(second), float(value)) for first, second, value in pairs)
    return Correlation(tuple(used), tuple(map(tuple, matrix.tolist())), kind, given)
