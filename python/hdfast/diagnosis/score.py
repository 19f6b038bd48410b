"""How well a structure predicts recordings it was not fitted to, and how much better it is than another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Index, Layout
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.left_out import left_out
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.shaken import exchanged, noise_of
from hdfast.sensors.channels import TORQUES

CONVINCING = 10.0
CERTAIN, CERTAIN_ERRORS = 20.0, 3.0
SHARE = 0.2
#: A torque is not explained where its error is this share of its spread, and no noise: so many times its floor.
NOTHING, HEARD = 0.95, 3.0


@dataclass(frozen=True, eq=False)
class Gain:
    """Gain in left-out log predictive density of one fit over another.

    Attributes:
        by_block: gain of each block, shape (B,).
        nrmse: left-out error of the better and the lesser fit, as shares of the channels' spread.
        fall: share by which the left-out error of one channel falls, of all recordings together, where it falls most.
    """

    by_block: Floats = field(repr=False)
    nrmse: tuple[float, float]
    fall: float = 0.0

    @property
    def total(self) -> float:
        """Sum over blocks."""
        return float(self.by_block.sum())

    @property
    def error(self) -> float:
        """Standard error of the total."""
        n = len(self.by_block)
        return float(np.sqrt(n) * np.std(self.by_block, ddof=1)) if n > 1 else np.inf

    def over(self, owner: Index) -> Gain:
        """The same with the blocks (B,) of an owner counted as one: what drifts slowly is alike in all of them."""
        _, present = np.unique(owner, return_inverse=True)
        return Gain(np.bincount(present, self.by_block).astype(np.float64), self.nrmse, self.fall)

    @property
    def limited(self) -> float:
        """Sum over blocks, none of which counts more than it needs to convince."""
        return float(self._clipped.sum())

    @property
    def limited_error(self) -> float:
        """Standard error of the limited sum."""
        n = len(self.by_block)
        return float(np.sqrt(n) * np.std(self._clipped, ddof=1)) if n > 1 else np.inf

    @property
    def counted_error(self) -> float:
        """The same, at least a twentieth of what convinces: blocks that all reach the limit have none."""
        return max(self.limited_error, 0.05 * CONVINCING)

    @property
    def ratio(self) -> float:
        """Limited sum in standard errors."""
        return self.limited / self.counted_error

    @property
    def certain(self) -> bool:
        """Whether it is large, and far beyond its error."""
        return self.limited >= CERTAIN and self.ratio > CERTAIN_ERRORS

    @property
    def spared(self) -> float:
        """Limited sum without the block that speaks most for it."""
        return float(self.limited - self._clipped.max(initial=0.0))

    @property
    def _clipped(self) -> Floats:
        return np.clip(self.by_block, -CONVINCING, CONVINCING)


def gain(replay: Replay, better: Fit, lesser: Fit, folds: Index, simulated: Fit | None = None) -> Gain:
    """Gain of one fit over another on left-out folds, both seen through the filter that whitens the better one.

    Args:
        replay: recordings.
        better, lesser: the fits.
        folds: fold of every stacked sample.
        simulated: the part of the better fit that is simulated, where that is not the whole.
    """
    layout = replay.layout
    moved = exchanged(replay, simulated or better, lesser)
    alike = replace(better, mismatch=better.mismatch + moved.change)
    quiet, loud = (left_out(one, better.white, layout, folds) for one in (alike, lesser))
    after, before = quiet.mismatch, loud.mismatch
    gained = loud.surprise(loud.filtered) + loud.vagueness - quiet.surprise(quiet.filtered) - quiet.vagueness
    if not (better.structure.rattles or lesser.structure.rattles):
        louder, quieter = (
            better.white(layout, np.where(replay.load_side, one.stir.noise, noise))
            for one, noise in ((lesser, noise_of(replay, lesser)), (better, moved.noise))
        )
        gained -= loud.surprise(louder) - quiet.surprise(quieter)
        after, before = (without_noise(layout, own, one.stir.noise) for own, one in ((after, better), (before, lesser)))
    errors = nrmse(layout, after), nrmse(layout, before)
    return Gain(layout.sums(gained), errors, fall(layout, after, before))


def without_noise(layout: Layout, mismatch: Floats, noise: Floats) -> Floats:
    """A mismatch (N,) as large as it is, recording by recording and channel by channel, without what noise adds."""
    found = mismatch.copy()
    for _, _, where in layout.pieces:
        share = float(np.mean(noise[where] ** 2) / max(float(np.mean(mismatch[where] ** 2)), 1e-300))
        found[where] *= np.sqrt(max(1.0 - share, 0.0))
    return found


def fall(layout: Layout, after: Floats, before: Floats) -> float:
    """Largest relative fall of a channel's error from one mismatch (N,) to another, where much of the error is.

    Recordings count by their size: one at constant speed shows little but noise, as does a channel that an effect
    leaves alone.
    """
    sizes = [_sizes(layout, mismatch) for mismatch in (after, before)]
    least = SHARE * nrmse(layout, before)
    wrong = [nrmse(layout, before, channel) > least for channel in layout.channels]
    return float(np.max((1.0 - sizes[0] / np.maximum(sizes[1], 1e-300))[wrong], initial=-np.inf))


def _sizes(layout: Layout, stacked: Floats) -> Floats:
    """Root of the sum of squares of stacked values (N,) by channel, shape (C,)."""
    return np.sqrt(np.bincount(layout.channel, stacked**2, minlength=len(layout.channels)))


def nrmse(layout: Layout, mismatch: Floats, channel: str | None = None) -> float:
    """Root mean square over recordings and channels, or one channel, of rms(mismatch) / std(measured)."""
    shares = [
        float(np.sqrt(np.mean(mismatch[where] ** 2))) / max(float(layout.spread[where][0]), 1e-300)
        for _, own, where in layout.pieces
        if channel in (None, own)
    ]
    return float(np.sqrt(np.mean(np.square(shares)))) if shares else float("nan")


def unexplained(replay: Replay, mismatch: Floats) -> list[str]:
    """Torques of which a mismatch (N,) leaves as good as everything, all recordings taken together."""
    layout = replay.layout
    left, spread, noise = (_sizes(layout, one) for one in (mismatch, layout.spread, replay.floor[layout.channel]))
    astray = left > np.maximum(NOTHING * spread, HEARD * noise)
    return [name for name, wrong in zip(layout.channels, astray, strict=True) if wrong and name in TORQUES]


def noise_floor(replay: Replay) -> float:
    """Error that the sensor noise alone makes, as a share of the channels' spread."""
    layout = replay.layout
    shares = [
        replay.floor[layout.channels.index(channel)] / max(float(layout.spread[where][0]), 1e-300)
        for _, channel, where in layout.pieces
    ]
    return float(np.sqrt(np.mean(np.square(shares)))) if shares else 0.0


def weights_of(gains: Sequence[Gain], rng: np.random.Generator, draws: int = 1000) -> Floats:
    """Pseudo-BMA weights of structures by their gains over a common rival: Bayesian bootstrap over blocks."""
    blocks = np.stack([one.by_block for one in gains])
    shares = rng.dirichlet(np.ones(blocks.shape[1]), size=draws) * blocks.shape[1]
    totals = shares @ blocks.T
    totals -= totals.max(axis=1, keepdims=True)
    relative = np.exp(totals)
    averaged: Floats = (relative / relative.sum(axis=1, keepdims=True)).mean(axis=0)
    return averaged
