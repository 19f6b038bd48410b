"""Steps of a channel: its smallest increment against what is stated, and values that are held or missing."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import NOTE, WARNING
from hdfast.health.straight import knots
from hdfast.health.subject import Subject
from hdfast.recordings import clock
from hdfast.recordings.columns import CHANNELS

MEASURED = ("motor_angle", "motor_torque", "load_angle", "output_torque")
FEWEST_CHANGES = 20
LARGEST_COUNT = 1000
OFF_LATTICE = 0.05
LATTICE_SHARE = 0.9
ROUNDED_SHARE = 0.05
DIFFERENT = 1.1
HELD_STEPS = 2.5
HELD_SHARE = 0.5
LONGEST_HOLD = 0.1
REGULAR = 3.0


def resolution(subject: Subject) -> None:
    """Keep the larger of the stated step and the one the values show; say where they differ."""
    for name in CHANNELS:
        if name not in subject.checked:
            continue
        stated = subject.recording.resolution.get(name, 0.0)
        values = subject.checked[name]
        seen = lattice(np.diff(values[np.isfinite(values)]))
        if max(stated, seen) > 0.0:
            subject.facts.resolution[name] = max(stated, seen)
        if stated and seen > DIFFERENT * stated:
            sentence = f"{name} moves in steps of {seen:.4g}, [sensors] states {stated:.4g}; the larger one is used"
            subject.find("resolution", WARNING, sentence, value=seen / stated, limit=DIFFERENT)
        elif stated and seen and seen < stated / DIFFERENT:
            sentence = (
                f"{name} moves in steps of {seen:.4g}, finer than the {stated:.4g} of [sensors]; the larger one is used"
            )
            subject.find("resolution", NOTE, sentence, value=seen / stated, limit=1.0 / DIFFERENT)


def lattice(increments: Floats) -> float:
    """The step of which the increments are whole multiples, 0 when there is none.

    At a few steady speeds increments of a fine sensor are multiples of one another, too, but they hardly differ from
    those beside them, as rounded ones do by whole steps.
    """
    bends = np.abs(np.diff(increments[np.isfinite(increments)], 2))
    size = np.abs(increments[np.isfinite(increments)])
    size = size[size > 0.0]
    if size.size < FEWEST_CHANGES:
        return 0.0
    floor = 1e-9 * float(np.max(size))
    size = size[size > floor]
    step = float(np.min(size))
    near = size[size < LARGEST_COUNT * step]
    if near.size < FEWEST_CHANGES:
        return 0.0
    counts = near / step
    step = float(np.mean(near[counts < 1.5]))
    counts = near / step
    whole = np.round(counts)
    share = float(np.mean(np.abs(counts - whole) < OFF_LATTICE))
    several = size.size < increments.size or np.unique(whole).size > 1
    rounded = np.sum(bends > 0.5 * step) > ROUNDED_SHARE * size.size
    return step if several and rounded and share > LATTICE_SHARE else 0.0


def held(subject: Subject) -> None:
    """Find columns whose values stay the same over several samples and then jump by more than one step.

    One that lines have filled up has as many new values as it had of its own.
    """
    t = subject.checked["t"]
    for name in CHANNELS:
        if name not in subject.checked:
            continue
        subject.facts.effective_rate_hz[name] = rate(subject, name)
        own = own_rate(subject, name)
        if own is not None:
            subject.facts.effective_rate_hz[name] = min(own, subject.facts.effective_rate_hz[name])
            sentence = (
                f"{name} has {own:.4g} samples per second of its own, and straight lines between them at "
                f"{subject.facts.rate_hz:.4g} Hz; nothing faster is compared"
            )
            subject.find("interpolated", NOTE, sentence, value=own, limit=subject.facts.rate_hz)
        period = hold(t, subject.checked[name], subject.facts.resolution.get(name, 0.0))
        if period is None:
            continue
        subject.facts.effective_rate_hz[name] = 1.0 / period
        sentence = (
            f"{name} holds its values for {1e3 * period:.3g} ms: {1.0 / period:.3g} new values per second at "
            f"{subject.facts.rate_hz:.4g} Hz; the hold is not modelled: record it faster, or keep one sample per value"
        )
        subject.find("held_values", WARNING, sentence, value=1.0 / period, limit=subject.facts.rate_hz)


def rate(subject: Subject, name: str) -> float:
    """Numbers per second of a column, below the rate of the clock where a recorder left out every so many samples."""
    known = np.isfinite(subject.checked[name])
    several = known.sum() > 1 and not known.all()
    return 1.0 / clock.period(subject.checked["t"][known]) if several else subject.facts.rate_hz


def own_rate(subject: Subject, name: str) -> float | None:
    """Samples per second that a column had before lines filled it up; None where none did.

    A torque that is commanded may be made of lines.
    """
    told = subject.recording.rates.get(name)
    commanded = name == "motor_torque" and "speed_reference" not in subject.checked
    if told is not None or name not in MEASURED or commanded:
        return told
    return knots(subject.checked["t"], subject.checked[name])


def hold(t: Floats, values: Floats, step: float) -> float | None:
    """The time a column holds its values [s], None when it does not.

    A coarse sensor repeats values too, but then it moves by one step at a time; only larger jumps after repeated
    values count. One that is noisy makes a few of these as well, between more that follow sample by sample.
    """
    known = np.isfinite(values)
    t, values = t[known], values[known]
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    if changes.size < FEWEST_CHANGES + 1:
        return None
    repeats, jumps, lasted = np.diff(changes), np.abs(np.diff(values)[changes[1:] - 1]), np.diff(t[changes])
    large = (jumps > HELD_STEPS * max(step, float(np.min(jumps)))) & (lasted < LONGEST_HOLD)
    paused = large & (repeats > 1)
    few = paused.sum() < max(FEWEST_CHANGES, HELD_SHARE * large.sum())
    if few or np.mean(repeats > 1) < HELD_SHARE:
        return None
    usual = float(np.median(lasted[paused]))
    regular = np.mean((lasted[paused] < REGULAR * usual) & (lasted[paused] > usual / REGULAR))
    return usual if regular > HELD_SHARE else None
