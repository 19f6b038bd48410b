"""The final proof: frozen models on recordings that no fit has seen."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, limited
from hdfast.diagnosis.fit import Bench, Fit
from hdfast.diagnosis.score import Gain, nrmse
from hdfast.diagnosis.whiten import Whitener

PROOF_ERRORS = 2.0
TELLS, POWERED = 0.5, 8.0
CLEARLY, WORSE = 0.9, 1.02
PART = 0.25


@dataclass(frozen=True, eq=False)
class Proof:
    """Errors on held-out recordings.

    Attributes:
        baseline, extended: nrmse of the two frozen models.
        floor: nrmse of the sensor noise.
        gain: of the extended model over the baseline, block by block.
        expected: the total gain if the extended model is right.
        mismatch: stacked mismatches (N,) of baseline and extended model.
    """

    baseline: float
    extended: float
    floor: float
    gain: Gain
    expected: float
    mismatch: tuple[Floats, Floats] = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether the extended model is better: by more than chance, or by what so few recordings can tell.

        If nothing were left out, the gain would be minus the expected one, with a variance of twice that.
        """
        if self.extended > WORSE * self.baseline:
            return False
        if self.gain.ratio > PROOF_ERRORS or self.extended < CLEARLY * self.baseline:
            return True
        if self.expected < POWERED:
            return self.expected >= TELLS and self.gain.total > 0.0
        return self.gain.total > PART * self.expected

    @property
    def refutes(self) -> bool:
        """Whether the recordings would have shown the improvement, and speak for the baseline."""
        return not self.holds and self.expected >= POWERED and self.gain.total < 0.0


def replayed(bench: Bench, frozen: Fit) -> Floats:
    """Mismatch (N,) of a frozen model on recordings it was not fitted to."""
    return np.asarray(bench.commanded(frozen).mismatch(frozen.structure, frozen.coordinates[None])[0])


def prove(bench: Bench, baseline: Fit, extended: Fit, floor: float) -> Proof:
    """Simulate the held-out recordings once with each frozen model."""
    return weigh_up(bench.layout, extended.white, replayed(bench, baseline), replayed(bench, extended), floor)


def weigh_up(layout: Layout, white: Whitener, before: Floats, after: Floats, floor: float) -> Proof:
    """The proof from the mismatches (N,) of baseline and extended model, the latter's noise whitened by `white`."""
    loud, quiet = (limited(white(layout, mismatch))[0] for mismatch in (before, after))
    errors = nrmse(layout, after), nrmse(layout, before)
    expected = 0.5 * float(np.sum(white(layout, before - after) ** 2))
    return Proof(errors[1], errors[0], floor, Gain(layout.sums(loud - quiet), errors), expected, (before, after))
