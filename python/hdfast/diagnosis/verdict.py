"""The verdict, by the rules that match first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hdfast.diagnosis.accept import ALARM, ALONE, HELD_OUT, SHORT, STILL, TIMING, USELESS, certain
from hdfast.diagnosis.experiment import NOTHING, Contest, Experiment, propose
from hdfast.diagnosis.facts import FACTS
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.limits import Limit, limits, unseen, untold_gain
from hdfast.diagnosis.locate import Where, locate
from hdfast.diagnosis.masking import Masked, masked
from hdfast.diagnosis.rivals import CLOSE_ERRORS, FAINT, INDISTINCT, SURE, Rival, Standing, stand
from hdfast.diagnosis.score import CERTAIN, CONVINCING, nrmse
from hdfast.diagnosis.session import Session
from hdfast.diagnosis.shapes import effect_of
from hdfast.diagnosis.trials import Search
from hdfast.diagnosis.unknown import Unknown, describe
from hdfast.printing import enumerated, percents

NAMED = ("no_evidence", "found", "undecided", "depends_on", "sensor", "not_reproducible", "data_rejected")
RISEN = 1.002
MOST_RIVALS = 2  # that a proposed motion tells from the leading effect, and from each other
PASTS = {"none": "", "rate_independent": " and on its path", "fading": " and on its recent past"}
WARMS_UP = "resists the motion and fades with time_since_start, as in a drive that warms up"


@dataclass(frozen=True, eq=False)
class Claim:
    """What is said.

    Attributes:
        name: one of `NAMED`.
        reason: why it is undecided, else "".
        session: calibration, search and proof.
        standings: accepted effects with probabilities and rivals.
        unknown: best description by a state variable alone, or None.
    """

    name: str
    reason: str
    session: Session = field(repr=False)
    standings: Sequence[Standing] = field(repr=False)
    unknown: Unknown | None = field(repr=False)

    @property
    def described(self) -> Unknown | None:
        """The torque without a name that the verdict rests on, or None."""
        return self.unknown if self.name == "depends_on" else None

    @property
    def extended(self) -> Fit | None:
        """The model with what was left out, named or not; None where nothing was added."""
        if self.described is not None:
            return self.described.fit
        return self.session.search.final if self.session.search.accepted else None

    @property
    def proof(self) -> Proof | None:
        """Both models on held-out recordings, or None without any."""
        return self.session.proof if self.described is None else self.described.proof

    @property
    def told(self) -> list[Standing]:
        """The effects that are named, or all that an undecided verdict is about."""
        return [one for one in self.standings if one.probability >= SURE or self.name == "undecided"]

    @property
    def sentence(self) -> str:
        """The verdict in one line."""
        if self.name == "no_evidence":
            return f"No evidence of left-out physics in these recordings{self._left}."
        if self.name == "undecided":
            return f"Undecided: {self.reason}{self._better}."
        if self.described is not None:
            at = f"at the {self.described.place}" if self.described.place else "at the motor or on the load"
            feature = self.described.feature
            warms_up = (feature.name, feature.memory) == ("time_since_start", "fading")
            cause = WARMS_UP if warms_up else f"depends on {feature.name}{PASTS[feature.memory]}"
            alike = " or ".join(self.alike)
            known = f"Could be {alike}, but not for sure" if alike else "None of the known effects"
            return f"{known}: a torque {at} that {cause}{self._better}."
        return f"The model leaves out {', '.join(dict.fromkeys(one.name for one in self.told))}{self._better}."

    @property
    def alike(self) -> list[str]:
        """Known effects that act as the described torque does, and that nothing but chance keeps from a name."""
        if self.described is None:
            return []
        last, feature, place = self.session.search.rounds[-1], self.described.feature.name, self.described.place
        likely = (
            one.candidate
            for one in last.trials
            if one.failed == (SHORT,) and last.screen.p[one.candidate.label] <= ALARM
        )
        matching = (one for one in likely if place in (None, one.place) and feature in FACTS[one.effect].depends_on)
        return list(dict.fromkeys(one.effect for one in matching))

    @property
    def _left(self) -> str:
        proof = self.proof
        if proof is None or not math.isfinite(proof.extended):
            return ""
        return (
            f"; error on held-out recordings {100 * proof.extended:.3g} %, "
            f"white sensor noise alone makes {100 * proof.floor:.2g} %"
        )

    @property
    def _better(self) -> str:
        proof = self.proof if self.extended is not None else None
        if proof is None or not math.isfinite(proof.extended):
            return ""
        before, after = percents(proof.baseline, proof.extended)
        return f"; error on held-out recordings {before} -> {after}"


@dataclass(frozen=True, eq=False)
class Verdict(Claim):
    """What is said, and the evidence it rests on.

    Attributes:
        where: location of the mismatch.
        masked: parameters that had swallowed an effect.
        limits: what these recordings can show of every effect.
        experiment: the manoeuvre that would decide, or None when nothing is open.
    """

    where: Where
    masked: Sequence[Masked]
    limits: Sequence[Limit] = field(repr=False)
    experiment: Experiment | None = field(repr=False)


def conclude(session: Session, seed: int) -> Verdict:
    """Weigh what the session found."""
    replay, search, baseline = session.replay, session.search, session.baseline
    rng = np.random.default_rng([seed, 2])
    standings = stand(replay, search, session.floor, session.shown, session.lessers, rng)
    unknown = None if standings else describe(replay, session.held, search.final, rng)
    name, reason, contest = _decide(session, standings, unknown)
    claim = Claim(name, reason, session, standings, unknown)
    extended = claim.extended or search.final
    last = search.rounds[-1]
    untaken = [one for one in last.signatures if not set(one.candidate.names) & set(search.final.structure.names)]
    taken = [trial.candidate for trial in search.accepted]
    return Verdict(
        **vars(claim),
        where=locate(replay, session.held, baseline, extended, [one.order for one in taken if one.order is not None]),
        masked=masked(baseline, extended, replay.layout) if extended is not baseline else (),
        limits=[
            *limits(untaken, last.screen, len(replay.plant.units)),
            *unseen(last.candidates, replay.plant, last.before.structure, _known(search)),
            *untold_gain(extended, replay.layout),
        ],
        experiment=None if contest is None else propose(replay, contest, np.random.default_rng([seed, 3])),
    )


def _known(search: Search) -> set[str]:
    """Effects that were screened in some round, that are in the model, or that are special cases of what is."""
    screened = {one.candidate.effect for each in search.rounds for one in each.signatures}
    structure = search.final.structure
    there = {effect_of(term) for term in structure.model.terms} | {effect for effect, _ in structure.sensors}
    taken = [*search.accepted, *search.rounds[-1].present]
    return screened | there | {effect for trial in taken for effect in trial.candidate.contains}


def _decide(
    session: Session, standings: Sequence[Standing], unknown: Unknown | None
) -> tuple[str, str, Contest | None]:
    """The verdict and, for an undecided one, why and between which models."""
    if not standings:
        return _without_a_name(session, unknown)
    search = session.search
    leading = max(standings, key=lambda one: one.alone.total)
    alone = Contest((leading.name, NOTHING), (search.final, leading.lesser))
    if session.proof is not None and not session.proof.holds:
        return "undecided", "the improvement does not show on the held-out recordings", alone
    if _worse(session):
        reason = (
            f"with {leading.name} the model follows left-out stretches and held-out recordings less well than without"
        )
        return "undecided", reason, alone
    rivals, others = leading.rivals, _besides(standings, leading)
    if leading.probability < SURE:
        if not rivals or rivals[0].weight < FAINT:
            reason = f"the evidence for {leading.name} is too thin for a name{others}"
            return "undecided", reason, alone
        reason = f"{leading.name} cannot be told from {rivals[0].effect}{others}"
        return "undecided", reason, _between(leading, search.final, rivals[0])
    close = [rival for rival in rivals if rival.alike > INDISTINCT and rival.behind < CLOSE_ERRORS]
    if close:
        reason = f"{leading.name} looks like {close[0].effect} on these recordings{others}"
        return "undecided", reason, _between(leading, search.final, close[0])
    if all(one.trial.candidate.place == "sensor" for one in standings if one.probability >= SURE):
        return "sensor", "", None
    return "found", "", None


def _between(leading: Standing, final: Fit, rival: Rival) -> Contest:
    """The leading effect, a rival, and what else is as likely or looks the same."""
    others = [one for one in leading.rivals if one is not rival and (one.weight >= FAINT or one.alike > INDISTINCT)]
    chosen = [rival, *others][:MOST_RIVALS]
    return Contest((leading.name, *(one.effect for one in chosen)), (final, *(one.fit for one in chosen)))


def _besides(standings: Sequence[Standing], leading: Standing) -> str:
    """What an undecided verdict says of effects that are sure beside the leading one."""
    sure = dict.fromkeys(one.name for one in standings if one is not leading and one.probability >= SURE)
    return f", beside {enumerated(list(sure))}" if sure else ""


def _worse(session: Session) -> bool:
    """Whether the errors of left-out stretches and of what was held out both rise with what was accepted.

    That counts for nothing where the held-out recordings convince, or confirm what is certain with the others: errors
    are those of the loudest channel.
    """
    proof = session.proof
    if proof is None or proof.extended <= RISEN * proof.baseline:
        return False
    gained = proof.gain.limited
    if gained >= CONVINCING or (proof.confirms and proof.margin + gained >= CERTAIN):
        return False
    accepted = session.search.accepted
    (_, before), (after, _) = accepted[0].gain.nrmse, accepted[-1].gain.nrmse
    return after > RISEN * before


def _without_a_name(session: Session, unknown: Unknown | None) -> tuple[str, str, Contest | None]:
    """The same where no effect was accepted."""
    if unknown is not None and unknown.accepted:
        return "depends_on", "", None
    if nrmse(session.replay.layout, session.baseline.mismatch) > USELESS:
        return "undecided", "the model does not follow these recordings at all, and nothing that was tried does", None
    if unknown is not None and unknown.open:
        reason = f"something depends on {unknown.feature.name}, but it does not show on the held-out recordings"
        return "undecided", reason, None
    first = session.search.rounds[0]
    refused = [
        trial
        for trial in first.trials
        if trial.failed == (HELD_OUT,) and certain(trial.candidate, trial.gain, first.screen)
    ]
    if refused:
        best = max(refused, key=lambda trial: trial.gain.total)
        reason = f"{best.candidate.effect} is beyond doubt where it was fitted, but the held-out recordings refuse it"
        return "undecided", reason, Contest((best.candidate.effect, NOTHING), (best.fit, first.before))
    if unknown is not None and unknown.refused:
        cause = f"that something depends on {unknown.feature.name} is beyond doubt where it was fitted"
        return "undecided", f"{cause}, but the held-out recordings refuse it", None
    near = [
        trial
        for trial in first.trials
        if trial.failed == (STILL,)
        and trial.candidate.effect not in TIMING
        and first.screen.p[trial.candidate.label] <= ALONE
        and trial.gain.total >= CONVINCING
    ]
    if not near:
        return "no_evidence", "", None
    best = max(near, key=lambda trial: trial.gain.total)
    contest = Contest((best.candidate.effect, NOTHING), (best.fit, first.before))
    return "undecided", "something is there, but nothing improves the prediction enough", contest
