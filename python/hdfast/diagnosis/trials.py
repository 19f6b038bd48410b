"""What a search tried and accepted, round by round."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from hdfast.diagnosis.accept import HELD_OUT
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.score import Gain
from hdfast.diagnosis.screen import Screen, Signature


@dataclass(frozen=True, eq=False)
class Trial:
    """A candidate fitted jointly with everything accepted so far.

    Attributes:
        candidate: the hypothesis.
        fit: the joint fit.
        gain: over the structure without it.
        failed: the acceptance rules it breaks, by name.
        confirmed: whether it took what was held out to accept it.
    """

    candidate: Candidate
    fit: Fit = field(repr=False)
    gain: Gain
    failed: tuple[str, ...]
    confirmed: bool = False


@dataclass(frozen=True, eq=False)
class Round:
    """One step of the search: what was there, what was thought of, what the screen saw, what was tried and accepted."""

    before: Fit = field(repr=False)
    present: list[Trial]
    candidates: list[Candidate] = field(repr=False)
    signatures: list[Signature] = field(repr=False)
    screen: Screen
    trials: list[Trial] = field(repr=False)
    accepted: Trial | None

    @property
    def refusing(self) -> Round:
        """The same round where what it accepted fails what was held out."""
        trials = [replace(one, failed=(HELD_OUT,)) if one is self.accepted else one for one in self.trials]
        return replace(self, trials=trials, accepted=None)


@dataclass(frozen=True, eq=False)
class Search:
    """The whole search; the last round accepted nothing, or what others confirmed."""

    rounds: list[Round]
    final: Fit = field(repr=False)
    accepted: list[Trial]

    def until(self, number: int) -> Search:
        """The search as it stood before it accepted its effect of this number, which fails what was held out."""
        taken = [one for one in self.rounds if one.accepted is not None]
        refused = taken[number]
        rounds = [*self.rounds[: self.rounds.index(refused)], refused.refusing]
        return Search(rounds, refused.before, refused.present)

    def less(self, trial: Trial, lesser: Fit) -> Search:
        """The search without an effect that fails what was held out beside the others; `lesser` has these alone."""
        rounds = [one.refusing if one.accepted is trial else one for one in self.rounds]
        return Search(rounds, lesser, [one for one in self.accepted if one is not trial])

    def more(self, trial: Trial, final: Fit) -> Search:
        """The search with an effect that its last round refused and others confirm; `final` has it as well."""
        confirmed, last = replace(trial, failed=(), confirmed=True), self.rounds[-1]
        trials = [confirmed if one is trial else one for one in last.trials]
        rounds = [*self.rounds[:-1], replace(last, trials=trials, accepted=confirmed)]
        return Search(rounds, final, joined_by(confirmed, self.accepted))

    def round_of(self, trial: Trial) -> Round:
        """The round that accepted an effect."""
        return next(one for one in self.rounds if one.accepted is trial)


def joined_by(trial: Trial, accepted: Sequence[Trial]) -> list[Trial]:
    """Accepted effects with one more, which takes the place of its special cases."""
    return [*(one for one in accepted if one.candidate.effect not in trial.candidate.contains), trial]
