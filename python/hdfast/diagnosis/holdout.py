"""The final proof: frozen models on recordings that no fit has seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.accept import ALONE, MOST_RISE, RISE, USELESS
from hdfast.diagnosis.evidence import Layout, limited
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import CERTAIN, CONVINCING, Gain, nrmse
from hdfast.diagnosis.shaken import Exchanged, exchanged
from hdfast.diagnosis.whiten import Whitener

PROOF_ERRORS = 2.0
TELLS, MUTE, POWERED = 0.5, 2.0, 8.0
LIKELY = 5.0
CLEARLY = 0.9
PART, LARGER, SMALLER_ERRORS = 0.25, 3.0, 4.0
RARE, ALMOST_NEVER = 0.003, 1e-4


@dataclass(frozen=True, eq=False)
class Proof:
    """Errors on held-out recordings.

    Attributes:
        baseline, extended: nrmse of the two frozen models.
        floor: nrmse of the sensor noise.
        gain: of the extended model over the baseline, block by block.
        expected: the gain if the extended model is right.
        margin: limited left-out gain on the recordings that were fitted, less two of its errors.
        mismatch: stacked mismatches (N,) of baseline and extended model.
        p: chance of what the screen shows of it, on the recordings that were fitted, where nothing is left out.
        outset: nrmse of the model that the search began with; default that of the baseline.
    """

    baseline: float
    extended: float
    floor: float
    gain: Gain
    expected: Gain
    margin: float
    mismatch: tuple[Floats, Floats] = field(repr=False)
    p: float = 1.0
    outset: float | None = None

    @property
    def shows(self) -> bool:
        """Whether these recordings show that the extended model is better, by more than chance or as far as they can.

        Those that can hardly show it have to make likely, with the others, what is not likely without them, or confirm
        what stands in few blocks, whose spread is no measure of its error. Those that can must not leave the others
        speaking against it. No block counts for more than it needs to convince: where something else shakes both
        models, as a blow on the load does, which of them is farther off says little.
        """
        if self._worse:
            return False
        if self._clear or (not self._powered and self.confirms):
            return True
        least = max(self._part, -self.margin) if self._powered else max(0.0, LIKELY - self.margin)
        return self.expected.total >= TELLS and self.gain.limited > least

    @property
    def confirms(self) -> bool:
        """Whether these recordings gain about what is expected, and chance would hardly have made what all show.

        An effect of twice the size gains three times what is expected of it; what gains far more is another one's.
        """
        least, most = self._part, LARGER * self.expected.total + PROOF_ERRORS * self._spread
        return not self._worse and least < self.gain.limited <= most and self._rare

    @property
    def speaks_alone(self) -> bool:
        """Whether chance would hardly make what these recordings gain, whatever the others show."""
        return self._chance <= ALMOST_NEVER

    @property
    def refutes(self) -> bool:
        """Whether the recordings would have shown the improvement, and speak for the baseline or are told worse.

        They are also where the extended model follows them so badly that it explains nothing. An effect that they show
        at less than half of its size is no reason to keep the baseline.
        """
        if self.shows or not self._powered:
            return False
        return self._worse or (self.gain.limited < 0.0 and not self._smaller)

    @property
    def holds(self) -> bool:
        """Whether the extended model stands.

        Recordings that can hardly show an effect, or show it at another size, leave standing what convinces on the
        others by more than they speak against it, and what the screen does not single out there only if it is certain;
        those that can tell next to nothing, what the screen singles out.
        """
        if self.shows:
            return True
        if self._worse or self.refutes:
            return False
        singled_out = self.expected.total < MUTE and self._rare
        against = min(self.gain.limited, 0.0)
        needed = CONVINCING if self._powered else LIKELY
        needed = CERTAIN if against < 0.0 and self.p > ALONE else needed
        return singled_out or self.margin + against >= needed

    @property
    def _smaller(self) -> bool:
        """Whether they show part of the improvement: a share s gains 2 s - 1 of what is expected.

        Far beyond chance, or with so much on the fitted recordings that both together still convince.
        """
        expected = self.expected.total
        above = self.gain.total + expected
        chance = max(self.gain.error, math.sqrt(2.0 * expected))
        convinces = self.margin + self.gain.limited >= CONVINCING
        return above >= 2.0 * PART * expected and (convinces or above > SMALLER_ERRORS * chance)

    @property
    def _part(self) -> float:
        """Of what is expected, so much that it is not refuted."""
        return PART * self.expected.limited

    @property
    def _rare(self) -> bool:
        """Whether chance would hardly make both what the screen shows and what these recordings gain.

        The product of two independent p values is judged by Fisher's rule.
        """
        both = max(self.p * self._chance, 1e-300)
        return both * (1.0 - math.log(both)) <= RARE

    @property
    def _chance(self) -> float:
        """How often a gain reaches this one where nothing is left out: it would then be minus the expected one."""
        return float(scipy.stats.norm.sf((self.gain.limited + self.expected.total) / self._spread))

    @property
    def _spread(self) -> float:
        """Standard deviation of the gain: its variance is twice what is expected, or what its blocks show."""
        return max(self.gain.limited_error, math.sqrt(2.0 * self.expected.total), 1e-12)

    @property
    def _powered(self) -> bool:
        return self.expected.total >= POWERED

    @property
    def _worse(self) -> bool:
        """Whether the error rises; what is certain may hide in the loudest channel where the search has lowered it."""
        outset = self.baseline if self.outset is None else self.outset
        most = (1.0 + (MOST_RISE if self.gain.certain else RISE)) * self.baseline
        return self.extended > min(most, (1.0 + RISE) * outset, USELESS)

    @property
    def _clear(self) -> bool:
        return self.gain.ratio > PROOF_ERRORS or self.extended < CLEARLY * self.baseline


def replayed(replay: Replay, frozen: Fit, reference: Fit) -> Exchanged:
    """Simulate recordings with a frozen model, and with the noise that a reference's inertias have."""
    return exchanged(replay.commanded(frozen), frozen, reference)


def weigh_up(
    layout: Layout,
    white: Whitener,
    before: Exchanged,
    after: Exchanged,
    floor: float,
    margin: float = 0.0,
    p: float = 1.0,
    outset: float | None = None,
) -> Proof:
    """The proof from the replays of baseline and extended model, the latter's noise whitened by `white`.

    Errors are those of the models as they are; the gain is between models that hold the same noise, less what either
    makes of it.
    """
    loud, quiet = (limited(white(layout, one.alike))[0] for one in (before, after))
    told = 0.5 * white(layout, before.alike - after.alike) ** 2
    gained = loud - quiet
    if not (before.rattles or after.rattles):
        louder, quieter = white(layout, before.noise), white(layout, after.noise)
        told, gained = told - 0.5 * (louder - quieter) ** 2, gained - (limited(louder)[0] - limited(quieter)[0])
    errors = nrmse(layout, after.mismatch), nrmse(layout, before.mismatch)
    expected = Gain(np.maximum(layout.sums(told), 0.0), errors)
    mismatch = before.mismatch, after.mismatch
    gain = Gain(layout.sums(gained), errors)
    return Proof(errors[1], errors[0], floor, gain, expected, margin, mismatch, p, outset)
