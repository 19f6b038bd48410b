"""One row with its full trajectory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hdfast import catalogue, checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose, nearest, shorten
from hdfast.model import Model
from hdfast.recordings import Recording
from hdfast.request import prepare_row
from hdfast.result import SweepResult
from hdfast.scenario import Scenario, chosen_scenario
from hdfast.sweep import run

GRID_STEP = 1e-3
GRID_SIZE = (1001, 100_001)
OPTIONS = (
    "metrics", "initial_state", "sensitivities", "method", "rtol", "atol", "max_steps", "max_step", "sensors", "strict",
)  # fmt: skip


class Trajectory:
    """One simulated row.

    Attributes:
        t: sample times [s], shape (T,).
        signals: arrays (T,) by name; NaN after the end of a row that failed.
        units: unit of every signal and metric by name.
        recorded: the `Recording` its sensors made, None without sensors.
        metrics: metrics of the row by name.
        status: name of the outcome, "finished" when all went well.
        message: the outcome in words, with a remedy when it failed.
        parameters: all parameter values by name.
        scenario: what is done to the drive.
        result: the `SweepResult` of the single row.
    """

    def __init__(self, result: SweepResult) -> None:
        self.result = result
        self.scenario = result.request.scenarios[0]
        self.t: Floats = result.t_eval[0]
        self.signals: dict[str, Floats] = {name: values[0] for name, values in result.samples.items()}
        self.recorded = self._recording(result)
        self.metrics: dict[str, float] = {name: float(values[0]) for name, values in result.metrics.items()}
        self.units = result.units
        self.status = next(iter(result.status_counts()))
        self.message = result.message(0)
        self.parameters = result.parameters(0)

    def __getitem__(self, name: str) -> Floats:
        if not isinstance(name, str) or name not in self.signals:
            raise InputError(f"the trajectory holds no {shorten(name)}{nearest(str(name), self.signals)}")
        return self.signals[name]

    def __repr__(self) -> str:
        return f"Trajectory: {len(self.t)} times to {self.t[-1]:g} s, signals {', '.join(self.signals)}\n{self.message}"

    def _recording(self, result: SweepResult) -> Recording | None:
        observation = result.request.observation
        if observation is None:
            return None
        columns = {"t": self.t, **{name: values[0] for name, values in result.recorded.items()}}
        return Recording("simulated", columns, observation.stage.resolution)

    def sampled(self, t: Any, signals: Sequence[str]) -> dict[str, Floats]:
        """Signals of the same run at other times [s], shape (T,) each; no metrics, no sensors."""
        request = replace(
            self.result.request.bare(),
            grids=[np.ascontiguousarray(checks.times("t", t, self.scenario.t_end))],
            signals=catalogue.choose_signals(signals, ()),
        )
        return {name: values[0] for name, values in run(request, threads=1).samples.items()}

    def plot(self) -> Any:
        """Speeds, windup and transmission error over time as a `matplotlib.figure.Figure`."""
        from hdfast.report import plots

        return plots.trajectory(self)


def simulate(
    row: Any = None,
    *,
    model: Model | None = None,
    scenario: Scenario | None = None,
    t_eval: Any = None,
    signals: Any = None,
    **options: Any,
) -> Trajectory:
    """Simulate one drive and keep its trajectory.

    Args:
        row: parameters that differ from the defaults, as a dict; or anything `sweep` takes with one row.
        model: the equations; default `Model()`.
        scenario: the inputs over time; default `Scenario.start_stop()`.
        t_eval: sample times [s], shape (T,); default 1 kHz over the whole run, but 1,001 to
            100,001 times.
        signals: names of the sampled signals; default all.
        options: metrics, initial_state, sensitivities, method, rtol, atol, max_steps, max_step, sensors and strict as
            in `sweep`.

    Raises:
        InputError: the call cannot mean anything, or more than one row was given.
        RowError: with strict, the row cannot be simulated.
    """
    for name in options:
        choose("option", name, OPTIONS)
    strict = options.pop("strict", False)
    scenario = chosen_scenario(scenario)
    if t_eval is None:
        size = int(np.clip(round(scenario.t_end / GRID_STEP) + 1, *GRID_SIZE))
        t_eval = np.linspace(0.0, scenario.t_end, size)
    chosen = list(catalogue.signals()) if signals is None else signals
    request = prepare_row(row, model=model, scenario=scenario, t_eval=t_eval, signals=chosen, **options)
    return Trajectory(run(request, threads=1, strict=strict))
