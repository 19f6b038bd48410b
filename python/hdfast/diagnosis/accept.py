"""What an effect has to show on left-out stretches before it is accepted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy

from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.evidence import Index
from hdfast.diagnosis.fit import placed
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.left_out import NEAR_NOISE, folds_near
from hdfast.diagnosis.masking import FAR
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.resolution import unresolved
from hdfast.diagnosis.score import CERTAIN_ERRORS, Gain, gain, nrmse
from hdfast.diagnosis.screen import Screen
from hdfast.diagnosis.shaken import calmer
from hdfast.diagnosis.structure import TORQUE_SCALE

ALARM, NOTICED, ALONE = 0.01, 0.05, 0.001
NOISY = 1.15
TWO_BLOCKS, GAIN_ERRORS, CHANCE, SLOW_CHANCE, SPARED = 1.4, 2.0, 0.01, 0.025, 4.0
FALL = 0.05
NEAR_FLOOR = 1.3
AMPLITUDE_SIGMAS = 2.0
PRICE, OWN_PRICE = 0.2, 0.05
RISE, MOST_RISE, TELLING = 0.02, 0.05, 8.0
USELESS = 1.5
CALMER, OWN_SHARE = 0.1, 0.5
SHORT, STILL, SMALL, HELD_OUT = "A1 gain", "A2 error", "A3 amplitude", "A7 held out"
NO_MODEL = "A0 simulation"
TIMING = ("actuator_lag", "delay", "sensor_delay", "sensor_lowpass")
DRIFTS = ("sensor_offset_drift", "clock_skew", "ratio_error")
ECCENTRIC, GRAVITY = "encoder_eccentricity", "gravity_unbalance"
SLOW = (*DRIFTS, ECCENTRIC, GRAVITY)
#: Linear laws: they act wherever the drive moves, and not in few blocks.
LINEAR = ("base_compliance", "input_compliance", "load_compliance", "viscoelastic")


@dataclass(frozen=True)
class Rules:
    """What an accepted effect has to show.

    Attributes:
        floor: nrmse of the sensor noise alone; near it the required fall of the error is waived.
        folds: fold of every stacked sample.
    """

    floor: float
    folds: Index = field(repr=False)

    @classmethod
    def near(cls, replay: Replay, current: Fit, floor: float) -> Rules:
        """The rules for what a fit leaves above noise of this nrmse."""
        return cls(floor, folds_near(replay, nrmse(replay.layout, current.mismatch), floor))

    def near_noise(self, error: float) -> bool:
        """Whether a mismatch of this nrmse is so small that refits of models tell what they lack."""
        return error <= NEAR_NOISE * self.floor

    def beyond_noise(self, error: float) -> bool:
        """Whether a mismatch of this nrmse is no noise, so that it opens the search without the screen."""
        return error > NOISY * self.floor

    def waived(self, seen: Screen, candidate: Candidate, error: float) -> bool:
        """Whether an error need not fall much: the screen singles the candidate out, and it is not far from noise.

        Clocks and filters of the recorder look like an actuator or a sensor that is late by a little.
        """
        if candidate.effect in TIMING:
            return False
        p = seen.p.get(candidate.label, 1.0)
        return (p <= ALARM and self.near_noise(error)) or (p <= NOTICED and error <= NEAR_FLOOR * self.floor)


def failed_rules(
    replay: Replay, joint: Fit, current: Fit, candidate: Candidate, gained: Gain, rules: Rules, seen: Screen
) -> tuple[str, ...]:
    """The rules that an effect breaks, by name; what the screen does not notice gains too little by itself."""
    if not np.isfinite(joint.mismatch).all():
        return (NO_MODEL,)
    failed = []
    slow = candidate.effect in DRIFTS or (candidate.effect in SLOW and len(replay.plant.units) > 1)
    p = seen.p.get(candidate.label, 1.0)
    beyond_chance = repeats(gained, p, replay.layout.unit_of_block) if slow else convinces(gained, p)
    if not beyond_chance or p > NOTICED or too_uneven(candidate, gained):
        failed.append(SHORT)
    after, before = gained.nrmse
    waived = rules.waived(seen, candidate, before) and gained.total >= TELLING
    beyond_doubt = certain(candidate, gained, seen)
    enough = gained.fall >= FALL or waived or beyond_doubt
    if after > (1.0 + (MOST_RISE if beyond_doubt else RISE)) * before or not enough:
        failed.append(STILL)
    if after > USELESS:
        failed.append("A8 prediction")
    if not sizeable(replay, joint, candidate):
        failed.append(SMALL)
    if unresolved(candidate, joint, replay):
        failed.append("A5 resolution")
    if special(candidate, joint):
        failed.append("A6 special case")
    failed += [f"A4 {name}" for name in [*_at_bounds(candidate, joint), *strained(joint, current, gained)][:1]]
    if not (failed or calmer(replay, joint, current) <= CALMER * gained.total):
        failed.append("A9 noise")
    asked = candidate.effect in TIMING or rules.near_noise(before)
    if asked and not (failed or of_its_own(candidate, own_gain(replay, joint, current, rules.folds), gained)):
        failed.append("A10 own gain")
    return tuple(failed)


def convinces(gained: Gain, p: float, chance: float = CHANCE) -> bool:
    """Whether a gain is beyond chance: by its error over blocks, or by all blocks but the one that speaks most for it.

    How many errors chance may make depends on how many blocks tell the error (Student's t). An effect that stands in
    few blocks never exceeds the error over all of them; where the screen singles it out, what the others gain decides.

    Args:
        gained: by block.
        p: family-wise p value of the screen.
        chance: how often a gain that is none may exceed its error so far.
    """
    beyond = bool(gained.ratio > scipy.stats.t.isf(chance, len(gained.by_block) - 1))
    return (beyond or singled(gained, p)) and gained.total >= SPARED


def singled(gained: Gain, p: float) -> bool:
    """Whether the screen singles an effect out that gains on more than the block that speaks most for it.

    Args:
        gained: by block.
        p: family-wise p value of the screen.
    """
    return p <= ALONE and gained.spared >= SPARED


def too_uneven(candidate: Candidate, gained: Gain) -> bool:
    """Whether a gain differs so much from block to block that it is no effect's, however rare chance makes it.

    What stands in two blocks alone gains by 1.41 of its errors. A linear law may vary less.
    """
    return gained.ratio < (GAIN_ERRORS if candidate.effect in LINEAR else TWO_BLOCKS)


def repeats(gained: Gain, p: float, recordings: Index) -> bool:
    """The same of what is alike all through a recording: it is one block then.

    Something else that is slow would do as well: only what is certain over the blocks may be singled out.

    Args:
        gained: by block.
        p: family-wise p value of the screen.
        recordings: recording of each block, shape (B,).
    """
    return convinces(gained.over(recordings), p if gained.ratio > CERTAIN_ERRORS else 1.0, SLOW_CHANCE)


def own_gain(replay: Replay, joint: Fit, current: Fit, folds: Index) -> Gain:
    """What an effect gains beside the model without it, once that has the parameters that were refitted with it.

    Args:
        replay: recordings.
        joint: the model with the effect.
        current: the model without it.
        folds: fold of every stacked sample.
    """
    return gain(replay, joint, placed(replay, current, current.beside(joint)), folds)


def of_its_own(candidate: Candidate, own: Gain, gained: Gain) -> bool:
    """Whether what an effect gains is its own, and not what its refit moves.

    A model that was refitted without it loses less than one that was not, so that its own gain is the larger one. What
    is late by a little moves phases, and takes the credit for whatever else its refit moves: where a controller answers
    to disturbances, a lower inertia predicts better, with a lag or without. Its own gain has to convince. That of
    others has to be half of all, or certain.

    Args:
        candidate: the effect.
        own: its gain beside the model with the same parameters.
        gained: that beside the refitted one.
    """
    if candidate.effect in TIMING:
        return convinces(own, 1.0)
    return own.certain or own.total >= OWN_SHARE * gained.total


def sizeable(replay: Replay, joint: Fit, candidate: Candidate) -> bool:
    """Whether its amplitude is more than its error, in the recorded torque and at its shape: neither may be known.

    An amplitude whose variance rounding takes to zero or below is not known at all.
    """
    names = joint.structure.names
    where = [names.index(name) for name in candidate.sizes]
    given = [names.index(name) for name in (TORQUE_SCALE, *candidate.names) if name not in candidate.sizes]
    covariance = joint.covariance(replay.layout)
    shared = covariance[np.ix_(where, given)]
    own = covariance[np.ix_(where, where)] - shared @ np.linalg.solve(covariance[np.ix_(given, given)], shared.T)
    positive = [joint.structure.free[j].positive for j in where]
    sizes = np.where(positive, 1.0, np.abs(joint.coordinates[where]))
    apart = sizes**2 > AMPLITUDE_SIGMAS**2 * np.diag(own)
    together = all(positive) and len(where) ** 2 > AMPLITUDE_SIGMAS**2 * own.sum()
    known = np.diag(own) > 0.0
    return bool(np.any(apart & known) or (together and known.all() and own.sum() > 0.0))


def certain(candidate: Candidate, gained: Gain, seen: Screen) -> bool:
    """Whether an effect is certain: the rest of the mismatch, or the noise, may then hide how far the error falls."""
    noticed = candidate.effect not in TIMING and seen.p.get(candidate.label, 1.0) <= ALARM
    return noticed and gained.certain


def special(candidate: Candidate, fitted: Fit) -> bool:
    """Whether nothing but a special case is left of a general law: a parameter ends at its bound."""
    return bool(candidate.contains and _at_bounds(candidate, fitted))


def _at_bounds(candidate: Candidate, fitted: Fit) -> list[str]:
    """The effect's own parameters that end at a bound; those of a multiple are of the factor."""
    ends = dict(zip(fitted.structure.names, fitted.coordinates, strict=True))
    bounded = [free for free in candidate.free if not free.ends]
    return [free.name for free in bounded if not free.bounds[0] < ends[free.name] < free.bounds[1]]


def strained(joint: Fit, current: Fit, gained: Gain) -> list[str]:
    """Parameters far from what is known of them that the gain does not pay for, the effect's own less readily."""
    known = dict(zip(current.structure.names, current.pulls, strict=True))
    found = []
    for name, pull in zip(joint.structure.names, joint.pulls, strict=True):
        far = pull > max(FAR, known.get(name, 0.0) + 0.5)
        paid = PRICE * gained.total if name in known else OWN_PRICE * gained.limited
        if far and 0.5 * (pull**2 - known.get(name, 0.0) ** 2) > paid:
            found.append(name)
    return found
