"""Units: amplitudes that are off by 57.3, 9.55, a thousand, the ratio or its inverse."""

from __future__ import annotations

import math

import numpy as np

from hdfast.health.finding import REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.recordings import COLUMNS
from hdfast.recordings.units import correction, factor

NAME = "units"
DEGREES = 180.0 / math.pi
CLOSE = 0.03
CLOSE_INERTIA = 0.15
FASTEST = 2000.0
SLOWEST_RATE, FASTEST_RATE = 5.0, 1e6
HOTTEST = 200.0  # no grease serves beyond [degC]
#: Of the inertia that the torque shows: so many times the stated one, and so many of its errors, are no tolerance.
FAR_OFF, SIGMAS = 5.0, 3.0
#: Columns that no replay needs.
ASIDE = ("speed_reference", "temperature")
#: With so many times the stated inertia, as of a time in milliseconds, nothing that is fitted means anything. Far less
#: of it is that of a locked output, stated as a load that hardly moves.
ABSURD = 1e4
LOOK = "look for a scale of motor_torque, motor_angle or t in [columns], or an inertia of [drive], that is far off"


def near_unit(relative: float, ratio: float | None, close: float = CLOSE) -> str:
    """Which mistake explains load angle x ratio over motor angle, as a sentence, or nothing."""
    reasons = {
        DEGREES: "load_angle looks like degrees: scale = 0.0174533 in [columns] load_angle",
        1.0 / DEGREES: "motor_angle looks like degrees: scale = 0.0174533 in [columns] motor_angle",
    }
    if ratio:
        reasons[abs(ratio)] = "both angles look like the same side of the gear: scale one of them by the ratio"
        reasons[ratio**2] = "the two angles look exchanged: name each other's column in [columns]"
    return explained(relative, reasons, close)


def explained(value: float, reasons: dict[float, str], close: float = CLOSE) -> str:
    """The reason whose factor a value is close to; nothing where it is close to 1 or to none."""
    if not value > 0.0 or abs(math.log(value)) < close:
        return ""
    factor = min(reasons, key=lambda known: abs(math.log(value / known)))
    return reasons[factor] if abs(math.log(value / factor)) < close else ""


def check(subject: Subject) -> None:
    """Compare speeds, rates and the inertia felt by the torque with what they should be; suggest, or reject."""
    if _stated(subject):
        return
    _rate(subject)
    speed = subject.motion.speed[subject.motion.valid]
    fastest = float(np.max(np.abs(speed), initial=0.0))
    if fastest > FASTEST:
        sentence = (
            f"the motor reaches {fastest:.4g} rad/s; motor_angle may be in degrees or counts: scale it in [columns]"
        )
        subject.find(NAME, WARNING, sentence, value=fastest, limit=FASTEST)
    _inertia(subject)
    _temperature(subject)


def _stated(subject: Subject) -> bool:
    """Whether the file itself names another unit, of a column without a scale, that a replay cannot be read in."""
    wrong = False
    for name, unit in subject.recording.units.items():
        sentence = correction(name, unit)
        if sentence:
            severity = WARNING if name in ASIDE else REJECT
            subject.find(NAME, severity, sentence, value=factor(unit, COLUMNS[name][0]))
            wrong |= severity == REJECT
    return wrong


def _rate(subject: Subject) -> None:
    rate = subject.facts.rate_hz
    if SLOWEST_RATE <= rate <= FASTEST_RATE:
        return
    sentence = f"{rate:.4g} samples per second; t may not be in seconds: scale it in [columns] t"
    subject.find(NAME, WARNING, sentence, value=rate, limit=SLOWEST_RATE if rate < SLOWEST_RATE else FASTEST_RATE)


def _temperature(subject: Subject) -> None:
    """A temperature whose unit the file does not state."""
    known = subject.known("temperature")
    if not len(known) or "temperature" in subject.recording.units:
        return
    hottest = float(np.max(subject.clean("temperature")[known]))
    if hottest > HOTTEST:
        sentence = (
            f"temperature reaches {hottest:.4g} degC; it may be in kelvin: "
            "convert it to degC in the file, which no scale does"
        )
        subject.find(NAME, WARNING, sentence, value=hottest, limit=HOTTEST)


def _inertia(subject: Subject) -> None:
    fit = subject.rigid
    if fit is None or subject.inertia is None or fit.inertia <= 10.0 * fit.inertia_error:
        return
    relative = fit.inertia / subject.inertia
    reasons = {
        1.0 / DEGREES: "motor_angle may be in degrees",
        DEGREES: "torque or angle may be off by 57.3",
        1e3: "motor_torque may be in mN m: scale = 0.001 in [columns] motor_torque",
        1e6: "t may be in milliseconds: scale = 0.001 in [columns] t",
    }
    if subject.ratio:
        reasons[abs(subject.ratio)] = "motor_torque may be the torque at the output: divide it by the ratio"
        reasons[subject.ratio**2] = "torque and angle may both be those of the output"
        reasons[1.0 / abs(subject.ratio)] = "motor_torque may be divided by the ratio once too often"
    hint = explained(relative, reasons, CLOSE_INERTIA)
    if not hint and relative > 0.0 and abs(math.log(relative)) > _tolerated(subject):
        hint = LOOK
    if hint:
        sentence = f"the torque per acceleration is {relative:.3g} times the stated inertia; {hint}"
        subject.find(NAME, REJECT if relative > ABSURD else WARNING, sentence, value=relative)


def _tolerated(subject: Subject) -> float:
    """How far, as a logarithm, the inertia that the torque shows may be from the stated one."""
    known = subject.campaign.priors["J_m"]
    return math.log(FAR_OFF) + (SIGMAS * known.sigma / known.value if known.value > 0.0 else 0.0)
