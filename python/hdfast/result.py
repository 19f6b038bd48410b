"""What a sweep returns: metrics, final states, statuses and samples, with names and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import catalogue, checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose, nearest, shorten
from hdfast.printing import text_table
from hdfast.request import Request, parameters_of
from hdfast.sensors.channels import CHANNELS

PERCENTILES = (1.0, 5.0, 50.0, 95.0, 99.0)
MAIN_METRICS = (
    "steady_speed",
    "rise_time",
    "stop_time",
    "peak_windup",
    "te_pp",
    "te_rms",
    "te_peak",
    "speed_ripple",
    "mode_frequency_start",
    "mode_amplitude_start",
    "mode_amplitude_stop",
    "residual_ring",
    "energy_in",
)


class SweepResult:
    """Result of `hdfast.sweep` for M rows.

    Attributes:
        metrics: arrays (M,) by name; NaN where a row did not get there.
        units: unit of every metric, signal and channel by name.
        samples: arrays (M, T) by signal name, NaN beyond a row's grid or end; empty without t_eval.
        recorded: what the sensors read, arrays (M, T) by channel; empty without sensors. Of a row that Ctrl-C cancels
            before it has passed them, neither samples nor readings are kept.
        t_eval: the sample times [s] of each grid.
        states: names of the S states.
        final_state: (M, S) last accepted state, columns as `states`.
        sensitivities: names of what derivatives were taken with respect to, W of them.
        metric_sensitivities: arrays (M, W) by metric name, derivatives in the metric's over the parameter's unit; NaN
            for time_outside_range and energy_residual, which are found in plain numbers, and for mode_*, which come
            from an iterated fit. Windows, extrema and crossings move with the parameter, the samples of a fit do not
            change in number.
        sample_sensitivities: arrays (M, T, W) by signal name.
        recorded_sensitivities: arrays (M, T, W) by channel, of the readings before they are rounded, with noise and
            jitter held as they were drawn (`SensorStage.linearise`); empty without sensors.
        final_state_sensitivities: (M, S, W).
        status: (M,) codes, 0 is finished; `status_counts()` and `message(row)` put them in words.
        detail: (M,) column of the offending parameter of a row that cannot be simulated, else -1.
        method: (M,) name of the method that ran the row.
        steps, rejected: (M,) accepted and rejected steps.
        time: (M,) time reached [s].
        interrupted: whether Ctrl-C ended the sweep.
        seconds, threads, simd: how the sweep ran.
        model, request: what was asked for.
    """

    def __init__(self, request: Request, raw: Mapping[str, Any]) -> None:
        request = request.kept()
        self.request = request
        self.model = request.model
        self.metrics: dict[str, Floats] = dict(zip((m.name for m in request.metrics), raw["metrics"], strict=True))
        self.recorded: dict[str, Floats] = {}
        self.recorded_sensitivities: dict[str, Floats] = {}
        self.status: NDArray[np.uint8] = raw["status"]
        self.interrupted: bool = raw["interrupted"]
        self._take(raw["samples"], raw["samples_sensitivities"])
        self.units = {item.name: item.unit for item in (*request.signals, *request.metrics)}
        self.units |= {name: CHANNELS[name].unit for name in self.recorded}
        self.t_eval: list[Floats] = request.grids
        self.states = request.model.states
        self.final_state: Floats = raw["final_state"]
        self.sensitivities = request.sensitivities.names
        self.metric_sensitivities = self._of_motion(self.metrics, raw["metrics_sensitivities"])
        self.final_state_sensitivities: Floats = request.sensitivities.of_motion(
            self.final_state, raw["final_state_sensitivities"]
        )
        self.method: NDArray[np.str_] = np.array(list(catalogue.methods()))[raw["method"]]
        self.detail: NDArray[np.int32] = raw["detail"]
        self.steps: NDArray[np.uint32] = raw["steps"]
        self.rejected: NDArray[np.uint32] = raw["rejected"]
        self.time: Floats = raw["time"]
        self.seconds: float = raw["seconds"]
        self.threads: int = raw["threads"]
        self.simd: str = raw["simd"]

    def _take(self, samples: list[Floats], slopes: list[Floats]) -> None:
        request, directions = self.request, self.request.sensitivities
        names = [signal.name for signal in request.signals]
        if request.observation is not None:
            own = list(directions.sensors.values())
            cancelled = catalogue.status_code(catalogue.CANCELLED)
            whole = self.status != cancelled
            found = request.observation.take(samples, slopes, request.grids, request.grid_index, own, whole)
            self.status[self.finished & ~found.taken] = cancelled
            self.interrupted |= not found.taken[whole].all()
            samples, slopes = ([each[name] for name in names] for each in (found.samples, found.slopes))
            self.recorded = found.recorded
            self.recorded_sensitivities = {
                name: directions.arranged(*np.split(along, [len(directions.drive)], axis=-1))
                for name, along in found.recorded_slopes.items()
            }
        self.samples = dict(zip(names, samples, strict=True))
        self.sample_sensitivities = self._of_motion(self.samples, slopes)

    def _of_motion(self, values: Mapping[str, Floats], slopes: list[Floats]) -> dict[str, Floats]:
        pairs = zip(values.items(), slopes, strict=True)
        return {name: self.request.sensitivities.of_motion(own, along) for (name, own), along in pairs}

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, name: str) -> Floats:
        order = catalogue.order_amplitude(name)
        held = name if order is None else order.name
        for group in (self.metrics, self.samples, self.recorded):
            if isinstance(held, str) and held in group:
                return group[held]
        known = [*self.metrics, *self.samples, *self.recorded]
        raise InputError(
            f"the result holds no {shorten(name)}{nearest(str(name), known)} (it holds: {', '.join(known)})"
        )

    @property
    def finished(self) -> NDArray[np.bool_]:
        """(M,) True where the row finished."""
        finished: NDArray[np.bool_] = self.status == 0
        return finished

    @property
    def rows_per_second(self) -> float:
        """Rows that ended, over the time of the sweep; what Ctrl-C left undone does not count."""
        return (len(self) - self.status_counts().get(catalogue.CANCELLED, 0)) / max(self.seconds, 1e-9)

    def status_counts(self) -> dict[str, int]:
        """Number of rows per status name, only those that occur."""
        codes, counts = np.unique(self.status, return_counts=True)
        names = catalogue.statuses()
        return {names[int(code)].name: int(count) for code, count in zip(codes, counts, strict=True)}

    def parameters(self, row: int) -> dict[str, float]:
        """All parameter values of a row by name, scenario columns and parameters of sensors included."""
        return parameters_of(self.request, self._row(row))

    def message(self, row: int) -> str:
        """What became of a row and, when it failed, what to do."""
        row = self._row(row)
        status = catalogue.statuses()[int(self.status[row])]
        if status.name == catalogue.FINISHED:
            return f"row {row}: finished, {self.steps[row]} steps"
        if self.detail[row] >= 0:
            parameter = self.request.table[int(self.detail[row])]
            value = self.parameters(row)[parameter.name]
            cause = f"{parameter.name} = {value:g} {parameter.unit}; {parameter.limits}"
            return f"row {row}: {status.name} ({cause}): {status.remedy}"
        if np.isnan(self.time[row]):
            return f"row {row}: {status.name}, not begun: {status.remedy}"
        return f"row {row}: {status.name} at t = {self.time[row]:.6g} s after {self.steps[row]} steps: {status.remedy}"

    def usable(self, metric: str) -> Floats:
        """(n,) values of a metric over the finished rows, those that are finite."""
        values = self.metrics[choose("metric", metric, self.metrics)][self.finished]
        return values[np.isfinite(values)]

    def percentiles(self, metric: str, q: float | Sequence[float] = PERCENTILES) -> Any:
        """Percentiles of a metric over its usable values, shape of q; NaN when there are none."""
        for percentage in np.ravel(q):
            checks.number("q", percentage, 0.0, 100.0)
        values = self.usable(metric)
        return np.percentile(values, q) if values.size else np.full(np.shape(q), np.nan)

    def _row(self, row: int) -> int:
        return checks.whole("row", row, -len(self), len(self) - 1) % len(self)

    def __repr__(self) -> str:
        failed = len(self) - int(np.count_nonzero(self.finished))
        lines = [
            f"SweepResult: {len(self)} rows, {len(self) - failed} finished, {failed} failed",
            f"{self.seconds:.3g} s on {self.threads} thread{'s' if self.threads > 1 else ''} "
            f"({self.simd}), {self.rows_per_second:.3g} rows/s",
        ]
        if failed:
            lines.append(", ".join(f"{name} {count}" for name, count in self.status_counts().items()))
            lines.append(self.message(int(np.flatnonzero(~self.finished)[0])))
        shown = [name for name in MAIN_METRICS if name in self.metrics] or list(self.metrics)[:12]
        if shown and len(self):
            rows = [[name, self.units[name], *(f"{value:.4g}" for value in self.percentiles(name))] for name in shown]
            header = ["metric", "unit", *(f"P{q:g}" for q in PERCENTILES)]
            lines.append(text_table(header, rows, right=range(2, len(header))))
        if self.samples:
            shape = next(iter(self.samples.values())).shape
            lines.append(f"samples {', '.join(self.samples)}: shape {shape}")
        return "\n".join(lines)

    def to_arrow(self, *, parameters: str = "all") -> Any:
        """One row per parameter row as a `pyarrow.Table`; units and meanings in the field metadata.

        Args:
            parameters: "all", "given" (only the columns that were given) or "none".
        """
        from hdfast.convert import to_arrow

        return to_arrow(self, parameters)

    def to_pandas(self, *, parameters: str = "all") -> Any:
        """The same as a `pandas.DataFrame`; units in `.attrs["units"]`."""
        from hdfast.convert import to_pandas

        return to_pandas(self, parameters)

    def to_polars(self, *, parameters: str = "all") -> Any:
        """The same as a `polars.DataFrame`."""
        from hdfast.convert import to_polars

        return to_polars(self, parameters)

    def to_xarray(self, *, parameters: str = "all") -> Any:
        """Metrics, states, samples and readings as an `xarray.Dataset` over row, state and time; units as attributes.

        Derivatives are named `d_<name>` and run over wrt as well.
        """
        from hdfast.convert import to_xarray

        return to_xarray(self, parameters)
