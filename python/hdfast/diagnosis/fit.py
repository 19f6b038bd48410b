"""Output-error fit of a structure: Gauss-Newton with priors, robust weights and coloured residuals."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import inner, limited
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.metric import Metric
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.slopes import linearise, stirred, units_of
from hdfast.diagnosis.stir import Stir, information
from hdfast.diagnosis.structure import Structure

#: Where a load rattles in a gap, slopes over small steps are chance. They are taken across so many standard deviations,
#: at most over so much.
ACROSS, WIDEST = 8.0, 0.2
#: Rounds of a fit; beyond these it goes on while one still finds `MUCH` [nats], as far from the noise it does.
ROUNDS, MOST_ROUNDS = 8, 32
MUCH = 10.0
CHORDS = 2
SHRINK = (1.0, 0.25)
CAREFUL = (*SHRINK, 0.06)
#: What a step has to find [nats], and a round of steps for another one where noise of the angle is loud, or a load
#: rattles: slopes are chance there and taken anew, so that the next round always finds a little.
SETTLED, WORTH = 0.05, 0.5
VALLEY, LOWER = 0.5, 1.0
#: Squared distance in standard deviations within which slopes are alike.
BESIDE = 1.0


@dataclass(frozen=True, eq=False)
class _Place:
    """Where a fit is: coordinates (P,), the mismatch there (N,), and what noise of the angle adds to it."""

    x: Floats
    mismatch: Floats = field(repr=False)
    stir: Stir = field(repr=False)


def fit(
    replay: Replay,
    structure: Structure,
    start: Floats | None = None,
    known: Fit | None = None,
    ahead: Fit | None = None,
) -> Fit:
    """Fit a structure; what ends at a bound is held there, so that its slopes are 0.

    Args:
        replay: recordings.
        structure: equations and free parameters.
        start: first coordinates (P,); default the prior centre.
        known: an earlier fit whose parameters come first in `structure`; its slopes are kept, and those of the added
            parameters computed alone, until no step with them finds better, and beyond where the fit ends beside it.
        ahead: a fit of the same structure from elsewhere, which is the answer once this one is in its valley.
    """
    x = np.clip(structure.start if start is None else start, *structure.bounds)
    kept = 0 if known is None else known.slopes.shape[1]
    widest = WIDEST * units_of(structure)
    steps = widest if structure.rattles else None
    mismatch, slopes, rough = linearise(replay, structure, x, kept, steps)
    if known is not None:
        slopes[:, :kept], rough[:, :kept] = known.slopes, known.rough
    stir = Stir.none(slopes) if structure.rattles else stirred(replay, structure, x, mismatch, slopes, known)
    place = _Place(x, mismatch, stir)
    for turn in range(1, MOST_ROUNDS + 1):
        metric = Metric.of(replay, place.mismatch)
        place, found = _descended(replay, structure, metric, place, slopes, rough)
        if turn == MOST_ROUNDS or (turn >= ROUNDS and found < MUCH):
            break
        precision = partial(_precision, replay, metric, structure, slopes, place.stir)
        if found < (WORTH if place.stir.loud or structure.rattles else SETTLED):
            if known is None or not kept or _beside(known, place.x, precision()):
                break
            kept = 0
        if ahead is not None and _in_valley(replay, ahead, place):
            return ahead
        if structure.rattles:
            steps = np.minimum(widest, ACROSS * np.sqrt(np.diag(np.linalg.inv(precision()))))
        _, fresh, rougher = linearise(replay, structure, place.x, kept, steps)
        slopes[:, kept:], rough[:, kept:] = fresh[:, kept:], rougher[:, kept:]
        if not (structure.rattles or kept):
            place = replace(place, stir=stirred(replay, structure, place.x, place.mismatch, slopes))
    metric = Metric.of(replay, place.mismatch)
    held = np.any(place.x == structure.bounds, axis=0)
    slopes[:, held], rough[:, held] = 0.0, 0.0
    stir = replace(place.stir, slopes=np.where(held, 0.0, place.stir.slopes))
    return Fit(structure, place.x, place.mismatch, slopes, rough, metric.weights, metric.white, stir)


def placed(replay: Replay, known: Fit, coordinates: Floats) -> Fit:
    """The model of a fit at other coordinates (P,), with what noise of the angle adds there, and the fit's slopes."""
    [place] = _places(replay, known.structure, coordinates[None], known.stir)
    return replace(known, coordinates=coordinates, mismatch=place.mismatch, stir=place.stir)


