"""Sign of the motor torque: a drive without external load takes energy from its motor."""

from __future__ import annotations

import numpy as np

from hdfast.health import coverage
from hdfast.health.finding import REJECT, WARNING
from hdfast.health.subject import Subject

NAME = "torque_sign"
LIMIT = -0.1
SIGMAS = 4.0
CLOSED = 0.05


def check(subject: Subject) -> None:
    """Reject when the energy over a closed motion is negative, or inertia and friction both come out negative.

    A motor at rest exchanges no energy but that of rounding.
    """
    if any(finding.check == coverage.NAME for finding in subject.findings):
        return
    motion = subject.motion
    used = motion.valid
    power = (motion.torque * motion.speed)[used]
    total = float(np.sum(np.abs(power)))
    if total == 0.0 or ("load_torque" in subject.checked and np.ptp(_load(subject)) > 0.0):
        return
    energy = float(np.sum(power)) / total
    fit = subject.rigid
    reversed_drive = (
        fit is not None and fit.inertia < -SIGMAS * fit.inertia_error and fit.friction < -SIGMAS * fit.friction_error
    )
    speed, angle = motion.speed[used], motion.angle[used]
    path = float(np.sum(np.abs(np.diff(angle))))
    first, last = speed[[0, -1]] / np.max(np.abs(speed))
    kinetic = abs(last**2 - first**2)
    closed = abs(angle[-1] - angle[0]) < CLOSED * path and kinetic < CLOSED
    if reversed_drive or (energy < LIMIT and closed):
        sentence = (
            f"the motor takes energy from the drive ({100.0 * energy:.3g} % of the energy exchanged); "
            f"flip the sign of scale in [columns] {_column(subject)}"
        )
        subject.find(NAME, REJECT, sentence, value=energy, limit=LIMIT)
    elif energy < LIMIT and not closed:
        sentence = (
            f"the motor takes energy from the drive ({100.0 * energy:.3g} % of the energy exchanged); "
            "right when a load drives it, otherwise flip the sign of motor_torque"
        )
        subject.find(NAME, WARNING, sentence, value=energy, limit=LIMIT)


def _load(subject: Subject) -> np.ndarray:
    load = subject.checked["load_torque"]
    return load[np.isfinite(load)]


def _column(subject: Subject) -> str:
    wrong_ratio = any(finding.check == "ratio" and (finding.value or 0.0) < -1.0 for finding in subject.findings)
    return "motor_angle" if wrong_ratio else "motor_torque"
