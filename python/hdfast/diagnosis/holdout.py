"""The final proof: frozen models on recordings that no fit has seen."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import CAP, Weights
from hdfast.diagnosis.fit import Bench, Fit
from hdfast.diagnosis.score import Gain, nrmse

PROOF_ERRORS = 2.0


@dataclass(frozen=True, eq=False)
class Proof:
    """Errors on held-out recordings.

    Attributes:
        baseline, extended: nrmse of the two frozen models.
        floor: nrmse of the sensor noise.
        gain: of the extended model over the baseline, block by block.
        mismatch: stacked mismatches (N,) of baseline and extended model.
    """

    baseline: float
    extended: float
    floor: float
    gain: Gain
    mismatch: tuple[Floats, Floats] = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether the extended model is better by more than chance."""
        return self.gain.ratio > PROOF_ERRORS or self.extended < 0.9 * self.baseline


def prove(bench: Bench, baseline: Fit, extended: Fit, floor: float) -> Proof:
    """Simulate the held-out recordings once with each frozen model."""
    before, after = (bench.mismatch(one.structure, one.coordinates[None])[0] for one in (baseline, extended))
    layout = bench.layout
    scale = np.sqrt(baseline.weights.scale * extended.weights.scale)
    colour = np.sqrt(baseline.weights.colour * extended.weights.colour)
    weights = Weights(scale, colour)
    density = [
        -_half(mismatch / weights.scale[layout.channel]) / weights.colour[layout.channel]
        for mismatch in (after, before)
    ]
    errors = nrmse(layout, after), nrmse(layout, before)
    gain = Gain(layout.sums(density[0] - density[1]), errors)
    return Proof(errors[1], errors[0], floor, gain, (before, after))


def _half(values: Floats) -> Floats:
    size = np.abs(values)
    return np.where(size <= CAP, 0.5 * size**2, CAP * (size - 0.5 * CAP))
