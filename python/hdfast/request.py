"""One checked call: everything `sweep` was asked for, in the form the core and the reference take."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import catalogue, checks
from hdfast.catalogue import Quantity
from hdfast.checks import Floats
from hdfast.errors import InputError, shorten
from hdfast.model import Model
from hdfast.params import Parameter, ParameterTable, chosen_model, layout
from hdfast.rows import Rows, read_rows
from hdfast.scenario import Scenario
from hdfast.scenario_parts import MAX_ANGLE
from hdfast.sensitivities import Directions, choose_directions
from hdfast.sensors.observation import Observation, observe
from hdfast.sensors.stage import SensorStage

DEFAULT_SIGNALS = ("te", "omega_m", "omega_l")
MAX_ROWS = MAX_STEPS = 2**31 - 1
RTOL = (1e-13, 1e-1)
ATOL = (1e-9, 1e9)

Progress = Callable[[int, int], None]
Index = NDArray[np.uint32]


@dataclass(frozen=True)
class Request:
    """A checked call.

    Attributes:
        table: all parameters, drive columns first, in core order.
        defaults: their defaults, shape (P + 6,).
        rows: columns by name, scenario columns included, and shared values (already part of `defaults`).
        scenarios: the scenarios; `scenario_index` (M,) picks one per row, None means the first for all.
        sensitivities: what derivatives are taken with respect to.
        grids: output times; `grid_index` (M,) picks one per row, None means the first for all.
        observation: what the sensors need, None without sensors.
    """

    model: Model
    table: ParameterTable
    defaults: Floats
    rows: Rows
    scenarios: list[Scenario]
    scenario_index: Index | None
    grids: list[Floats]
    grid_index: Index | None
    signals: list[Quantity]
    metrics: list[Quantity]
    initial_state: Floats | None
    sensitivities: Directions
    method: str
    find_stiff: bool
    rtol: float
    atol: float
    max_steps: int
    max_step: float
    observation: Observation | None

    def kept(self) -> Request:
        """The same call with rows, start and times of its own, whatever becomes of the caller's arrays."""
        columns = {name: column.copy() for name, column in self.rows.columns.items()}
        seen = self.observation
        if seen is not None:
            seen = replace(seen, values={name: np.copy(value) for name, value in seen.values.items()})
        start = None if self.initial_state is None else self.initial_state.copy()
        grids = [grid.copy() for grid in self.grids]
        rows = replace(self.rows, columns=columns)
        return replace(self, rows=rows, initial_state=start, grids=grids, observation=seen)

    def bare(self) -> Request:
        """The same rows, of which nothing is asked but how they end."""
        nothing = Directions((), {}, {})
        return replace(self, grids=[], grid_index=None, signals=[], metrics=[], sensitivities=nothing, observation=None)

    @property
    def sensor_values(self) -> list[tuple[Parameter, Any]]:
        """Parameters of the sensors, none without, each with its number or its (M,) values."""
        if self.observation is None:
            return []
        stage, given = self.observation.stage, self.observation.values
        named = zip(stage.parameters, stage.named(self.table), strict=True)
        return [(row, given.get(own.name, stage.value(own.name))) for own, row in named]


