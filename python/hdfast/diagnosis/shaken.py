"""What the noise of the motor angle does to a model that is replayed on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.band import low_pass
from hdfast.diagnosis.fit import Bench, Fit, quieted
from hdfast.diagnosis.prepare import Unit

SHAKES = 2


def calmer(bench: Bench, one: Fit, other: Fit) -> float:
    """By how much noise of the angle disturbs one model less than another [nats], as the first one's filter sees it.

    The recorded motion holds such noise, which shakes the simulated drive and not the real one: a spring or a damper in
    the right place calms it, and predicts better, whether the drive has one or not. Parameters that multiply the
    acceleration are the other model's, as when gains are compared.
    """
    costs = [
        _disturbed(bench, fit, coordinates, one)
        for fit, coordinates in ((one, quieted(bench, one, other)), (other, other.coordinates))
    ]
    return costs[1] - costs[0]


def _disturbed(bench: Bench, fit: Fit, coordinates: Floats, filtering: Fit) -> float:
    """Half the sum of squares that more of the same noise adds [nats], mean of a few draws."""
    still = bench.mismatch(fit.structure, coordinates[None])[0]
    added = []
    for draw in range(SHAKES):
        units = [_shaken(bench, unit, np.random.default_rng([draw, k])) for k, unit in enumerate(bench.plant.units)]
        shaken = replace(bench, plant=replace(bench.plant, units=units))
        moved = shaken.mismatch(fit.structure, coordinates[None])[0] - still
        added.append(0.5 * float(np.sum(filtering.white(bench.layout, moved) ** 2)))
    return float(np.mean(added))


def _shaken(bench: Bench, unit: Unit, rng: np.random.Generator) -> Unit:
    band = bench.plant.band
    noise = np.sqrt(0.5 * band.angle_noise * band.rate) * rng.standard_normal(len(unit.t))
    return unit.moved(low_pass(noise, band.replayed, band.rate))
