"""Friction over inertia from coasting to rest without motor torque."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.identify.coast_law import coast
from hdfast.identify.coasts import Coast, coasts
from hdfast.identify.estimate import Estimate, Estimates, estimate
from hdfast.identify.fit import Fit
from hdfast.identify.left_out import coulomb, negative, negative_text
from hdfast.identify.nonlinear import fit
from hdfast.identify.reading import gather

MISFIT = 3.0  # residual of a law that holds, in standard deviations of the angle


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

    The angle is fitted, not its derivatives: rounding noise stays where it is. Coasts in both directions have an `a`
    each. Coasting yields friction over inertia only; `inertia`, known from an added disc or a known torque, turns it
    into torque. A law that the angles do not follow is noted.

    Args:
        recordings: coasts without motor torque; each needs t and motor_angle and begins in motion. Constant speed
            before the motor is switched off is left out. The median of a motor_torque from there until rest is, but for
            three standard errors, at most a fifth of the torque that slows the drive, or 0.02 N m without `inertia`.
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
    notes = [f"{item.name}: {note}" for item in listed for note in item.notes]
    runs = coasts(listed, j_total, notes)
    directions = sorted({run.direction for run in runs}, reverse=True)
    names = ["_forward", "_backward"] if len(directions) == 2 else [""]
    start = [_first_guess(run.t, run.angle) for run in runs]
    fastest = max(speed for _, speed in start)
    decay = 0.5 / max(float(run.t[-1]) for run in runs)
    first = [*(fastest * decay for _ in names), decay, *([0.1 * decay / fastest**2] if cubic else [])]
    count, b = len(first), len(names)

    def laws(values: Floats) -> list[tuple[float, float, float]]:
        a = dict(zip(directions, values.tolist(), strict=False))
        return [(a[run.direction], float(values[b]), float(values[b + 1]) if cubic else 0.0) for run in runs]

    def residuals(values: Floats) -> list[Floats]:
        begins = values[count:].reshape(-1, 2)
        return [
            run.angle - begin - coast(run.t, float(speed), law)
            for run, (begin, speed), law in zip(runs, begins, laws(values), strict=True)
        ]

    found = fit(
        lambda values: np.concatenate(residuals(values)), [*first, *(value for pair in start for value in pair)]
    )

    def listed_as(quantities: list[tuple[str, str]], scale: float = 1.0) -> list[Estimate]:
        return [
            estimate(name, found.values[j] * scale, unit, found.sigma[j] * scale, found.freedom)
            for j, (name, unit) in enumerate(quantities)
        ]

    over = [*((f"T_c_over_J{name}", "rad/s^2") for name in names), ("B_over_J", "1/s"), ("b3_over_J", "s/rad^2")]
    estimates = listed_as(over[:count])
    if b == 1:
        notes.append("one direction only: asymmetry is not known")
    sections: dict[str, Any] = {}
    decided: set[str] = set()
    if j_total is None:
        notes += [f"{negative_text(item)}: was the motor driven?" for item in estimates if negative(item)]
        notes.append("inertia is not given: friction is known over inertia only, and the model file holds nothing new")
    else:
        estimates += listed_as([*((f"T_c{name}", "N m") for name in names), ("B", "N m s/rad")], j_total)
        sections["drive"] = _share(estimates[-1], base, i, notes)
        sections["terms"], decided = coulomb(estimates[-1 - b : -1], notes)
    notes.append(f"angle residual {np.std(found.residuals):.3g} rad rms over {len(runs)} coasts")
    notes += _misfit(runs, residuals(found.values), cubic)
    return Fit(
        "coastdown",
        "Friction from coasting to rest",
        Estimates(estimates),
        sections,
        notes,
        {"residual_rms": float(np.std(found.residuals)), "speeds": [pair[1] for pair in start]},
        {},
        {
            "runs": [(run.t, run.angle) for run in runs],
            "laws": laws(found.values),
            "starts": list(found.values[count:].reshape(-1, 2)),
        },
        {
            "t": ("s", np.concatenate([run.t for run in runs])),
            "motor_angle": ("rad", np.concatenate([run.angle for run in runs])),
            "residual": ("rad", found.residuals),
        },
        base or {},
        source,
        decided,
    )


def _misfit(runs: list[Coast], residuals: list[Floats], cubic: bool) -> list[str]:
    """A note where the angle misses the law by more than its noise, one for all; a millionth of the way is rounding."""
    noise = max(max(run.noise, 1e-6 * float(run.angle[-1])) for run in runs)
    sizes = [float(np.std(values)) / noise for values in residuals]
    worst = int(np.argmax(sizes))
    if sizes[worst] <= MISFIT:
        return []
    return [
        f"the law does not hold for {sum(size > MISFIT for size in sizes)} of {len(runs)} coasts: {runs[worst].name} "
        f"misses it by {np.std(residuals[worst]):.2g} rad rms, {sizes[worst]:.1f} times the noise of motor_angle "
        f"(allowed: {MISFIT:g} times), and numbers may be off by more than their intervals: did it begin before the "
        f"motor was switched off, or does its angle jump?{'' if cubic else ' Else fit cubic as well'}"
    ]


def _first_guess(t: Floats, angle: Floats) -> tuple[float, float]:
    near = max(6, len(t) // 10)
    line = np.polyfit(t[:near], angle[:near], 2)
    return max(abs(float(line[2])), 1e-3), max(float(line[1]), float(angle[-1] / t[-1]))


def _share(seen: Estimate, base: Mapping[str, Any] | None, ratio: float | None, notes: list[str]) -> dict[str, Any]:
    from hdfast.identify.friction import viscous_share

    if ratio is None:
        notes += [f"no viscous damping: {negative_text(seen)}"] if negative(seen) else []
        notes.append("ratio is not given: the model file holds nothing new")
        return {}
    return viscous_share(seen, base, ratio, notes)
