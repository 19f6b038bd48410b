"""Each of several effects held against recordings that no fit has seen, beside the others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from hdfast.diagnosis.holdout import Proof, replayed, weigh_up
from hdfast.diagnosis.left_out import folds_near
from hdfast.diagnosis.lesser import Lesser, lessened
from hdfast.diagnosis.prove import Proven, chance, margin_of, whole_proof
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import noise_floor, nrmse
from hdfast.diagnosis.together import side_by_side
from hdfast.diagnosis.trials import Search, Trial

#: What several effects have to gain each, beside the others [nats].
LEAST = 15.0


def beside(replay: Replay, held: Replay, before: Proven, floor: float) -> tuple[Proven, dict[str, Lesser]]:
    """The search without those of several effects that do not hold beside the others, and its lessers.

    What an effect took on that came later is told by the whole model alone: beside it, the first may explain nothing.

    Args:
        replay: the recordings that were fitted.
        held: those that were held out.
        before: the search, as far as it holds one effect after another.
        floor: nrmse of the sensor noise.

    Returns:
        What is left, with the gains of its effects over the models before them, or beside the others where another one
        has gone, and the final model without an effect and what it gains, by its label; none where there is only one.
    """
    found, proof, shown = before
    while len(found.accepted) > 1:
        trials = _of_their_own(found)
        lessers = dict(zip(trials, _lessers(replay, found, trials, floor), strict=True))
        steps = _steps(held, found, lessers, proof.baseline)
        failing = [one for one, step in steps.items() if not step.holds or lessers[one].gain.limited < LEAST]
        if not failing:
            gains = {one.candidate.label: step.gain.limited for one, step in steps.items()}
            return (found, proof, gains | shown), {one.candidate.label: lesser for one, lesser in lessers.items()}
        weakest = min(failing, key=lambda one: steps[one].gain.limited)
        found = found.less(weakest, lessers[weakest].fit)
        proof, shown = whole_proof(held, found), {}
    gains = {one.candidate.label: proof.gain.limited for one in found.accepted}
    return (found, proof, gains | shown), {}


def _of_their_own(found: Search) -> list[Trial]:
    """The effects that neither refine another one nor are refined."""
    refined = {one.candidate.effect for one in found.accepted if one.candidate.refines}
    return [one for one in found.accepted if one.candidate.effect not in refined]


def _lessers(replay: Replay, found: Search, trials: Sequence[Trial], floor: float) -> Iterator[Lesser]:
    """The final model without each effect."""
    folds = folds_near(replay, nrmse(replay.layout, found.final.mismatch), floor)
    return side_by_side(replay.commanded(found.final), partial(lessened, search=found, folds=folds), trials)


def _steps(held: Replay, found: Search, lessers: Mapping[Trial, Lesser], outset: float) -> dict[Trial, Proof]:
    """The final model over the one without an effect, for each of them; `outset` is the error before the search."""
    before, final = found.rounds[0].before, found.final
    whole, noise = replayed(held, final, before), noise_floor(held)

    def step(trial: Trial, lesser: Lesser) -> Proof:
        margin, likely = margin_of([lesser.gain]), chance(trial, found.round_of(trial))
        without = replayed(held, lesser.fit, before)
        return weigh_up(held.layout, final.white, without, whole, noise, margin, likely, outset)

    return {trial: step(trial, lesser) for trial, lesser in lessers.items()}
