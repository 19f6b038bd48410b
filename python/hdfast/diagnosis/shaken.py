"""What the noise of the motor angle does to a model that is replayed on it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.metric import near
from hdfast.diagnosis.plant import TORQUE
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.slopes import ACCELERATED, SHAKEN
from hdfast.diagnosis.structure import Structure

NOTHING = -30.0


def calmer(replay: Replay, one: Fit, other: Fit) -> float:
    """By how much noise of the angle disturbs one model less than another [nats], as the first one's filter sees it.

    The recorded motion holds such noise, which shakes the simulated drive and not the real one: a spring or a damper in
    the right place calms it, and predicts better, whether the drive has one or not. What both models have of inertia,
    stiffness and damping is the other model's: what a refit does to it is not the effect's. Nothing where gains leave
    out what noise adds.
    """
    if not (one.structure.rattles or other.structure.rattles):
        return 0.0

    def disturbed(structure: Structure, coordinates: Floats) -> float:
        still, *moved = replay.mismatches(structure, coordinates[None])
        noises = [one.white(replay.layout, (found - still)[0]) for found in moved]
        return 0.5 * float(np.mean([np.sum(noise**2) for noise in noises]))

    return disturbed(other.structure, other.coordinates) - disturbed(one.structure, _alike(replay, one, other))


def noise_of(replay: Replay, one: Fit) -> Floats:
    """What more noise of the angle adds to the mismatch (N,) of a fit."""
    _, found = replay.with_noise(one.structure, one.coordinates[None])
    return np.asarray(np.nan_to_num(found[0]))


def quieted(replay: Replay, one: Fit, other: Fit) -> Floats:
    """Coordinates (P,) of a fit whose acceleration is as noisy as another's: the parameters that multiply it are its.

    Noise that only one of two models brings along says nothing about which is right, and the smaller of two inertias is
    quieter, right or wrong. What the other model does not have is left out whole, and its multiples with it. Far from
    the noise, what is fast in a mismatch is no noise: what both models have then stays as it is.
    """
    index = replay.layout.channels.index(TORQUE)
    noisy = float(min(near(replay, own.weights.scale)[index] for own in (one, other)))
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
        noise: what more noise of the angle adds to the changed mismatch, shape (N,).
        rattles: whether its load moves in a gap, so that the noise there is chance.
    """

    mismatch: Floats = field(repr=False)
    change: Floats = field(repr=False)
    noise: Floats = field(repr=False)
    rattles: bool

    @property
    def alike(self) -> Floats:
        """The changed mismatch (N,)."""
        return self.mismatch + self.change


def exchanged(replay: Replay, one: Fit, other: Fit) -> Exchanged:
    """A fit with the noise of another fit's acceleration, as far as it can be told from motion.

    That noise is in the fast part of the torque, and so is motion where the load strikes or swings. Block by block, as
    much of the fast part is exchanged as noise of the angle makes of it; nothing where there is no such drive. What is
    left of it is known by its size alone.
    """
    structure, unchanged = one.structure, np.zeros(replay.layout.size)
    if one is other:
        still, noise = replay.with_noise(structure, one.coordinates[None])
        return Exchanged(still[0], unchanged, np.nan_to_num(noise[0]), structure.rattles)
    replays = replay.split(structure, np.stack([one.coordinates, quieted(replay, one, other)]))
    change, *changes = (np.diff(found - slow, axis=0)[0] for found, slow in replays)
    still, moved = (found[0] for found, _ in replays[:2])
    noise = np.nan_to_num(moved - still)
    if not np.isfinite(change).all():
        return Exchanged(still, unchanged, noise, structure.rattles)
    shakes = [np.nan_to_num(own - change) for own in changes]
    shaking = np.mean([replay.layout.sums(shake**2) for shake in shakes], axis=0)
    share = np.minimum(1.0, shaking / np.maximum(replay.layout.sums(change**2), 1e-300))[replay.layout.block]
    return Exchanged(still, share * change, noise + share * shakes[0], structure.rattles)


def _alike(replay: Replay, one: Fit, other: Fit) -> Floats:
    """Coordinates (P,) of a fit with the other's inertias, stiffness and damping."""
    found = quieted(replay, one, other)
    names = one.structure.names
    for name in set(names) & set(other.structure.names) & set(SHAKEN):
        found[names.index(name)] = other.coordinates[other.structure.names.index(name)]
    return found
