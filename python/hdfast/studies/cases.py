"""The five simple cases in which start, run and stop can be told apart, and one sweep over all of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import spring
from hdfast.checks import Floats
from hdfast.model import Model
from hdfast.params import params
from hdfast.result import SweepResult
from hdfast.scenario import Scenario
from hdfast.scenario_parts import RPM
from hdfast.studies import trends
from hdfast.studies.ring import ring
from hdfast.sweep import sweep

LOADS = (0.5, 2.0, 12.0)
RTOL = 1e-7


@dataclass(frozen=True)
class Case:
    """A scenario with the start state and kinematic error that make one effect visible.

    Attributes:
        key: letter of the analytic trend.
        label: for figures.
        scenario: key of `SCENARIOS`.
        speed_rpm: set speed of the motor [r/min].
        te_scale: factor on the kinematic error.
        zero_angle: start with both angles zero, which pre-winds the spring.
    """

    key: str
    label: str
    scenario: str
    speed_rpm: float
    te_scale: float = 1.0
    zero_angle: bool = False


SCENARIOS = {
    "step": lambda: Scenario.start_stop(speed_rpm=300.0),
    "soft": lambda: Scenario.start_stop(speed_rpm=15.0, torque_ramp=0.5),
    "held": lambda: Scenario.start_stop(speed_rpm=300.0, start="speed_ramp", stop=None, t_off=6.0),
    "brake": lambda: Scenario.start_stop(speed_rpm=100.0, start="speed_ramp", stop="brake"),
    "torque": lambda: Scenario.start_stop(speed_rpm=300.0, torque=0.0388),
}
CASES = {
    "a": Case("a", "(a) torque step, no TE", "step", 300.0, te_scale=0.0),
    "b": Case("b", "(b) released TE", "soft", 15.0, zero_angle=True),
    "c": Case("c", "(c) run, speed held", "held", 300.0),
    "d": Case("d", "(d) coast", "step", 300.0),
    "e": Case("e", "(e) brake", "brake", 100.0),
    "d0": Case("d0", "(d) coast, no TE", "step", 300.0, te_scale=0.0),
    "e0": Case("e0", "(e) brake, no TE", "brake", 100.0, te_scale=0.0),
    "t": Case("t", "torque kept", "torque", 300.0),
}
EVERY = ("a", "b", "c", "d", "d0", "e", "e0")
RING = ("brake_frequency", "brake_decay", "brake_amplitude")
BRAKE_OFF = 3.0
METRICS = (
    "steady_speed",
    "rise_time",
    "stop_time",
    "peak_windup",
    "initial_te_peak",
    "te_mean",
    "te_peak",
    "te_pp",
    "te_rms",
    "speed_ripple",
    "speed_ripple_rms",
    "mode_frequency_start",
    "mode_decay_start",
    "mode_amplitude_start",
    "mode_frequency_stop",
    "mode_decay_stop",
    "mode_amplitude_stop",
    "residual_ring",
    "loss_motor",
    "loss_wave_generator",
    "loss_load",
    "loss_mesh",
    "energy_in_start",
    "energy_residual",
    "upsilon_min",
    "time_outside_range",
)


@dataclass(frozen=True, eq=False)
class Grid:
    """A sweep over case x load inertia x value of one parameter.

    Attributes:
        parameter: what varies, "speed_rpm" included.
        values: (v,) factors of the default; r/min where the parameter is "speed_rpm".
        marked: (v,) True at the points of the article.
        loads: load inertias [kg m^2] (j,).
        cases: keys of `CASES` (c,).
        result: the sweep; row (c, j, v) in C order.
        own: parameters of the drive that differ from the defaults, which are known to about a thousandth.
        rings: rings after a brake found so far, by row.
    """

    parameter: str
    values: Floats
    marked: NDArray[np.bool_]
    loads: tuple[float, ...]
    cases: tuple[str, ...]
    result: SweepResult
    own: tuple[str, ...]
    rings: dict[int, tuple[float, float, float]] = field(default_factory=dict, repr=False)

    def of(self, metric: str, case: str, load: float = LOADS[0]) -> Floats:
        """A metric, "spring_torque", "energy_lost" or a ring after a brake over the values (v,), in `unit(metric)`."""
        if metric == "spring_torque":
            windup = self._slice(self.result["peak_windup"], case, load)
            return np.array([self._torque(row, phi) for row, phi in zip(self.rows(case, load), windup, strict=True)])
        if metric == "energy_lost":
            parts = [self.of(f"loss_{place}", case, load) for place in ("motor", "wave_generator", "load", "mesh")]
            return np.asarray(np.sum(parts, axis=0))
        if metric in RING:
            return np.array([self._ring(row)[RING.index(metric)] for row in self.rows(case, load)])
        return self._slice(self.result[metric], case, load)

    def unit(self, metric: str) -> str:
        """Unit of a metric that `of` knows."""
        own = {"spring_torque": "N m", "energy_lost": "J", **dict(zip(RING, ("Hz", "1/s", "rad/s"), strict=True))}
        return own.get(metric) or self.result.units[metric]

    def rows(self, case: str, load: float = LOADS[0]) -> list[int]:
        """Row numbers over the values."""
        numbers = np.arange(len(self.result)).reshape(len(self.cases), len(self.loads), len(self.values))
        return [int(n) for n in numbers[self.cases.index(case), self.loads.index(load)]]

    def _slice(self, values: Floats, case: str, load: float) -> Floats:
        return np.asarray(values[self.rows(case, load)])

    def _ring(self, row: int) -> tuple[float, float, float]:
        if row not in self.rings:
            self.rings[row] = self._find_ring(row)
        return self.rings[row]

    def _find_ring(self, row: int) -> tuple[float, float, float]:
        p = self.result.parameters(row)
        t = self.result.t_eval[0]
        begin = BRAKE_OFF + 0.03
        inside = (t >= begin) & (t <= begin + 0.6)
        twist = self.result.samples["omega_l"][row] - self.result.samples["omega_m"][row] / p["ratio"]
        guess = abs(trends.controlled_mode(p, p["K_p"], p["K_i"]).imag) / (2.0 * math.pi)
        return ring(t[inside], twist[inside], guess)

    def _torque(self, row: int, windup: float) -> float:
        k = self.result.parameters(row)
        return float(spring.torque(self.result.model.spring, k, np.array([windup]))[0])


def run(
    parameter: str,
    values: Sequence[float] | Floats,
    marks: Sequence[float],
    *,
    cases: Sequence[str] = EVERY,
    loads: Sequence[float] = LOADS,
    drive: Mapping[str, float] | None = None,
    orders: Sequence[int] = (),
    signals: Sequence[str] = (),
    t_eval: Any = None,
    threads: int | None = None,
) -> Grid:
    """One sweep over all cases, load inertias and values.

    Args:
        parameter: "speed_rpm" (values in r/min, in every case), "K" (all k_n), or a parameter (values are factors).
        values: grid; `marks` are added to it.
        marks: the article's points.
        cases: keys of `CASES`.
        loads: load inertias [kg m^2].
        drive: parameters that differ from the defaults.
        orders: orders whose amplitudes are asked for.
        signals: signals sampled at t_eval [s].
    """
    grid = np.unique(np.concatenate([np.asarray(values, dtype=np.float64), np.asarray(marks, dtype=np.float64)]))
    marked = np.isin(grid, np.asarray(marks, dtype=np.float64))
    table = params()
    base = {row.name: row.default for row in table} | dict(drive or {})
    shape = (len(cases), len(loads), len(grid))
    size = int(np.prod(shape))
    chosen = [CASES[key] for key in cases]

    def spread(per_case: list[float]) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(np.array(per_case)[:, None, None], shape)).reshape(size)

    columns: dict[str, Any] = dict(base)
    columns["te_scale"] = spread([case.te_scale * base["te_scale"] for case in chosen])
    columns["omega_set"] = spread([case.speed_rpm * RPM for case in chosen])
    columns["J_l"] = np.broadcast_to(np.array(loads)[:, None], shape).reshape(size).copy()
    _vary(columns, parameter, np.broadcast_to(grid, shape).reshape(size), base)
    keys = list(dict.fromkeys(case.scenario for case in chosen))
    index = spread([float(keys.index(case.scenario)) for case in chosen]).astype(np.int64)
    at_zero = sum(value for name, value in base.items() if name.startswith("te_cos_"))
    state = np.zeros((size, 4))
    state[:, 2] = np.where(spread([float(case.zero_angle) for case in chosen]) > 0, 0.0, -at_zero * columns["te_scale"])
    asked = [*METRICS, *(f"{kind}{n}" for kind in ("order_", "speed_order_") for n in orders)]
    sampled: dict[str, Any] = {"t_eval": t_eval, "signals": list(signals)} if signals else {}
    result = sweep(
        columns,
        model=Model(),
        scenario=[SCENARIOS[key]() for key in keys],
        scenario_index=index,
        metrics=asked,
        initial_state=state,
        threads=threads,
        rtol=RTOL,
        **sampled,
    )
    own = tuple(row.name for row in table if not math.isclose(base[row.name], row.default, rel_tol=1e-3, abs_tol=1e-12))
    return Grid(parameter, grid, marked, tuple(loads), tuple(cases), result, own)


def _vary(columns: dict[str, Any], parameter: str, values: Floats, base: Mapping[str, float]) -> None:
    if parameter == "speed_rpm":
        columns["omega_set"] = values * RPM
    elif parameter == "K":
        for n in range(1, 6):
            columns[f"k{n}"] = values * base[f"k{n}"]
    elif parameter in ("J_l", "te_scale"):
        columns[parameter] = columns[parameter] * values
    else:
        columns[parameter] = values * base[parameter]
