"""The speed reference against the motor's speed: its sign and its unit."""

from __future__ import annotations

import math

import numpy as np

from hdfast.health.finding import REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.health.units import DEGREES, NAME, explained

RPM = 30.0 / math.pi
FEWEST = 20
OPPOSITE, CLOSE = -0.9, 0.1


def check(subject: Subject) -> None:
    """Reject a reference that runs against the motor; suggest another unit."""
    if "speed_reference" not in subject.checked:
        return
    motion = subject.motion
    if np.isfinite(subject.checked["speed_reference"]).sum() < 2:
        return
    asked = subject.on_grid("speed_reference")
    used = motion.moving & (np.abs(asked) > 0.1 * np.max(np.abs(asked)))
    if used.sum() < FEWEST:
        return
    asked, speed = asked[used], motion.speed[used]
    wanted, share = asked / np.max(np.abs(asked)), speed / np.max(np.abs(speed))
    relative = float(np.sum(asked * share) / np.sum(speed * share))
    hint = explained(abs(relative), _reasons(subject.ratio))
    alike = float(wanted @ share / np.linalg.norm(wanted) / np.linalg.norm(share))
    if alike < OPPOSITE and (hint or abs(math.log(-relative)) < CLOSE):
        sentence = (
            f"speed_reference is {relative:.4g} times the motor speed and runs against it: flip the sign of scale in "
            "[columns] speed_reference"
        )
        subject.find("reference", REJECT, sentence, value=alike, limit=OPPOSITE)
    elif hint:
        sentence = f"speed_reference is {relative:.4g} times the motor speed; {hint} in [columns] speed_reference"
        subject.find(NAME, WARNING, sentence, value=relative)


def _reasons(ratio: float | None) -> dict[float, str]:
    """What makes a reference so many times the motor's speed."""
    reasons = {
        DEGREES: "speed_reference looks like deg/s: scale = 0.0174533",
        RPM: "speed_reference looks like r/min: scale = 0.1047198",
    }
    if ratio:
        reasons[1.0 / abs(ratio)] = "speed_reference looks like the speed of the output: scale = ratio"
        reasons[RPM / abs(ratio)] = "speed_reference looks like r/min of the output: scale = 0.1047198 ratio"
    return reasons
