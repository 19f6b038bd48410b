"""Score screen: which signatures are in the mismatch, beyond what a refit absorbs, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.evidence import CAP, Layout
from hdfast.diagnosis.fit import ACCELERATED, Bench, Fit

DRAWS = 999
BORROWED = 20.0
NEGLIGIBLE = 1e-3
SEEN, SMALL = 7.0, 0.3
QUIETEST = 1.0


@dataclass(frozen=True, eq=False)
class Signature:
    """What a candidate would add to the recordings, per typical amplitude.

    Attributes:
        candidate: the hypothesis.
        left: part of the whitened change of the simulated signals that a refit does not absorb, shape (N, d).
        absorbed: coordinates of the model that stand for the rest, shape (P, d).
        shares: least-squares amplitude in the mismatch, in typical amplitudes, shape (d,).
        gain: fall of half the whitened sum of squares at that amplitude.
        bulk: the same without whitening, in independent samples.
        visibility: share of the change that a refit does not absorb, 0 to 1.
    """

    candidate: Candidate
    left: Floats = field(repr=False)
    absorbed: Floats = field(repr=False)
    shares: Floats
    gain: float
    bulk: float
    visibility: float


@dataclass(frozen=True)
class Screen:
    """Outcome of the screen.

    Attributes:
        statistic: statistic of each candidate's label.
        p: family-wise p value of each label.
        needed: statistic that each label would need for a family-wise p value of 1 %.
        spread: standard deviation of the length that each statistic is made of.
    """

    statistic: dict[str, float]
    p: dict[str, float]
    needed: dict[str, float]
    spread: dict[str, float]

    @property
    def smallest_p(self) -> float:
        """Family-wise p value of the best candidate; 1 without candidates."""
        return min(self.p.values(), default=1.0)


class Projector:
    """Takes out of a signal what a refit of the model's parameters would absorb, priors included."""

    def __init__(self, fit: Fit, layout: Layout) -> None:
        self.layout = layout
        self.A = fit.white(layout, fit.slopes)
        self.inverse = np.linalg.inv(self.A.T @ self.A + np.diag(fit.structure.sigma**-2))

    def absorbed(self, signal: Floats) -> Floats:
        """Coordinates (P, ...) that a refit gives to a whitened signal (N, ...)."""
        coordinates: Floats = self.inverse @ (self.A.T @ signal)
        return coordinates

    def left(self, signal: Floats) -> Floats:
        """A whitened signal (N, ...) without what is absorbed."""
        remaining: Floats = signal - self.A @ self.absorbed(signal)
        return remaining

    def residual(self, fit: Fit) -> Floats:
        """The whitened mismatch (N,) without what is absorbed; no sample counts for more than `CAP` of them."""
        return self.left(np.clip(fit.white(self.layout, fit.mismatch), -CAP, CAP))

    def levered(self, residual: Floats) -> Floats:
        """(I - P_bb)^(-1/2) r block by block: undoes how much the fit followed each block."""
        root = np.linalg.cholesky(self.inverse)
        corrected = residual.copy()
        order = np.argsort(self.layout.block, kind="stable")
        bounds = np.flatnonzero(np.diff(self.layout.block[order])) + 1
        for rows in np.split(order, bounds):
            B = self.A[rows] @ root
            values, vectors = np.linalg.eigh(B.T @ B)
            values = np.clip(values, 0.0, 1.0 - 1e-6)
            factor = np.where(values > 1e-10, (1.0 / np.sqrt(1.0 - values) - 1.0) / np.maximum(values, 1e-10), 0.5)
            corrected[rows] += B @ (vectors @ (factor * (vectors.T @ (B.T @ residual[rows]))))
        return corrected


