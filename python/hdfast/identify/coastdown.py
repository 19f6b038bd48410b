"""Friction over inertia from coasting to rest without motor torque."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.angles import refuse_wrapped
from hdfast.identify.estimate import Estimate, Estimates, estimate
from hdfast.identify.fit import Fit
from hdfast.identify.left_out import coulomb
from hdfast.identify.nonlinear import fit
from hdfast.recordings import Recording, gather

POINTS = 400
STEPS = 400
REST = 0.02
LEAST_ANGLE = 0.1
LEVEL = 0.02  # N m
SHARE = 0.2  # of what slows the drive: friction would be off by as much
MEDIAN_ERROR = math.sqrt(0.5 * math.pi)  # of normal noise, over that of the mean
LEAST_SAMPLES = 5  # in motion: one coast alone carries the law, its start and its speed


def coastdown(
    recordings: Any,
    *,
    inertia: float | None = None,
    ratio: float | None = None,
    cubic: bool = False,
    columns: Mapping[str, Any] | None = None,
    base: Mapping[str, Any] | None = None,
    source: str = "",
) -> Fit:
    """Fit the motor angle of every coast with one law: dw/dt = -(a sgn w + b w + c w^3).

    The angle is fitted, not its derivatives: rounding noise stays where it is. Coasting yields friction over inertia
    only; `inertia`, known from an added disc or a known torque, turns it into torque.

    Args:
        recordings: coasts without motor torque; each needs t and motor_angle and begins in motion. The median of a
            motor_torque until rest is, but for three standard errors, at most a fifth of the torque that slows the
            drive, or 0.02 N m without `inertia`.
        inertia: moving inertia at the motor J_m + J_l/ratio^2 [kg m^2].
        ratio: gear ratio, for the model file.
        cubic: fit c as well; it needs fast and slow coasts.
        columns, base, source: as in `stiffness`.

    Raises:
        InputError: a column is missing, a recording does not move, is driven or has a wrapped angle, or an argument is
            out of range.
    """
    j_total = None if inertia is None else checks.positive("inertia", inertia, 1e6, "kg m^2")
    i = None if ratio is None else checks.positive("ratio", ratio, 1e4)
    listed = gather(recordings, columns)
    runs = [_moving(item, j_total) for item in listed]
    start = [_first_guess(t, angle) for t, angle in runs]
    fastest = max(speed for _, speed in start)
    decay = 0.5 / max(float(t[-1]) for t, _ in runs)
    first = [fastest * decay, decay] + ([0.1 * decay / fastest**2] if cubic else [])
    count = len(first)

    def residual(values: Floats) -> Floats:
        law = (values[0], values[1], values[2] if cubic else 0.0)
        parts = [
            angle - values[count + 2 * j] - coast(t, values[count + 2 * j + 1], law)
            for j, (t, angle) in enumerate(runs)
        ]
        return np.concatenate(parts)

    guess = [*first, *(value for pair in start for value in pair)]
    found = fit(residual, guess)
    law = (float(found.values[0]), float(found.values[1]), float(found.values[2]) if cubic else 0.0)
    names = [("T_c_over_J", "rad/s^2"), ("B_over_J", "1/s"), ("b3_over_J", "s/rad^2")][:count]
    estimates = [estimate(n, found.values[j], u, found.sigma[j], found.freedom) for j, (n, u) in enumerate(names)]
    notes = [f"{item.name}: {note}" for item in listed for note in item.notes]
    sections: dict[str, Any] = {}
    decided: set[str] = set()
    if j_total is None:
        notes.append("inertia is not given: friction is known over inertia only, and the model file holds nothing new")
    else:
        for j, (name, unit) in enumerate((("T_c", "N m"), ("B", "N m s/rad"))):
            estimates.append(estimate(name, found.values[j] * j_total, unit, found.sigma[j] * j_total, found.freedom))
        sections["drive"] = _share(estimates[-1], base, i, notes)
        sections["terms"], decided = coulomb(estimates[-2], notes)
    notes.append(f"angle residual {np.std(found.residuals):.3g} rad rms over {len(runs)} coasts")
    return Fit(
        "coastdown",
        "Friction from coasting to rest",
        Estimates(estimates),
        sections,
        notes,
        {"residual_rms": float(np.std(found.residuals)), "speeds": [pair[1] for pair in start]},
        {},
        {
            "runs": runs,
            "law": law,
            "starts": [found.values[count + 2 * j : count + 2 * j + 2] for j in range(len(runs))],
        },
        {
            "t": ("s", np.concatenate([t for t, _ in runs])),
            "motor_angle": ("rad", np.concatenate([angle for _, angle in runs])),
            "residual": ("rad", found.residuals),
        },
        base or {},
        source,
        decided,
    )


def coast(t: Floats, speed: float, law: tuple[float, float, float]) -> Floats:
    """Angle [rad] after coasting for t [s] from a speed [rad/s] > 0 to rest; law = (a, b, c)."""
    a, b, c = law
    speed = max(speed, 1e-9)
    if c == 0.0 and b > 0.0:
        rest = math.log1p(b * speed / a) / b if a > 1e-9 * b * speed else math.inf
        moving = np.minimum(t, rest)
        return np.asarray((speed + a / b) / b * -np.expm1(-b * moving) - a / b * moving)
    return _integrated(t, speed, law)


def _integrated(t: Floats, speed: float, law: tuple[float, float, float]) -> Floats:
    """Runge-Kutta of fourth order on STEPS steps, held at rest."""
    a, b, c = law
    h = float(t[-1]) / STEPS

    def rate(w: float) -> float:
        return -(a + b * w + c * w**3) if w > 0.0 else 0.0

    angle, w, angles, speeds = 0.0, speed, [0.0], [speed]
    for _ in range(STEPS):
        k1 = rate(w)
        k2 = rate(w + 0.5 * h * k1)
        k3 = rate(w + 0.5 * h * k2)
        k4 = rate(w + h * k3)
        angle += h * w + h * h * (k1 + k2 + k3) / 6.0
        w = max(w + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0, 0.0)
        angles.append(angle)
        speeds.append(w)

    return np.asarray(
        scipy.interpolate.CubicHermiteSpline(np.linspace(0.0, float(t[-1]), STEPS + 1), angles, speeds)(t)
    )


def _moving(recording: Recording, inertia: float | None) -> tuple[Floats, Floats]:
    """Time from the first sample and distance travelled until rest, thinned to means."""
    t, angle = recording.need("a coast-down", "t", "motor_angle")
    refuse_wrapped(recording, "motor_angle")
    travelled = (angle - angle[0]) * np.sign(angle[-1] - angle[0])
    total = travelled[-1]
    if not total > LEAST_ANGLE:
        raise InputError(f"{recording.name}: the motor turns by {total:.3g} rad (allowed: at least {LEAST_ANGLE})")
    still = np.flatnonzero(travelled > total - REST * min(total, 1.0))
    stop = int(still[0]) + 1
    if stop < LEAST_SAMPLES:
        raise InputError(
            f"{recording.name}: the motor rests after {stop} samples (allowed: at least {LEAST_SAMPLES} in motion)"
        )
    _refuse_driven(recording, t[:stop], travelled[:stop], inertia)
    size = max(1, stop // POINTS)
    count = stop // size
    means = [values[: count * size].reshape(count, size).mean(axis=1) for values in (t - t[0], travelled)]
    return means[0], means[1]


def _refuse_driven(recording: Recording, t: Floats, travelled: Floats, inertia: float | None) -> None:
    """Refuse a motor torque at a level that its noise does not explain."""
    torque = recording.get("motor_torque", np.full(recording.samples, np.nan))[recording["t"] <= t[-1]]
    known = torque[np.isfinite(torque)]
    if not known.size:
        return
    if inertia is None:
        limit, meaning = LEVEL, "without inertia"
    else:
        halfway = float(np.interp(0.5 * (t[0] + t[-1]), t, travelled))
        slowing = 4.0 * (2.0 * halfway - float(travelled[-1])) / float(t[-1] - t[0]) ** 2
        limit, meaning = SHARE * inertia * max(slowing, 0.0), f"{SHARE:g} of what slows the drive"
    noise = MEDIAN_ERROR * float(np.std(known)) / math.sqrt(known.size)
    level = float(np.median(known))
    if abs(level) > limit + 3.0 * noise:
        raise InputError(
            f"{recording.name}: motor_torque is not near zero, its median is {level:.3g} N m (allowed: up to "
            f"{limit:.3g} N m in size, {meaning}, and {3.0 * noise:.2g} N m for its noise); "
            "a coast-down needs a motor that is switched off"
        )


def _first_guess(t: Floats, angle: Floats) -> tuple[float, float]:
    near = max(6, len(t) // 10)
    line = np.polyfit(t[:near], angle[:near], 2)
    return max(abs(float(line[2])), 1e-3), max(float(line[1]), float(angle[-1] / t[-1]))


def _share(seen: Estimate, base: Mapping[str, Any] | None, ratio: float | None, notes: list[str]) -> dict[str, Any]:
    from hdfast.identify.friction import viscous_share

    if ratio is None:
        notes.append("ratio is not given: the model file holds nothing new")
        return {}
    return viscous_share(seen, base, ratio, notes)
