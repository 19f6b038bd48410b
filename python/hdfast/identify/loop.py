"""Torque-windup loops: what each recording gives, and what several give together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast.health.subject import ANGLES
from hdfast.identify import branches, sparse
from hdfast.identify.branches import Branches
from hdfast.identify.crossings import TORQUES, Crossings, crossings, windup_and_torque
from hdfast.identify.estimate import Estimate, mean
from hdfast.identify.loop_energy import energy
from hdfast.identify.reading import gather
from hdfast.identify.resolution import resolution
from hdfast.identify.spring_fit import Points, SpringFit

SAME_SIZE = 0.95


@dataclass(frozen=True, eq=False)
class Loop:
    """The loop of one recording.

    Attributes:
        name: name of the recording.
        column: where the torque was read.
        rate: speed of the torque [N m/s].
        found: level crossings.
        pair: the branches.
        losses: energy of a cycle, hysteresis loss, lost motion.
    """

    name: str
    column: str
    rate: float
    found: Crossings
    pair: Branches
    losses: tuple[Estimate, ...]

    @property
    def size(self) -> float:
        """Half the range of the torque [N m]."""
        return 0.5 * (self.found.top[1] - self.found.top[0])


def loops(recordings: Any, ratio: float | None, columns: Any, rated: float, notes: list[str]) -> list[Loop]:
    """The loop of every recording, largest torque first.

    Raises:
        InputError: a column is missing, or a loop is not whole.
    """
    listed = []
    for recording in gather(recordings, columns, smooth=(*ANGLES, *TORQUES)):
        notes += [f"{recording.name}: {note}" for note in recording.notes]
        t, windup, torque, column = windup_and_torque(recording, ratio, notes)
        found = crossings(windup, torque, resolution(recording, "load_angle", windup, notes))
        pair = branches.branches(found)
        if found.sparse:
            notes.append(f"{recording.name}: {sparse.told(found)}")
        area = sparse.energy(found) if found.sparse else energy(pair, found)
        losses = (area, branches.hysteresis_loss(found), branches.lost_motion(found, rated))
        notes += [
            f"{recording.name}: {item.name} ({item.meaning}) is not known: a branch does not pass that torque"
            for item in losses
            if math.isnan(item.value)
        ]
        travelled = float(np.sum(np.abs(np.diff(torque[np.linspace(0, len(torque) - 1, 201).astype(int)]))))
        listed.append(Loop(recording.name, column, travelled / float(t[-1] - t[0]), found, pair, losses))
    return sorted(listed, key=lambda loop: -loop.size)


def settled(listed: Sequence[Loop], notes: list[str]) -> list[Loop]:
    """The loops whose branches run parallel somewhere; the first one always."""
    kept = [loop for j, loop in enumerate(listed) if j == 0 or loop.pair.settled]
    notes += [
        f"{loop.name}: the branches still approach their distance, the loop gives its losses only"
        for loop in listed
        if loop not in kept
    ]
    return kept


def points(listed: Sequence[Loop]) -> Points:
    """The crossings on the parallel parts of all loops."""
    used = [branches.parallel(loop.found, loop.pair.cut) for loop in listed]
    found = [loop.found for loop in listed]
    quiet = min(loop.pair.noise for loop in listed)
    return Points(
        np.concatenate([item.windup[chosen] for item, chosen in zip(found, used, strict=True)]),
        np.concatenate([item.torque[chosen] for item, chosen in zip(found, used, strict=True)]),
        np.concatenate([item.direction[chosen] for item, chosen in zip(found, used, strict=True)]),
        np.concatenate([np.full(chosen.sum(), j, dtype=np.int64) for j, chosen in enumerate(used)]),
        np.concatenate(
            [np.full(chosen.sum(), quiet / loop.pair.noise) for loop, chosen in zip(listed, used, strict=True)]
        ),
        max(item.alike for item in found),
    )


def losses(listed: Sequence[Loop]) -> list[Estimate]:
    """Energy, hysteresis loss and lost motion of the largest loop, averaged over the loops of its size."""
    alike = [loop.losses for loop in listed if loop.size >= SAME_SIZE * listed[0].size]
    return [mean(same) for same in zip(*alike, strict=True)]


def table(listed: Sequence[Loop], fitted: Sequence[Loop], law: SpringFit) -> tuple[list[str], list[list[str]]]:
    """Each loop with its losses, and with its own hysteresis torque where it takes part in the fit of the spring."""
    header = ["recording", "torque [N m]", "rate [N m/s]"]
    header += [f"{item.name.replace('_', ' ')} [{item.unit}]" for item in listed[0].losses]
    rows = []
    for loop in listed:
        half = f"{law.halves[fitted.index(loop)]:.4g}" if loop in fitted else "-"
        cells = [f"{loop.size:.4g}", f"{loop.rate:.3g}", *(f"{item.value:.4g}" for item in loop.losses)]
        rows.append([loop.name, *cells, half])
    return [*header, "T_h [N m]"], rows
