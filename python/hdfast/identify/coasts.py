"""Coasts of recordings: from where the motor is switched off until it rests."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.angles import refuse_wrapped
from hdfast.identify.nonlinear import fit
from hdfast.identify.resolution import smallest_step
from hdfast.recordings import Recording

POINTS = 400
REST = 0.02
LEAST_ANGLE = 0.1
LEVEL = 0.02  # N m
SHARE = 0.2  # of what slows the drive: friction would be off by as much
MEDIAN_ERROR = math.sqrt(0.5 * math.pi)  # of normal noise, over that of the mean
LEAST_SAMPLES = 5  # in motion: one coast alone carries the law, its start and its speed
SWITCHES = 40  # moments at which the motor may have been switched off, for a first look
DECAYS = np.array([0.1, 1.0, 3.0, 8.0])  # of speed, over the time after them
LEAST_DECAY = 1e-5  # below it rounding is larger than what a decay changes
MOST_GROWTH = 50.0  # of -decay times time: no coast, and short of overflow
LATE = 0.75  # share of the time after which it is looked at again, with a shorter lead
NEAR = 0.4  # share of the coast in which a cubic friction hardly differs from the law
SURE = 5.0  # standard deviations of the moment
STEADY = 0.5  # deceleration before it over that after it
CURVED = 3  # samples that show a deceleration


@dataclass(frozen=True, eq=False)
class Coast:
    """One coast in motion, thinned to means.

    Attributes:
        name: of the recording.
        t: time from the first sample [s].
        angle: distance travelled [rad].
        direction: +1 or -1.
        noise: standard deviation of a sample of the angle, rounding included [rad].
    """

    name: str
    t: Floats
    angle: Floats
    direction: float
    noise: float


def coasts(recordings: list[Recording], inertia: float | None, notes: list[str]) -> list[Coast]:
    """The coast of every recording; constant speed before it is left out and noted.

    Raises:
        InputError: a column is missing, a recording does not move, is driven or has a wrapped angle.
    """
    return [_of(recording, inertia, notes) for recording in recordings]


def _of(recording: Recording, inertia: float | None, notes: list[str]) -> Coast:
    t, angle = recording.need("a coast-down", "t", "motor_angle")
    refuse_wrapped(recording, "motor_angle")
    direction = float(np.sign(angle[-1] - angle[0]))
    travelled = (angle - angle[0]) * direction
    total = travelled[-1]
    if not total > LEAST_ANGLE:
        raise InputError(f"{recording.name}: the motor turns by {total:.3g} rad (allowed: at least {LEAST_ANGLE})")
    still = np.flatnonzero(travelled > total - REST * min(total, 1.0))
    stop = int(still[0]) + 1
    if stop < LEAST_SAMPLES:
        raise InputError(
            f"{recording.name}: the motor rests after {stop} samples (allowed: at least {LEAST_SAMPLES} in motion)"
        )
    first = _switched_off(t[:stop], travelled[:stop])
    if first:
        notes.append(
            f"{recording.name}: constant speed for {t[first] - t[0]:.3g} s before the coast is left out: the motor was "
            "not yet switched off"
        )
    _refuse_driven(recording, t[first:stop], travelled[first:stop], inertia)
    at, way = _thinned(t[first:stop], travelled[first:stop])
    jitter = float(np.median(np.abs(np.diff(angle[first:stop], 4)))) / 0.6745 / math.sqrt(70.0)
    step = recording.resolution.get("motor_angle") or smallest_step(angle)
    return Coast(recording.name, at, way, direction, math.hypot(jitter, step / math.sqrt(12.0)))


def _thinned(t: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Means over POINTS stretches or more of time and angle, from their first values on."""
    size = max(1, len(t) // POINTS)
    count = len(t) // size
    at, way = (values[: count * size].reshape(count, size).mean(axis=1) for values in (t - t[0], angle - angle[0]))
    return at, way


def _switched_off(t: Floats, angle: Floats) -> int:
    """First sample after a speed that surely was constant before the drive slowed down; 0 where there is none."""
    first = 0
    while len(t) - first > 2 * LEAST_SAMPLES:
        at, way = _thinned(t[first:], angle[first:])
        *_, moment = guess = _bend(at, way)
        if moment <= LATE * at[-1]:
            near = at < moment + NEAR * (at[-1] - moment)
            sure = _sure_bend(at[near], way[near], guess)
            found = int(np.searchsorted(t, t[first] + sure)) if sure else 0
            return found if len(t) - found >= LEAST_SAMPLES else 0
        first = int(np.searchsorted(t, t[first] + 2.0 * moment - at[-1]))
    return 0


def _bend(t: Floats, angle: Floats) -> list[float]:
    """First angle, speed, deceleration, its decay [1/s] and when it sets in [s], from a coarse grid of the last two."""
    tried = {}
    for moment in np.linspace(0.0, 1.0, SWITCHES, endpoint=False)[1:] * t[-1]:
        for decay in DECAYS / (t[-1] - moment):
            columns = np.stack([np.ones_like(t), t, -_lost(t - moment, decay)], axis=1)
            found = np.linalg.lstsq(columns, angle, rcond=None)[0]
            left = angle - columns @ found
            tried[float(left @ left)] = [*found.tolist(), float(decay), float(moment)]
    return tried[min(tried)]


def _lost(after: Floats, decay: float) -> Floats:
    """Way that a deceleration of 1 rad/s^2 costs, if it dies away with the speed's share of the friction."""
    span = float(np.ptp(after))
    decay = decay if abs(decay) > LEAST_DECAY / span else LEAST_DECAY / span
    past = np.maximum(decay * np.maximum(after, 0.0), -MOST_GROWTH)
    return np.asarray((past + np.expm1(-past)) / decay**2)


def _sure_bend(t: Floats, angle: Floats, guess: list[float]) -> float:
    """Time [s] at which a coast surely follows upon constant speed, with a margin; 0 where it does not."""

    def residual(values: Floats) -> Floats:
        begin, speed, deceleration, decay, moment = values
        return np.asarray(angle - begin - speed * t + deceleration * _lost(t - moment, decay))

    if len(t) <= len(guess):
        return 0.0
    found = fit(residual, guess)
    moment, sigma = float(found.values[4]), float(found.sigma[4])
    before = t < moment
    if not moment > SURE * sigma or min(before.sum(), (~before).sum()) < CURVED:
        return 0.0
    lead, coast = (-float(np.polyfit(t[part], angle[part], 2)[0]) for part in (before, ~before))
    return moment + 3.0 * sigma if abs(lead) < STEADY * coast else 0.0


def _refuse_driven(recording: Recording, t: Floats, travelled: Floats, inertia: float | None) -> None:
    """Refuse a motor torque at a level that its noise does not explain."""
    torque = recording.get("motor_torque", np.full(recording.samples, np.nan))
    torque = torque[(recording["t"] >= t[0]) & (recording["t"] <= t[-1])]
    known = torque[np.isfinite(torque)]
    if not known.size:
        return
    if inertia is None:
        limit, meaning = LEVEL, "without inertia"
    else:
        halfway = float(np.interp(0.5 * (t[0] + t[-1]), t, travelled))
        slowing = 4.0 * (2.0 * halfway - float(travelled[0] + travelled[-1])) / float(t[-1] - t[0]) ** 2
        limit, meaning = SHARE * inertia * max(slowing, 0.0), f"{SHARE:g} of what slows the drive"
    noise = MEDIAN_ERROR * float(np.std(known)) / math.sqrt(known.size)
    level = float(np.median(known))
    if abs(level) > limit + 3.0 * noise:
        raise InputError(
            f"{recording.name}: motor_torque is not near zero, its median is {level:.3g} N m (allowed: up to "
            f"{limit:.3g} N m in size, {meaning}, and {3.0 * noise:.2g} N m for its noise); "
            "a coast-down needs a motor that is switched off"
        )
