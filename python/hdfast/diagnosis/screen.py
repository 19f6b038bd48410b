"""Score screen: which signatures are in the mismatch, beyond what a refit absorbs, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.changes import Change, Changer
from hdfast.diagnosis.evidence import Layout, inner
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.projector import Projector, orthonormal
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.statistics import statistics
from hdfast.diagnosis.together import on_threads

NEGLIGIBLE = 1e-3
SEEN, SLIGHT, SMALL = 7.0, 1.0, 0.3
HEARD = 2.0


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
        score: length of the mismatch along `left`, shape (d,).
        feigned: how much of that noise of the angle in both of them makes, shape (d,).
    """

    candidate: Candidate
    left: Floats = field(repr=False)
    absorbed: Floats = field(repr=False)
    shares: Floats
    gain: float
    bulk: float
    visibility: float
    score: Floats
    feigned: Floats


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


class _Bulk:
    """What a signature would explain of the mismatch without whitening."""

    def __init__(self, fit: Fit, layout: Layout) -> None:
        self.fit, self.layout = fit, layout
        self.A = fit.weights.normalise(layout, fit.slopes.T).T
        self.inverse = np.linalg.inv(inner(self.A, self.A) + np.diag(fit.structure.sigma**-2))
        self.residual = fit.weights.normalise(layout, fit.mismatch)

    def gain(self, change: Floats) -> float:
        """Fall of half the sum of squares, in independent samples, by a change (N, d) and a refit."""
        raw = self.fit.weights.normalise(self.layout, change.T).T
        left = raw - self.A @ (self.inverse @ inner(self.A, raw))
        gram, score = left.T @ left, left.T @ self.residual
        return float(0.5 * score @ np.linalg.solve(gram + 1e-9 * np.trace(gram) * np.eye(len(gram)), score))


class _Signer:
    """Takes signatures about a fitted model."""

    def __init__(self, replay: Replay, fit: Fit) -> None:
        self.fit, self.layout = fit, replay.layout
        self.projector, self.bulk = Projector(fit, replay.layout), _Bulk(fit, replay.layout)
        self.stir = fit.stir.whitened(replay.layout, fit.white)

    def sign(self, change: Change) -> Signature | None:
        """The signature of a change; None where nothing changes on these recordings."""
        raw = self.fit.white(self.layout, change.values)
        size = float(np.sum(raw**2))
        if not np.isfinite(size) or size <= NEGLIGIBLE:
            return None
        absorbed = self.projector.absorbed(raw)
        left = self.projector.left(raw, absorbed)
        score = left.T @ self.projector.residual_about(orthonormal(left))
        shares, gain = _amplitude(left, score)
        visibility, bulk = float(np.sum(left**2)) / size, self.bulk.gain(change.values)
        return Signature(
            change.candidate, left, absorbed, shares, gain, bulk, visibility, score, feigned=np.zeros_like(score)
        )

    def without(self, noise: Floats, one: Signature) -> Signature:
        """A signature less what noise (N, d) of its change feigns."""
        told = np.nan_to_num(self.fit.white(self.layout, noise)) - self.stir.slopes @ one.absorbed
        feigned = told.T @ self.stir.noise
        shares, gain = _amplitude(one.left, one.score - feigned)
        return replace(one, shares=shares, gain=gain, feigned=feigned)


def _amplitude(left: Floats, score: Floats) -> tuple[Floats, float]:
    """Shares (d,) of projected columns (N, d) that a mismatch reaches so far along, and its fall by them."""
    gram = left.T @ left
    ridge = 1e-9 * np.trace(gram) * np.eye(len(gram))
    shares = np.linalg.solve(gram + ridge, score)
    return shares, float(0.5 * score @ shares)


def signatures(replay: Replay, fit: Fit, changed: Sequence[Change]) -> list[Signature]:
    """Signatures of changes about a fitted model; those without any effect on these recordings are left out.

    What a refit leaves of a small effect is not what it leaves of a large one: a softer spring moves a resonance, and
    of that a projection follows the first order, a refit all of it. Where the typical amplitude is far above what would
    be seen, the signature is taken there as well, and where the change itself is no more than seen, to first order.
    """
    signer, changer = _Signer(replay, fit), Changer(replay, fit)

    def signed(some: Sequence[Change]) -> list[tuple[Change, Signature]]:
        told = zip(some, on_threads(replay.plant.threads, signer.sign, some), strict=True)
        return [(one, signature) for one, signature in told if signature is not None]

    found = signed(changed)
    found += signed(
        changer.changes([(replace(one.candidate, size=size), n) for _, one in found for size, n in _sizes(one)])
    )
    heard = [n for n, (one, signature) in enumerate(found) if _heard(replay, fit, one, signature)]
    noises = changer.noises([found[n][0] for n in heard])
    pairs = list(zip(noises, (found[n][1] for n in heard), strict=True))
    less = dict(zip(heard, on_threads(replay.plant.threads, lambda pair: signer.without(*pair), pairs), strict=True))
    return [less.get(n, one) for n, (_, one) in enumerate(found)]


def _heard(replay: Replay, fit: Fit, change: Change, signature: Signature) -> bool:
    """Whether noise of the angle may be what speaks for a signature: it takes a simulation to know how much."""
    return fit.stir.loud and signature.gain >= HEARD and bool(change.values[replay.load_side].any())


def _sizes(one: Signature) -> list[tuple[str, float]]:
    """Smaller amplitudes at which a signature is taken as well, in typical ones."""
    if not one.candidate.bends or one.candidate.unseen:
        return []
    left = float(np.linalg.norm(one.left))
    small, slight = SEEN / left, SLIGHT * np.sqrt(one.visibility) / left
    found = [("small", small)] if small < SMALL else []
    return [*found, ("slight", slight)] if slight < SMALL * min(small, 1.0) else found


def screen(replay: Replay, fit: Fit, found: Sequence[Signature], rng: np.random.Generator) -> Screen:
    """Statistics of the signatures in the mismatch, with family-wise p values."""
    if not found:
        return Screen({}, {}, {}, {})
    projector = Projector(fit, replay.layout)
    left = [one.left for one in found]
    one_sided = [one.candidate.one_sided for one in found]
    feigned = [one.feigned for one in found]
    seen = statistics(replay.layout, projector, left, rng, one_sided, feigned, replay.plant.threads)
    labels = [one.candidate.label for one in found]
    needed = seen.rare * np.quantile(seen.largest, 0.99)
    columns = (seen.observed, seen.p, needed, seen.spread)
    return Screen(*(dict(zip(labels, column.tolist(), strict=True)) for column in columns))
