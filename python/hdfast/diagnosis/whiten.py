"""From a coloured mismatch to independent samples of unit variance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, colour

ORDER = 16
FEWEST_PER_TAP = 20


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
            stride = int(np.diff(sample).min(initial=1 if len(sample) < 2 else sample[-1]))
            complete[past:] = sample[past:] - sample[: len(sample) - past] == past * stride
            found[where] = own * (complete if stacked.ndim == 1 else complete[:, None])
        return found


def whiten(layout: Layout, stacked: Floats, floor: Floats) -> Whitener:
    """Filters that leave nothing to predict in a mismatch (N,), by Yule-Walker over all recordings of a channel.

    Args:
        layout: of the stack.
        stacked: the mismatch.
        floor: noise of each channel, shape (C,); the innovations are not taken for quieter.
    """
    taps = {}
    for index, channel in enumerate(layout.channels):
        pieces = [stacked[where] - stacked[where].mean() for _, name, where in layout.pieces if name == channel]
        taps[channel] = _taps(pieces, float(floor[index]))
    filtered = Whitener(taps)(layout, stacked)
    left = {channel: max(1.0, colour(layout, filtered, channel)) for channel in taps}
    return Whitener({channel: own / np.sqrt(left[channel]) for channel, own in taps.items()})


def _taps(pieces: list[Floats], floor: float) -> Floats:
    total = sum(len(own) for own in pieces)
    order = min(ORDER, total // FEWEST_PER_TAP)
    lags = np.array([sum(float(own[lag:] @ own[: len(own) - lag]) for own in pieces) for lag in range(order + 1)])
    power = lags / max(total, 1)
    if order == 0 or power[0] <= 0.0:
        return np.array([1.0 / max(np.sqrt(max(power[0], 0.0)), floor, 1e-300)])
    power[0] *= 1.0 + 1e-6
    predictor = solve_toeplitz(power[:-1], power[1:])
    innovation = np.sqrt(max(power[0] - predictor @ power[1:], 0.0))
    quietest = floor / np.sqrt(1.0 + predictor @ predictor)
    return np.asarray(np.concatenate([[1.0], -predictor]) / max(innovation, 0.1 * quietest, 1e-300))
