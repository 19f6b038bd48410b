"""What these recordings could not show, and why, and the smallest amplitude that would be seen of what they could."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from hdfast.diagnosis.accept import DRIFTS
from hdfast.diagnosis.baseline import NO_SPREAD
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.library import OF_THE_LOAD_ANGLE, OF_THE_WINDUP
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.screen import Screen, Signature
from hdfast.diagnosis.shapes import effect_of
from hdfast.diagnosis.structure import TORQUE_SCALE, Free, Structure
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
GAIN = "torque_gain"
UNTOLD = (
    "a factor on the torque, the inertias and the stiffnesses changes next to nothing: its scale is known as stated"
)
EXACT = "the scale of the motor torque is stated as exact"
SILENT = "changes next to nothing on these recordings, or cannot be simulated on them"


@dataclass(frozen=True)
class Limit:
    """An effect of one shape, and what these recordings can say of it.

    Attributes:
        effect: its id.
        shape: for which this holds, where the effect has several, else "".
        visibility: share of its signature that refitting the model leaves, 0 to 1, at the size that shows most.
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
    """Every shape of each effect of the library, by effect; what only refines an effect that is there is none.

    What shows best comes first, effects and shapes.

    What a refit leaves of an effect depends on its size: the limit of a shape is that of the size that hides best. With
    the one that shows best, couplings, hystereses and gaps of up to twenty times their limit were in recordings that
    showed no evidence of them.

    Args:
        signatures: of the last round.
        seen: its screen.
        recordings: how many are fitted.
    """
    shapes: dict[str, dict[Hashable, list[Signature]]] = defaultdict(lambda: defaultdict(list))
    for one in signatures:
        if not (one.candidate.refines or one.candidate.unseen):
            shapes[one.candidate.effect][one.candidate.variety].append(one)
    found = [
        sorted((_limit(sizes, seen, recordings, named=len(own) > 1) for sizes in own.values()), key=_order)
        for own in shapes.values()
    ]
    return [limit for own in sorted(found, key=lambda own: _order(own[0])) for limit in own]


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


def untold_gain(fit: Fit, layout: Layout) -> list[Limit]:
    """The gain of the torque, which every model fits and none adds, unless the recordings tell it twice as well.

    Args:
        fit: the model that is left.
        layout: of its mismatch.
    """
    [stated] = [free.sigma for free in fit.structure.free if free.name == TORQUE_SCALE]
    if fit.sigma_without_priors(layout, TORQUE_SCALE) < 0.5 * stated:
        return []
    return [Limit(GAIN, "", 0.0, None, "", np.inf, EXACT if stated <= NO_SPREAD else UNTOLD)]


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


def _order(limit: Limit) -> tuple[bool, float]:
    return limit.reason is not None, limit.multiple


def _limit(sizes: Sequence[Signature], seen: Screen, recordings: int, *, named: bool) -> Limit:
    """Of the signatures of one shape; `named` where the effect has others."""
    one, multiple = max(((size, _multiple(size, seen)) for size in sizes), key=lambda pair: _hidden(*pair))
    candidate = one.candidate
    visibility = max(size.visibility for size in sizes)
    smallest = _amplitude(candidate, multiple) if np.isfinite(multiple) else None
    reason = None
    if visibility < SWALLOWED:
        reason = f"{100.0 * (1.0 - visibility):.0f} % of it is swallowed by the drive's parameters"
    elif smallest is None or not _plausible(candidate, smallest):
        reason = "only an implausibly large effect would be seen"
    elif candidate.effect in DRIFTS and recordings == 1:
        reason = SECOND
    shape, unit = candidate.shape if named else "", _size_of(candidate).unit
    return Limit(candidate.effect, shape, visibility, smallest, unit, multiple, reason)


def _multiple(one: Signature, seen: Screen) -> float:
    """How many typical effects would be seen."""
    label = one.candidate.label
    remaining = float(np.sqrt(np.sum(one.left**2) / one.left.shape[1]))
    threshold = (seen.needed[label] + POWER) * seen.spread[label]
    return threshold / remaining if remaining > 0.0 else np.inf


def _hidden(one: Signature, multiple: float) -> float:
    """What grows with the effect that would be seen, for signatures of one shape."""
    amplitude = _amplitude(one.candidate, multiple)
    return -amplitude if one.candidate.stiffness else amplitude


def _amplitude(candidate: Candidate, multiple: float) -> float:
    """So many typical effects, in the unit of the amplitude: a larger stiffness is a smaller effect."""
    size = max(abs(_size_of(candidate).value), 1e-300)
    return size / multiple if candidate.stiffness else size * multiple


def _size_of(candidate: Candidate) -> Free:
    """Its amplitude, at a typical effect."""
    return next(free for free in candidate.free if free.name == candidate.amplitude)


def _plausible(candidate: Candidate, amplitude: float) -> bool:
    """Whether an effect of this amplitude, or a larger one, is within what the catalogue calls plausible."""
    if candidate.law not in terms().ids:
        return True
    every = table(candidate.sensors)[0] if candidate.sensors else terms()[candidate.law].parameters
    own = next((p for p in every if candidate.amplitude.endswith(f"{candidate.law}_{p.name}")), None)
    return own is None or (amplitude >= own.low if candidate.stiffness else amplitude <= own.high)
