"""Angles, speeds, accelerations and torques of a recording, smoothed alike on an even grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from hdfast.checks import Floats
from hdfast.recordings import Recording

SMOOTHING = 0.04
FEWEST = 7
MOST = 200_000


@dataclass(frozen=True)
class Motion:
    """Arrays (m,) on an even grid.

    Attributes:
        t: time [s].
        angle, speed, acceleration: of the motor [rad, rad/s, rad/s^2].
        load_angle: [rad], or None.
        torque: motor torque [N m].
        valid: no gap and no missing sample within the smoothing window.
        width: smoothing window [s].
    """

    t: Floats
    angle: Floats
    speed: Floats
    acceleration: Floats
    load_angle: Floats | None
    torque: Floats
    valid: NDArray[np.bool_]
    width: float

    @classmethod
    def of(cls, recording: Recording, rate: float) -> Motion:
        """Resample a recording at its own rate and smooth it with a local quadratic."""
        t = recording["t"]
        span = float(t[-1] - t[0])
        size = int(np.clip(round(span * rate) + 1, FEWEST, MOST))
        grid = np.linspace(t[0], t[-1], size)
        step = span / (size - 1)
        half = max(FEWEST // 2, round(SMOOTHING / step / 2.0))
        window = min(2 * half + 1, size if size % 2 else size - 1)
        used = ["motor_angle", "motor_torque", *(["load_angle"] if "load_angle" in recording else [])]
        known = np.logical_and.reduce([np.isfinite(recording[name]) for name in used])
        moments = t[known]
        around = np.searchsorted(moments, grid)
        before, after = moments[np.maximum(around - 1, 0)], moments[np.minimum(around, len(moments) - 1)]
        bridged = (after - before) > 2.5 * step
        valid = ~(np.convolve(bridged, np.ones(window), "same") > 0.5)

        def smooth(name: str, derivative: int = 0) -> Floats:
            even = np.interp(grid, moments, recording[name][known])
            return np.asarray(savgol_filter(even, window, 2, deriv=derivative, delta=step), dtype=np.float64)

        return cls(
            grid,
            smooth("motor_angle"),
            smooth("motor_angle", 1),
            smooth("motor_angle", 2),
            smooth("load_angle") if "load_angle" in recording else None,
            smooth("motor_torque"),
            valid,
            window * step,
        )

    @property
    def step(self) -> float:
        """Step of the grid [s]."""
        return float(self.t[1] - self.t[0])

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Where the motor turns faster than a fiftieth of its largest speed."""
        return np.asarray(self.valid & (np.abs(self.speed) > 0.02 * np.max(np.abs(self.speed))))
