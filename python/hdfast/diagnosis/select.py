"""Forward search: one effect after another, each refitted with everything else and judged on left-out stretches."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from collections.abc import Set as AbstractSet
from contextlib import closing
from functools import partial

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.accept import ALARM, LINEAR, NO_MODEL, Rules, failed_rules
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.changes import attentive, changes
from hdfast.diagnosis.choice import best, carried
from hdfast.diagnosis.fit import fit, placed
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.metric import Metric
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import CONVINCING, gain, nrmse
from hdfast.diagnosis.screen import Screen, Signature, screen, signatures
from hdfast.diagnosis.shapes import effect_of
from hdfast.diagnosis.shortlist import overlooked, shortlist
from hdfast.diagnosis.stages import Stages
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.together import side_by_side
from hdfast.diagnosis.trials import Round, Search, Trial, joined_by

MOST_EFFECTS, MOST_ANEW = 4, 3
DISPLACED = 2.0
AMPLITUDES, FAR, STRONG = (0.3, 1.0, 3.0), 0.3, 3.0

Library = Callable[[Fit], list[Candidate]]


def search(
    replay: Replay,
    start: Fit,
    library: Library,
    floor: float,
    rng: np.random.Generator,
    stages: Stages,
) -> Search:
    """Add effects while one passes every rule.

    Args:
        replay: recordings.
        start: the model without any.
        library: the candidates for what a model leaves.
        floor: nrmse of the sensor noise.
        rng: of the screen.
        stages: is told what happens.
    """
    rounds: list[Round] = []
    accepted: list[Trial] = []
    known: set[str] = set()
    current, anew = start, 0
    while True:
        present = [trial.candidate.effect for trial in accepted]
        replay, rules = replay.commanded(current), Rules.near(replay, current, floor)
        stages.expect(1)
        every = library(current)
        pool = [one for one in every if _possible(one, accepted, current)]
        changed = changes(replay, current, pool)
        heard = attentive(replay, current, [one.values for one in changed])
        found = signatures(replay, heard, changed)
        seen = screen(replay, heard, found, rng)
        stages.done(f"screened {len(found)} candidates: p = {seen.smallest_p:.3f}")
        trials: list[Trial] = []
        lower, error = None, nrmse(replay.layout, current.mismatch)
        if (seen.smallest_p <= ALARM or rules.beyond_noise(error)) and len(accepted) < MOST_EFFECTS:
            listed = shortlist(found, seen, first=not accepted)
            effort = partial(_try, current=current, rules=rules, seen=seen, known=known)
            watched = current if rules.near_noise(error) and anew < MOST_ANEW else None
            trials, lower = _tried(replay, effort, listed, watched, stages)
            if lower is None and not accepted and all(one.failed for one in trials):
                others, lower = _tried(replay, effort, overlooked(found, seen, trials), watched, stages)
                trials += others
        if lower is not None:
            current, anew = lower, anew + 1
            stages.say("a refit came upon a better fit of the model without it: once more from there")
            continue
        known |= {one.candidate.effect for one in trials}
        trials = carried(replay, trials, seen, rules)
        taken = best(replay, trials, accepted, seen, rules)
        rounds.append(Round(current, accepted, every, found, seen, trials, taken))
        if taken is None:
            return Search(rounds, current, accepted)
        accepted = joined_by(taken, accepted)
        current = settled(replay, taken)
        stages.say(f"accepted {taken.candidate.label}" + (f" after {', '.join(present)}" if present else ""))


def settled(replay: Replay, taken: Trial) -> Fit:
    """The model with an effect that is accepted, and what was assumed of it fitted too."""
    assumed = [float(free.coordinate(free.value)) for free in taken.candidate.assumed]
    return fit(replay, taken.candidate.settled_in(taken.fit.structure), np.append(taken.fit.coordinates, assumed))


def _tried(
    replay: Replay,
    effort: Callable[[Replay, list[Signature]], Trial],
    listed: Sequence[list[Signature]],
    watched: Fit | None,
    stages: Stages,
) -> tuple[list[Trial], Fit | None]:
    """Trials of all listed, or those until one leads to a better fit of the watched model, and that fit."""
    trials: list[Trial] = []
    stages.expect(len(listed))
    with closing(side_by_side(replay, effort, listed)) as found:
        for trial in found:
            trials.append(trial)
            stages.done(f"refitted with {trial.candidate.effect}")
            lower = None if watched is None else lower_valley(replay, watched, trial.fit)
            if lower is not None:
                stages.expect(len(trials) - len(listed))
                return trials, lower
    return trials, None


def lower_valley(replay: Replay, current: Fit, other: Fit) -> Fit | None:
    """A better fit of a model, from where that of a larger one left its parameters; None without one.

    A fit may stop in a valley of its own. Whatever is added then leads out of it, and would be given the credit.

    Args:
        replay: recordings.
        current: the model's own fit.
        other: one with more parameters, or with others in the place of some.
    """
    metric, there = Metric.about(replay, current), placed(replay, current, current.beside(other))
    here = metric.cost_of(replay.layout, current)
    if not here - metric.cost_of(replay.layout, there) > CONVINCING:
        return None
    lower = fit(replay, current.structure, there.coordinates)
    return lower if here - metric.cost_of(replay.layout, lower) > CONVINCING else None


def _possible(candidate: Candidate, accepted: Sequence[Trial], current: Fit) -> bool:
    found = {trial.candidate.effect for trial in accepted}
    present = found | {effect_of(term) for term in current.structure.model.terms}
    structure = current.structure
    if (candidate.refines and candidate.effect not in found) or set(candidate.names) & set(structure.names):
        return False
    if candidate.terms and candidate.effect in present:
        return False
    if set(candidate.terms) & set(structure.model.terms) or set(candidate.sensors) & set(structure.sensors):
        return False
    if candidate.needs and not present & set(candidate.needs):
        return False
    if any(candidate.effect in trial.candidate.contains for trial in accepted):
        return False
    return candidate.fits_into(structure)


def _try(
    replay: Replay, alike: Sequence[Signature], *, current: Fit, rules: Rules, seen: Screen, known: AbstractSet[str]
) -> Trial:
    """Refit with the best of several shapes; from elsewhere as well, unless that was done for a known effect.

    Of several fits the one that costs least stands. A load that rattles makes fits cheaper by chance: where what is
    unseen holds it, the one that gains most left out does.
    """
    candidate = alike[0].candidate
    contained = [term for term in current.structure.model.terms if term in candidate.contains]
    reduced, here = without(current, contained)
    structure = candidate.added_to(reduced)
    starts = _starts(replay, structure, current, here, alike, elsewhere=candidate.effect not in known)
    if not starts:
        return Trial(candidate, current, gain(replay, current, current, rules.folds), (NO_MODEL,))
    fits = [fit(replay, structure, starts[0], None if contained else current)]
    ahead = None if structure.rattles or candidate.stiffness else fits[0]
    fits += [fit(replay, structure, start, fits[0], ahead) for start in starts[1:]]
    if not candidate.unseen:
        fits = [Metric.about(replay, current).best_fit(replay.layout, fits)]
    told = [(one, gain(replay, one, current, rules.folds)) for one in fits]
    joint, gained = max(told, key=lambda pair: pair[1].limited)
    return Trial(candidate, joint, gained, failed_rules(replay, joint, current, candidate, gained, rules, seen))


def _starts(
    replay: Replay, structure: Structure, current: Fit, here: Floats, alike: Sequence[Signature], *, elsewhere: bool
) -> list[Floats]:
    """The best of several shapes and amplitudes, from the present parameters.

    With each amplitude the parameters that had stood for the effect give it back, or stay. If `elsewhere`, also from
    the priors of displaced ones: there what bends begins at an amplitude of its own, since the start that costs least
    lies where the effect is small and the others stand for it, and steps may not lead out; a linear law at a large one
    as well, since a coupling has a resonance of its own, and what depends on something unseen in all the ways in which
    that may act. Nothing where none can be simulated.
    """
    kept = [current.structure.names.index(name) for name in structure.names[: len(here)]]
    added, given = [], []
    for signature in alike:
        for one, share in _sized(signature):
            own = _coordinates(one)
            added += [own, own]
            given += [np.zeros(len(here)), signature.absorbed[kept] @ share]
    metric, tried = Metric.about(replay, current), np.concatenate([here - np.array(given), np.array(added)], axis=1)
    starts = [metric.best_start(replay, structure, tried)]
    centre, sigma = structure.start[: len(here)], structure.sigma[: len(here)]
    displaced = np.abs(here - centre) > DISPLACED * sigma
    if elsewhere and displaced.any():
        back = np.where(displaced, centre, here)
        if alike[0].candidate.unseen:
            far = [np.array([[*back, *_coordinates(one.candidate)] for one in alike])]
        elif alike[0].candidate.bends:
            sizes = (FAR, STRONG) if alike[0].candidate.effect in LINEAR else (FAR,)
            far = [np.concatenate([back, _coordinates(alike[0].candidate.scaled(size))])[None] for size in sizes]
        else:
            far = [np.concatenate([back - np.array(given), np.array(added)], axis=1)]
        starts += [metric.best_start(replay, structure, tried) for tried in far]
    return [one for one in starts if one is not None]


def _coordinates(candidate: Candidate) -> list[float]:
    """Of the parameters that it adds."""
    return [float(free.coordinate(free.value)) for free in candidate.free]


def _sized(signature: Signature) -> list[tuple[Candidate, Floats]]:
    """The candidate at several amplitudes, with the shares (d,) of its signatures."""
    candidate = signature.candidate
    shares = candidate.possible(signature.shares)
    typical = np.ones(len(shares)) if candidate.spans else np.eye(len(shares))[0]
    return [(candidate.started(shares), shares)] + [(candidate.scaled(times), times * typical) for times in AMPLITUDES]


def without(current: Fit, parts: Collection[str]) -> tuple[Structure, Floats]:
    """The structure and coordinates of a fit without some terms, orders or sensor effects."""
    reduced, kept = current.structure.without(parts)
    return reduced, current.coordinates[kept]
