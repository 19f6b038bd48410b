"""How far a mismatch reaches along signatures, and how far it would if nothing were left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.projector import Projector, orthonormal
from hdfast.diagnosis.together import on_threads

DRAWS = 9999
BORROWED = 20.0
QUIETEST = 1.0
OCTAVES = 14
NEGLIGIBLE = 1e-12


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
    rng: np.random.Generator,
    one_sided: Sequence[bool] | None = None,
    feigned: Sequence[Floats] | None = None,
    threads: int | None = 1,
) -> Statistics:
    """How far the mismatch reaches along each projected signature, in units of what noise does.

    White residuals of unit variance reach 1 along each direction. What is left of their colour shows in the scores of
    whole blocks, taken about the fitted amplitude so that an effect does not hide itself; a signature that lives in few
    blocks says little of that, so its variance is drawn towards the median of all signatures as if that were known from
    `BORROWED` blocks. The null draws normal scores with the covariance of the signatures and the uncertainty of their
    variances; signs of whole blocks cannot be flipped for this, as few blocks have few signs. Each signature counts in
    units of its own 1 % point. The variance is never below what the spectrum of the rest gives the signature, in
    the draws neither.

    Args:
        layout: of the stack.
        projector: of the fitted model.
        left: the signatures (N, d).
        rng: of the null.
        one_sided: signatures of effects that cannot be negative, which a mismatch of the other sign does not support.
        feigned: length of the mismatch along each signature that is known to be noise, (d,).
        threads: for the signatures, side by side.
    """
    sides = np.zeros(len(left), dtype=bool) if one_sided is None else np.asarray(one_sided)
    known = [None] * len(left) if feigned is None else feigned
    plain = projector.levered(projector.residual)
    told = on_threads(threads, lambda own: _along(layout, projector, plain, *own), list(zip(left, known, strict=True)))
    scores = [one.score for one in told]
    variance, blocks, heard = np.array([(one.variance, one.blocks, one.heard) for one in told]).T
    freedom = blocks + BORROWED
    typical = max(float(np.median(variance)), QUIETEST)
    shrunk = (blocks * variance + BORROWED * typical) / freedom
    least = np.maximum(heard, QUIETEST)
    spread = np.sqrt(np.maximum(shrunk, least))
    whole = np.concatenate([one.unit for one in told], axis=1)
    values, vectors = np.linalg.eigh(whole.T @ whole)
    kept = np.flatnonzero(values > NEGLIGIBLE * values[-1])
    root = vectors[:, kept] * np.sqrt(values[kept])
    drawn = rng.standard_normal((DRAWS, len(values)))[:, kept] @ root.T
    estimated = rng.chisquare(freedom, size=(DRAWS, len(left))) / freedom
    taken = np.sqrt(np.maximum(estimated, least / spread**2))
    observed, rare, largest = np.zeros(len(left)), np.ones(len(left)), np.zeros(DRAWS)
    begin = 0
    for j, score in enumerate(scores):
        null = drawn[:, begin : begin + len(score)]
        begin += len(score)
        reached = np.linalg.norm(null, axis=1) / taken[:, j]
        observed[j] = np.linalg.norm(score) / spread[j]
        if sides[j]:
            observed[j] *= score[0] > 0.0
            reached *= null[:, 0] > 0.0
        rare[j] = np.quantile(reached, 0.99)
        largest = np.maximum(largest, reached / rare[j])
    return Statistics(observed, spread, rare, largest)


@dataclass(frozen=True, eq=False)
class _Along:
    """What stands along one signature.

    Attributes:
        unit: the signature's columns of unit length at right angles, shape (N, d).
        score: length of the mismatch along them, shape (d,).
        variance, blocks: of a residual along them as its blocks show it, and from how many of them.
        heard: the same variance as the spectrum shows it.
    """

    unit: Floats
    score: Floats
    variance: float
    blocks: float
    heard: float


def _along(layout: Layout, projector: Projector, plain: Floats, left: Floats, feigned: Floats | None) -> _Along:
    """Of a projected signature (N, d), with the residual (N,) that is levered for all."""
    unit = orthonormal(left)
    residual = projector.residual_about(unit)
    score = unit.T @ residual
    if feigned is not None and feigned.any():
        score = score - np.linalg.solve((unit.T @ left).T, feigned)
    corrected = plain if residual is projector.residual else projector.levered(residual)
    variance, blocks = _inflation(layout, unit, corrected)
    return _Along(unit, score, variance, blocks, _by_octave(layout, unit, residual))


def _inflation(layout: Layout, unit: Floats, residual: Floats) -> tuple[float, float]:
    """Variance of a residual (N,) along orthonormal columns (N, d) as its blocks show it, and from how many of them."""
    grams = layout.grams(unit)
    own = layout.sums(unit * residual[:, None])
    about = own - np.einsum("bij,j->bi", grams, own.sum(axis=0))
    shared = float(np.einsum("bij,bji->", grams, grams))
    expected = max(unit.shape[1] - shared, 1e-12)
    return float(np.sum(about**2)) / expected, max(unit.shape[1] / shared - 1.0, 1e-12)


def _by_octave(layout: Layout, unit: Floats, residual: Floats) -> float:
    """Variance of a residual (N,) along orthonormal columns (N, d) as the spectrum of what they leave shows it.

    Noise that falls with frequency over seconds is longer than a block and longer than a whitening filter. The spectrum
    is that of all recordings of a channel, in octaves.
    """
    about = residual - unit @ (unit.T @ residual)
    power = np.zeros((len(layout.channels), OCTAVES))
    share, count = np.zeros_like(power), np.zeros_like(power)
    for _, channel, where in layout.pieces:
        n = where.stop - where.start
        quick = scipy.fft.next_fast_len(n, real=True)
        octave = np.minimum(np.log2(quick / (2.0 * np.arange(1, quick // 2 + 1))).astype(np.int64), OCTAVES - 1)
        row = layout.channels.index(channel)
        values = np.vstack([about[where], unit[where].T])
        values -= values.mean(axis=1, keepdims=True)
        squares = np.abs(scipy.fft.rfft(values, quick)[:, 1:]) ** 2
        power[row] += np.bincount(octave, squares[0], minlength=OCTAVES)
        share[row] += np.bincount(octave, squares[1:].sum(axis=0), minlength=OCTAVES)
        count[row] += n * np.bincount(octave, minlength=OCTAVES)
    density = power / np.maximum(count, 1.0)
    return float(np.sum(share * density) / max(float(np.sum(share)), 1e-300))
