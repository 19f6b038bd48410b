"""How sure a name is: every accepted effect against what could stand in its place."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from hdfast.diagnosis.accept import SHORT, SMALL, STILL, special
from hdfast.diagnosis.evidence import Index
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.left_out import folds_near
from hdfast.diagnosis.lesser import Lesser, lessened
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import Gain, gain, nrmse, weights_of
from hdfast.diagnosis.screen import Signature
from hdfast.diagnosis.select import without
from hdfast.diagnosis.together import side_by_side
from hdfast.diagnosis.trials import Round, Search, Trial

INDISTINCT, ALIKE, BESIDE = 0.98, 0.95, 0.3
FAINT = 0.05
UNKNOWN_FLOOR, THIN = 0.02, 10.0
SURE = 0.75
MOST_RIVALS = 3
CLOSE_ERRORS = 2.0
#: Dry friction and hysteresis are found in every strain-wave drive that was looked at; that its drag is not viscous, or
#: that its spring relaxes, in few. Where recordings hardly tell them apart, what is common is the likelier.
SELDOM = {"nonlinear_viscous": 1.0 / 3.0, "viscoelastic": 1.0 / 3.0}
UNCERTAIN = {SHORT, STILL, SMALL}


@dataclass(frozen=True, eq=False)
class Rival:
    """Another effect in the place of an accepted one.

    Attributes:
        effect: its id.
        label: with its shape.
        weight: its share against the accepted effect, 0 to 1, by what the recordings say and how common both are.
        alike: largest correlation of the two signatures after refit, 0 to 1.
        behind: gain of the accepted effect over it, in standard errors.
        contains: its special cases.
        fit: the model with it in the place of the accepted effect.
    """

    effect: str
    label: str
    weight: float
    alike: float
    behind: float
    contains: tuple[str, ...]
    fit: Fit = field(repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the fit."""
        return {one.name: getattr(self, one.name) for one in fields(self) if one.name != "fit"}


@dataclass(frozen=True, eq=False)
class Standing:
    """An accepted effect and its rivals.

    Attributes:
        trial: the effect as it was accepted.
        name: the effect that is named: a special case where its generalisations cannot be told from each other, or
            where it is all that is left of the law in the final model.
        probability: of the name, 0 to 1.
        rivals: effects that could stand in its place, most likely first.
        alone: gain of the whole model over the model without this effect.
        lesser: the model without it.
    """

    trial: Trial
    name: str
    probability: float
    rivals: tuple[Rival, ...]
    alone: Gain = field(repr=False)
    lesser: Fit = field(repr=False)


def stand(
    replay: Replay,
    search: Search,
    floor: float,
    shown: Mapping[str, float],
    lessers: Mapping[str, Lesser],
    rng: np.random.Generator,
) -> list[Standing]:
    """Put rivals in the place of each accepted effect, refit, and weigh them.

    Args:
        replay: recordings.
        search: its accepted effects.
        floor: nrmse of the sensor noise.
        shown: gain of each accepted effect on what was held out, by its label.
        lessers: the final model without an effect, by its label, as far as it is known.
        rng: of the weights.
    """
    found = []
    error = nrmse(replay.layout, search.final.mismatch)
    replay, folds = replay.commanded(search.final), folds_near(replay, error, floor)
    names = {trial.candidate.effect for trial in search.accepted}
    for trial in search.accepted:
        if trial.candidate.refines:
            continue
        seen = search.round_of(trial)
        lesser = lessers.get(trial.candidate.label) or lessened(replay, trial, search=search, folds=folds)
        challengers = _challengers(trial, seen, names, lesser.fit)
        substitutes = side_by_side(replay, partial(_instead, lesser=lesser.fit), challengers)
        compared = [
            _compare(replay, search.final, other, substitute, trial, seen, folds, rng)
            for other, substitute in zip(challengers, substitutes, strict=True)
            if substitute is not None
        ]
        rivals = sorted(compared, key=lambda rival: -rival.weight)
        name = trial.candidate.effect
        evidence = max(lesser.gain.limited, trial.gain.limited) + shown.get(trial.candidate.label, 0.0)
        probability = confidence([rival.weight for rival in rivals], evidence)
        kin = [rival for rival in rivals if set(rival.contains) & set(trial.candidate.contains)]
        if (probability < SURE and kin) or special(trial.candidate, search.final):
            name = trial.candidate.contains[0]
            rivals = [rival for rival in rivals if rival not in kin]
            probability = confidence([rival.weight for rival in rivals], evidence)
        found.append(Standing(trial, name, probability, tuple(rivals), lesser.gain, lesser.fit))
    return found


