"""From a coloured mismatch to independent samples of unit variance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Index, Layout, colour, spread_of

ORDER = 16
FEWEST_PER_TAP = 20
QUIETEST = 0.1


@dataclass(frozen=True, eq=False)
class Whitener:
    """Prediction-error filter of each channel, scaled to independent samples of unit variance.

    Attributes:
        taps: coefficients by channel, shape (p + 1,).
    """

    taps: Mapping[str, Floats] = field(repr=False)

    def __call__(self, layout: Layout, stacked: Floats) -> Floats:
        """Filter (N,) or (N, d) recording by recording; samples without a complete past become 0."""
        found = np.zeros_like(stacked)
        for _, channel, where in layout.pieces:
            taps = self.taps[channel]
            own = lfilter(taps, [1.0], stacked[where], axis=0)
            past = len(taps) - 1
            sample = layout.sample[where]
            complete = np.zeros(len(sample), dtype=bool)
            complete[past + _followed(sample, past, stride_of(sample))] = True
            found[where] = own * (complete if stacked.ndim == 1 else complete[:, None])
        return found


def stride_of(sample: Index) -> int:
    """Smallest distance of sample numbers (n,)."""
    return int(np.diff(sample).min(initial=1 if len(sample) < 2 else sample[-1]))


def _followed(sample: Index, lag: int, stride: int) -> Index:
    """Positions in sample numbers (n,) whose next `lag` ones follow without a gap; none in a shorter piece."""
    begin = sample[: max(len(sample) - lag, 0)]
    return np.flatnonzero(sample[lag:] - begin == lag * stride)


def whiten(layout: Layout, stacked: Floats, floor: Floats) -> Whitener:
    """Filters that leave nothing to predict in a mismatch (N,), by Yule-Walker over all recordings of a channel.

    Args:
        layout: of the stack.
        stacked: the mismatch.
        floor: noise of each channel, shape (C,); the innovations are not taken for quieter.
    """
    predictors, quietest = {}, {}
    for index, channel in enumerate(layout.channels):
        own = [(layout.sample[where], stacked[where]) for _, name, where in layout.pieces if name == channel]
        predictors[channel] = _predictor(own)
        quietest[channel] = QUIETEST * floor[index] / np.linalg.norm(predictors[channel])
    filtered = Whitener(predictors)(layout, stacked)
    scaled = {}
    for index, channel in enumerate(layout.channels):
        innovation = spread_of(filtered[(layout.channel == index) & (filtered != 0.0)])
        counted = max(1.0, colour(layout, filtered, channel))
        scaled[channel] = predictors[channel] / (max(innovation, quietest[channel], 1e-300) * np.sqrt(counted))
    return Whitener(scaled)


def _predictor(pieces: list[tuple[Index, Floats]]) -> Floats:
    """Taps (p + 1,) of the prediction error of samples (n,) with their numbers; pairs across a gap do not count."""
    total = sum(len(own) for _, own in pieces)
    order = min(ORDER, total // FEWEST_PER_TAP)
    lags = np.zeros(order + 1)
    for sample, own in pieces:
        centred, stride = own - own.mean(), stride_of(sample)
        for lag in range(order + 1):
            first = _followed(sample, lag, stride)
            lags[lag] += float(centred[first + lag] @ centred[first])
    if order == 0 or lags[0] <= 0.0:
        return np.ones(1)
    lags[0] *= 1.0 + 1e-6
    return np.concatenate([[1.0], -solve_toeplitz(lags[:-1], lags[1:])])
