"""The search held against recordings that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdfast.diagnosis.accept import ALARM, ALONE, SHORT, SLOW, SPARED, STILL, TIMING, too_uneven
from hdfast.diagnosis.holdout import LIKELY, Proof, replayed, weigh_up
from hdfast.diagnosis.lesser import without_one
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import Gain, noise_floor, nrmse
from hdfast.diagnosis.select import settled
from hdfast.diagnosis.trials import Round, Search, Trial

Proven = tuple[Search, Proof, dict[str, float]]


def proven(replay: Replay, held: Replay, found: Search) -> Proven:
    """The search as far as it holds on what was held out, its proof, and the gains of its effects there.

    Of what it did not accept in the end, the effect that came closest is looked at once more: what the fitted
    recordings show too faintly for a name the others may confirm.

    Args:
        replay: the recordings that were fitted.
        held: those that were held out.
        found: the search.
    """
    whole = _holding(replay, held, found)
    faint = _faintest(found.rounds[-1])
    if faint is None or whole[0] is not found:
        return whole
    return _confirmed(replay, held, found, faint) or whole


def _holding(replay: Replay, held: Replay, found: Search) -> Proven:
    """The search up to the first later effect that does not hold.

    A first effect that is refuted takes all others with it, unless they show together, or hold without it; one that
    does not show alone is judged with those that came after it: two may hide each other.
    """
    floor = noise_floor(held)
    taken = [one for one in found.rounds if one.accepted is not None]
    models = [*(one.before for one in taken), found.final]
    trials = [one.accepted for one in taken if one.accepted is not None]
    chances = [chance(one, seen) for one, seen in zip(trials, taken, strict=True)]
    replays = [replayed(held, model, models[0]) for model in models]
    outset = nrmse(held.layout, replays[0].mismatch)

    def between(first: int, last: int) -> Proof:
        margin, ends = margin_of([one.gain for one in trials[first:last]]), (replays[first], replays[last])
        likely = max(chances[first:last], default=1.0)
        return weigh_up(held.layout, models[last].white, *ends, floor, margin, likely, outset)

    last = len(models) - 1
    steps = [between(n, n + 1) for n in range(last)]
    if last and steps[0].refutes and not between(0, last).shows:
        return _without(replay, held, found, trials[0]) or (found.until(0), between(0, 0), {})
    kept = next((n for n in range(1, last) if not steps[n].holds), last)
    shown = {one.candidate.label: step.gain.limited for one, step in zip(trials, steps[:kept], strict=False)}
    return found if kept == last else found.until(kept), between(0, kept), shown


def _without(replay: Replay, held: Replay, found: Search, first: Trial) -> Proven | None:
    """The later effects alone, if there are any and they hold without the first one, which is refuted."""
    others = [one for one in found.accepted if one is not first]
    if not others or first not in found.accepted or any(one.candidate.refines for one in others):
        return None
    less = found.less(first, without_one(replay.commanded(found.final), first, search=found))
    proof = whole_proof(held, less)
    return (less, proof, {}) if proof.holds else None


def whole_proof(held: Replay, found: Search) -> Proof:
    """The final model over the one that the search began with."""
    before, final = found.rounds[0].before, found.final
    ends = replayed(held, before, before), replayed(held, final, before)
    likely = max((chance(one, found.round_of(one)) for one in found.accepted), default=1.0)
    margin = margin_of([one.gain for one in found.accepted])
    return weigh_up(held.layout, final.white, *ends, noise_floor(held), margin, likely)


def margin_of(gains: Sequence[Gain]) -> float:
    """Limited sum of independent gains, less two of its errors [nats]."""
    errors = float(np.linalg.norm([one.limited_error for one in gains]))
    return sum(one.limited for one in gains) - 2.0 * errors


def chance(trial: Trial, seen: Round) -> float:
    """How often the screen shows as much where nothing is left out; 1 where one block decides.

    What is slow is alike in all blocks of a recording, so that it always counts as chance.
    """
    one_block = trial.gain.spared < SPARED
    return 1.0 if one_block or trial.candidate.effect in SLOW else seen.screen.p[trial.candidate.label]


def _faintest(last: Round) -> Trial | None:
    """The best effect whose gain, or whose fall of the error, alone was too small to be accepted.

    Clocks, filters and drifts are alike in all recordings of a recorder, which would confirm them.
    """
    faint = [
        one
        for one in last.trials
        if one.failed
        and set(one.failed) <= {SHORT, STILL}
        and one.gain.limited > 0.0
        and one.candidate.effect not in (*TIMING, *SLOW)
    ]
    return max(faint, key=lambda one: one.gain.limited, default=None)


def _confirmed(replay: Replay, held: Replay, found: Search, trial: Trial) -> Proven | None:
    """The search with one faint effect more, where the held-out recordings confirm it and are predicted better with it.

    What does not open a search has to gain two errors on the fitted recordings, unless the others speak for it alone,
    as they have to for what is uneven, and for what comes beside other effects. Where these or the screen single an
    effect out that gains more than that, its gain may stand in less than the error does.
    """
    last, nominal = found.rounds[-1], found.rounds[0].before
    likely, margin = chance(trial, last), margin_of([trial.gain])
    before, after = (replayed(held, model, nominal) for model in (last.before, trial.fit))
    proof = weigh_up(held.layout, trial.fit.white, before, after, noise_floor(held), margin, likely)
    if not (proof.confirms and proof.holds):
        return None
    faint = last.screen.p[trial.candidate.label] > ALARM and margin < 0.0
    doubtful = faint or bool(found.accepted) or too_uneven(trial.candidate, trial.gain)
    hidden = margin >= LIKELY and (likely <= ALONE or proof.speaks_alone)
    if (doubtful and not proof.speaks_alone) or not (hidden or proof.extended < proof.baseline):
        return None
    final = settled(replay.commanded(last.before), trial)
    return _holding(replay, held, found.more(trial, final))
