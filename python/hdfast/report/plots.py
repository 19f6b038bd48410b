"""Every figure of the package, in one look."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator

from hdfast.checks import Floats
from hdfast.result import MAIN_METRICS, SweepResult
from hdfast.scenario_parts import PER_RPM
from hdfast.simulate import Trajectory
from hdfast.tolerance.limits import Spec

INK, BLUE, ORANGE, RED, GREY = "#1b1f24", "#1f5f99", "#d9822b", "#b3261e", "#8a929a"
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9.0,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "grid.color": "#e3e6e9",
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.color": INK,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "hdfast",
}
HAIR = 0.01  # [in]
TITLES = {
    "steady_speed": "steady motor speed",
    "rise_time": "rise time, motor, 5-95 %",
    "stop_time": "stop time, motor, 95-5 %",
    "peak_windup": "peak windup",
    "te_pp": "transmission error, p-p",
    "te_rms": "transmission error, rms",
    "te_peak": "transmission error, peak",
    "speed_ripple": "load speed ripple, p-p",
    "mode_frequency_start": "mode frequency after start",
    "mode_amplitude_start": "mode amplitude after start",
    "mode_amplitude_stop": "mode amplitude after stop",
    "residual_ring": "residual ring",
    "energy_in": "energy in",
}
PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"))
HARMONICS = 20
POINTS_PER_TURN = 720

Arguments = ParamSpec("Arguments")


def styled(draw: Callable[Arguments, Figure]) -> Callable[Arguments, Figure]:
    """Draw a figure in the look of the package, whatever the user's settings are."""

    @wraps(draw)
    def inside(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Figure:
        with mpl.rc_context(dict(mpl.rcParamsDefault) | STYLE):
            return draw(*args, **kwargs)

    return inside


def svg(figure: Figure) -> str:
    """A figure as SVG text without XML header, the same bytes for the same figure."""
    text = _saved(figure)
    if _is_cut(figure):
        _pin_ticks(figure)
        text = _saved(figure)
    return text[text.index("<svg") :]


def _saved(figure: Figure) -> str:
    buffer = io.StringIO()
    box = "tight" if figure.get_layout_engine() is None else None
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format="svg", bbox_inches=box, metadata={"Date": None})
    return buffer.getvalue()


def _is_cut(figure: Figure) -> bool:
    """Whether a layout left too little room at an edge, as it does where other ticks are drawn than it saw."""
    if figure.get_layout_engine() is None:
        return False
    with mpl.rc_context(STYLE):
        taken = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    return bool(min(taken.x0, taken.y0, width - taken.x1, height - taken.y1) < -HAIR)