class _Bulk:
    """What a signature would explain of the mismatch without whitening."""

    def __init__(self, fit: Fit, layout: Layout) -> None:
        self.fit, self.layout = fit, layout
        self.A = fit.weights.normalise(layout, fit.slopes.T).T
        self.inverse = np.linalg.inv(self.A.T @ self.A + np.diag(fit.structure.sigma**-2))
        self.residual = fit.weights.normalise(layout, fit.mismatch)

    def gain(self, change: Floats) -> float:
        """Fall of half the sum of squares, in independent samples, by a change (N, d) and a refit."""
        raw = self.fit.weights.normalise(self.layout, change.T).T
        left = raw - self.A @ (self.inverse @ (self.A.T @ raw))
        gram, score = left.T @ left, left.T @ self.residual
        return float(0.5 * score @ np.linalg.solve(gram + 1e-9 * np.trace(gram) * np.eye(len(gram)), score))


class _Signer:
    """Takes signatures about a fitted model."""

    def __init__(self, bench: Bench, fit: Fit) -> None:
        self.bench, self.fit = bench, fit
        self.projector, self.bulk = Projector(fit, bench.layout), _Bulk(fit, bench.layout)
        self.residual = self.projector.residual(fit)
        self.here = bench.mismatch(fit.structure, fit.coordinates[None])[0]
        self.steady = bench.steady(fit.structure, fit.coordinates[None])[0]

    def sign(self, candidate: Candidate, times: float = 1.0) -> Signature | None:
        """Signature per typical amplitude, taken at so many of them; None where nothing changes on these recordings."""
        fit, layout = self.fit, self.bench.layout
        structure = candidate.added_to(fit.structure)
        values = np.array([[one[name] for name in candidate.names] for one in candidate.scaled(times).settings()])
        own = [[float(f.coordinate(v)) for f, v in zip(candidate.free, row, strict=True)] for row in values]
        coordinates = np.stack([np.concatenate([fit.coordinates, row]) for row in own])
        if any(name in ACCELERATED for name in candidate.names):
            change = (self.steady - self.bench.steady(structure, coordinates)).T / times
        else:
            change = (self.here - self.bench.mismatch(structure, coordinates)).T / times
        raw = fit.white(layout, change)
        size = float(np.sum(raw**2))
        if not np.isfinite(size) or size <= NEGLIGIBLE:
            return None
        left, absorbed = self.projector.left(raw), self.projector.absorbed(raw)
        gram = left.T @ left
        ridge = 1e-9 * np.trace(gram) * np.eye(gram.shape[0])
        score = left.T @ self.residual
        shares = np.linalg.solve(gram + ridge, score)
        gain, visibility = float(0.5 * score @ shares), float(np.sum(left**2)) / size
        return Signature(candidate, left, absorbed, shares, gain, self.bulk.gain(change), visibility)


def signatures(bench: Bench, fit: Fit, candidates: Sequence[Candidate]) -> list[Signature]:
    """Signatures of candidates about a fitted model; those without any effect on these recordings are left out.

    What a refit leaves of a small effect is not what it leaves of a large one: a softer spring moves a resonance, and
    of that a refit follows the first order. Where the typical amplitude is far above what would be seen, the signature
    is taken there as well.
    """
    signer = _Signer(bench, fit)
    large = [one for candidate in candidates if (one := signer.sign(candidate)) is not None]
    small = [
        signer.sign(replace(one.candidate, shape=f"{one.candidate.shape}, small".lstrip(", ")), times)
        for one in large
        if one.candidate.bends and (times := SEEN / float(np.linalg.norm(one.left))) < SMALL
    ]
    return [*large, *(one for one in small if one is not None)]


def screen(bench: Bench, fit: Fit, found: Sequence[Signature], rng: np.random.Generator) -> Screen:
    """Statistics of the signatures in the mismatch, with family-wise p values."""
    if not found:
        return Screen({}, {}, {}, {})
    projector = Projector(fit, bench.layout)
    residual = projector.residual(fit)
    left = [one.left for one in found]
    one_sided = [one.candidate.one_sided for one in found]
    seen = statistics(bench.layout, projector, left, residual, rng, one_sided)
    labels = [one.candidate.label for one in found]
    needed = seen.rare * np.quantile(seen.largest, 0.99)
    columns = (seen.observed, seen.p, needed, seen.spread)
    return Screen(*(dict(zip(labels, column.tolist(), strict=True)) for column in columns))


