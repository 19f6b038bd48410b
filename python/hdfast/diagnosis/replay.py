"""What is replayed: recordings, their stacking, and the noise of the motor angle that they show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.plant import TORQUE, Plant
from hdfast.diagnosis.prepare import SHAKES
from hdfast.diagnosis.source import Mask
from hdfast.diagnosis.structure import Structure
from hdfast.scenario_parts import MAX_TORQUE


@dataclass(frozen=True, eq=False)
class Replay:
    """Recordings to be replayed through a structure, and compared.

    Attributes:
        plant: the recordings.
        layout: their stacking.
        floor: standard deviation of each channel's noise as its highest frequencies show it, shape (C,).
        stated: the same as its sensors state it, shape (C,).
    """

    plant: Plant
    layout: Layout
    floor: Floats
    stated: Floats

    def commanded(self, fitted: Fit) -> Replay:
        """The same with the quiet part of the torque that a fitted model needs in place of the recorded one.

        The rest carries the noise of the angle, which a controller answers to: it would look like a late actuator, or
        like a gain that varies. The recorded one stays where the model needs none that a drive could have.
        """
        needed = self.plant.needed(fitted.structure, fitted.coordinates)
        torques = [self.plant.band.quiet(torque) for torque in needed]
        if not all(np.all(np.abs(torque) < MAX_TORQUE) for torque in torques):
            return self
        units = [unit.commanded(torque) for unit, torque in zip(self.plant.units, torques, strict=True)]
        return replace(self, plant=replace(self.plant, units=units))

    @cached_property
    def shaken(self) -> tuple[Replay, ...]:
        """The same recordings, replayed with more of the noise of the angle that they show, a few times."""
        every = zip(*(unit.shaken for unit in self.plant.units), strict=True)
        return tuple(replace(self, plant=replace(self.plant, units=units)) for units in every)

    def mismatch(self, structure: Structure, coordinates: Floats) -> Floats:
        """Stacked mismatches (M, N) at coordinates (M, P)."""
        return self.layout.stack(self.plant.mismatch(structure, coordinates))

    def steady(self, structure: Structure, coordinates: Floats) -> Floats:
        """As `mismatch`, with the slow part of the torque alone.

        An acceleration holds the angle's noise, as the mismatch does: only the slow part of a torque that is made of it
        is motion. A fit that could use the rest would find every inertia too small.
        """
        return self.layout.stack(self._slow(self.plant.mismatch(structure, coordinates)))

    def mismatches(self, structure: Structure, coordinates: Floats, draws: int = SHAKES) -> list[Floats]:
        """Mismatches (M, N) at coordinates (M, P) on the recorded motion, and with more noise of the angle."""
        return [self.layout.stack(found) for found in self._mismatches(structure, coordinates, draws)]

    def split(self, structure: Structure, coordinates: Floats) -> list[tuple[Floats, Floats]]:
        """As `mismatches`, each once more as `steady` has it."""
        every = self._mismatches(structure, coordinates, SHAKES)
        return [(self.layout.stack(found), self.layout.stack(self._slow(found))) for found in every]

    def _mismatches(self, structure: Structure, coordinates: Floats, draws: int) -> list[list[dict[str, Floats]]]:
        found, units = self._noisy[draws - 1].mismatch(structure, coordinates), len(self.plant.units)
        return [found[begin : begin + units] for begin in range(0, len(found), units)]

    @cached_property
    def _noisy(self) -> tuple[Plant, ...]:
        """The recordings with one, two ... more noises beside them, to be simulated at once."""
        noises = [one.plant.units for one in self.shaken]
        every = [[*self.plant.units, *chain(*noises[:draws])] for draws in range(1, SHAKES + 1)]
        return tuple(replace(self.plant, units=units) for units in every)

    @cached_property
    def load_side(self) -> Mask:
        """Which stacked samples are the load side's, shape (N,)."""
        mask: Mask = self.layout.channel != self.layout.channels.index(TORQUE)
        return mask

    def of_load(self, stacked: Floats) -> Floats:
        """The load side's samples of (..., N), 0 in the place of the others."""
        return np.where(self.load_side, stacked, 0.0)

    def with_noise(self, structure: Structure, coordinates: Floats) -> tuple[Floats, Floats]:
        """Mismatches (M, N) at coordinates (M, P), and what more noise of the angle adds to them, (M, N)."""
        still, moved = self.mismatches(structure, coordinates, 1)
        return still, moved - still

    def noise_on_load(self, structure: Structure, coordinates: Floats, mismatch: Floats) -> Floats:
        """What more noise of the angle adds on the load side to known mismatches (M, N) at coordinates (M, P)."""
        return self.of_load(self.shaken[0].mismatch(structure, coordinates) - mismatch)

    def both(self, structure: Structure, coordinates: Floats, rows: Sequence[int]) -> tuple[Floats, Floats]:
        """Mismatches (M, N) at coordinates (M, P), and those of some rows (R, N) as `steady` has them."""
        found = self.plant.mismatch(structure, coordinates)
        some = [{name: own[rows] for name, own in unit.items()} for unit in found]
        return self.layout.stack(found), self.layout.stack(self._slow(some))

    def _slow(self, found: Sequence[Mapping[str, Floats]]) -> list[dict[str, Floats]]:
        slow = self.plant.band.slow
        return [{name: slow(own) if name == TORQUE else own for name, own in unit.items()} for unit in found]
