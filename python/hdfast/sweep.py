"""The main job: many rows of parameters through one model and one or more scenarios."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from hdfast import _core, catalogue, checks
from hdfast.errors import InputError, Interrupted, RowError, shorten
from hdfast.model import Model
from hdfast.request import Progress, Request, parameters_of, prepare
from hdfast.result import SweepResult
from hdfast.scenario import Scenario
from hdfast.sensors.stage import SensorStage
from hdfast.threads import resolve_threads


def sweep(
    rows: Any,
    *,
    model: Model | None = None,
    scenario: Scenario | Sequence[Scenario] | None = None,
    scenario_index: Any = None,
    t_eval: Any = None,
    t_eval_index: Any = None,
    signals: Sequence[str] | None = None,
    metrics: Sequence[str] | None = None,
    initial_state: Any = None,
    sensitivities: Sequence[str] | None = None,
    method: str = "auto",
    rtol: float = 1e-6,
    atol: float = 1.0,
    max_steps: int = 1_000_000,
    max_step: float = math.inf,
    sensors: SensorStage | None = None,
    threads: int | None = None,
    progress: bool | Progress = False,
    strict: bool = False,
) -> SweepResult:
    """Simulate every row of parameters.

    Args:
        rows: float64 array (M, P) with the columns of `hdfast.params(model)`; or a dict of columns (M,) and numbers, a
            structured array, or a pandas, polars or Arrow table. What is left out takes its default. Named columns may
            also carry omega_set [rad/s], tau_load [N m], K_p, K_i, tau_max [N m] and theta_m0 [rad], which override the
            scenario row by row; rows cannot differ in one that it makes no use of. All values in SI units.
        model: the equations; default `Model()`.
        scenario: the inputs over time, or a list of them; default `Scenario.start_stop()`.
        scenario_index: (M,) integers, which scenario of the list each row takes.
        t_eval: sample times [s], shape (T,), or a list of such arrays.
        t_eval_index: (M,) integers, which grid of the list each row takes.
        signals: names of the signals sampled at t_eval; default te, omega_m, omega_l.
        metrics: names of the metrics, also `order_<o>` and `speed_order_<o>`; default all fixed ones.
        initial_state: (M, S) or (S,) start in place of the scenario's, columns as `model.states`; z may be left out and
            is then 0, angles are up to 1e9 rad in size. Hidden states of terms are those that the load torque winds up.
        sensitivities: names of parameters (scenario columns, parameters of terms and of sensors included) and of
            initial states (`initial_theta_m`, `initial_omega_m`, ...) with respect to which all numbers are
            differentiated, readings of the sensors included; with the methods auto, dop853 and rodas5p.
        method: "auto", "bs3", "tsit5", "dopri5", "dop853" or, for stiff motions, "rodas5p". With terms, which bs3 and
            dopri5 do not know, "auto" runs a row by dop853 and starts it again with rodas5p where stability holds its
            steps down; `result.method` tells.
        rtol: relative tolerance, 1e-13 to 1e-1.
        atol: factor on the built-in absolute tolerances of the states, 1e-9 to 1e9.
        max_steps: steps, accepted and rejected, after which a row is given up with the status "max_steps". Of more than
            65,536 before or after t_off the middle ones are forgotten: `steady_speed`, `rise_*`, `dead_time`, `stop_*`
            and orders that need them are NaN.
        max_step: largest step [s].
        sensors: a `hdfast.sensors.SensorStage`; `result.recorded` is what it reads at t_eval, by channel. Rows may
            name its parameters.
        threads: number of threads; default HDFAST_NUM_THREADS, RAYON_NUM_THREADS, then the CPUs this process may use.
        progress: True shows a bar on stderr; a function is called with (rows done, rows in total).
        strict: raise for the first row that cannot be simulated, before any is run to its end, instead of giving it the
            status "bad_parameters".

    Returns:
        The result; rows that failed carry their status, NaN metrics and a message.

    Raises:
        InputError: the call cannot mean anything; nothing was run.
        RowError: with strict=True, naming row, parameter and value.
        Interrupted: Ctrl-C; `.result` holds the rows that had finished.
    """
    request = prepare(
        rows,
        model=model,
        scenario=scenario,
        scenario_index=scenario_index,
        t_eval=t_eval,
        t_eval_index=t_eval_index,
        signals=signals,
        metrics=metrics,
        initial_state=initial_state,
        sensitivities=sensitivities,
        method=method,
        rtol=rtol,
        atol=atol,
        max_steps=max_steps,
        max_step=max_step,
        sensors=sensors,
    )
    return run(request, threads=threads, progress=progress, strict=strict)


def run(
    request: Request, *, threads: int | None = None, progress: bool | Progress = False, strict: bool = False
) -> SweepResult:
    """Hand a checked call to the core."""
    count = resolve_threads(threads)
    catalogue.build_info()
    if checks.flag("strict", strict):
        _raise_for_bad_row(request, count)
    with _reporter(progress, request.rows.count) as report:
        return _result(request, count, report)


def _result(request: Request, threads: int, report: Progress | None = None) -> SweepResult:
    observation = request.observation
    raw = _core.sweep(
        base=request.model.base,
        spring=request.model.spring,
        orders=request.model.order_values,
        terms=list(request.model.terms),
        defaults=request.defaults,
        columns=[(request.table.column(name), column) for name, column in request.rows.columns.items()],
        rows=request.rows.count,
        programs=[program(scenario) for scenario in request.scenarios],
        program_index=request.scenario_index,
        initial=request.scenarios[0].initial,
        initial_state=request.initial_state,
        grids=observation.grids if observation else request.grids,
        grid_index=request.grid_index,
        signals=[signal.name for signal in (observation.signals if observation else request.signals)],
        metrics=[metric.name for metric in request.metrics],
        directions=list(request.sensitivities.drive.values()),
        method=request.method,
        find_stiff=request.find_stiff,
        rtol=request.rtol,
        atol=request.atol,
        max_steps=request.max_steps,
        max_step=request.max_step,
        threads=threads,
        progress=report,
    )
    result = SweepResult(request, raw)
    if result.interrupted:
        raise Interrupted(result)
    return result


def program(scenario: Scenario) -> _core.Program:
    """The scenario as the core takes it."""
    return _core.Program(
        segments=scenario.segments,
        t_end=scenario.t_end,
        t_on=scenario.t_on,
        t_off=scenario.t_off,
        t_run=scenario.t_run,
        ring_delay=scenario.ring_delay,
        ring_width=scenario.ring_width,
        ring_on_load=scenario.ring_on_load,
    )


def _raise_for_bad_row(request: Request, threads: int) -> None:
    """One step of each row, about a hundredth of a sweep, tells which cannot be simulated."""
    try:
        result = _result(replace(request.bare(), max_steps=1), threads)
    except Interrupted as stop:
        begun = stop.result.status == catalogue.status_code(catalogue.MAX_STEPS)
        stop.result.status[begun] = catalogue.status_code(catalogue.CANCELLED)
        raise
    bad = np.flatnonzero(result.detail >= 0)
    if not bad.size:
        return
    row = int(bad[0])
    parameter = result.request.table[int(result.detail[row])]
    value = parameters_of(result.request, row)[parameter.name]
    raise RowError(
        f"row {row}: {parameter.name} = {value:g} {parameter.unit} cannot be simulated ({parameter.limits})",
        row,
        parameter.name,
    )


@contextmanager
def _reporter(progress: Any, rows: int) -> Iterator[Callable[[int, int], None] | None]:
    if progress is None or progress is False:
        yield None
    elif progress is True:
        from tqdm import tqdm

        with tqdm(total=rows, unit="row", file=sys.stderr, dynamic_ncols=True, leave=False) as bar:
            yield lambda done, total: _advance(bar, done, total)
    elif callable(progress):
        yield progress
    else:
        raise InputError(f"progress = {shorten(progress)} is not True, False or a function of (done, total)")


def _advance(bar: Any, done: int, total: int) -> None:
    bar.total = total
    bar.update(done - bar.n)