def _pin_ticks(figure: Figure) -> None:
    """Keep the ticks as they are, whatever room the next layout gives."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_locator(), AutoLocator):
                low, high = sorted(axis.get_view_interval())
                axis.set_ticks([place for place in axis.get_majorticklocs() if low <= place <= high])


def scaled(values: Floats, unit: str) -> tuple[float, str]:
    """Factor and unit with a prefix that bring the values near 1 ... 1000."""
    if unit.split("/", maxsplit=1)[0].split(" ", maxsplit=1)[0] not in ("rad", "N", "J", "s"):
        return 1.0, unit
    finite = np.abs(values[np.isfinite(values)])
    size = float(np.max(finite)) if finite.size else 0.0
    if size == 0.0:
        return 1.0, unit
    step, prefix = next(((s, p) for s, p in reversed(PREFIXES) if size >= s), PREFIXES[0])
    return 1.0 / step, prefix + unit


@styled
def histograms(result: SweepResult, specs: Mapping[str, Spec]) -> Figure:
    """Histograms of the main and the specified metrics with percentiles and limits."""
    names = [name for name in dict.fromkeys([*specs, *MAIN_METRICS]) if name in result.metrics][:12]
    columns = min(3, len(names))
    lines = math.ceil(len(names) / columns) if names else 0
    figure = Figure(figsize=(9.6, 2.35 * max(lines, 1)), layout="constrained")
    for position, name in enumerate(names):
        _histogram(figure.add_subplot(lines, columns, position + 1), result, name, specs.get(name))
    if names:
        handles = figure.axes[0].get_legend_handles_labels()
        limited = next((axes for axes in figure.axes if "limit" in axes.get_legend_handles_labels()[1]), None)
        handles = limited.get_legend_handles_labels() if limited else handles
        figure.legend(*handles, loc="outside lower center", ncols=4)
    return figure


def bars(axes: Any, values: Floats, factor: float, *, most: int) -> bool:
    """Counts of values, times a factor, in at most so many bins; False where there are no values to count."""
    axes.set_ylabel("rows")
    axes.locator_params(axis="x", nbins=5)
    if not values.size:
        axes.text(0.5, 0.5, "no row has this metric", ha="center", va="center", transform=axes.transAxes, color=GREY)
        return False
    spread = float(np.ptp(values))
    bins = 1 if spread <= 1e-12 * abs(float(values[0])) else int(np.clip(np.sqrt(values.size), 8, most))
    axes.hist(values * factor, bins=bins, color=BLUE, alpha=0.75, linewidth=0.0)
    return True


def _histogram(axes: Any, result: SweepResult, name: str, spec: Spec | None) -> None:
    values = result.usable(name)
    factor, unit = scaled(values, result.units[name])
    axes.set_title(TITLES.get(name, name.replace("_", " ")), loc="left")
    axes.set_xlabel(f"{name} [{unit}]")
    if not bars(axes, values, factor, most=60):
        return
    low, middle, high = np.percentile(values, (5.0, 50.0, 95.0)) * factor
    axes.axvline(low, color=INK, linewidth=0.9, linestyle=":", label="5 % and 95 %")
    axes.axvline(high, color=INK, linewidth=0.9, linestyle=":")
    axes.axvline(middle, color=INK, linewidth=1.0, label="median")
    for side, limit in (("right", spec.upper), ("left", spec.lower)) if spec else ():
        if math.isfinite(limit):
            _limit(axes, limit * factor, unit, side)


def _limit(axes: Any, limit: float, unit: str, side: str) -> None:
    """A line where the limit is near the data, else a note with an arrow to its side."""
    low, high = axes.get_xlim()
    if low - 1.5 * (high - low) <= limit <= high + 1.5 * (high - low):
        label = None if "limit" in axes.get_legend_handles_labels()[1] else "limit"
        axes.axvline(limit, color=RED, linewidth=1.3, linestyle="--", label=label)
        return
    text = f"limit {limit:.4g} {unit}"
    note = f"{text} \u2192" if side == "right" else f"\u2190 {text}"
    at = 0.99 if side == "right" else 0.01
    axes.text(
        at, 0.97, note, ha=side, va="top", transform=axes.transAxes, color=RED, fontsize=8.0, backgroundcolor="white"
    )


@styled
def trajectory(run: Trajectory, names: Sequence[str] = ("omega_m", "omega_l", "windup", "te", "tau_m")) -> Figure:
    """The named signals over time, as far as they were sampled; all sampled signals when none of them was."""
    panels = [(name, *PANELS[name]) for name in names if name in run.signals]
    if not panels:
        panels = [(name, name, 1.0, run.units[name]) for name in run.signals]
    figure = Figure(figsize=(9.6, 1.75 * len(panels)), layout="constrained")
    shared = None
    for position, (name, label, factor, unit) in enumerate(panels):
        axes = figure.add_subplot(len(panels), 1, position + 1, sharex=shared)
        shared = shared or axes
        axes.plot(run.t, run[name] * factor, color=BLUE)
        axes.set_ylabel(f"{label}\n[{unit}]")
        _mark_phases(axes, run)
        if position < len(panels) - 1:
            axes.tick_params(labelbottom=False)
    figure.axes[-1].set_xlabel("time [s]")
    return figure


PANELS = {
    "omega_m": ("motor speed", PER_RPM, "r/min"),
    "omega_l": ("load speed", PER_RPM, "r/min"),
    "windup": ("windup", 1e6, "µrad"),
    "te": ("transmission error", 1e6, "µrad"),
    "tau_m": ("motor torque", 1.0, "N m"),
}


def _mark_phases(axes: Any, run: Trajectory) -> None:
    for moment in {run.scenario.t_on, run.scenario.t_off} - {0.0, run.scenario.t_end}:
        axes.axvline(moment, color=GREY, linewidth=0.8, linestyle="--")
    axes.set_xlim(run.t[0], run.t[-1])


def _legend_above(axes: Any) -> None:
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)


@styled
def speeds(run: Trajectory) -> Figure:
    """Input and output speed over time, the output also drawn at the input's scale."""
    figure = Figure(figsize=(9.6, 3.9), layout="constrained")
    _speeds(run, *figure.subplots(2, 1, sharex=True))
    return figure


