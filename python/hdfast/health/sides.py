"""Ratio, sign and clock of the load side."""

from __future__ import annotations

import math

import numpy as np

from hdfast.checks import Floats
from hdfast.health.alignment import HALF_TURN, SIGMAS, Alignment, align, slope
from hdfast.health.finding import NOTE, REJECT, WARNING
from hdfast.health.subject import Subject
from hdfast.health.units import near_unit

SMALLEST_TRAVEL, DEAD = 0.02, 1e-9
LEAST_ARC = 0.3  # over less of it the windup under gravity or a spring may be in proportion to the angle [rad]
RATIO_OFF, RATIO_CANDIDATE = 0.02, 1e-4
WINDUP = 0.01  # more than any strain-wave gear winds up [rad]
LATE, LATE_CANDIDATE = 0.05, 5e-4
SKEW = 2e-5


def check(subject: Subject) -> None:
    """Compare load and motor angle wherever the motor turned far enough to wind up the gear many times over."""
    motion, ratio = subject.motion, subject.ratio
    if motion.load_angle is None or not motion.valid.any():
        return
    load = motion.load_angle[motion.valid]
    found = slope(motion.angle[motion.valid], load)
    travel = float(np.ptp(motion.angle[motion.valid]))
    if found != 0.0 and abs(found) * travel > SMALLEST_TRAVEL:
        subject.facts.ratio = 1.0 / found
    if ratio is None:
        _unstated(subject, travel)
        return
    turned = max(travel, float(np.ptp(load))) / abs(ratio)
    if turned < SMALLEST_TRAVEL:
        return
    dead = still(load, travel, subject.facts.resolution.get("load_angle", 0.0))
    if dead:
        subject.find("ratio", WARNING, dead, value=0.0, limit=RATIO_OFF)
        return
    apart = unlike(found * ratio, ratio, turned)
    if apart:
        subject.find("ratio", REJECT, apart, value=found * ratio - 1.0, limit=RATIO_OFF)
        return
    alignment = align(motion, ratio, subject.campaign.orders)
    if alignment is not None:
        _ratio(subject, alignment, ratio, turned)
        _clock(subject, alignment, turned)


def _unstated(subject: Subject, travel: float) -> None:
    """Name the ratio that the angles give where none is stated, and reject where the default drive has another."""
    seen, taken = subject.facts.ratio, subject.campaign.priors["ratio"].value
    if seen is None:
        return
    other = abs(taken / seen - 1.0) > max(RATIO_OFF, WINDUP * abs(taken) / travel)
    remedy = f", and {taken:g} would be taken: state ratio in [drive]" if other else ""
    sentence = f"the angles give a ratio of {seen:.6g}; [drive] states none{remedy}"
    subject.find("ratio", REJECT if other else NOTE, sentence, value=seen)


def still(load: Floats, travel: float, resolution: float = 0.0) -> str:
    """What is said of a load angle (n,) that stays while the motor turns [rad]; nothing of others."""
    if np.ptp(load) > max(resolution, DEAD * travel):
        return ""
    return f"load_angle stays while the motor turns by {travel:.4g} rad: a locked output or a dead channel"


def unlike(relative: float, ratio: float, travel: float) -> str:
    """What is said of a load that moves `relative` times as far as the motor over the ratio; nothing of windup.

    Args:
        relative: slope of the load angle against the motor angle, times the ratio.
        ratio: nominal gear ratio.
        travel: of the motor, at the output [rad].
    """
    if abs(relative - 1.0) <= max(RATIO_OFF, WINDUP / travel):
        return ""
    if relative < 0.0 and abs(relative + 1.0) <= RATIO_OFF:
        return "load_angle turns against motor_angle; flip the sign of scale in [columns] load_angle or motor_angle"
    hint = near_unit(abs(relative), ratio) or "check ratio and the scales in [columns]"
    return f"load_angle moves {relative:.5g} times as far as motor_angle / ratio; {hint}"


def _ratio(subject: Subject, found: Alignment, ratio: float, travel: float) -> None:
    """Name another ratio than the stated one, where the output turned far enough [rad] to tell."""
    off = found.slope - 1.0
    if travel < LEAST_ARC or abs(off) < max(RATIO_CANDIDATE, SIGMAS * found.slope_error):
        return
    seen = ratio / found.slope
    whole = round(seen)
    other = (
        f" (a gear of {whole} : 1 with another member fixed?)" if abs(seen - whole) < 0.05 and whole != ratio else ""
    )
    alike = _alike("one turn") if travel < 2.0 * math.pi else ""
    sentence = f"the angles give a ratio of {seen:.6g} against {ratio:g}{other}; ratio_error is a candidate{alike}"
    subject.find("ratio", WARNING, sentence, value=off, limit=RATIO_CANDIDATE)


def _alike(travel: str) -> str:
    """What else is named that depends on the angle of the output, where that turns by less."""
    return f"; so are encoder_eccentricity and gravity_unbalance within {travel}"


def _clock(subject: Subject, found: Alignment, travel: float) -> None:
    """Name a lag of the load side's clock, and its growth, where the output turned this far [rad]."""
    if not math.isfinite(found.lag_error) or found.lag_error > LATE:
        return
    subject.facts.lag_s = found.lag
    late = found.lag - subject.stated_lag("load_angle")
    if abs(late) > LATE and abs(late) > SIGMAS * found.lag_error:
        sentence = (
            f"load_angle lags motor_angle by {1e3 * found.lag:.3g} ms; shift one of them, or record both on one clock"
        )
        subject.find("clock", REJECT, sentence, value=late, limit=LATE)
    elif abs(late) > max(LATE_CANDIDATE, 0.5 / subject.facts.rate_hz, SIGMAS * found.lag_error):
        sentence = f"load_angle lags motor_angle by {1e3 * found.lag:.3g} ms; delay and sensor_delay are candidates"
        subject.find("clock", WARNING, sentence, value=late, limit=LATE_CANDIDATE)
    if abs(found.drift) > max(SKEW, SIGMAS * found.drift_error):
        alike = _alike("half a turn") if travel < HALF_TURN else ""
        sentence = f"the lag of load_angle grows by {1e6 * found.drift:.3g} us per second; clock_skew is a candidate"
        subject.find("clock", WARNING, f"{sentence}{alike}", value=found.drift, limit=SKEW)