@dataclass(frozen=True, eq=False)
class Statistics:
    """Of C signatures in a mismatch.

    Attributes:
        observed: length of the mismatch along each signature, over its spread, shape (C,).
        spread: standard deviation of that length where nothing is left out, shape (C,).
        rare: 1 % point of each under the null, shape (C,).
        largest: largest ratio of statistic and 1 % point in each draw of the null, shape (DRAWS,).
    """

    observed: Floats
    spread: Floats
    rare: Floats
    largest: Floats

    @property
    def p(self) -> Floats:
        """Family-wise p values (C,)."""
        ratios = (self.observed / self.rare)[:, None]
        found: Floats = (1.0 + np.sum(self.largest >= ratios, axis=1)) / (len(self.largest) + 1.0)
        return found


def statistics(
    layout: Layout,
    projector: Projector,
    left: Sequence[Floats],
    residual: Floats,
    rng: np.random.Generator,
    one_sided: Sequence[bool] | None = None,
) -> Statistics:
    """How far the mismatch reaches along each projected signature, in units of what noise does.

    White residuals of unit variance reach 1 along each direction. What is left of their colour shows in the scores of
    whole blocks, taken about the fitted amplitude so that an effect does not hide itself; a signature that lives in few
    blocks says little of that, so its variance is drawn towards the median of all signatures as if that were known from
    `BORROWED` blocks. The null draws normal scores with the covariance of the signatures and the uncertainty of their
    variances; signs of whole blocks cannot be flipped for this, as few blocks have few signs. Each signature counts in
    units of its own 1 % point.

    Args:
        layout: of the stack.
        projector: of the fitted model.
        left: the signatures (N, d).
        residual: whitened and projected mismatch (N,).
        rng: of the null.
        one_sided: signatures of effects that cannot be negative, which a mismatch of the other sign does not support.
    """
    corrected = projector.levered(residual)
    sides = np.zeros(len(left), dtype=bool) if one_sided is None else np.asarray(one_sided)
    unit = [_orthonormal(one) for one in left]
    scores = [one.T @ residual for one in unit]
    variance, blocks = np.array([_inflation(layout, one, corrected) for one in unit]).T
    freedom = blocks + BORROWED
    typical = max(float(np.median(variance)), QUIETEST)
    spread = np.sqrt(np.maximum((blocks * variance + BORROWED * typical) / freedom, QUIETEST))
    whole = np.concatenate(unit, axis=1)
    values, vectors = np.linalg.eigh(whole.T @ whole)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = rng.standard_normal((DRAWS, len(values))) @ root.T
    estimated = rng.chisquare(freedom, size=(DRAWS, len(left))) / freedom
    observed, rare, largest = np.zeros(len(left)), np.ones(len(left)), np.zeros(DRAWS)
    begin = 0
    for j, score in enumerate(scores):
        null = drawn[:, begin : begin + len(score)]
        begin += len(score)
        reached = np.linalg.norm(null, axis=1) / np.sqrt(estimated[:, j])
        observed[j] = np.linalg.norm(score) / spread[j]
        if sides[j]:
            observed[j] *= score[0] > 0.0
            reached *= null[:, 0] > 0.0
        rare[j] = np.quantile(reached, 0.99)
        largest = np.maximum(largest, reached / rare[j])
    return Statistics(observed, spread, rare, largest)


def _orthonormal(signature: Floats) -> Floats:
    """Columns (N, d) of unit length at right angles, the first along the first."""
    basis, triangle = np.linalg.qr(signature)
    return np.asarray(basis * np.sign(np.diag(triangle) + (np.diag(triangle) == 0.0)))


def _inflation(layout: Layout, unit: Floats, residual: Floats) -> tuple[float, float]:
    """Variance of a residual (N,) along orthonormal columns (N, d) as its blocks show it, and from how many of them."""
    grams = layout.grams(unit)
    own = layout.sums(unit * residual[:, None])
    about = own - np.einsum("bij,j->bi", grams, own.sum(axis=0))
    shared = float(np.einsum("bij,bji->", grams, grams))
    expected = max(unit.shape[1] - shared, 1e-12)
    return float(np.sum(about**2)) / expected, max(unit.shape[1] / shared - 1.0, 1e-12)
