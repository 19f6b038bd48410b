"""Load side against motor side: gear ratio, sign, lag and clock, from one regression on the angles.

With motor angle th and speed w the load angle follows

    load = const + (1 + rho) th / i - tau w / i - eps t w / i + kinematic error + windup,

rho the error of the ratio, tau the lag, eps the drift of one clock against the other. The kinematic error is a series
of the stated orders and of 1, 2 and 4, the orders of two lobes. The windup follows the load's acceleration, its known
torque and the direction of motion, and where it turns by half a revolution the sine and cosine of its angle, as under
gravity; an eccentric encoder shows there, too. The acceleration of a swing is in proportion to its angle, and so is its
windup: where the angle has next to nothing of its own, the ratio is not known. Deviations come from sums over blocks,
because neighbouring residuals are alike, and are never below the residual's own range: what moves the load angle by
less than that cannot be told from what the regression leaves out. At constant speed rho and eps are the same; where eps
comes out larger than any clock's, there is taken to be none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.motion import Motion

BLOCKS = 20
ROUNDS = 5
LARGEST_LAG = 0.5
LOBES = (1.0, 2.0, 4.0)
FEWEST, FEWEST_CYCLES = 100, 2.0
SIGMAS = 5.0
PER_WINDOW = 8
SETTLED = 1e-6
LARGEST_DRIFT = 0.01
LEAST_OWN = 0.02  # share of the angle that no other regressor has: 3e-3 and less in swings of one tone
SLOPE, SPEED, DRIFT = 1, 2, 3
HALF_TURN = 3.0  # of the load [rad]

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Alignment:
    """Estimates with their standard errors.

    Attributes:
        slope: load angle over motor angle, times the ratio.
        lag: of the load angle [s].
        drift: change of the lag per second.
    """

    slope: float
    slope_error: float
    lag: float
    lag_error: float
    drift: float
    drift_error: float


def slope(angle: Floats, load: Floats) -> float:
    """Load angle (n,) over motor angle (n,) by least squares; 0 when the motor did not turn."""
    turned = angle - angle.mean()
    power = float(turned @ turned)
    return float(turned @ (load - load.mean())) / power if power > 0.0 else 0.0


def align(motion: Motion, ratio: float, orders: Iterable[float] = ()) -> Alignment | None:
    """Estimate ratio, lag and clock drift from the samples that move; None when there are too few.

    Args:
        motion: the recording; it needs a load angle.
        ratio: nominal gear ratio.
        orders: stated orders of the kinematic error, cycles per motor revolution.
    """
    used = motion.moving & (np.arange(len(motion.t)) % max(1, round(motion.width / motion.step / PER_WINDOW)) == 0)
    if used.sum() < FEWEST:
        return None
    t = motion.t - motion.t.mean()
    w = motion.speed / ratio
    revolutions = float(np.ptp(motion.angle[used])) / (2.0 * np.pi)
    told = [order for order in sorted({*LOBES, *orders}) if order * revolutions > FEWEST_CYCLES]
    waves = [wave(order * motion.angle) for order in told for wave in (np.cos, np.sin)]
    parts = [np.ones_like(t), motion.angle / ratio, -w]
    drifting = _regressed(motion, used, np.column_stack([*parts, -t * w, *waves]))
    if drifting is None or abs(drifting.drift) <= LARGEST_DRIFT:
        return drifting
    steady = _regressed(motion, used, np.column_stack([*parts, np.zeros_like(t), *waves]))
    return None if steady is None else replace(steady, drift_error=math.inf)


def _wound(motion: Motion, used: Mask) -> list[Floats]:
    """What the windup may be in proportion to, each (m,)."""
    assert motion.load_angle is not None
    assert motion.load_acceleration is not None
    found = [motion.load_acceleration, motion.direction]
    if motion.load_torque is not None:
        found.append(motion.load_torque)
    if np.ptp(motion.load_angle[used]) > HALF_TURN:
        found += [np.cos(motion.load_angle), np.sin(motion.load_angle)]
    return found


def _regressed(motion: Motion, used: Mask, basis: Floats) -> Alignment | None:
    """From regressors (m, p) of the motor's time on samples (m,); None with too few of them."""
    assert motion.load_angle is not None
    lag, wound = coarse_lag(motion), _wound(motion, used)
    for _ in range(ROUNDS):
        moments = motion.t + lag
        inside = used & (moments >= motion.t[0]) & (moments <= motion.t[-1])
        if inside.sum() < FEWEST:
            return None
        shifted = np.interp(moments[inside], motion.t, motion.load_angle)
        windup = [np.interp(moments[inside], motion.t, one) for one in wound]
        columns = np.column_stack([basis[inside], *windup])
        found, errors = block_regression(columns, shifted)
        lag += float(np.clip(found[SPEED], -0.1, 0.1))
        if abs(found[SPEED]) < SETTLED:
            break
    left = float(np.ptp(shifted - columns @ found))
    told = [SLOPE, SPEED, DRIFT]
    ranges = np.array([_own_range(columns, column) for column in told])
    errors = np.maximum(errors[told], left / SIGMAS / np.maximum(ranges, 1e-30))
    if ranges[0] < LEAST_OWN * np.ptp(columns[:, SLOPE]):
        errors[0] = math.inf
    return Alignment(found[SLOPE], errors[0], lag, errors[1], found[DRIFT], errors[2])


def _own_range(basis: Floats, column: int) -> float:
    """Range of what a column has that no other column has."""
    others = np.delete(basis, column, axis=1)
    rest, *_ = np.linalg.lstsq(others, basis[:, column], rcond=None)
    return float(np.ptp(basis[:, column] - others @ rest))


def coarse_lag(motion: Motion) -> float:
    """The shift [s] at which the two speeds are most alike, to a sample."""
    assert motion.load_angle is not None
    step = motion.step
    motor, load = (np.gradient(x, step) * motion.valid for x in (motion.angle, motion.load_angle))
    motor, load = motor - motor.mean(), load - load.mean()
    size = 2 * len(motor)
    spectrum = np.fft.rfft(load, size) * np.conj(np.fft.rfft(motor, size))
    score = np.fft.irfft(spectrum, size)
    reach = min(int(LARGEST_LAG / step), len(motor) // 4)
    lags = np.arange(-reach, reach + 1)
    return float(lags[np.argmax(np.abs(score[lags]))]) * step


def block_regression(basis: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Least squares of values (n,) on a basis (n, p): coefficients and standard errors from sums over blocks."""
    scale = np.linalg.norm(basis, axis=0)
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(basis / scale, rcond=1e-9)
    found = inverse @ values
    residual = values - (basis / scale) @ found
    parts = np.array_split(inverse * residual, min(BLOCKS, len(values)), axis=1)
    sums = np.array([part.sum(axis=1) for part in parts])
    blocks, width = len(sums), basis.shape[1]
    spread = np.sqrt(np.sum(sums**2, axis=0) * blocks / max(blocks - width, 1))
    return found / scale, spread / scale
