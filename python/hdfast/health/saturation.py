"""Saturation: samples at a plateau of the motor torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import REJECT, WARNING
from hdfast.health.stretches import stretches
from hdfast.health.subject import Subject

NAME = "saturation"
MOST = 0.3
WORTH_SAYING = 0.005
FLAT = 0.005
AT_LIMIT = 0.99
FEWEST_STAYS, SHORTEST_STAY = 3, 3
FEWEST_LEVELS = 20
CROWDED = 6.0
BEYOND = 1.5
SHOWN, FOLLOWED = 0.2, 0.05


@dataclass(frozen=True)
class Plateau:
    """Where a torque stays at one of its extremes, to a width [N m]: share of samples, number of separate stays."""

    level: float
    share: float
    stays: int
    width: float = 0.0


def check(subject: Subject) -> None:
    """Tell a torque that is cut off from one that was asked to be constant.

    At the stated limit of the controller a plateau is a saturation; far beyond it, torque or limit is wrong. Without a
    stated limit it takes several separate stays at one extreme, other than 0, while the torque between them varies
    freely; for so long that too little is left, they reject unless the torque may have been asked to stay.
    """
    torque = subject.checked["motor_torque"]
    torque = torque[np.isfinite(torque)]
    controller = subject.campaign.controller
    limit = controller.limit if controller is not None else np.inf
    if np.isfinite(limit):
        share = float(np.mean(np.abs(torque) >= AT_LIMIT * limit))
        found = [Plateau(limit, share, 1)] if share else []
        largest = float(np.max(np.abs(torque)))
        if largest > BEYOND * limit > 0.0:
            sentence = (
                f"motor_torque reaches {largest:.4g} N m, {largest / limit:.3g} times the limit of [controller]: "
                "scale it in [columns] motor_torque, or correct limit"
            )
            subject.find(NAME, REJECT if share > MOST else WARNING, sentence, value=largest / limit, limit=BEYOND)
            return
    else:
        found = cut_off(torque, subject.facts.resolution.get("motor_torque", 0.0))
    share = sum(plateau.share for plateau in found)
    if share < WORTH_SAYING:
        return
    level = max(found, key=lambda plateau: plateau.share).level
    subject.facts.saturation = (level, share)
    reject = share > MOST and (bool(np.isfinite(limit)) or not _asked(subject, found))
    if reject:
        remedy = "record with less torque"
    else:
        remedy = "a limit of the drive or of its controller holds it" + (", or it is asked for" if share > MOST else "")
    subject.find(
        NAME,
        REJECT if reject else WARNING,
        f"motor_torque stays at {level:.4g} N m in {100.0 * share:.3g} % of the samples; {remedy}",
        value=share,
        limit=MOST,
    )


def _asked(subject: Subject, found: list[Plateau]) -> bool:
    """Whether a torque may stay because it is asked to: the speed follows its reference, or the motion shows it too.

    A single plateau without a reference is a command as well as a limit.
    """
    motion, fit = subject.motion, subject.rigid
    inside = motion.valid & np.any([np.abs(motion.torque - one.level) < one.width for one in found], axis=0)
    reference = subject.checked.get("speed_reference", np.zeros(0))
    known = np.isfinite(reference)
    if known.any() and np.ptp(reference[known]) > 0.0:
        asked = subject.on_grid("speed_reference")
        return bool(_size((motion.speed - asked)[inside]) <= FOLLOWED * np.ptp(reference[known]))
    if len(found) < 2 or fit is None:
        return True
    return bool(_size(fit.residual[inside]) <= SHOWN * np.std((motion.torque - fit.residual)[motion.valid]))


def _size(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def cut_off(torque: Floats, step: float) -> list[Plateau]:
    """The plateaus at the two extremes of a torque (n,) that look like a cut-off."""
    span = float(np.ptp(torque)) if torque.size else 0.0
    if span == 0.0:
        return []
    noise = 1.4826 * float(np.median(np.abs(np.diff(torque, 2)))) / np.sqrt(6.0)
    width = max(FLAT * span, 1.5 * step, 6.0 * noise)
    between = torque[(torque > np.min(torque) + width) & (torque < np.max(torque) - width)]
    if np.unique(np.round(between / width)).size < FEWEST_LEVELS:
        return []
    found = []
    for side in (1.0, -1.0):
        top = float(np.max(side * torque))
        begins, ends = stretches(side * torque > top - width)
        lengths = ends - begins
        long = lengths[lengths >= SHORTEST_STAY]
        flat = _flat(side * torque, top - width, width)
        off = top - width <= 0.0 <= top
        if long.size >= FEWEST_STAYS and flat and not off:
            found.append(Plateau(side * top, float(long.sum()) / torque.size, int(long.size), width))
    return found


def _flat(torque: Floats, low: float, width: float) -> bool:
    """A cut-off is entered at a slope: samples crowd in the plateau, not in the band of equal width below it."""
    below = float(np.mean((torque > low - width) & (torque <= low)))
    within = float(np.mean(torque > low))
    return within > CROWDED * below
