"""The manoeuvre that would decide between models that the recordings at hand cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import lay_out
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.manoeuvres import Limits, Manoeuvre, drawn, known, varied
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.slopes import linearise

THOROUGH, QUICK = (12, 3), (5, 1)  # motions drawn at random, rounds of search
KEPT, NEIGHBOURS = 2, 3
NOTHING = "nothing left out"
SPOKEN = {"te": "the transmission error", "motor_torque": "the motor torque", "output_torque": "the output torque"}
#: Odds [nats] that decide, and beyond which a search for more is not worth its time.
DECIDING, AMPLE = 5.0, 50.0


@dataclass(frozen=True, eq=False)
class Contest:
    """A leading model and those that stand beside it.

    Attributes:
        names: what each holds to be left out, the leading one first.
        fits: the fitted models; the noise is what the first leaves over.
    """

    names: tuple[str, ...]
    fits: tuple[Fit, ...] = field(repr=False)


@dataclass(frozen=True, eq=False)
class Experiment:
    """A proposed manoeuvre.

    Attributes:
        contest: the models it tells apart.
        manoeuvre: the motion.
        limits: what it keeps to.
        odds: expected log Bayes factor for the model that is true, of the pair that is hardest to tell apart.
        usual: the median of random motions.
        telling: (channel, time [s], motor speed [rad/s], first model minus another there, that one's name), where the
            one that is most like the first differs most from it.
        unit: of that difference.
    """

    contest: Contest
    manoeuvre: Manoeuvre
    limits: Limits
    odds: float
    usual: float
    telling: tuple[str, float, float, float, str]
    unit: str

    def to_dict(self) -> dict[str, Any]:
        """The content of `next_experiment`."""
        channel, time, speed, difference, other = self.telling
        first = self.contest.names[0]
        return {
            "separates": list(self.contest.names),
            "manoeuvre": self.manoeuvre.to_dict(),
            "duration_s": self.limits.duration,
            "limits": {"speed_rad_s": self.limits.speed, "acceleration_rad_s2": self.limits.acceleration,
                       "low_angle_rad": self.limits.low, "high_angle_rad": self.limits.high},
            "expected_log_bayes_factor": self.odds,
            "random_motion_log_bayes_factor": self.usual,
            "beyond": list(self.limits.beyond),
            "decides": _decides(self),
            "difference": f"after {time:.2f} s, with the motor at {speed:.3g} rad/s, {SPOKEN[channel]} about its mean "
                          f"is {abs(difference):.3g} {self.unit} {'higher' if difference > 0.0 else 'lower'} "
                          f"with {first} than with {other}",
        }  # fmt: skip


def propose(replay: Replay, contest: Contest, rng: np.random.Generator) -> Experiment | None:
    """Search motions for the one that separates the models best, each from each; None if none does.

    What counts is the smallest of the expected log Bayes factors, each after the false model's parameters were refitted
    to the new recording as far as the old ones let them, whichever of a pair is false. Motions keep to the limits of
    the recordings, and go beyond them, as little as it takes, where only that decides.

    Args:
        replay: the recordings at hand.
        contest: the models.
        rng: for random motions.
    """
    limits = Limits.of(replay.plant.units)
    within = _best(replay, contest, limits, rng, THOROUGH)
    if _decides(within):
        return within
    longer, *narrower, widest = limits.wider(contest.fits[0].value("ratio"))
    last = _best(replay, contest, widest, rng, QUICK)
    if not _decides(last):
        return within
    if within is not None and within.odds * longer.duration > DECIDING * limits.duration:
        narrower.insert(0, longer)
    tried = (_best(replay, contest, one, rng, QUICK) for one in narrower)
    return next((one for one in tried if _decides(one)), last)


def _decides(one: Experiment | None) -> bool:
    return one is not None and one.odds > DECIDING


def _best(
    replay: Replay, contest: Contest, limits: Limits, rng: np.random.Generator, effort: tuple[int, int]
) -> Experiment | None:
    """The best motion found within limits, with as many drawn at random and as many rounds of search as effort says.

    Rounds end early where one decides amply.
    """
    drawn_ones, rounds = effort
    pool = known(limits) + drawn(limits, drawn_ones, rng)
    odds = _odds(replay, contest, pool)
    usual = float(np.median(odds[-drawn_ones:]))
    for _ in range(rounds):
        if odds.max() > AMPLE:
            break
        leading = np.argsort(-odds, kind="stable")[:KEPT]
        near = [varied(pool[index], limits, rng) for index in leading for _ in range(NEIGHBOURS)]
        pool = [pool[index] for index in leading] + near
        odds = np.concatenate([odds[leading], _odds(replay, contest, near)])
    best = int(np.argmax(odds))
    if odds[best] <= 0.0:
        return None
    telling, unit = _telling(replay, contest, pool[best])
    return Experiment(contest, pool[best], limits, float(odds[best]), usual, telling, unit)


def _imagined(replay: Replay, contest: Contest, manoeuvres: Sequence[Manoeuvre]) -> Replay:
    """A replay of the motions as if they had been recorded, with as uncertain a zero of the torque."""
    plant = replay.plant
    like = max(plant.units, key=lambda unit: len(unit.measured))
    ratio = contest.fits[0].value("ratio")
    slowest = min(unit.slowest for unit in plant.units)
    plant = replace(plant, units=[one.unit(plant.band, ratio, like, slowest) for one in manoeuvres])
    layout = lay_out(plant, replay.stated, like=replay.plant.units)
    return Replay(plant, layout, replay.floor, replay.stated).commanded(contest.fits[0])


def _odds(replay: Replay, contest: Contest, manoeuvres: Sequence[Manoeuvre]) -> Floats:
    """Expected log Bayes factor of each motion, shape (n,); 0 where a model cannot follow it."""
    imagined = _imagined(replay, contest, manoeuvres)
    layout = imagined.layout
    if not layout.size:
        return np.zeros(len(manoeuvres))
    mismatch, slopes, _ = zip(
        *(linearise(imagined, one.structure, one.coordinates) for one in contest.fits), strict=True
    )
    weights, pairs = contest.fits[0].weights, list(permutations(range(len(contest.fits)), 2))
    found = np.full((len(pairs), len(manoeuvres)), np.inf)
    already = [np.linalg.inv(fit.covariance(replay.layout)) for fit in contest.fits]
    A = [weights.normalise(layout, own.T).T for own in slopes]
    for row, (false, true) in enumerate(pairs):
        r = weights.normalise(layout, mismatch[false] - mismatch[true])
        for index in range(len(manoeuvres)):
            own = layout.unit == index
            pull = A[false][own].T @ r[own]
            absorbed = pull @ np.linalg.solve(already[false] + A[false][own].T @ A[false][own], pull)
            found[row, index] = 0.5 * (r[own] @ r[own] - absorbed)
    return np.asarray(np.nan_to_num(found.min(axis=0), nan=0.0, posinf=0.0))


def _telling(
    replay: Replay, contest: Contest, manoeuvre: Manoeuvre
) -> tuple[tuple[str, float, float, float, str], str]:
    imagined = _imagined(replay, contest, [manoeuvre])
    layout, unit = imagined.layout, imagined.plant.units[0]
    first, *others = (imagined.mismatch(one.structure, one.coordinates[None])[0] for one in contest.fits)
    apart = [np.abs(contest.fits[0].weights.normalise(layout, other - first)) for other in others]
    closest = int(np.argmin([np.sum(own**2) for own in apart]))
    best = int(np.argmax(apart[closest]))
    sample = int(layout.sample[best])
    channel, difference = layout.channels[int(layout.channel[best])], float(others[closest][best] - first[best])
    name = contest.names[1 + closest]
    place = (channel, float(unit.t[sample]), float(unit.speed[sample]), difference, name)
    return place, "rad" if channel == "te" else "N m"
