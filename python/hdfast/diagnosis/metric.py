"""What a fit makes small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, Weights, limited, weigh
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.stir import Stir
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.whiten import Whitener, whiten

NEAR = 1.5


@dataclass(frozen=True, eq=False)
class Metric:
    """What a fit makes small: the bulk of the mismatch in independent samples, and near the noise its fine structure.

    The bulk alone overlooks what stands out only between the frequencies of the noise; but far from the noise a
    whitened fit would leave the slow mismatch as it is, since that predicts itself, and would lower the inertia to
    quieten the acceleration.

    Attributes:
        weights: scale and colour.
        white: filter to independent samples of unit variance.
        fine: share of the whitened mismatch of each channel, 0 to a half, shape (C,).
    """

    weights: Weights
    white: Whitener
    fine: Floats

    @classmethod
    def of(cls, replay: Replay, mismatch: Floats) -> Metric:
        """For the noise that a mismatch (N,) shows."""
        layout = replay.layout
        weights = weigh(layout, mismatch, replay.floor)
        fine = 0.5 * near(replay, weights.scale)
        return cls(weights, whiten(layout, mismatch, replay.floor), fine)

    @classmethod
    def about(cls, replay: Replay, fit: Fit) -> Metric:
        """For the noise that a fit's own mismatch shows."""
        return cls(fit.weights, fit.white, 0.5 * near(replay, fit.weights.scale))

    def of_columns(self, layout: Layout, stacked: Floats) -> Floats:
        """Both parts of (N,) or (N, P), one after the other: (2N,) or (2N, P)."""
        found = np.empty((2 * layout.size, *stacked.shape[1:]))
        bulk, fine = np.split(found, 2)
        np.multiply(stacked.T, (np.sqrt(1.0 - self.fine) / self.weights.unit)[layout.channel], out=bulk.T)
        np.multiply(self.white(layout, stacked).T, np.sqrt(self.fine)[layout.channel], out=fine.T)
        return found

    def cost(
        self, layout: Layout, structure: Structure, x: Floats, mismatch: Floats, stir: Stir | None = None
    ) -> float:
        """Half the weighted sum of squares plus the prior's, less that of what the noise of the angle adds."""
        half, _ = limited(self.of_columns(layout, mismatch))
        pull = (x - structure.start) / structure.sigma
        if stir is None or not stir.loud:
            return float(np.sum(half) + 0.5 * pull @ pull)
        noise, _ = limited(self.of_columns(layout, stir.noise))
        return float(np.sum(half - noise) + 0.5 * stir.firmness @ pull**2)

    def cost_of(self, layout: Layout, fit: Fit) -> float:
        """What a fit costs, less what noise of the angle adds to it."""
        return self.cost(layout, fit.structure, fit.coordinates, fit.mismatch, fit.stir)

    def best_start(self, replay: Replay, structure: Structure, starts: Floats) -> Floats | None:
        """The start (P,) of several (M, P) that costs least; None where none can be simulated."""
        pairs = zip(starts, replay.mismatch(structure, starts), strict=True)
        costs = [self.cost(replay.layout, structure, *pair) for pair in pairs]
        best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
        return np.asarray(starts[best]) if np.isfinite(costs[best]) else None

    def best_fit(self, layout: Layout, fits: Sequence[Fit]) -> Fit:
        """The fit that costs least."""
        return min(fits, key=partial(self.cost_of, layout))


def near(replay: Replay, scale: Floats) -> Floats:
    """How far mismatches of this scale are noise, by channel, 0 to 1, shape (C,)."""
    return np.asarray(np.minimum(1.0, NEAR * replay.stated / scale) ** 4)
