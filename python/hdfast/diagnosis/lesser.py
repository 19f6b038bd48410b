"""The model that a search ends with, refitted without one of its effects."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Index
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import Gain, gain
from hdfast.diagnosis.select import without
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.trials import Search, Trial


@dataclass(frozen=True, eq=False)
class Lesser:
    """The final model without one of its effects.

    Attributes:
        fit: of that model.
        gain: of the final model over it.
    """

    fit: Fit = field(repr=False)
    gain: Gain


def lessened(replay: Replay, trial: Trial, *, search: Search, folds: Index) -> Lesser:
    """The final model without an effect, and what the effect gains beside the others on left-out folds (N,)."""
    lesser = without_one(replay, trial, search=search)
    return Lesser(lesser, gain(replay, search.final, lesser, folds))


def without_one(replay: Replay, trial: Trial, *, search: Search) -> Fit:
    """The final model without an effect; where no such drive can be simulated, the one to which it was added."""
    structure, here = _less(search, trial)
    starts = np.stack([here, structure.start])
    simulated = np.isfinite(replay.mismatch(structure, starts)).all(axis=1)
    return fit(replay, structure, starts[np.argmax(simulated)]) if simulated.any() else search.round_of(trial).before


def _less(search: Search, trial: Trial) -> tuple[Structure, Floats]:
    """The final structure and coordinates without an effect; a declared special case that it replaced comes back."""
    own = trial.candidate
    sensors = [f"{channel}_{effect}" for effect, channel in own.sensors]
    reduced, here = without(search.final, [*own.terms, *own.orders, *sensors])
    declared = search.rounds[0].before
    lost = tuple(term for term in declared.structure.model.terms if term in own.contains)
    if not lost:
        return reduced, here
    prefixes = tuple(f"{term}_" for term in lost)
    fixed = {name: value for name, value in declared.structure.fixed.items() if name.startswith(prefixes)}
    back = [j for j, free in enumerate(declared.structure.free) if free.name.startswith(prefixes)]
    free = [declared.structure.free[j] for j in back]
    return reduced.with_terms(lost, (), (), fixed, free), np.concatenate([here, declared.coordinates[back]])
