"""The benchmark problem: the default gear geometry under a speed profile, every parameter varied by ±10 %."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import hdfast

ORDERS = range(1, 16)
VARIED = ("J_m", "J_l", "B_m", "B_l", "B_ml", "B_sp", "k1", "k3", "k5", "te_scale")
COLUMNS = (*VARIED, "omega_set")
NOMINAL = {
    "ratio": 121.0,
    "J_m": 2.5e-4,
    "J_l": 0.6,
    "B_m": 1.5e-3,
    "B_l": 0.3,
    "B_ml": 2e-4,
    "s": 1.0,
    "B_sp": 12.0,
    "k1": 3.1e4,
    "k2": 0.0,
    "k3": 4.0e9,
    "k4": 0.0,
    "k5": -1.0e14,
    "phi_max": 4.5e-3,
    "te_scale": 1.0,
}
K_P, K_I = 0.05, 0.8
CORNERS = (0.0, 0.5, 2.0, 2.5, 3.0)
RMS_WINDOW = (1.0, 2.0)


def coefficients() -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine coefficients [rad] of the kinematic error, orders 1 to 15."""
    k = np.arange(1, 16)
    amplitude = np.where(k == 2, 1.5e-4, 0.4e-4)
    return -amplitude * np.cos(1.7 * k) / k**1.2, -amplitude * np.sin(2.3 * k) / k**1.2


def columns(rows: int) -> dict[str, np.ndarray]:
    """The varied columns, and the set speed [rad/s], from one fixed draw."""
    rng = np.random.default_rng(12345)
    drawn = {name: NOMINAL[name] * rng.uniform(0.9, 1.1, rows) for name in VARIED}
    drawn["omega_set"] = rng.uniform(50.0, 300.0, rows) * 2 * np.pi / 60
    return drawn


@cache
def constants() -> dict[str, float]:
    """The parameters that all rows share."""
    cosines, sines = coefficients()
    shared = {name: value for name, value in NOMINAL.items() if name not in VARIED}
    shared |= {f"te_cos_{n}": a for n, a in zip(ORDERS, cosines, strict=True)}
    return shared | {f"te_sin_{n}": b for n, b in zip(ORDERS, sines, strict=True)}


@cache
def scenario() -> hdfast.Scenario:
    """Up in half a second, steady to 2 s, down in half a second, at rest to 3 s."""
    import hdfast

    return hdfast.Scenario.speed_profile(
        t=CORNERS, relative=(0, 1, 1, 0, 0), K_p=K_P, K_i=K_I, tau_max=np.inf, t_off=2.0, run_window=RMS_WINDOW
    )


def sweep(
    rows: dict[str, np.ndarray], metrics: tuple[str, ...] = ("te_rms", "peak_windup"), **options: Any
) -> hdfast.SweepResult:
    """Rows through hdfast."""
    import hdfast

    return hdfast.sweep(constants() | rows, scenario=scenario(), metrics=list(metrics), **options)


def matrix(count: int) -> np.ndarray:
    """As many rows (count, 11) as wanted from one fixed draw, their set speeds spread evenly over its range.

    Few rows cost on average what many do, so a slow solver may be timed on few.
    """
    drawn = columns(8192)
    table = np.column_stack([drawn[name] for name in COLUMNS])
    if count >= len(table):
        return np.tile(table, (-(-count // len(table)), 1))[:count]
    shares = (np.arange(count) + 0.5) * len(table) / count
    chosen = np.argsort(table[:, -1])[shares.astype(int)]
    return table[np.sort(chosen)]