def prepare(
    rows: Any,
    *,
    model: Model | None = None,
    scenario: Scenario | Sequence[Scenario] | None = None,
    scenario_index: Any = None,
    t_eval: Any = None,
    t_eval_index: Any = None,
    signals: Any = None,
    metrics: Any = None,
    initial_state: Any = None,
    sensitivities: Any = None,
    method: str = "auto",
    rtol: float = 1e-6,
    atol: float = 1.0,
    max_steps: int = 1_000_000,
    max_step: float = math.inf,
    sensors: Any = None,
) -> Request:
    """Check the arguments of `hdfast.sweep`; nothing runs.

    Raises:
        InputError: naming argument, value and allowed range.
        ParameterError: an unknown parameter name, with the nearest known one.
    """
    model = chosen_model(model)
    table = layout(model)
    drive = table[: sum(row.group == "drive" for row in table)]
    given, readings = _split(rows, drive, table, sensors)
    if given.count > MAX_ROWS:
        raise InputError(f"rows has {given.count} rows (allowed: at most {MAX_ROWS})")
    scenarios = _scenarios(scenario)
    index = _index("scenario_index", scenario_index, given.count, len(scenarios), "scenario")
    _check_idle(given, scenarios, initial_state is not None)
    defaults, given = _with_scenario_values(table, given, scenarios, index)
    if t_eval is None and (signals is not None or t_eval_index is not None):
        raise InputError("signals and t_eval_index need t_eval, the times at which to sample [s]")
    grids = [] if t_eval is None else _grids(t_eval)
    chosen = catalogue.choose_signals(signals, DEFAULT_SIGNALS) if grids else []
    quantities = catalogue.choose_metrics(metrics)
    observation = None if sensors is None else observe(sensors, readings, chosen, grids)
    stage = None if observation is None else observation.stage
    sampled, times = (chosen, grids) if observation is None else (observation.signals * 2, observation.grids)
    automatic, method = method == "auto", catalogue.choose_method(method, terms=bool(model.terms))
    directions = choose_directions(sensitivities, model, table, method, stage)
    numbers = len(quantities) + len(sampled) * max(map(len, times), default=0)
    _check_size(given.count, numbers, len(directions.names))
    grid_index = _index("t_eval_index", t_eval_index, given.count, len(grids), "t_eval") if grids else None
    _check_ends(grids, grid_index, scenarios, index)
    return Request(
        model=model,
        table=table,
        defaults=defaults,
        rows=given,
        scenarios=scenarios,
        scenario_index=index,
        grids=grids,
        grid_index=grid_index,
        signals=chosen,
        metrics=quantities,
        initial_state=_initial_state(initial_state, given.count, model),
        sensitivities=directions,
        method=method,
        find_stiff=automatic and bool(model.terms),
        rtol=checks.number("rtol", rtol, *RTOL),
        atol=checks.number("atol", atol, *ATOL),
        max_steps=checks.whole("max_steps", max_steps, 1, MAX_STEPS),
        max_step=checks.positive("max_step", max_step, math.inf, "s"),
        observation=observation,
    )


def prepare_row(row: Any, **asked: Any) -> Request:
    """As `prepare`, for a call that takes one row; None stands for the default drive.

    Raises:
        InputError: as there, or more than one row was given.
    """
    request = prepare({} if row is None else row, **asked)
    if request.rows.count != 1:
        raise InputError(f"row holds {request.rows.count} rows (allowed: 1; use hdfast.sweep for many)")
    return request


def _split(rows: Any, drive: ParameterTable, table: ParameterTable, sensors: Any) -> tuple[Rows, dict[str, Any]]:
    """Rows of the drive, and the values of the sensors among them by name."""
    if not isinstance(sensors, SensorStage):
        return read_rows(rows, drive, table), {}
    own = sensors.named(table)
    given = read_rows(rows, drive, table.joined(own))
    columns = {name: given.columns.pop(name) for name in own.names if name in given.columns}
    shared = {name: given.shared.pop(name) for name in own.names if name in given.shared}
    return given, {**columns, **shared}


def _scenarios(scenario: Any) -> list[Scenario]:
    if scenario is None:
        return [Scenario.start_stop()]
    listed = [scenario] if isinstance(scenario, Scenario) else scenario
    if not isinstance(listed, (list, tuple)) or not listed:
        raise InputError(f"scenario = {shorten(scenario)} is not a hdfast.Scenario or a list of them")
    for item in listed:
        if not isinstance(item, Scenario):
            raise InputError(f"scenario contains {shorten(item)}, which is not a hdfast.Scenario")
    if len({item.initial for item in listed}) > 1:
        raise InputError(
            "the scenarios of one sweep need the same initial (allowed: all 'relaxed' or all 'zero_angle')"
        )
    return list(listed)


def _index(argument: str, value: Any, rows: int, choices: int, what: str) -> Index | None:
    if value is None:
        if choices > 1:
            raise InputError(
                f"{choices} entries in {what} need {argument}, shape ({rows},), to say which row takes which"
            )
        return None
    array = np.asarray(value)
    if array.shape != (rows,) or array.dtype.kind not in "iu":
        raise InputError(
            f"{argument} has shape {array.shape} and dtype {array.dtype}, allowed: integers of shape ({rows},)"
        )
    wrong = np.flatnonzero((array < 0) | (array >= choices))
    if wrong.size:
        raise InputError(f"{argument}[{wrong[0]}] = {array[wrong[0]]} is out of range (allowed: 0 to {choices - 1})")
    return array.astype(np.uint32)


