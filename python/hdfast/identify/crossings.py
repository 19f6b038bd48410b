"""A torque-windup loop as level crossings: the torque at which the windup passes known angles.

A rounded angle is exact only where it changes. The level between two steps of the sensor is therefore an exact
abscissa, and the torque at the crossing, averaged over the samples around it, carries all the error. Regression of
torque on windup is then free of the bias that rounding noise in the abscissa would cause. Where samples are too sparse
for this, they step over levels, rounding errors are small beside their distance, and the samples themselves are taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.identify.angles import refuse_wrapped
from hdfast.recordings import Recording

TORQUES = ("output_torque", "load_torque")
MOST_LEVELS = 600
TURN_SHARE = 0.005  # of the range of torque, on either side of a turning point
ROUNDING = np.sqrt(12.0)  # step over the standard deviation of what rounding to it leaves
DENSE = 5  # samples within a step of the windup


@dataclass(frozen=True, eq=False)
class Crossings:
    """Level crossings of all whole passes of a loop, or their samples in the order of time where these are sparse.

    Attributes:
        windup: level [rad], shape (n,), from an arbitrary zero.
        torque: torque at the crossing [N m], (n,).
        share: samples averaged for it, as a share of those of a full level, (n,).
        direction: +1 while the torque rises, -1 while it falls, (n,).
        passes: number of the pass, (n,).
        spacing: distance of the levels [rad]; of sparse samples that of the samples.
        step: smallest step of the windup [rad].
        sparse: True when the points are the samples.
        reach: (lowest, highest) windup of the loop [rad].
        top: (lowest, highest) torque of the loop [N m].
        turns: torque at the lower and the upper turning points with its standard deviation [N m].
    """

    windup: Floats
    torque: Floats
    share: Floats
    direction: Floats
    passes: NDArray[np.int64]
    spacing: float
    step: float
    sparse: bool
    reach: tuple[float, float]
    top: tuple[float, float]
    turns: tuple[tuple[float, float], tuple[float, float]]

    @property
    def alike(self) -> float:
        """Points that an error may have in common: samples hardly farther apart than a step are rounded alike."""
        return 1.0 + self.step / self.spacing if self.sparse else 1.0


def windup_and_torque(
    recording: Recording, ratio: float | None, notes: list[str]
) -> tuple[Floats, Floats, Floats, str]:
    """Time [s], windup from an arbitrary zero [rad], torque [N m], each (n,), and the name of the torque column.

    Of two torques output_torque is read, unless it is empty and load_torque is not.

    Raises:
        InputError: a column is missing, an angle is wrapped, or the motor turned and the ratio is not known.
    """
    purpose = "a stiffness test"
    torque = max((name for name in TORQUES if name in recording), key=recording.filled, default=TORQUES[-1])
    names = ["t", "load_angle", torque, *recording.optional(notes, "motor_angle")]
    found = dict(zip(names, recording.need(purpose, *names), strict=True))
    refuse_wrapped(recording, "load_angle", "motor_angle", ratio=ratio)
    windup = -(found["load_angle"] - found["load_angle"][0])
    if "motor_angle" in found:
        turned = found["motor_angle"] - found["motor_angle"][0]
        if ratio is not None:
            windup = windup + turned / ratio
        elif np.ptp(turned) > 3.0 * recording.resolution.get("motor_angle", 0.0):
            raise InputError(
                f"{recording.name}: motor_angle moves by {np.ptp(turned):.3g} rad; "
                "give ratio, so that it can be taken off"
            )
    return found["t"], windup, found[torque], torque


def crossings(windup: Floats, torque: Floats, step: float) -> Crossings:
    """Level crossings of the whole passes after the first quarter loop.

    Args:
        windup: (n,) [rad].
        torque: (n,) [N m], slowly up and down.
        step: smallest step of the windup [rad]; 0 for a windup that is as good as continuous.

    Raises:
        InputError: fewer than two whole passes, or a windup that does not grow with the torque.
    """
    bounds = turning_points(torque)
    span = float(np.ptp(torque))
    whole = [(a, b) for a, b in pairwise(bounds[1:]) if abs(torque[b - 1] - torque[a]) > 0.6 * span]
    if len(whole) < 2:
        raise InputError(
            f"the torque makes {len(whole)} whole passes after the first quarter loop "
            "(allowed: at least 2, that is 0, +T, -T, +T)"
        )
    loop = slice(whole[0][0], whole[-1][1])
    inside = windup[loop]
    reach = float(np.ptp(inside))
    if not np.cov(inside, torque[loop])[0, 1] > 0.0:
        raise InputError(
            f"the windup, which moves by {reach:.3g} rad, does not grow with the torque "
            "(allowed: positive torque turns load_angle back; a negative scale turns a column round)"
        )
    noise = float(np.median(np.abs(np.diff(windup, 2)))) / 0.6745 / np.sqrt(6.0)
    sparse = _sparse([windup[a:b] for a, b in whole], max(step if step else ROUNDING * noise, reach / MOST_LEVELS))
    if sparse:
        moved = np.abs(np.concatenate([np.diff(windup[a:b]) for a, b in whole]))
        spacing = float(moved @ moved / np.sum(moved))
        parts = [(windup[a:b], torque[a:b], np.ones(b - a)) for a, b in whole]
    else:
        spacing = max(6.0 * noise, reach / MOST_LEVELS)
        spacing = step * max(1.0, np.ceil(spacing / step)) if step else spacing
        parts = [_pass(windup[a:b], torque[a:b], spacing, step, 4.0 * noise) for a, b in whole]
    signs = [np.sign(torque[b - 1] - torque[a]) for a, b in whole]
    return Crossings(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([part[1] for part in parts]),
        np.concatenate([part[2] for part in parts]),
        np.concatenate([np.full(len(part[0]), sign) for part, sign in zip(parts, signs, strict=True)]),
        np.concatenate([np.full(len(part[0]), index, dtype=np.int64) for index, part in enumerate(parts)]),
        float(spacing),
        step,
        sparse,
        (float(np.min(inside)), float(np.max(inside))),
        (float(np.min(torque)), float(np.max(torque))),
        _turns(torque, sorted({mark for pair in whole for mark in pair} - {len(torque)})),
    )


def _sparse(passes: list[Floats], grain: float) -> bool:
    """Whether most stretches of `grain` [rad] hold few samples of the windup of each pass [rad]."""
    places = [np.round((windup - np.min(windup)) / grain).astype(np.int64) for windup in passes]
    return bool(np.median(np.concatenate([np.bincount(place) for place in places])) < DENSE)


def turning_points(torque: Floats, share: float = 0.1) -> list[int]:
    """Indices where the torque turns by more than `share` of its range, with the first and one past the last."""
    band = share * float(np.ptp(torque))
    marks, best, rising = [0], 0, bool(torque[np.argmax(np.abs(torque - torque[0]) > band)] > torque[0])
    stride = max(1, len(torque) // 20_000)
    for i in range(0, len(torque), stride):
        ahead = torque[i] - torque[best] if rising else torque[best] - torque[i]
        if ahead >= 0.0:
            best = i
        elif -ahead > band:
            marks.append(best)
            best, rising = i, not rising
    return [*marks, len(torque)]


def _turns(torque: Floats, marks: list[int]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Torque at the lower and the upper turning points: where straight lines on both sides of each meet."""
    middle = 0.5 * float(np.min(torque) + np.max(torque))
    noise = float(np.median(np.abs(np.diff(torque, 2)))) / 0.6745 / np.sqrt(6.0)
    near = max(TURN_SHARE * float(np.ptp(torque)), 4.0 * noise)
    sides: tuple[list[tuple[float, float]], ...] = ([], [])
    for mark in marks:
        upper = int(torque[mark] > middle)
        sides[upper].append(_meeting(torque, mark, near, noise))
    mean = [np.mean(side, axis=0) for side in sides]
    return tuple(  # type: ignore[return-value]
        (float(value), float(sigma) / np.sqrt(len(side))) for (value, sigma), side in zip(mean, sides, strict=True)
    )


