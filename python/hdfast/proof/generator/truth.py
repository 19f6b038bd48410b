"""The true structure, refitted to recordings with their noise and the minor effects that no structure has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hdfast.proof.generator.effects import Drive
from hdfast.proof.generator.linear import Linearisation, moved
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.responses import Motion, noise_of, responses
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.sizing import Sized, together
from hdfast.proof.generator.whitening import Channels, whiten

NUDGE = 0.01

Signals = dict[str, Array]


@dataclass(frozen=True)
class Refitted:
    """The true structure with what a refit makes of it.

    Attributes:
        drive: the refitted drive.
        scale: of its torque reading.
    """

    drive: Drive
    scale: float

    def misses(self, rig: Rig, full: Drive, motions: list[Motion]) -> Channels:
        """What it misses of the channels of the whole drive, its minor effects included."""
        pairs = zip(responses(rig, full, motions), responses(rig, self.drive, motions), strict=True)
        factors = 1.0 + rig.torque_scale, self.scale
        return [
            [factors[0] * own[0] - factors[1] * model[0], *(a - b for a, b in zip(own[1:], model[1:], strict=True))]
            for own, model in pairs
        ]


def refitted(
    lin: Linearisation, named: Sequence[Sized], full: Drive, clean: Sequence[Signals], noisy: Sequence[Signals]
) -> Refitted:
    """A refit that knows the effects' laws but not their sizes, linear and held by the data sheet.

    Args:
        lin: linearisation of the drive without its effects.
        named: the effects.
        full: the drive with them and with its minor effects.
        clean, noisy: signals of each recording on the grid, without and with noise.
    """
    rig, effects = lin.rig, np.ones(len(named))
    true, _ = lin.signature(together(lin.drive, named))
    inertia = lin.drive.plant.J_r + lin.drive.plant.J_w

    def changed(drive: Drive) -> Array:
        return lin.signature(drive)[0] - true

    grown = [together(lin.drive, named, effects + NUDGE * own) for own in np.eye(len(named))]
    columns = np.column_stack([lin.columns, *(changed(drive) / NUDGE for drive in grown)])
    noise = [noise_of(rig, a, b, inertia) for a, b in zip(clean, noisy, strict=True)]
    seen = whiten(rig, lin.motions, lin.filters, noise) + changed(full)
    centre = np.zeros(columns.shape[1])
    sheet = _data_sheet(rig)
    centre[: sheet.size] = sheet
    information = columns.T @ columns + np.eye(centre.size)
    shift = centre + scipy.linalg.solve(information, columns.T @ (seen - columns @ centre), assume_a="pos")
    plain = lin.drive._replace(plant=moved(rig, lin.drive.plant, shift))
    sizes = np.maximum(effects + shift[len(lin.names) :], NUDGE)
    scale = 1.0 + rig.torque_sigma * float(shift[lin.names.index("torque_scale")])
    return Refitted(together(plain, named, sizes), scale)


def _data_sheet(rig: Rig) -> Array:
    """Where the data sheet is, seen from the truth, in prior sigma: parameters, then lines of the kinematic error."""
    own = [np.log(rig.nominal[name] / true) / rig.sigma[name] for name, true in rig.true.items()]
    true = rig.plant.te_amplitude * np.exp(-1j * rig.plant.te_phase)
    lines = (np.array(rig.nominal_error["cos"]) + 1j * np.array(rig.nominal_error["sin"]) - true) / rig.error_sigma
    return np.concatenate([own, np.column_stack([lines.real, lines.imag]).ravel()])
