"""Score screen: which signatures are in the mismatch, beyond what a refit absorbs, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fit import Bench, Fit

FLIPS = 999
NEGLIGIBLE = 1e-3
QUIETEST = 1.0


@dataclass(frozen=True, eq=False)
class Signature:
    """What a candidate would add to the recordings, per typical amplitude.

    Attributes:
        candidate: the hypothesis.
        left: part of the whitened change of the simulated signals that a refit does not absorb, shape (N, d).
        shares: least-squares amplitude in the mismatch, in typical amplitudes, shape (d,).
        gain: fall of half the whitened sum of squares at that amplitude.
        bulk: the same without whitening, in independent samples.
        visibility: share of the change that a refit does not absorb, 0 to 1.
    """

    candidate: Candidate
    left: Floats = field(repr=False)
    shares: Floats
    gain: float
    bulk: float
    visibility: float


@dataclass(frozen=True)
class Screen:
    """Outcome of the screen.

    Attributes:
        statistic: block statistic of each candidate's label.
        p: family-wise p value of each label.
        needed: statistic that each label would need for a family-wise p value of 1 %.
    """

    statistic: dict[str, float]
    p: dict[str, float]
    needed: dict[str, float]

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

    def left(self, signal: Floats) -> Floats:
        """A whitened signal (N, ...) without what is absorbed."""
        remaining: Floats = signal - self.A @ (self.inverse @ (self.A.T @ signal))
        return remaining

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


def signatures(bench: Bench, fit: Fit, candidates: Sequence[Candidate]) -> list[Signature]:
    """Signatures of candidates about a fitted model; those without any effect on these recordings are left out."""
    projector = Projector(fit, bench.layout)
    residual = projector.left(fit.white(bench.layout, fit.mismatch))
    bulk = _Bulk(fit, bench.layout)
    found = []
    here = bench.mismatch(fit.structure, fit.coordinates[None])[0]
    for candidate in candidates:
        structure = candidate.added_to(fit.structure)
        settings = candidate.settings()
        values = np.array([[one[name] for name in candidate.names] for one in settings])
        coordinates = np.stack(
            [
                np.concatenate(
                    [fit.coordinates, [float(f.coordinate(v)) for f, v in zip(candidate.free, row, strict=True)]]
                )
                for row in values
            ]
        )
        change = here - bench.mismatch(structure, coordinates)
        raw = fit.white(bench.layout, change.T)
        size = float(np.sum(raw**2))
        if not np.isfinite(size) or size <= NEGLIGIBLE:
            continue
        left = projector.left(raw)
        gram = left.T @ left
        ridge = 1e-9 * np.trace(gram) * np.eye(gram.shape[0])
        score = left.T @ residual
        shares = np.linalg.solve(gram + ridge, score)
        found.append(
            Signature(
                candidate, left, shares, float(0.5 * score @ shares), bulk.gain(change.T),
                float(np.sum(left**2)) / size,
            )
        )  # fmt: skip
    return found


def screen(bench: Bench, fit: Fit, found: Sequence[Signature], rng: np.random.Generator) -> Screen:
    """Largest block statistics with family-wise p values from sign flips of whole blocks, leverage corrected."""
    if not found:
        return Screen({}, {}, {})
    projector = Projector(fit, bench.layout)
    residual = projector.left(fit.white(bench.layout, fit.mismatch))
    left = [one.left for one in found]
    one_sided = [one.candidate.one_sided for one in found]
    observed, rare, largest = block_statistics(bench.layout, projector, left, residual, rng, one_sided)
    labels = [one.candidate.label for one in found]
    p = (1.0 + np.sum(largest >= (observed / rare)[:, None], axis=1)) / (FLIPS + 1.0)
    return Screen(
        dict(zip(labels, observed.tolist(), strict=True)),
        dict(zip(labels, p.tolist(), strict=True)),
        dict(zip(labels, (rare * np.quantile(largest, 0.99)).tolist(), strict=True)),
    )


def block_statistics(
    layout: Layout,
    projector: Projector,
    left: Sequence[Floats],
    residual: Floats,
    rng: np.random.Generator,
    one_sided: Sequence[bool] | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Studentised score of each projected signature (N, d) under the null of sign flips.

    The spread of the blocks' scores is taken about the fitted amplitude, so that an effect does not hide itself, and is
    not believed below what white residuals give. (Wild bootstrap-t with the null imposed: Cameron, Gelbach,
    Miller, Review of Economics and Statistics 90 (2008) 414.) A signature that lives in few blocks has heavier tails
    than the others: each counts in units of its own 1 % point, lest the family's largest be always the same.

    Args:
        layout: of the stack.
        projector: of the fitted model.
        left: the signatures.
        residual: whitened and projected mismatch (N,).
        rng: of the flips.
        one_sided: signatures of effects that cannot be negative, which a mismatch of the other sign does not support.

    Returns:
        Statistics (C,), their 1 % points under the null (C,), and the largest of their ratios under each of `FLIPS`
        flips.
    """
    corrected = projector.levered(residual)
    signs = rng.choice(np.array([-1.0, 1.0]), size=(FLIPS, layout.blocks))
    largest = np.zeros(FLIPS)
    observed, rare = np.zeros(len(left)), np.ones(len(left))
    for j, one in enumerate(left):
        grams = layout.grams(one)
        own = layout.sums(one * residual[:, None])
        null = layout.sums(one * corrected[:, None])
        flipped = _studentised(signs, null, grams)
        observed[j] = _studentised(np.ones((1, layout.blocks)), own, grams)[0]
        if one_sided is not None and one_sided[j]:
            observed[j] *= own.sum() > 0.0
            flipped *= (signs @ null)[:, 0] > 0.0
        rare[j] = max(float(np.quantile(flipped, 0.99)), 1.0)
        largest = np.maximum(largest, flipped / rare[j])
    return observed, rare, largest


def _studentised(signs: Floats, scores: Floats, grams: Floats) -> Floats:
    """Statistics (F,) of flipped block scores: signs (F, B), scores (B, d), Gram matrices of the blocks (B, d, d)."""
    whole = grams.sum(axis=0)
    whole = whole + 1e-12 * np.trace(whole) * np.eye(len(whole))
    total = signs @ scores
    amplitude = np.linalg.solve(whole, total.T).T
    fitted = np.einsum("bij,fj->fbi", grams, amplitude)
    left = signs[:, :, None] * scores - fitted
    spread = np.einsum("fbi,fbj->fij", left, left) * len(scores) / max(len(scores) - 1, 1)
    root = np.linalg.inv(np.linalg.cholesky(whole))
    values, vectors = np.linalg.eigh(root @ spread @ root.T)
    projected = np.einsum("fji,fj->fi", vectors, total @ root.T)
    found: Floats = np.sqrt(np.sum(projected**2 / np.maximum(values, QUIETEST), axis=1))
    return found