def _meeting(torque: Floats, mark: int, near: float, noise: float) -> tuple[float, float]:
    lines = []
    for step in (-1, 1):
        end = mark
        while 0 < end < len(torque) - 1 and abs(torque[end] - torque[mark]) < near:
            end += step
        part = np.arange(min(mark, end), max(mark, end) + 1)
        if len(part) < 4:
            return float(torque[mark]), noise
        lines.append(np.polyfit(part - mark, torque[part], 1))
    (a, b), (c, d) = lines
    return float(b + a * (d - b) / (a - c)), float(np.sqrt(2.0 / len(part))) * noise


def _pass(windup: Floats, torque: Floats, spacing: float, step: float, margin: float) -> tuple[Floats, Floats, Floats]:
    direction = 1.0 if torque[-1] > torque[0] else -1.0
    origin = 0.5 * step
    first = np.ceil((float(np.min(windup)) + margin - origin) / spacing)
    last = np.floor((float(np.max(windup)) - margin - origin) / spacing)
    levels = origin + spacing * np.arange(first, last + 1)
    position = np.searchsorted(np.sort(direction * windup), direction * levels)
    gaps = np.abs(np.diff(position)).astype(np.float64) if len(position) > 1 else np.array([2.0])
    local = np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps))[: len(position)]
    width = np.maximum(local, 2.0)
    half = np.minimum(width / 2.0, np.minimum(position, len(torque) - position))
    usable = half >= 1.0
    position, half, width = position[usable], half[usable], width[usable]
    total = np.concatenate([[0.0], np.cumsum(torque)])
    index = np.arange(len(total), dtype=np.float64)
    mean = (np.interp(position + half, index, total) - np.interp(position - half, index, total)) / (2.0 * half)
    return levels[usable], mean, 2.0 * half / width