def confidence(weights: Sequence[float], evidence: float) -> float:
    """Probability of a name: thin evidence may be that of something else.

    Args:
        weights: of its rivals, each against it, 0 to 1.
        evidence: left-out gain of all recordings [nats].
    """
    odds = sum(weight / max(1.0 - weight, 1e-6) for weight in weights)
    return (1.0 - UNKNOWN_FLOOR) * (1.0 - math.exp(-max(evidence, 0.0) / THIN)) / (1.0 + odds)


def _challengers(trial: Trial, seen: Round, names: set[str], lesser: Fit) -> list[Trial]:
    """The best other effects of the round that are neither special cases, nor generalisations, nor accepted as well.

    One whose gain or amplitude is uncertain may still be what it was. One that looks like something else entirely does
    not stand in the place of the effect but beside it.
    """
    own = trial.candidate
    others = [
        one
        for one in seen.trials
        if one.candidate.effect not in names
        and one.candidate.effect not in own.contains
        and own.effect not in one.candidate.contains
        and set(one.failed) <= UNCERTAIN
        and one.candidate.fits_into(lesser.structure)
        and alike(_signature(seen, trial), _signature(seen, one)) > BESIDE
    ]
    return sorted(others, key=lambda one: -one.gain.total)[:MOST_RIVALS]


def _instead(replay: Replay, other: Trial, *, lesser: Fit) -> Fit | None:
    """The model with another effect in the place of one; None where the drive cannot be simulated with it."""
    contained = [term for term in lesser.structure.model.terms if term in other.candidate.contains]
    reduced, here = without(lesser, contained)
    found = dict(zip(other.fit.structure.names, other.fit.coordinates.tolist(), strict=True))
    begin = [found.get(one.name, float(one.coordinate(one.value))) for one in other.candidate.free]
    structure, start = other.candidate.added_to(reduced), np.concatenate([here, begin])
    if not np.isfinite(replay.mismatch(structure, start[None])).all():
        return None
    return fit(replay, structure, start, None if contained else lesser)


def _compare(
    replay: Replay,
    final: Fit,
    other: Trial,
    substitute: Fit,
    trial: Trial,
    seen: Round,
    folds: Index,
    rng: np.random.Generator,
) -> Rival:
    """Another effect in the place of one, weighed against it."""
    lead = gain(replay, final, substitute, folds)
    none = Gain(np.zeros_like(lead.by_block), lead.nrmse)
    weight = float(weights_of([lead, none], rng)[1])
    theirs, ours = (SELDOM.get(one.candidate.effect, 1.0) for one in (other, trial))
    weight = weight * theirs / (weight * theirs + (1.0 - weight) * ours)
    return Rival(
        other.candidate.effect,
        other.candidate.label,
        weight,
        alike(_signature(seen, trial), _signature(seen, other)),
        lead.ratio,
        other.candidate.contains,
        substitute,
    )


def _signature(seen: Round, trial: Trial) -> Signature:
    return next(one for one in seen.signatures if one.candidate.label == trial.candidate.label)


def alike(first: Signature, second: Signature) -> float:
    """Largest correlation between two signatures after refit (the cosine of their smallest angle)."""
    bases = [np.linalg.qr(one.left)[0] for one in (first, second)]
    return float(np.linalg.svd(bases[0].T @ bases[1], compute_uv=False)[0])
