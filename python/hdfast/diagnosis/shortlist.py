"""Which candidates of a round are tried."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from operator import attrgetter

from hdfast.diagnosis.accept import ALARM, ALONE, NOTICED
from hdfast.diagnosis.screen import Screen, Signature
from hdfast.diagnosis.trials import Trial

SHORTLIST = 5
#: Family-wise p value of the screen up to which a first effect is tried all the same: the held-out recordings may
#: confirm it. Where friction holds the load, nothing of it shows to first order.
SUSPECTED, HOLDING = 0.3, ("load_side_friction",)
FAINTEST = 0.03


def shortlist(found: Sequence[Signature], seen: Screen, *, first: bool) -> list[list[Signature]]:
    """The best shapes of the most telling laws that the screen notices, by fine structure and by bulk.

    Their special cases belong to them. Shapes that are other amplitudes of one structure differ in where its fit
    starts, so that they share one; those that were not chosen join them. What nothing but a lower error speaks for is
    not tried: on blind cases it was wrong five times out of six. If `first`, what the screen suspects is.

    What gains most of a law may lie where noise does as well, as a slow line beside a fast one: a shape for which
    chance is less likely is tried with it.
    """
    chosen: dict[str, Signature] = {}
    least = SUSPECTED if first else NOTICED
    noticed = [one for one in found if seen.p[one.candidate.label] <= least]
    for size in (attrgetter("gain"), attrgetter("bulk")):
        ranked = _leading(noticed, size)
        for one in ranked:
            if size(one) >= FAINTEST * size(ranked[0]):
                chosen.setdefault(one.candidate.label, one)
    chosen |= _likelier(noticed, chosen, seen)
    cases = {effect for one in chosen.values() for effect in one.candidate.contains}
    for one in found:
        if one.candidate.effect in cases or (first and one.candidate.effect in HOLDING):
            chosen.setdefault(one.candidate.label, one)
    return _grouped(chosen, found, noticed, seen)


def overlooked(found: Sequence[Signature], seen: Screen, trials: Sequence[Trial]) -> list[list[Signature]]:
    """The best shapes of the laws that the screen singles out, and that others kept off the shortlist."""
    tried = {one.candidate.law for one in trials}
    singled = [one for one in found if seen.p[one.candidate.label] <= ALONE and one.candidate.law not in tried]
    chosen = {one.candidate.label: one for one in _leading(singled, attrgetter("gain"))}
    return _grouped(chosen, found, singled, seen)


def _leading(found: Sequence[Signature], size: Callable[[Signature], float]) -> list[Signature]:
    """The best shape of each law, of the first few laws by size."""
    return list(_best_of_laws(found, size).values())[:SHORTLIST]


def _likelier(noticed: Sequence[Signature], chosen: Mapping[str, Signature], seen: Screen) -> dict[str, Signature]:
    """The shape with the smallest p of each chosen law, where that is an alarm and smaller than those of the chosen.

    Of several the last: small amplitudes stand behind the typical ones.
    """
    least: dict[str, float] = {}
    for label, one in chosen.items():
        least[one.candidate.law] = min(seen.p[label], least.get(one.candidate.law, ALARM))
    best = _best_of_laws(noticed[::-1], lambda one: -seen.p[one.candidate.label])
    likelier = (one for law, one in best.items() if law in least and seen.p[one.candidate.label] < least[law])
    return {one.candidate.label: one for one in likelier}


def _best_of_laws(found: Sequence[Signature], size: Callable[[Signature], float]) -> dict[str, Signature]:
    """The largest shape of each law, the largest first."""
    best: dict[str, Signature] = {}
    for one in sorted(found, key=size, reverse=True):
        best.setdefault(one.candidate.law, one)
    return best


def _grouped(
    chosen: Mapping[str, Signature], found: Sequence[Signature], noticed: Sequence[Signature], seen: Screen
) -> list[list[Signature]]:
    """The chosen by the structure they add, the most conspicuous first, each with what else is noticed of it.

    What is unseen acts in many ways, of which few are noticed about a model that is not refitted: all are tried.
    """
    grouped: dict[Hashable, list[Signature]] = {}
    for one in sorted(chosen.values(), key=lambda one: (seen.p[one.candidate.label], -one.gain)):
        grouped.setdefault(one.candidate.variety, []).append(one)
    for one in [*noticed, *(one for one in found if one.candidate.unseen)]:
        alike = grouped.get(one.candidate.variety, [one])
        if all(one.candidate.free != other.candidate.free for other in alike):
            alike.append(one)
    return list(grouped.values())
