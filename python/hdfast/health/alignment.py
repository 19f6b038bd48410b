"""Load side against motor side: gear ratio, sign, lag and clock, from one regression on the angles.

With motor angle th and speed w and the acceleration a of the load, the load angle follows

    load = const + (1 + rho) th / i - tau w / i - eps t w / i + b a + kinematic error,

rho the error of the ratio, tau the lag, eps the drift of one clock against the other; b takes up the windup under
inertia. The kinematic error is a series of the stated orders and of 1, 2 and 4, the orders of two lobes. Deviations
come from sums over blocks, because neighbouring residuals are alike, and are never below the residual's own range: what
moves the load angle by less than that cannot be told from what the regression leaves out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

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


def slope(motion: Motion) -> float:
    """Load angle over motor angle by least squares; 0 when the motor did not turn."""
    assert motion.load_angle is not None
    th, load = motion.angle[motion.valid], motion.load_angle[motion.valid]
    turned = th - th.mean()
    power = float(turned @ turned)
    return float(turned @ (load - load.mean())) / power if power > 0.0 else 0.0


def align(motion: Motion, ratio: float, orders: Iterable[float] = ()) -> Alignment | None:
    """Estimate ratio, lag and clock drift from the samples that move; None when there are too few.

    Args:
        motion: the recording; it needs a load angle.
        ratio: nominal gear ratio.
        orders: stated orders of the kinematic error, cycles per motor revolution.
    """
    assert motion.load_angle is not None
    assert motion.load_acceleration is not None
    used = motion.moving & (np.arange(len(motion.t)) % max(1, round(motion.width / motion.step / PER_WINDOW)) == 0)
    if used.sum() < FEWEST:
        return None
    t = motion.t - motion.t.mean()
    w = motion.speed / ratio
    revolutions = float(np.ptp(motion.angle[used])) / (2.0 * np.pi)
    told = [order for order in sorted({*LOBES, *orders}) if order * revolutions > FEWEST_CYCLES]
    waves = [wave(order * motion.angle) for order in told for wave in (np.cos, np.sin)]
    parts = [np.ones_like(t), motion.angle / ratio, -w, -t * w, *waves]
    basis = np.column_stack(parts)
    lag = coarse_lag(motion)
    for _ in range(ROUNDS):
        moments = motion.t + lag
        inside = used & (moments >= motion.t[0]) & (moments <= motion.t[-1])
        if inside.sum() < FEWEST:
            return None
        shifted = np.interp(moments[inside], motion.t, motion.load_angle)
        windup = np.interp(moments[inside], motion.t, motion.load_acceleration)
        columns = np.column_stack([basis[inside], windup])
        found, errors = block_regression(columns, shifted)
        lag += float(np.clip(found[2], -0.1, 0.1))
        if abs(found[2]) < SETTLED:
            break
    remainder = float(np.ptp(shifted - columns @ found))
    errors = np.maximum(errors, remainder / SIGMAS / np.maximum(own_range(columns, 4), 1e-30))
    return Alignment(found[1], errors[1], lag, errors[2], found[3], errors[3])


def own_range(basis: Floats, count: int) -> Floats:
    """Range of what each of the first columns has that no other column has."""
    ranges = np.zeros(count)
    for column in range(1, count):
        others = np.delete(basis, column, axis=1)
        rest, *_ = np.linalg.lstsq(others, basis[:, column], rcond=None)
        ranges[column] = np.ptp(basis[:, column] - others @ rest)
    return np.pad(ranges, (0, basis.shape[1] - count))


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
