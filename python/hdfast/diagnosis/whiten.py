"""From a coloured mismatch to independent samples of unit variance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import as_strided

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Index, Layout, colour, spread_of

ORDER = 16
FEWEST_PER_TAP = 20
QUIETEST = 0.1
RIDGE = 1e-6
#: Samples that are filtered by one product of matrices: of many columns it takes a fifth of the time of one by one.
TOGETHER = 16


@dataclass(frozen=True, eq=False)
class Whitener:
    """Prediction-error filters of each channel, scaled to independent samples of unit variance.

    Attributes:
        taps: of each channel, those of order k in the first k + 1 of row k, the rest 0; shape (p + 1, p + 1).
    """

    taps: Mapping[str, Floats] = field(repr=False)

    def __call__(self, layout: Layout, stacked: Floats) -> Floats:
        """Filter (N,) or (N, d) recording by recording; samples soon after a gap are predicted from those since."""
        found = np.zeros_like(stacked)
        for _, channel, where in layout.pieces:
            taps, own = self.taps[channel], stacked[where]
            filtered = _filtered(taps[-1], own)
            since = layout.since[where]
            soon = np.flatnonzero(since < len(taps) - 1)
            past = np.maximum(soon[:, None] - np.arange(len(taps)), 0)
            filtered[soon] = np.einsum("hl,hl...->h...", taps[since[soon]], own[past])
            found[where] = filtered
        return found


def _filtered(taps: Floats, values: Floats) -> Floats:
    """Values (n,) or (n, d) through a filter with taps (p + 1,), of zeros before them."""
    order, n = len(taps) - 1, len(values)
    rows = math.ceil(n / TOGETHER)
    padded = np.zeros((rows * TOGETHER + order, math.prod(values.shape[1:])))
    padded[order : order + n] = values.reshape(n, -1)
    each, own = padded.strides
    windows = as_strided(padded, (rows, TOGETHER + order, padded.shape[1]), (TOGETHER * each, each, own))
    banded = np.zeros((TOGETHER, TOGETHER + order))
    for row in range(TOGETHER):
        banded[row, row : row + order + 1] = taps[::-1]
    return np.asarray((banded @ windows).reshape(-1, padded.shape[1])[:n].reshape(values.shape))


def whiten(layout: Layout, stacked: Floats, floor: Floats) -> Whitener:
    """Filters that leave nothing to predict in a mismatch (N,), by Burg's recursion over all recordings of a channel.

    Args:
        layout: of the stack.
        stacked: the mismatch.
        floor: noise of each channel, shape (C,); the innovations are not taken for quieter.
    """
    predictors, quietest = {}, {}
    for index, channel in enumerate(layout.channels):
        pieces = [where for _, name, where in layout.pieces if name == channel]
        predictors[channel] = _predictors([(layout.since[where], stacked[where]) for where in pieces])
        quietest[channel] = QUIETEST * floor[index] / np.linalg.norm(predictors[channel][-1])
    filtered = Whitener(predictors)(layout, stacked)
    scaled = {}
    for index, channel in enumerate(layout.channels):
        innovation = spread_of(filtered[layout.channel == index])
        counted = max(1.0, colour(layout, filtered, channel))
        scaled[channel] = predictors[channel] / (max(innovation, quietest[channel], 1e-300) * np.sqrt(counted))
    return Whitener(scaled)


def _predictors(pieces: list[tuple[Index, Floats]]) -> Floats:
    """Taps of the prediction errors of all orders, each as large as that of the highest.

    Of pieces with how many samples precede each without a gap (n,), and the samples (n,). Autocorrelations would do
    where spectra are flat; of a low-passed mismatch they leave much to predict, as its last octave is far below the
    others.

    Returns:
        As `Whitener.taps`.
    """
    if not pieces:
        return np.ones((1, 1))
    since = np.concatenate([one for one, _ in pieces])
    ahead = np.concatenate([own - own.mean() for _, own in pieces])
    highest = min(ORDER, len(ahead) // FEWEST_PER_TAP)
    power = float(np.mean(ahead**2))
    if highest == 0 or power <= 0.0:
        return np.ones((1, 1))
    taps, left = np.zeros((highest + 1, highest + 1)), np.full(highest + 1, power)
    taps[0, 0] = 1.0
    behind = ahead
    for order in range(1, highest + 1):
        behind = np.concatenate([[0.0], behind[:-1]])
        f, b = ahead[since >= order], behind[since >= order]
        reflected = -2.0 * float(f @ b) / max((1.0 + RIDGE) * float(f @ f + b @ b), 1e-300)
        ahead, behind = ahead + reflected * behind, behind + reflected * ahead
        taps[order, : order + 1] = taps[order - 1, : order + 1] + reflected * taps[order - 1, order::-1]
        left[order] = left[order - 1] * (1.0 - reflected**2)
    return np.asarray(taps * np.sqrt(left[-1] / left)[:, None])