def _speeds(run: Trajectory, upper: Any, lower: Any) -> None:
    ratio = run.parameters["ratio"]
    upper.plot(
        run.t, run["omega_l"] * PER_RPM * ratio, color=ORANGE, linewidth=0.9, label=f"load speed times {ratio:g}"
    )
    upper.plot(run.t, run["omega_m"] * PER_RPM, color=BLUE, label="motor speed")
    upper.set_ylabel("motor speed\n[r/min]")
    _legend_above(upper)
    lower.plot(run.t, run["omega_l"] * PER_RPM, color=ORANGE)
    lower.set_ylabel("load speed\n[r/min]")
    lower.set_xlabel("time [s]")
    for axes in (upper, lower):
        _mark_phases(axes, run)


@styled
def overview(result: SweepResult, run: Trajectory, specs: Mapping[str, Spec]) -> Figure:
    """A run on one picture: speeds, transmission error with its orders, and three distributions."""
    figure = Figure(figsize=(10.4, 7.6), layout="constrained")
    parts: Any = figure.subfigures(3, 1, height_ratios=(1.35, 1.0, 0.95))
    top, middle, bottom = parts
    _speeds(run, *top.subplots(2, 1, sharex=True))
    _transmission_error(run, *middle.subplots(1, 2, width_ratios=(3, 2)))
    for axes, name in zip(bottom.subplots(1, 3), ("te_pp", "rise_time", "mode_frequency_start"), strict=True):
        _histogram(axes, result, name, specs.get(name))
    return figure


@styled
def transmission_error(run: Trajectory) -> Figure:
    """Transmission error over motor revolutions of the run phase, and its order spectrum."""
    figure = Figure(figsize=(9.6, 3.2), layout="constrained")
    _transmission_error(run, *figure.subplots(1, 2, width_ratios=(3, 2)))
    return figure


def _transmission_error(run: Trajectory, left: Any, right: Any) -> None:
    revolutions, te, kinematic = whole_revolutions(run)
    left.set_xlabel("motor revolutions before the stop")
    left.set_ylabel("transmission error [µrad]")
    right.set_xlabel("order [per motor revolution]")
    right.set_ylabel("amplitude [µrad]")
    if not te.size:
        left.text(0.5, 0.5, "less than one revolution", ha="center", va="center", transform=left.transAxes, color=GREY)
        return
    left.plot(revolutions, kinematic * 1e6, color="#c3c9cf", linewidth=3.5, label="kinematic error alone")
    left.plot(revolutions, te * 1e6, color=BLUE, label="transmission error")
    _legend_above(left)
    turns = round(float(revolutions[-1] - revolutions[0]))
    orders = np.arange(1, HARMONICS + 1)
    for offset, values, color, label in (
        (-0.18, kinematic, GREY, "kinematic error"),
        (0.18, te, BLUE, "transmission error"),
    ):
        lines = 2.0 / (len(values) - 1) * np.abs(np.fft.rfft(values[:-1]))[orders * turns]
        right.bar(orders + offset, lines * 1e6, width=0.36, color=color, label=label)
    right.set_yscale("log")
    right.set_xticks([1, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20])
    right.grid(visible=False, axis="x")
    _legend_above(right)
    right.set_ylim(bottom=max(right.get_ylim()[0], 1e-3))


def whole_revolutions(run: Trajectory, longest: int = 3) -> tuple[Floats, Floats, Floats]:
    """(revolutions, te, theta_e) on a uniform angle grid over the last whole revolutions of the run phase."""
    begin = run.scenario.t_on if math.isnan(run.scenario.t_run) else run.scenario.t_run
    inside = (run.t >= begin) & (run.t <= run.scenario.t_off) & np.isfinite(run["te"])
    angle = run["theta_m"][inside] / (2.0 * math.pi)
    if angle.size < 2:
        return (np.empty(0),) * 3
    if angle[-1] < angle[0]:
        angle = -angle
    still = np.flatnonzero(np.diff(angle) <= 0.0)
    first = int(still[-1]) + 1 if still.size else 0
    turns = min(longest, int(angle[-1] - angle[first]))
    if turns < 1:
        return (np.empty(0),) * 3
    t = run.t[inside]
    begin = t[max(int(np.searchsorted(angle, angle[-1] - turns)) - 1, first)]
    points = turns * POINTS_PER_TURN + 1
    fine = run.sampled(np.linspace(begin, t[-1], points), ("theta_m", "te", "theta_e"))
    angle = np.abs(fine["theta_m"] - fine["theta_m"][-1]) / (2.0 * math.pi)
    grid = np.linspace(-turns, 0.0, points)
    te, kinematic = (np.interp(grid, -angle, fine[name]) for name in ("te", "theta_e"))
    return grid, te, kinematic
