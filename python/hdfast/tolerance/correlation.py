"""Dependence between parameters: Gaussian copula, or Iman-Conover for the blocks of a Latin hypercube."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose

if TYPE_CHECKING:
    from hdfast.tolerance.distributions import Tolerance

KINDS = ("scores", "rank")
CELLS = 100  # of probability, into which a continuous law is cut beside one with ties


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

    def of_parts(self, shares: Sequence[float]) -> Correlation:
        """The correlation that two independent parts of every score need for their sum to have this one.

        A score is sqrt(s) times a part that its batch has in common and sqrt(1 - s) times a part of its own. When both
        parts of i and j correlate by m, the scores do by m (sqrt(s_i s_j) + sqrt((1 - s_i) (1 - s_j))): by m itself
        where the shares are equal, and by less at most the more they differ.

        Args:
            shares: (d,) share s of the variance of each score that a batch has in common.

        Raises:
            InputError: shares so different that the scores cannot correlate as asked.
        """
        share, asked = np.array(shares), np.array(self.matrix)
        most = np.sqrt(np.outer(share, share)) + np.sqrt(np.outer(1.0 - share, 1.0 - share))
        needed = np.divide(asked, most, out=np.where(asked == 0.0, 0.0, np.inf), where=most > 0.0)
        np.fill_diagonal(needed, 1.0)
        beyond = np.argwhere(np.triu(np.abs(needed) >= 1.0, 1)).tolist()
        if beyond:
            i, j = beyond[0]
            raise InputError(
                f"pairs: the scores of {self.names[i]} and {self.names[j]} cannot correlate by {asked[i, j]:.3g} with "
                f"batch_share = {share[i]:g} and {share[j]:g} (allowed: less than {most[i, j]:.3g} in size); give them "
                "shares that differ less"
            )
        _require_joint(needed, "with these batch shares")
        return replace(self, matrix=tuple(map(tuple, needed.tolist())))

    def reorder(self, u: Floats) -> Floats:
        """(n, d) columns of u, reordered so that their normal scores correlate as asked (Iman and Conover 1982)."""
        scores = scipy.special.ndtri((scipy.stats.rankdata(u, axis=0) - 0.5) / len(u))
        present = np.corrcoef(scores, rowvar=False)
        target = scores @ np.linalg.inv(np.linalg.cholesky(present)).T @ self.factor.T
        ranks = scipy.stats.rankdata(target, method="ordinal", axis=0) - 1
        return np.take_along_axis(np.sort(u, axis=0), ranks, axis=0)


def correlation(
    pairs: Sequence[Sequence[Any]], kind: str, names: Sequence[str], laws: Mapping[str, Tolerance] | None = None
) -> Correlation | None:
    """Correlation from pairs [name, name, value]; None without pairs.

    Args:
        laws: of the names, whose ties a rank correlation heeds; continuous ones when left out.

    Raises:
        InputError: an unknown name, a value outside -1 to 1 or beyond what the laws of a pair can have, or pairs that
            no joint distribution has.
    """
    if not pairs:
        return None
    values: dict[frozenset[str], float] = {}
    for first, second, value in pairs:
        pair = frozenset((choose("pairs", first, names), choose("pairs", second, names)))
        if len(pair) < 2 or pair in values:
            raise InputError(f"pairs: {first}, {second} is given twice or is no pair of different parameters")
        number = checks.number(f"correlation of {first} and {second}", value, -1.0, 1.0)
        ties = [np.empty((0, 2)) if laws is None else laws[name].ties for name in (first, second)]
        values[pair] = _score_correlation(first, second, number, *ties) if kind == "rank" else number
    used = [name for name in names if any(name in pair for pair in values)]
    matrix = np.eye(len(used))
    for pair, number in values.items():
        i, j = (used.index(name) for name in pair)
        matrix[i, j] = matrix[j, i] = number
    _require_joint(matrix, "together")
    given = tuple((str(first), str(second), float(value)) for first, second, value in pairs)
    return Correlation(tuple(used), tuple(map(tuple, matrix.tolist())), kind, given)


def _score_correlation(first: str, second: str, asked: float, *ties: Floats) -> float:
    """Correlation of the normal scores of two parameters whose values have Spearman's correlation `asked`."""
    if not any(map(len, ties)):
        return 2.0 * math.sin(math.pi * asked / 6.0)
    steps = [_steps(own) for own in ties]
    low, high = (_spearman(angle, *steps) for angle in (-math.pi / 2.0, math.pi / 2.0))
    if not low < asked < high:
        raise InputError(
            f"correlation of {first} and {second} = {asked:g} is beyond the rank correlation that these laws, whose "
            f"equal values share a rank, can have (allowed: above {low:.3g} and below {high:.3g})"
        )
    angle = scipy.optimize.brentq(lambda found: _spearman(found, *steps) - asked, -math.pi / 2.0, math.pi / 2.0)
    return math.sin(angle)


def _steps(ties: Floats) -> tuple[Floats, Floats]:
    """Scores (m,) at which the mean rank of a law steps, and its steps (m,) in standard deviations of that rank."""
    ties = ties[ties[:, 1] - ties[:, 0] > 0.5 / CELLS]  # narrower ones count as little as the cut
    edges = np.union1d(np.linspace(0.0, 1.0, CELLS + 1), ties)
    edges = edges[~np.any((edges > ties[:, :1]) & (edges < ties[:, 1:]), axis=0)]
    ranks, shares = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)
    deviation = math.sqrt(float(np.sum(shares * (ranks - 0.5) ** 2)))
    return scipy.special.ndtri(edges[1:-1]), np.diff(ranks) / deviation


def _spearman(angle: float, first: tuple[Floats, Floats], second: tuple[Floats, Floats]) -> float:
    """Spearman's correlation where that of the scores is sin(angle): Hoeffding's covariance by Plackett's integral."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    s, t = first[0][:, None, None], second[0][:, None]
    between = angle * (nodes + 1.0) / 2.0
    density = np.exp(-(s**2 + t**2 - 2.0 * s * t * np.sin(between)) / (2.0 * np.cos(between) ** 2)) / (2.0 * math.pi)
    return float(first[1] @ (density @ weights) @ second[1]) * angle / 2.0


def _require_joint(matrix: Floats, how: str) -> None:
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    if smallest < 1e-9:
        raise InputError(
            f"pairs: no distribution has these correlations {how} (smallest eigenvalue {smallest:.3g}, "
            "allowed: above 1e-9); weaken the strongest of them"
        )
