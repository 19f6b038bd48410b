"""Forward selection by the Bayesian information criterion, as if residuals were independent from sample to sample.

Engine, library and output-error fit are those of the diagnosis; what is naive is the criterion of G. Schwarz, Annals of
Statistics 6 (1978) 461, with as many observations as samples.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.changes import changes
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.screen import Signature, signatures
from hdfast.diagnosis.session import Setup, candidates
from hdfast.proof.rivals.said import Named, Said, finding

MOST_EFFECTS = 4
SHORTLIST = 5


def answer(setup: Setup, calibrated: Fit) -> Said:
    """Add the effect that lowers the criterion most, as long as one does."""
    replay, current, named = setup.replay, calibrated, list[Named]()
    ratio = calibrated.value("ratio")
    while len(named) < MOST_EFFECTS:
        replay = replay.commanded(current)
        pool = [
            one for one in candidates(replay, current, ratio) if fits_in(one, [n.candidate for n in named], current)
        ]
        found = signatures(replay, current, changes(replay, current, pool))
        tried = [(one.candidate, added(replay, current, one)) for one in shortlist(found)]
        trials = [(candidate, trial) for candidate, trial in tried if trial is not None]
        scores = [bic(replay.layout, trial) for _, trial in trials]
        before = bic(replay.layout, current)
        if not scores or min(scores) >= before:
            break
        best = int(np.argmin(scores))
        weights = np.exp(-0.5 * (np.array([*scores, before]) - scores[best]))
        named.append(Named(trials[best][0], float(1.0 / weights.sum())))
        current = trials[best][1]
    return finding(current, named)


def bic(layout: Layout, fitted: Fit) -> float:
    """Criterion of a fit: N_c ln(mean square of channel c) over channels, plus ln N for each parameter."""
    misfit = 0.0
    for index in range(len(layout.channels)):
        own = fitted.mismatch[layout.channel == index]
        if own.size:
            misfit += own.size * np.log(max(float(np.mean(own**2)), 1e-300))
    found = misfit + len(fitted.coordinates) * np.log(max(layout.size, 2))
    return float(found) if np.isfinite(found) else np.inf


def fits_in(candidate: Candidate, named: Sequence[Candidate], current: Fit) -> bool:
    """Whether a candidate is new and what it needs is there."""
    present = {one.effect for one in named} | set(current.structure.model.terms)
    if candidate.effect in present and not candidate.orders:
        return False
    if candidate.orders and set(candidate.orders) & set(current.structure.model.orders):
        return False
    if present & set(candidate.contains) or any(candidate.effect in one.contains for one in named):
        return False
    if candidate.needs and not present & set(candidate.needs):
        return False
    return candidate.fits_into(current.structure)


def shortlist(found: Sequence[Signature]) -> list[Signature]:
    """The best shapes of the effects that would lower the sum of squares most."""
    best: dict[str, Signature] = {}
    for one in sorted(found, key=lambda one: -one.bulk):
        best.setdefault(one.candidate.effect, one)
    return list(best.values())[:SHORTLIST]


def added(replay: Replay, current: Fit, signature: Signature) -> Fit | None:
    """The joint fit with one more effect, from its linear estimate or its typical size; None where neither runs."""
    candidate = signature.candidate
    structure = candidate.added_to(current.structure)
    for sized in (candidate.started(candidate.possible(signature.shares)), candidate):
        start = started(current, [sized])
        if np.isfinite(replay.mismatch(structure, start[None])).all():
            return fit(replay, structure, start, current)
    return None


def started(current: Fit, sized: Sequence[Candidate]) -> Floats:
    """Coordinates of a fit followed by those of more effects."""
    more = [float(free.coordinate(free.value)) for one in sized for free in one.free]
    return np.concatenate([current.coordinates, more])
