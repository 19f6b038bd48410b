"""What the noise of the motor angle does to a model that is replayed on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.band import low_pass
from hdfast.diagnosis.fit import SHAKEN, Bench, Fit, quieted
from hdfast.diagnosis.plant import Structure

SHAKES = 2


def calmer(bench: Bench, one: Fit, other: Fit) -> float:
    """By how much noise of the angle disturbs one model less than another [nats], as the first one's filter sees it.

    The recorded motion holds such noise, which shakes the simulated drive and not the real one: a spring or a damper in
    the right place calms it, and predicts better, whether the drive has one or not. What both models have of inertia,
    stiffness and damping is the other model's: what a refit does to it is not the effect's.
    """
    shaken = [_shaken(bench, draw) for draw in range(SHAKES)]

    def disturbed(structure: Structure, coordinates: Floats) -> float:
        still, *moved = (own.mismatch(structure, coordinates[None])[0] for own in (bench, *shaken))
        added = [0.5 * float(np.sum(one.white(bench.layout, found - still) ** 2)) for found in moved]
        return float(np.mean(added))

    return disturbed(other.structure, other.coordinates) - disturbed(one.structure, _alike(bench, one, other))


def _alike(bench: Bench, one: Fit, other: Fit) -> Floats:
    """Coordinates (P,) of a fit with the other's inertias, stiffness and damping."""
    found = quieted(bench, one, other)
    names = one.structure.names
    for name in set(names) & set(other.structure.names) & set(SHAKEN):
        found[names.index(name)] = other.coordinates[other.structure.names.index(name)]
    return found


def _shaken(bench: Bench, draw: int) -> Bench:
    """The same recordings, replayed with more of the noise that they show."""
    band, units = bench.plant.band, []
    for number, unit in enumerate(bench.plant.units):
        noise = np.random.default_rng([draw, number]).standard_normal(len(unit.t))
        loud = np.sqrt(0.5 * band.angle_noise * band.rate) * noise
        units.append(unit.moved(low_pass(loud, band.replayed, band.rate)))
    return replace(bench, plant=replace(bench.plant, units=units))
