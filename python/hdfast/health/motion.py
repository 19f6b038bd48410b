"""Angles, speeds, accelerations and torques of a recording, smoothed alike on an even grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.recordings import Recording

SMOOTHING = 0.04
FEWEST = 7
MOST = 200_000
ENDS = 4
CREEP = 0.03  # of the largest speed


@dataclass(frozen=True)
class Motion:
    """Arrays (m,) on an even grid.

    Attributes:
        t: time [s].
        angle, speed, acceleration: of the motor [rad, rad/s, rad/s^2].
        load_angle, load_acceleration: [rad, rad/s^2], or None.
        load_torque: recorded torque on the load [N m], or None unless it is known throughout.
        torque: motor torque [N m], through the filter that the acceleration has gone through.
        valid: no gap and no missing sample within the smoothing window.
        width: smoothing window [s].
    """

    t: Floats
    angle: Floats
    speed: Floats
    acceleration: Floats
    load_angle: Floats | None
    load_acceleration: Floats | None
    load_torque: Floats | None
    torque: Floats
    valid: NDArray[np.bool_]
    width: float

    @classmethod
    def of(cls, recording: Recording, rate: float) -> Motion:
        """Resample a recording at its own rate and smooth it with a local quadratic.

        The load angle takes part where enough of its samples have an angle and a torque of the motor beside them.
        """
        t = recording["t"]
        span = float(t[-1] - t[0])
        size = int(np.clip(round(span * rate) + 1, FEWEST, MOST))
        grid = np.linspace(t[0], t[-1], size)
        step = span / (size - 1)
        half = max(FEWEST // 2, round(SMOOTHING / step / 2.0))
        window = min(2 * half + 1, size if size % 2 else size - 1)
        known = np.isfinite(recording["motor_angle"]) & np.isfinite(recording["motor_torque"])
        both = known & np.isfinite(recording["load_angle"]) if "load_angle" in recording else np.zeros_like(known)
        loaded = both.sum() >= FEWEST
        known = both if loaded else known
        told = "load_torque" in recording and bool(np.isfinite(recording["load_torque"][known]).all())
        moments = t[known]
        around = np.searchsorted(moments, grid)
        before, after = moments[np.maximum(around - 1, 0)], moments[np.minimum(around, len(moments) - 1)]
        outside = np.maximum(moments[0] - grid, grid - moments[-1])
        bridged = np.maximum(after - before, outside) > 2.5 * step
        valid = ~(np.convolve(bridged, np.ones(window), "same") > 0.5)

        if size > ENDS * window:
            valid[: window // 2] = valid[-(window // 2) :] = False

        def even(name: str) -> Floats:
            return np.interp(grid, moments, recording[name][known])

        def smooth(name: str, derivative: int = 0) -> Floats:
            return np.asarray(
                scipy.signal.savgol_filter(even(name), window, 2, deriv=derivative, delta=step), dtype=np.float64
            )

        return cls(
            grid,
            smooth("motor_angle"),
            smooth("motor_angle", 1),
            smooth("motor_angle", 2),
            smooth("load_angle") if loaded else None,
            smooth("load_angle", 2) if loaded else None,
            smooth("load_torque") if told else None,
            as_acceleration(even("motor_torque"), window),
            valid,
            window * step,
        )

    @property
    def step(self) -> float:
        """Step of the grid [s]."""
        return float(self.t[1] - self.t[0])

    @property
    def direction(self) -> Floats:
        """Direction of motion, -1 to 1, smooth where it creeps, shape (m,)."""
        largest = float(np.max(np.abs(self.speed[self.valid]), initial=0.0))
        return np.tanh(self.speed / (CREEP * largest))

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Where the motor turns faster than a fiftieth of its largest speed."""
        return np.asarray(self.valid & (np.abs(self.speed) > 0.02 * np.max(np.abs(self.speed))))


def as_acceleration(values: Floats, window: int) -> Floats:
    """Values (m,) smoothed as the second derivative of a local quadratic smooths an acceleration.

    Its coefficients are second differences of positive weights with the sum 1; with these, the torque of a rigid body
    stays in proportion to its acceleration whatever the step.
    """
    weights = np.cumsum(np.cumsum(scipy.signal.savgol_coeffs(window, 2, deriv=2)))[:-2]
    return np.asarray(scipy.ndimage.correlate1d(values, weights / weights.sum(), mode="nearest"), dtype=np.float64)
