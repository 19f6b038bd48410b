"""Mismatch of all recordings as one vector, with its channels, its scale, its blocks and its colour."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.diagnosis.plant import TORQUE, Plant
from hdfast.diagnosis.prepare import Unit

ZERO_SHARE = 0.02
REST, REST_READINGS = 0.2, 2.0
SHORTEST_BLOCK = 0.4
MOST_BLOCKS = 120
CAP = 4.0

Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Layout:
    """Where every judged sample of a plant stands in the stacked vector of N samples.

    Attributes:
        channels: channel names.
        channel, unit, block, sample: per stacked sample, the channel, recording, block and position in the recording.
        pieces: (unit, channel, slice into the stack) in stacking order.
        spread: standard deviation of the measured channel in its recording, per stacked sample.
        certain: share of a piece's mean that counts, shape (len(pieces),).
    """

    channels: tuple[str, ...]
    channel: Index = field(repr=False)
    unit: Index = field(repr=False)
    block: Index = field(repr=False)
    sample: Index = field(repr=False)
    pieces: tuple[tuple[int, str, slice], ...] = field(repr=False)
    spread: Floats = field(repr=False)
    certain: Floats = field(repr=False)

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1 if len(self.block) else 0

    @property
    def size(self) -> int:
        """Number of stacked samples."""
        return len(self.channel)

    @property
    def unit_of_block(self) -> Index:
        """Recording of each block, shape (B,)."""
        found = np.zeros(self.blocks, dtype=np.int64)
        found[self.block] = self.unit
        return found

    @cached_property
    def since(self) -> Index:
        """How many samples of its piece precede each stacked one without a gap, shape (N,)."""
        found = np.zeros(self.size, dtype=np.int64)
        for _, _, where in self.pieces:
            apart = np.diff(self.sample[where])
            places = np.arange(len(apart) + 1)
            gap = np.concatenate([[False], apart != apart.min(initial=np.iinfo(np.int64).max)])
            found[where] = places - np.maximum.accumulate(np.where(gap, places, 0))
        return found

    def stack(self, found: Sequence[Mapping[str, Floats]]) -> Floats:
        """Stack mismatches (M, n) per unit and channel to (M, N); of a mean counts what is certain of it."""
        parts = []
        for (unit, channel, where), certain in zip(self.pieces, self.certain.tolist(), strict=True):
            values = found[unit][channel][:, self.sample[where]]
            parts.append(values - (1.0 - certain) * values.mean(axis=1, keepdims=True))
        return np.concatenate(parts, axis=1)

    def sums(self, values: Floats) -> Floats:
        """Sums over blocks of (N,) or (N, d): (B,) or (B, d)."""
        if values.ndim == 1:
            return np.asarray(np.bincount(self.block, values, minlength=self.blocks), dtype=np.float64)
        return np.stack([np.bincount(self.block, column, minlength=self.blocks) for column in values.T], axis=1)

    def grams(self, values: Floats) -> Floats:
        """Gram matrices of (N, d) in each block: (B, d, d)."""
        found = np.empty((self.blocks, values.shape[1], values.shape[1]))
        for i, j in zip(*np.tril_indices(values.shape[1]), strict=True):
            found[:, i, j] = found[:, j, i] = self.sums(values[:, i] * values[:, j])
        return found


def lay_out(plant: Plant, stated: Floats, like: Sequence[Unit] | None = None) -> Layout:
    """Stack the judged samples of a plant, as many as its band holds; blocks are stretches of one recording.

    The zero of a torque sensor is not the same in every recording, so recordings that move give up their means: a zero
    may be off by as much as the torque varies. Where all hold their levels, levels are all there is; zeros are taken as
    known to `ZERO_SHARE` of them. Where a drive rests, the zero is not off by much more than what is shown there: a
    torque that holds it would have to make up for it. The other sensors' zeros are unknown.

    Args:
        plant: recordings.
        stated: standard deviation of one sample of each channel, in the channel's unit, shape (C,).
        like: recordings whose torque tells how far zeros may be off; default those of the plant.
    """
    channels = tuple(plant.channels)
    total = sum(unit.t[-1] for unit in plant.units)
    length = max(SHORTEST_BLOCK, total / MOST_BLOCKS)
    columns: list[list[Floats]] = [[], [], [], [], []]
    pieces, certain = [], []
    begin, first_block = 0, 0
    noise = max(float(stated[channels.index(TORQUE)]), 1e-300)
    zero = _zero(plant.units if like is None else like, noise)
    for index, unit in enumerate(plant.units):
        count = max(1, round(unit.t[-1] / length))
        block = np.minimum((unit.t / unit.t[-1] * count).astype(np.int64), count - 1) + first_block
        first_block += count
        for channel in unit.measured:
            judged = np.flatnonzero(unit.judged[channel])
            judged = judged[judged % plant.band.stride(channel) == 0]
            n = len(judged)
            if n < 8:
                continue
            spread = float(np.std(unit.measured[channel][judged]))
            entries = (channels.index(channel), index, block[judged], judged, spread)
            for column, entry in zip(columns, entries, strict=True):
                column.append(np.broadcast_to(entry, n))
            pieces.append((index, channel, slice(begin, begin + n)))
            off = min(zero, _at_rest(unit))
            certain.append(1.0 / math.hypot(1.0, off * math.sqrt(n) / noise) if channel == TORQUE else 0.0)
            begin += n
    channel_, unit_, block_, sample_, spread_ = (
        np.concatenate(column) if column else np.zeros(0) for column in columns
    )
    blocks = np.unique(block_, return_inverse=True)[1]
    return Layout(
        channels, channel_.astype(np.int64), unit_.astype(np.int64), blocks, sample_.astype(np.int64),
        tuple(pieces), spread_, np.array(certain),
    )  # fmt: skip


def _zero(units: Sequence[Unit], noise: float) -> float:
    """How far the zero of the torque may be off by what recordings show of it in motion [N m].

    Args:
        units: recordings.
        noise: standard deviation of one sample of the torque [N m].
    """
    torques = [unit.measured[TORQUE][unit.judged[TORQUE]] for unit in units if unit.judged[TORQUE].any()]
    levels, varied = [float(np.mean(one)) for one in torques], [float(np.std(one)) for one in torques]
    moved = math.sqrt(max(max(varied, default=0.0) ** 2 - noise**2, 0.0))
    return max(moved, ZERO_SHARE * math.sqrt(float(np.mean(np.square(levels)))) if levels else 0.0)


def _at_rest(unit: Unit) -> float:
    """How far the zero of the torque may be off by what is shown at rest [N m]; infinite without a rest."""
    torque = unit.measured[TORQUE]
    shown = torque[unit.resting]
    if len(shown) * (unit.t[1] - unit.t[0]) < REST:
        return math.inf
    return math.hypot(REST_READINGS * float(np.mean(shown)), ZERO_SHARE * float(np.std(torque)))


def inner(one: Floats, other: Floats) -> Floats:
    """Sums over all samples of (N, p) times (N, ...), shape (p, ...); `@` would keep other threads waiting for it."""
    return np.asarray(np.dot(one.T, other))


def members(owner: Index) -> list[Index]:
    """The samples of each owner (N,), in their order."""
    order = np.argsort(owner, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(owner[order])) + 1)


@dataclass(frozen=True, eq=False)
class Weights:
    """Scale of the mismatch per channel and how many samples count as one.

    Attributes:
        scale: standard deviation by channel, in the channel's unit, shape (C,).
        colour: samples per independent sample, the same for all channels.
    """

    scale: Floats
    colour: float

    @property
    def unit(self) -> Floats:
        """What a channel is divided by, so that a sum of squares counts independent samples, shape (C,)."""
        return self.scale * math.sqrt(self.colour)

    def normalise(self, layout: Layout, stacked: Floats) -> Floats:
        """Divide (..., N) by the unit of each channel."""
        return stacked / self.unit[layout.channel]


def limited(values: Floats) -> tuple[Floats, Floats]:
    """Half squares of normalised values, linear beyond `CAP` (Huber), and the weights that belong to them."""
    size = np.abs(values)
    near = np.minimum(size, CAP)
    return 0.5 * near**2 + CAP * (size - near), CAP / np.maximum(size, CAP)


def spread_of(values: Floats) -> float:
    """Root mean square of values (n,), none of which counts for more than `CAP` typical ones; 0 for none."""
    if not values.size:
        return 0.0
    most = CAP * max(1.4826 * float(np.median(np.abs(values - np.median(values)))), 1e-300)
    return float(np.sqrt(np.mean(np.clip(values, -most, most) ** 2)))


def weigh(layout: Layout, stacked: Floats, floor: Floats) -> Weights:
    """Robust scale and colour of a mismatch (N,), not below the floor per channel.

    The colour is the channels' geometric mean: with its own, a channel whose mismatch is large and smooth would count
    as a few samples, and a fit would leave it as it is.
    """
    scale, colours = np.ones(len(layout.channels)), np.ones(len(layout.channels))
    for index in range(len(layout.channels)):
        own = stacked[layout.channel == index]
        if own.size:
            scale[index] = max(spread_of(own), floor[index], 1e-300)
            colours[index] = colour(layout, stacked, layout.channels[index])
    return Weights(scale, math.exp(float(np.mean(np.log(colours)))))


def colour(layout: Layout, stacked: Floats, channel: str) -> float:
    """Samples per independent one: 1 + 2 times the sum of autocorrelations up to their first crossing of 0.05."""
    found, weights = [], []
    for _, name, where in layout.pieces:
        if name != channel:
            continue
        own = stacked[where] - stacked[where].mean()
        n = len(own)
        width = 1 << (2 * n - 1).bit_length()
        power = np.abs(np.fft.rfft(own, width)) ** 2
        correlation = np.fft.irfft(power, width)[: n // 2]
        if correlation[0] <= 0.0:
            continue
        correlation = correlation / correlation[0]
        below = np.flatnonzero(correlation < 0.05)
        end = int(below[0]) if below.size else len(correlation)
        found.append(1.0 + 2.0 * float(np.sum(correlation[1:end])))
        weights.append(n)
    return float(np.average(found, weights=weights)) if found else 1.0
