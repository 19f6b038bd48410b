"""The final proof: frozen models on recordings that no fit has seen."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, limited
from hdfast.diagnosis.fit import Bench, Fit, quieted
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


class Replay(NamedTuple):
    """Mismatch (N,) of a frozen model on recordings it was not fitted to.

    Attributes:
        mismatch: as it is.
        alike: with the noise of the acceleration that the model compared with holds.
    """

    mismatch: Floats
    alike: Floats


def replayed(bench: Bench, frozen: Fit, reference: Fit) -> Replay:
    """Simulate recordings with a frozen model, and once more with the inertias of a reference for their noise alone."""
    rows = np.stack([frozen.coordinates, quieted(bench, frozen, reference)])
    found, slow = bench.commanded(frozen).both(frozen.structure, rows, [0, 1])
    return Replay(found[0], found[1] + slow[0] - slow[1])


def prove(bench: Bench, baseline: Fit, extended: Fit, floor: float) -> Proof:
    """Simulate the held-out recordings once with each frozen model."""
    before, after = (replayed(bench, one, baseline) for one in (baseline, extended))
    return weigh_up(bench.layout, extended.white, before, after, floor)


def weigh_up(layout: Layout, white: Whitener, before: Replay, after: Replay, floor: float) -> Proof:
    """The proof from the replays of baseline and extended model, the latter's noise whitened by `white`.

    Errors are those of the models as they are; the gain is between models that hold the same noise.
    """
    loud, quiet = (limited(white(layout, one.alike))[0] for one in (before, after))
    errors = nrmse(layout, after.mismatch), nrmse(layout, before.mismatch)
    expected = 0.5 * float(np.sum(white(layout, before.alike - after.alike) ** 2))
    mismatch = before.mismatch, after.mismatch
    return Proof(errors[1], errors[0], floor, Gain(layout.sums(loud - quiet), errors), expected, mismatch)
