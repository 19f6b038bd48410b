"""What the noise of the motor angle does to a model that is replayed on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.fit import ACCELERATED, SHAKEN, Bench, Fit, near, rattles
from hdfast.diagnosis.plant import TORQUE, Structure

NOTHING = -30.0


def calmer(bench: Bench, one: Fit, other: Fit) -> float:
    """By how much noise of the angle disturbs one model less than another [nats], as the first one's filter sees it.

    The recorded motion holds such noise, which shakes the simulated drive and not the real one: a spring or a damper in
    the right place calms it, and predicts better, whether the drive has one or not. What both models have of inertia,
    stiffness and damping is the other model's: what a refit does to it is not the effect's. Nothing where gains leave
    out what noise adds.
    """
    if known_beside(one, other):
        return 0.0

    def disturbed(structure: Structure, coordinates: Floats) -> float:
        still, *moved = (own.mismatch(structure, coordinates[None])[0] for own in (bench, *bench.shaken))
        added = [0.5 * float(np.sum(one.white(bench.layout, found - still) ** 2)) for found in moved]
        return float(np.mean(added))

    return disturbed(other.structure, other.coordinates) - disturbed(one.structure, _alike(bench, one, other))


def known_beside(one: Fit, other: Fit) -> bool:
    """Whether what noise of the angle adds can be told for both of two fits."""
    return not (rattles(one.structure) or rattles(other.structure))


def added(bench: Bench, one: Fit) -> Floats:
    """What more noise of the angle adds to the mismatch (N,) of a fit."""
    _, found = bench.disturbed(one.structure, one.coordinates[None])
    return np.asarray(np.nan_to_num(found[0]))


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


@dataclass(frozen=True, eq=False)
class Exchanged:
    """A simulated fit with the noise of the acceleration that another fit's model holds.

    Attributes:
        mismatch: of the fit itself, shape (N,).
        change: of that by the exchange, shape (N,).
        added: what more noise of the angle adds to the changed mismatch, shape (N,).
        known: whether that is more than chance.
    """

    mismatch: Floats = field(repr=False)
    change: Floats = field(repr=False)
    added: Floats = field(repr=False)
    known: bool

    @property
    def alike(self) -> Floats:
        """The changed mismatch (N,)."""
        return self.mismatch + self.change


def exchanged(bench: Bench, one: Fit, other: Fit) -> Exchanged:
    """A fit with the noise of another fit's acceleration, as far as it can be told from motion.

    That noise is in the fast part of the torque, and so is motion where the load strikes or swings. Block by block, as
    much of the fast part is exchanged as noise of the angle makes of it; nothing where there is no such drive. What is
    left of it is known by its size alone.
    """
    rows = np.stack([one.coordinates, quieted(bench, one, other)])
    (found, change), *shaken = (_fast(own, one.structure, rows) for own in (bench, *bench.shaken))
    noise, known = np.nan_to_num(shaken[0][0] - found), not rattles(one.structure)
    if not np.isfinite(change).all():
        return Exchanged(found, np.zeros(bench.layout.size), noise, known)
    shakes = [np.nan_to_num(fast - change) for _, fast in shaken]
    shaking = np.mean([bench.layout.sums(shake**2) for shake in shakes], axis=0)
    share = np.minimum(1.0, shaking / np.maximum(bench.layout.sums(change**2), 1e-300))[bench.layout.block]
    return Exchanged(found, share * change, noise + share * shakes[0], known)


def _fast(bench: Bench, structure: Structure, rows: Floats) -> tuple[Floats, Floats]:
    """Mismatch (N,) at the first of coordinates (2, P), and by how much the fast part of the torque differs (N,)."""
    found, slow = bench.both(structure, rows, [0, 1])
    return found[0], np.asarray(np.diff(found - slow, axis=0)[0])


def _alike(bench: Bench, one: Fit, other: Fit) -> Floats:
    """Coordinates (P,) of a fit with the other's inertias, stiffness and damping."""
    found = quieted(bench, one, other)
    names = one.structure.names
    for name in set(names) & set(other.structure.names) & set(SHAKEN):
        found[names.index(name)] = other.coordinates[other.structure.names.index(name)]
    return found