def _descended(
    replay: Replay, structure: Structure, metric: Metric, place: _Place, slopes: Floats, rough: Floats
) -> tuple[_Place, float]:
    """Where a few steps with the same slopes (N, P) lead, each to the best of several lengths; what they find [nats].

    Steps are compared with as much noise of the acceleration as there is here: `rough` (N, P) of it per coordinate.
    """
    layout = replay.layout
    seen = partial(metric.of_columns, layout)
    A, stir, found = seen(slopes), place.stir.through(seen), 0.0
    for _ in range(CHORDS):
        step = _step(structure, place.x, A, seen(place.mismatch), stir)
        tried = _along(replay, structure, place, step)
        alike = [one.mismatch + rough @ (one.x - place.x) for one in tried]
        costs = [metric.cost(layout, structure, one.x, own, one.stir) for one, own in zip(tried, alike, strict=True)]
        best = int(np.argmin(np.where(np.isfinite(costs), costs, np.inf)))
        fall = metric.cost(layout, structure, place.x, place.mismatch, place.stir) - costs[best]
        if not fall > SETTLED:
            break
        place, found = tried[best], found + fall
        stir = replace(stir, noise=place.stir.through(seen).noise) if stir.loud else stir
    return place, found


def _along(replay: Replay, structure: Structure, place: _Place, step: Floats) -> list[_Place]:
    """The places at several lengths of a step (P,)."""
    shares = np.multiply.outer(CAREFUL if structure.rattles else SHRINK, step)
    return _places(replay, structure, np.clip(place.x + shares, *structure.bounds), place.stir)


def _places(replay: Replay, structure: Structure, coordinates: Floats, stir: Stir) -> list[_Place]:
    """The places at coordinates (M, P), with what noise of the angle adds at each where it is loud."""
    if not stir.loud:
        pairs = zip(coordinates, replay.mismatch(structure, coordinates), strict=True)
        return [_Place(x, mismatch, stir) for x, mismatch in pairs]
    every = zip(coordinates, *replay.with_noise(structure, coordinates), strict=True)
    return [_Place(x, mismatch, replace(stir, noise=replay.of_load(noise))) for x, mismatch, noise in every]


def _precision(replay: Replay, metric: Metric, structure: Structure, slopes: Floats, stir: Stir) -> Floats:
    """Of the coordinates (P, P), as slopes (N, P) tell them."""
    seen = partial(metric.of_columns, replay.layout)
    return information(structure, seen(slopes), stir.through(seen))


def _beside(known: Fit, x: Floats, precision: Floats) -> bool:
    """Whether coordinates (P,), of this precision (P, P), are so near an earlier fit's that its slopes are theirs."""
    kept = len(known.coordinates)
    away = x[:kept] - known.coordinates
    return bool(away @ precision[:kept, :kept] @ away < BESIDE)


def _in_valley(replay: Replay, ahead: Fit, place: _Place) -> bool:
    """Whether a place costs what another fit's slopes say that it does, and that fit is the lower one."""
    metric = Metric.about(replay, ahead)
    predicted = ahead.mismatch - (ahead.slopes + ahead.rough) @ (place.x - ahead.coordinates)
    best, here, told = (
        metric.cost(replay.layout, ahead.structure, *pair)
        for pair in ((ahead.coordinates, ahead.mismatch), (place.x, place.mismatch), (place.x, predicted))
    )
    return here >= best - LOWER and abs(here - told) <= VALLEY * abs(here - best) + LOWER


def _step(structure: Structure, x: Floats, A: Floats, r: Floats, stir: Stir) -> Floats:
    """Gauss-Newton step of the coordinates from weighted slopes (2N, P) and mismatch (2N,), and from the noise's."""
    _, share = limited(r)
    pull = stir.firmness * structure.sigma**-2 * (x - structure.start)
    score = inner(A, share * r) - pull
    if stir.loud:
        score -= stir.slopes.T @ stir.noise
    whole = information(structure, A * np.sqrt(share)[:, None], stir)
    return np.asarray(np.linalg.solve(whole, score), dtype=np.float64)
