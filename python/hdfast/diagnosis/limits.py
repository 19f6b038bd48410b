"""What these recordings could not show, and why, and the smallest amplitude that would be seen of what they could."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdfast.diagnosis.accept import DRIFTS
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.library import OF_THE_LOAD_ANGLE, OF_THE_WINDUP
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.screen import Screen, Signature
from hdfast.diagnosis.shapes import effect_of
from hdfast.diagnosis.structure import Structure
from hdfast.sensors.names import table
from hdfast.terms import terms

SWALLOWED = 0.05
POWER = 0.84
SECOND = "needs a second recording: it drifts too slowly for one to tell"
NEEDS_WINDUP = "needs the windup of the gear: record the load angle or the output torque"
RIGID = "needs the windup of the gear, which the base one_inertia leaves out"
NEEDS_LOAD_ANGLE = "needs the load angle: record it"
NEEDS_LOAD_TORQUE = "needs the load torque: record it"
NEEDS_TEMPERATURE = "needs the temperature of the drive: record it"
NO_ROOM = "has no room beside the hidden states and orders of the model"
SILENT = "changes next to nothing on these recordings, or cannot be simulated on them"


@dataclass(frozen=True)
class Limit:
    """An effect and what these recordings can say of it.

    Attributes:
        effect: its id.
        shape: for which this holds, where it depends on more than the amplitude, else "".
        visibility: share of its signature that refitting the model leaves, 0 to 1.
        minimum_detectable: amplitude that would be seen in 80 % of campaigns like this one, in its unit.
        unit: of that amplitude.
        multiple: of a typical effect, so large is that.
        reason: why it cannot be shown, or None when it can.
    """

    effect: str
    shape: str
    visibility: float
    minimum_detectable: float | None
    unit: str
    multiple: float
    reason: str | None


def limits(signatures: Sequence[Signature], seen: Screen, recordings: int) -> list[Limit]:
    """The best shape of each effect of the library; what only refines an effect that is there is none.

    Args:
        signatures: of the last round.
        seen: its screen.
        recordings: how many are fitted.
    """
    best: dict[str, Limit] = {}
    added = [one for one in signatures if not one.candidate.refines]
    varieties: dict[str, set[Hashable]] = defaultdict(set)
    for one in added:
        varieties[one.candidate.effect].add(one.candidate.variety)
    for one in added:
        limit = _limit(one, seen, recordings)
        known = best.get(limit.effect)
        if known is None or _easier(limit, known, stiffness=one.candidate.stiffness):
            best[limit.effect] = limit if len(varieties[limit.effect]) > 1 else replace(limit, shape="")
    return sorted(best.values(), key=lambda limit: limit.visibility)


def _easier(limit: Limit, known: Limit, *, stiffness: bool) -> bool:
    """Whether a shape is seen at a smaller effect than another; a larger stiffness is a smaller effect."""
    if limit.minimum_detectable is None or known.minimum_detectable is None:
        return known.minimum_detectable is None
    if limit.unit != known.unit:
        return limit.multiple < known.multiple
    sign = -1.0 if stiffness else 1.0
    return sign * limit.minimum_detectable < sign * known.minimum_detectable


def unseen(candidates: Sequence[Candidate], plant: Plant, before: Structure, known: Collection[str]) -> list[Limit]:
    """Effects of the library that were not screened, and why.

    Args:
        candidates: of the last round.
        plant: the recordings.
        before: the structure that they could join.
        known: effects that were screened, or that are there.
    """
    reasons = _unavailable(plant, elastic=before.model.base == "two_inertia")
    reasons |= {one.effect: _unused(one, before) for one in candidates}
    return [
        Limit(effect, "", 0.0, None, "", np.inf, reason) for effect, reason in reasons.items() if effect not in known
    ]


def _unavailable(plant: Plant, *, elastic: bool) -> dict[str, str]:
    """Why effects of the library are no candidates for such recordings, by effect."""
    found: dict[str, str] = {}
    if not (elastic and plant.load_side):
        found = dict.fromkeys(OF_THE_WINDUP, RIGID if plant.load_side else NEEDS_WINDUP)
    elif not plant.loaded:
        found["te_load_dependence"] = NEEDS_LOAD_TORQUE
    if not plant.warm:
        found["thermal_viscous"] = NEEDS_TEMPERATURE
    if "te" not in plant.channels:
        found |= dict.fromkeys(OF_THE_LOAD_ANGLE, NEEDS_LOAD_ANGLE)
    return found


def _unused(one: Candidate, before: Structure) -> str:
    """Why a candidate that is not there has no signature."""
    if one.needs and not {effect_of(term) for term in before.model.terms} & set(one.needs):
        return f"needs {' or '.join(one.needs)}, and the model that it could join has none"
    return SILENT if one.fits_into(before) else NO_ROOM


def _limit(one: Signature, seen: Screen, recordings: int) -> Limit:
    candidate = one.candidate
    free = next(free for free in candidate.free if free.name == candidate.amplitude)
    size = max(abs(free.value), 1e-300)
    remaining = float(np.sqrt(np.sum(one.left**2) / one.left.shape[1]))
    threshold = (seen.needed[candidate.label] + POWER) * seen.spread[candidate.label]
    multiple = threshold / remaining if remaining > 0.0 else np.inf
    smallest = None
    if remaining > 0.0:
        smallest = size / multiple if candidate.stiffness else size * multiple
    reason = None
    if one.visibility < SWALLOWED:
        reason = f"{100.0 * (1.0 - one.visibility):.0f} % of it is swallowed by the drive's parameters"
    elif smallest is not None and not _plausible(candidate, smallest):
        reason = "only an implausibly large effect would be seen"
    elif candidate.effect in DRIFTS and recordings == 1:
        reason = SECOND
    return Limit(candidate.effect, candidate.shape, one.visibility, smallest, free.unit, multiple, reason)


def _plausible(candidate: Candidate, amplitude: float) -> bool:
    """Whether an effect of this amplitude, or a larger one, is within what the catalogue calls plausible."""
    if candidate.law not in terms().ids:
        return True
    every = table(candidate.sensors)[0] if candidate.sensors else terms()[candidate.law].parameters
    own = next((p for p in every if candidate.amplitude.endswith(f"{candidate.law}_{p.name}")), None)
    return own is None or (amplitude >= own.low if candidate.stiffness else amplitude <= own.high)
