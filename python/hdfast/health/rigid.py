"""The motor torque explained by a rigid drive, which is enough to tell signs, units and what stands out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.health.alignment import block_regression
from hdfast.health.motion import Motion

FEWEST = 50
ROUNDS, OUTLIER = 4, 6.0


@dataclass(frozen=True)
class RigidFit:
    """torque = inertia a + viscous w + dry direction + constant + terms of the output angle and of a known load torque.

    Attributes:
        inertia, inertia_error: torque per acceleration [kg m^2].
        friction, friction_error: dry friction and viscous friction at the largest speed [N m].
        residual: (m,) what is left of the torque [N m].
    """

    inertia: float
    inertia_error: float
    friction: float
    friction_error: float
    residual: Floats


def rigid_fit(motion: Motion, ratio: float | None = None) -> RigidFit | None:
    """Fit the drive, leaving out what stands far out; None without enough motion."""
    used = motion.valid
    if motion.moving.sum() < FEWEST or not motion.speed[used].any():
        return None
    columns = laws(motion, ratio)
    kept = used
    for _ in range(ROUNDS):
        found, errors = block_regression(columns[kept], motion.torque[kept])
        residual = np.abs(motion.torque - columns @ found)
        kept = used & (residual <= OUTLIER * np.median(residual[used]))
    return RigidFit(
        float(found[0]),
        float(errors[0]),
        float(found[1] + found[2]),
        float(np.hypot(errors[1], errors[2])),
        motion.torque - columns @ found,
    )


def laws(motion: Motion, ratio: float | None) -> Floats:
    """What the torque of a rigid drive is made of, in the order of `RigidFit`, shape (m, p)."""
    used = motion.valid
    basis = [
        motion.acceleration,
        motion.speed / float(np.max(np.abs(motion.speed[used]))),
        motion.direction,
        np.ones_like(motion.t),
    ]
    output = motion.load_angle if motion.load_angle is not None else motion.angle / ratio if ratio else None
    if output is not None and np.ptp(output[used]) > 0.2:
        basis += [np.cos(output), np.sin(output)]
    if motion.load_torque is not None and np.ptp(motion.load_torque[used]) > 0.0:
        basis.append(motion.load_torque)
    return np.column_stack(basis)
