"""The torque at the output against what accelerates the load and what the motor gives: a dead sensor, sign and unit.

The load takes J_l times its acceleration, the motor gives the ratio times its torque; what friction, gravity and the
motor's own inertia take stands beside either. Each tells a factor of the sensor where enough of it is found in the
torque and in nothing else, and both have to agree.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hdfast.checks import Floats
from hdfast.health import torque_sign
from hdfast.health.finding import WARNING
from hdfast.health.motion import Motion, as_acceleration
from hdfast.health.subject import Subject

NAME = "output_torque"
FEWEST = 100
EXPLAINED, WORTH_TELLING = 0.5, 0.1
WITHIN = 0.3  # of a power of ten: a factor of 2
ALONE = 3  # powers of ten that need no second witness: a ratio that is not stated may be 10 or 100
STEPS, SHARE = 10.0, 0.02
UNITS = {2: " (N cm?)", 3: " (N mm or mN m?)", -2: " (at the motor?)", -3: " (kN m?)"}


def check(subject: Subject) -> None:
    """Do not use a torque that stays while the load accelerates, or one of another sign or unit."""
    if NAME not in subject.checked or not subject.ratio or subject.rejected:
        return
    motion = subject.motion
    if motion.moving.sum() < FEWEST:
        return
    values = subject.checked[NAME]
    sentence = _dead(subject, values[np.isfinite(values)])
    if not sentence:
        smooth = as_acceleration(subject.on_grid(NAME), round(motion.width / motion.step))
        sentence = _told(_factors(subject, motion, smooth))
    if sentence:
        subject.find(NAME, WARNING, f"{sentence}; the column is not used")
        subject.drop(NAME)


def _acceleration(motion: Motion, ratio: float) -> Floats:
    return motion.acceleration / ratio if motion.load_acceleration is None else motion.load_acceleration


def _dead(subject: Subject, values: Floats) -> str:
    """What is said of a torque that stays although the load's inertia takes much of what the motor gives."""
    motion, inertia = subject.motion, subject.campaign.drive.values.get("J_l", 0.0)
    step = subject.facts.resolution.get(NAME, 0.0)
    if np.ptp(values) > step:
        return ""
    rates = _acceleration(motion, subject.ratio or 1.0)[motion.valid]
    needed = inertia * float(np.ptp(np.quantile(rates, [0.05, 0.95])))
    given = abs(subject.ratio or 1.0) * float(np.max(np.abs(motion.torque[motion.valid])))
    if needed < max(STEPS * step, SHARE * given):
        return ""
    return f"output_torque stays at {values[0]:.4g} N m while the load takes {needed:.3g} N m: a dead channel"


def _factors(subject: Subject, motion: Motion, torque: Floats) -> list[float]:
    """What the torque (m,) is times what it should be, by the load's inertia and by the motor's torque."""
    ratio, inertia = subject.ratio or 1.0, subject.campaign.drive.values.get("J_l", 0.0)
    used = motion.moving
    speed = motion.speed / np.max(np.abs(motion.speed[used]))
    drag = [np.ones_like(speed), speed, motion.direction]
    output = motion.angle / ratio if motion.load_angle is None else motion.load_angle
    held = [output, np.cos(output), np.sin(output)]
    outside = motion.load_torque if motion.load_torque is not None else np.zeros_like(torque)
    accelerated = inertia * _acceleration(motion, ratio)
    found = [own_factor(torque - outside, accelerated, [*drag, *held], used)] if inertia > 0.0 else []
    if not any(finding.check in (torque_sign.NAME, "units") for finding in subject.findings):
        found.append(own_factor(torque, ratio * motion.torque, [*drag, motion.acceleration], used))
    return [factor for factor in found if factor]


def own_factor(values: Floats, part: Floats, others: Sequence[Floats], used: np.ndarray) -> float:
    """Factor of a part (m,) in values (m,) beside others; 0 where too little of it is its own."""
    basis = np.column_stack(others)[used]
    basis = basis / np.linalg.norm(basis, axis=0).clip(min=1e-300)
    own, rest = (x - basis @ np.linalg.lstsq(basis, x, rcond=1e-9)[0] for x in (part[used], values[used]))
    power = float(own @ own)
    factor = float(own @ rest) / power if power > 0.0 else 0.0
    explained = factor**2 * power
    enough = explained > EXPLAINED * float(rest @ rest) and explained > WORTH_TELLING**2 * float(
        np.sum((values[used] - values[used].mean()) ** 2)
    )
    return factor if enough else 0.0


def _told(factors: Sequence[float]) -> str:
    """What is said of factors that agree on another sign or power of ten."""
    if not factors or min(factors) * max(factors) < 0.0:
        return ""
    sizes = [math.log10(abs(factor)) for factor in factors]
    power = round(sizes[0])
    if max(abs(size - power) for size in sizes) > WITHIN or (0 < abs(power) < ALONE and len(factors) == 1):
        return ""
    relative = f"output_torque is {factors[0]:.3g} times what moves the load"
    if power:
        sign = "-" if factors[0] < 0.0 else ""
        return f"{relative}{UNITS.get(power, '')}: scale = {sign}1e{-power} in [columns] output_torque"
    return f"{relative}: flip the sign of scale in [columns] output_torque" if factors[0] < 0.0 else ""
