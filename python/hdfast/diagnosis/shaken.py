"""What the noise of the motor angle does to a model that is replayed on it."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.fit import ACCELERATED, SHAKEN, Bench, Fit, near, rattles
from hdfast.diagnosis.plant import TORQUE, Structure
from hdfast.diagnosis.source import Mask

NOTHING = -30.0


def calmer(bench: Bench, one: Fit, other: Fit) -> float:
    """By how much noise of the angle disturbs one model less than another [nats], as the first one's filter sees it.

    The recorded motion holds such noise, which shakes the simulated drive and not the real one: a spring or a damper in
    the right place calms it, and predicts better, whether the drive has one or not. What both models have of inertia,
    stiffness and damping is the other model's: what a refit does to it is not the effect's. Where gains leave out what
    noise adds, the load side does not count.
    """
    counted = ~known_beside(bench, one, other)

    def disturbed(structure: Structure, coordinates: Floats) -> float:
        still, *moved = (own.mismatch(structure, coordinates[None])[0] for own in (bench, *bench.shaken))
        added = [0.5 * float(np.sum(one.white(bench.layout, found - still)[counted] ** 2)) for found in moved]
        return float(np.mean(added))

    return disturbed(other.structure, other.coordinates) - disturbed(one.structure, _alike(bench, one, other))


def known_beside(bench: Bench, one: Fit, other: Fit) -> Mask:
    """Where both of two fits know what noise of the angle adds, shape (N,)."""
    return bench.load_side & (not (rattles(one.structure) or rattles(other.structure)))


def quieted(bench: Bench, one: Fit, other: Fit) -> Floats:
    """Coordinates (P,) of a fit whose acceleration is as noisy as another's: the parameters that multiply it are its.

    Noise that only one of two models brings along says nothing about which is right, and the smaller of two inertias is
    quieter, right or wrong. What the other model does not have is left out whole, and its multiples with it. Far from
    the noise, what is fast in a mismatch is no noise: what both models have then stays as it is.
    """
    index = bench.layout.channels.index(TORQUE)
    noisy = float(min(near(bench, own.weights.scale)[index] for own in (one, other)))
    found = one.coordinates.copy()
    for j, free in enumerate(one.structure.free):
        if free.name in ACCELERATED and free.name in other.structure.names:
            found[j] += noisy * (other.coordinates[other.structure.names.index(free.name)] - found[j])
        elif free.name in ACCELERATED and free.times is None:
            found[j] = NOTHING
    return found


def exchanged(bench: Bench, one: Fit, other: Fit) -> Floats:
    """What the mismatch (N,) of a fit changes by where it holds the noise of the acceleration of another fit's model.

    That noise is in the fast part of the torque, and so is motion where the load strikes or swings. Block by block, as
    much of the fast part is exchanged as noise of the angle makes of it; nothing where there is no such drive.
    """
    rows = np.stack([one.coordinates, quieted(bench, one, other)])
    if np.array_equal(*rows):
        return np.zeros(bench.layout.size)
    change = _fast(bench, one.structure, rows)
    if not np.isfinite(change).all():
        return np.zeros(bench.layout.size)
    shakes = [np.nan_to_num(_fast(own, one.structure, rows) - change) for own in bench.shaken]
    noise, whole = np.mean([bench.layout.sums(shake**2) for shake in shakes], axis=0), bench.layout.sums(change**2)
    share = np.minimum(1.0, noise / np.maximum(whole, 1e-300))
    return np.asarray(share[bench.layout.block] * change)


def _fast(bench: Bench, structure: Structure, rows: Floats) -> Floats:
    """By how much the fast part of the torque differs (N,) from the first to the second of coordinates (2, P)."""
    found, slow = bench.both(structure, rows, [0, 1])
    return np.asarray(np.diff(found - slow, axis=0)[0])


def _alike(bench: Bench, one: Fit, other: Fit) -> Floats:
    """Coordinates (P,) of a fit with the other's inertias, stiffness and damping."""
    found = quieted(bench, one, other)
    names = one.structure.names
    for name in set(names) & set(other.structure.names) & set(SHAKEN):
        found[names.index(name)] = other.coordinates[other.structure.names.index(name)]
    return found
