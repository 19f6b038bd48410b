"""Which of the trials of a round is accepted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hdfast.diagnosis.accept import ALARM, GAIN_ERRORS, SHORT, SLOW, STILL, TIMING, Rules, too_uneven
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import gain
from hdfast.diagnosis.screen import Screen
from hdfast.diagnosis.trials import Trial

GENERAL_ERRORS, GENERAL_FALL = 3.0, 0.10
FAR_BELOW = 0.5


def carried(replay: Replay, trials: Sequence[Trial], seen: Screen, rules: Rules) -> list[Trial]:
    """The trials, one of which may break no rule any more: it gains too little by chance alone, and beats the best.

    That something is there, the best that breaks no rule shows; what it is, the better explanation tells.

    Args:
        replay: recordings.
        trials: of one round.
        seen: what the screen shows.
        rules: of the round.
    """
    short = [
        one
        for one in trials
        if one.failed == (SHORT,)
        and seen.p[one.candidate.label] <= ALARM
        and one.candidate.effect not in (*TIMING, *SLOW)
        and not too_uneven(one.candidate, one.gain)
    ]
    passed = _unbeaten_first(replay, [one for one in trials if not one.failed], rules) if short else []
    for better in sorted(short, key=lambda one: -one.gain.limited):
        if passed and _beats(replay, better, passed[0], rules):
            return [replace(one, failed=()) if one is better else one for one in trials]
    return list(trials)


def best(
    replay: Replay, trials: Sequence[Trial], accepted: Sequence[Trial], seen: Screen, rules: Rules
) -> Trial | None:
    """The best trial that breaks no rule; None where all do.

    A general law has to beat its special case clearly, and other generalisations of that case as well; else the
    special case goes first, also where it alone would gain too little, or lower the error too little: the law speaks
    for it.
    """
    passed = _unbeaten_first(replay, [one for one in trials if not one.failed], rules)
    known = {one.candidate.effect for one in (*trials, *accepted) if not set(one.failed) - {SHORT, STILL}}
    for leading in passed:
        shared = [effect for effect in leading.candidate.contains if effect in known]
        cases = [one for one in trials if one.candidate.effect in shared and not set(one.failed) - {SHORT, STILL}]
        others = [
            one
            for one in passed
            if one.candidate.effect != leading.candidate.effect and set(one.candidate.contains) & set(shared)
        ]
        close = [one for one in cases if not _clearly(replay, leading, one, seen, rules)]
        if close:
            return max(close, key=lambda one: one.gain.limited)
        if all(gain(replay, leading.fit, one.fit, rules.folds).ratio > GAIN_ERRORS for one in others):
            return leading
    return None


def _unbeaten_first(replay: Replay, passed: Sequence[Trial], rules: Rules) -> list[Trial]:
    """By their gains over the model without them, but one first that beats those before it face to face."""
    ranked = sorted(passed, key=lambda one: -one.gain.limited)
    first = 0
    for index in range(1, len(ranked)):
        if _beats(replay, ranked[index], ranked[first], rules):
            first = index
    return [*ranked[first : first + 1], *ranked[:first], *ranked[first + 1 :]]


def _beats(replay: Replay, one: Trial, other: Trial, rules: Rules) -> bool:
    """Whether a trial predicts better than another: by the filters of both fits, unless one error is far the smaller.

    The filter of a fit that misses much takes for noise what it misses, and what little another gains in most blocks
    may count for more than what explains most of the motion in a few.
    """
    error, others = one.gain.nrmse[0], other.gain.nrmse[0]
    if min(error, others) < FAR_BELOW * max(error, others):
        return error < others
    ahead = gain(replay, one.fit, other.fit, rules.folds).limited
    return ahead > 0.0 and ahead > gain(replay, other.fit, one.fit, rules.folds).limited


def _clearly(replay: Replay, general: Trial, special: Trial, seen: Screen, rules: Rules) -> bool:
    lead = gain(replay, general.fit, special.fit, rules.folds)
    enough = lead.fall >= GENERAL_FALL or rules.waived(seen, general.candidate, lead.nrmse[1])
    return enough and lead.ratio > GENERAL_ERRORS
