"""`reference.sweep` and `reference.simulate`: the arguments of `hdfast.sweep`, one row after another."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hdfast.errors import InputError, choose, shorten

from .integrate import Trajectory, advance
from .methods import METHODS
from .metrics import Metrics
from .problem import Problem
from .signals import NAMES, reported_state, sample
from .stepper import Vector

if TYPE_CHECKING:
    from hdfast.request import Request
    from hdfast.scenario import Scenario


@dataclass(frozen=True)
class ReferenceResult:
    """What `hdfast.sweep` returns, as plain lists.

    Attributes:
        metrics: list over rows by metric name; NaN for rows that did not finish.
        final_state: one list per row.
        status: names such as "finished".
        detail: name of the parameter that makes a row impossible, else "".
        steps: accepted steps per row.
        rejected: rejected steps per row.
        time: time reached [s] per row.
        samples: list over rows of lists over time, by signal name.
        trajectories: every step of every row, for a closer look.
    """

    metrics: dict[str, Vector]
    final_state: list[Vector]
    status: list[str]
    detail: list[str]
    steps: list[int]
    rejected: list[int]
    time: Vector
    samples: dict[str, list[Vector]]
    trajectories: list[Trajectory]

    def __getitem__(self, name: str) -> Vector:
        return self.metrics[name]

    def __len__(self) -> int:
        return len(self.status)


def sweep(rows: Any, **options: Any) -> ReferenceResult:
    """Simulate every row in plain Python; slow, meant for checking `hdfast.sweep`.

    Args:
        rows: rows of parameters in any form `hdfast.sweep` takes.
        **options: model, scenario, scenario_index, t_eval, t_eval_index, signals, metrics, initial_state, method, rtol,
            atol, max_steps and max_step as in `hdfast.sweep`.

    Raises:
        InputError: as `hdfast.sweep`; and for what the reference has not: terms, sensors, sensitivities, rodas5p.
    """
    from hdfast.request import prepare

    request = prepare(rows, **options)
    beyond = {"terms": request.model.terms} | {name: options.get(name) for name in ("sensors", "sensitivities")}
    for name, value in beyond.items():
        if value:
            raise InputError(f"{name} = {shorten(value)} (allowed in the reference: none)")
    choose("method", request.method, METHODS)
    return solve_rows(
        [read_row(request, k) for k in range(request.rows.count)],
        [request.grids[k].tolist() for k in grid_of_rows(request)] if request.grids else None,
        [signal.name for signal in request.signals],
        [metric.name for metric in request.metrics],
        request.method,
        request.rtol,
        request.atol,
        request.max_steps,
        request.max_step,
    )


def simulate(
    row: Any = None, *, scenario: Scenario | None = None, t_eval: Any = None, signals: Any = None, **options: Any
) -> ReferenceResult:
    """One row with every signal at the times `t_eval`; by default 1001 of them. Other arguments as in `sweep`."""
    from hdfast.scenario import chosen_scenario

    scenario = chosen_scenario(scenario)
    if t_eval is None:
        t_eval = [scenario.t_end * k / 1000 for k in range(1001)]
    chosen = NAMES if signals is None else signals
    return sweep({} if row is None else row, scenario=scenario, t_eval=t_eval, signals=chosen, **options)


def solve_rows(
    problems: Sequence[Problem],
    grids: Sequence[Sequence[float]] | None = None,
    signals: Sequence[str] = (),
    metrics: Sequence[str] = (),
    method: str = "dop853",
    rtol: float = 1e-6,
    atol: float = 1.0,
    max_steps: int = 1_000_000,
    max_step: float = math.inf,
) -> ReferenceResult:
    """The same for rows spelled out as `Problem`, with one list of sample times per row."""
    runs = [advance(problem, method, rtol, atol, max_steps, max_step) for problem in problems]
    tables = [Metrics(run) for run in runs]
    return ReferenceResult(
        metrics={name: [table[name] for table in tables] for name in metrics},
        final_state=[reported_state(run) for run in runs],
        status=[run.status for run in runs],
        detail=[problem.impossible() for problem in problems],
        steps=[len(run.steps) for run in runs],
        rejected=[run.rejected for run in runs],
        time=[run.time for run in runs],
        samples=sample_rows(runs, grids, signals) if grids else {},
        trajectories=runs,
    )


def sample_rows(
    runs: Sequence[Trajectory], grids: Sequence[Sequence[float]], signals: Sequence[str]
) -> dict[str, list[Vector]]:
    """Signals of all rows, padded with NaN to the longest list of times."""
    width = max(map(len, grids))
    padded = [[*grid, *[math.nan] * (width - len(grid))] for grid in grids]
    return {name: [sample(run, name, grid) for run, grid in zip(runs, padded, strict=True)] for name in signals}


def grid_of_rows(request: Request) -> Iterable[int]:
    """Which list of sample times each row takes."""
    return [0] * request.rows.count if request.grid_index is None else map(int, request.grid_index)


def read_row(request: Request, k: int) -> Problem:
    """One row of a checked call in plain numbers."""
    from hdfast.request import parameters_of, scenario_at

    scenario, state = scenario_at(request, k), request.initial_state
    return Problem(
        parameters=parameters_of(request, k),
        orders=request.model.order_values,
        labels=request.model.order_labels,
        segments=scenario.segments.tolist(),
        t_end=scenario.t_end,
        t_on=scenario.t_on,
        t_off=scenario.t_off,
        t_run=scenario.t_run,
        ring_delay=scenario.ring_delay,
        ring_width=scenario.ring_width,
        ring_on_load=scenario.ring_on_load,
        base=request.model.base,
        spring=request.model.spring,
        initial=scenario.initial,
        initial_state=None if state is None else state[k].tolist(),
    )