def _check_idle(given: Rows, scenarios: list[Scenario], placed: bool) -> None:
    """Rows must not differ in what changes nothing; one number for all may, so that a drive fits every scenario."""
    from_state = {"theta_m0": "with initial_state, which has the angle"} if placed else {}
    idle = [{**scenario.idle, **from_state} for scenario in scenarios]
    for name, reason in idle[0].items():
        column = given.columns.get(name, np.empty(0))
        if np.any(column[1:] != column[:-1]) and all(name in others for others in idle):
            raise InputError(f"rows differ in {name}, which has no meaning {reason} (allowed: left out, or one number)")


def _with_scenario_values(
    table: ParameterTable, given: Rows, scenarios: list[Scenario], index: Index | None
) -> tuple[Floats, Rows]:
    """Defaults from the scenarios and shared values; a column where the scenarios of the rows differ."""
    defaults = table.defaults
    columns = dict(given.columns)
    for name in scenarios[0].values:
        values = np.array([scenario.values[name] for scenario in scenarios])
        defaults[table.column(name)] = values[0]
        if name not in columns and name not in given.shared and index is not None and np.any(values != values[0]):
            columns[name] = values[index]
    for name, value in given.shared.items():
        defaults[table.column(name)] = value
    return defaults, Rows(given.count, columns, given.shared)


def _grids(t_eval: Any) -> list[Floats]:
    several = isinstance(t_eval, (list, tuple)) and len(t_eval) > 0 and all(np.ndim(item) == 1 for item in t_eval)
    if not several:
        return [np.ascontiguousarray(checks.times("t_eval", t_eval, strictly=False))]
    return [np.ascontiguousarray(checks.times(f"t_eval[{i}]", item, strictly=False)) for i, item in enumerate(t_eval)]


def _check_ends(grids: list[Floats], grid_index: Index | None, scenarios: list[Scenario], index: Index | None) -> None:
    """No grid may reach beyond the end of a scenario that one of its rows takes."""
    ends = np.array([scenario.t_end for scenario in scenarios])
    for position, grid in enumerate(grids):
        rows = slice(None) if grid_index is None else grid_index == position
        taken = ends[:1] if index is None else ends[index[rows]]
        checks.times(
            "t_eval" if len(grids) == 1 else f"t_eval[{position}]", grid, taken.min(initial=np.inf), strictly=False
        )


def _initial_state(value: Any, rows: int, model: Model) -> Floats | None:
    if value is None:
        return None
    array = checks.as_floats("initial_state", value)
    full = len(model.states)
    if array.ndim not in (1, 2) or array.shape[-1] not in (full - 1, full) or (array.ndim == 2 and len(array) != rows):
        raise InputError(
            f"initial_state has shape {array.shape}, allowed: ({rows}, {full}) or ({full},) "
            f"with {', '.join(model.states)}; z may be left out"
        )
    states = np.ascontiguousarray(np.broadcast_to(array, (rows, array.shape[-1])))
    for name, values in zip(model.states, states.T, strict=False):
        angle = name.startswith("theta")
        wrong = np.flatnonzero(~(np.abs(values) <= MAX_ANGLE) if angle else ~np.isfinite(values))
        if wrong.size:
            row, allowed = wrong[0], f"{-MAX_ANGLE:g} to {MAX_ANGLE:g} rad" if angle else "a finite number"
            raise InputError(f"initial_state has {name} = {values[row]:g} in row {row} (allowed: {allowed})")
    return states


def _check_size(rows: int, numbers: int, directions: int) -> None:
    needed = 8 * rows * (numbers + 8) * (1 + directions)
    limit = checks.memory_limit()
    if needed > limit:
        raise InputError(
            f"the result of {rows} rows with {numbers} metrics and samples and {directions} sensitivities each needs "
            f"{needed / 1e9:.3g} GB, this machine has {limit / 1e9:.3g} GB: "
            "ask for fewer rows, signals, times or sensitivities at once"
        )


def scenario_at(request: Request, row: int) -> Scenario:
    """The scenario of a row."""
    return request.scenarios[0 if request.scenario_index is None else int(request.scenario_index[row])]


def parameters_of(request: Request, row: int) -> dict[str, float]:
    """All parameter values of a row by name, those of the sensors last."""
    values = dict(zip(request.table.names, request.defaults.tolist(), strict=True))
    values.update({name: float(column[row]) for name, column in request.rows.columns.items()})
    for parameter, given in request.sensor_values:
        values[parameter.name] = float(given if np.ndim(given) == 0 else given[row])
    return values
