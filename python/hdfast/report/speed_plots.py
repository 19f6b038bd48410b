"""Figures of the studies of speed and of the validation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.report.look import SERIES, label, legend, plain_log
from hdfast.report.plots import BLUE, GREY, ORANGE, RED, styled
from hdfast.scenario_parts import PER_RPM
from hdfast.simulate import Trajectory
from hdfast.studies import cases, speed, validation_runs
from hdfast.studies.study import Study

TURN = 2.0 * math.pi
FLOOR = 1e-6  # µrad; rounding of the integration lies below


@styled
def crossings(study: Study) -> Figure:
    """Amplitude of every order of the load speed over the set speed, and where orders cross the mode."""
    grid = study.grids["speed_rpm"]
    figure = Figure(figsize=(9.6, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    lines = study.curves["lines"] * 1e3
    edges_n = np.arange(len(speed.ORDERS) + 1) + 0.5
    middle = 0.5 * (grid.values[1:] + grid.values[:-1])
    edges = np.concatenate(
        [[1.5 * grid.values[0] - 0.5 * grid.values[1]], middle, [1.5 * grid.values[-1] - 0.5 * grid.values[-2]]]
    )
    mesh = left.pcolormesh(edges, edges_n, np.log10(np.maximum(lines, 1e-3)), cmap="viridis", rasterized=True)
    figure.colorbar(mesh, ax=left, label="load speed amplitude [mrad/s], log10")
    mode = study.curves["mode"]
    left.plot(
        grid.values,
        mode * 60.0 / grid.values,
        color="white",
        linewidth=1.2,
        linestyle="--",
        label="order meets the mode",
    )
    left.set_ylim(0.5, len(speed.ORDERS) + 0.5)
    left.grid(visible=False)
    label(left, "set speed [r/min]", "order [per motor revolution]")
    leg = left.legend(loc="upper right", fontsize=7.5)
    for text in leg.get_texts():
        text.set_color("white")
    for n, color in zip((1, 2, 4, 6, 15), SERIES, strict=False):
        right.plot(grid.values, lines[n - 1], color=color, label=f"order {n}")
        right.plot(grid.values[grid.marked], lines[n - 1][grid.marked], "o", ms=3.0, color=color)
    right.set_yscale("log")
    label(right, "set speed [r/min]", "load speed amplitude [mrad/s]")
    legend(right, 3)
    return figure


@styled
def time_frequency(study: Study) -> Figure:
    """Time-frequency and angle-order map of a start, run and stop at 300 r/min."""
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    run: Trajectory = study.curves["run"]
    for axes, (x, y, values), top, names in (
        (left, speed.time_frequency(run), 90.0, ("time [s]", "frequency [Hz]")),
        (right, speed.order_map(run), 20.0, ("motor revolutions", "order [per motor revolution]")),
    ):
        shown = y <= top
        level = np.log10(np.maximum(values[shown] * 1e3, 1e-3))
        mesh = axes.pcolormesh(x, y[shown], level, cmap="viridis", shading="nearest", rasterized=True)
        axes.grid(visible=False)
        label(axes, *names)
        figure.colorbar(mesh, ax=axes, label="amplitude [mrad/s], log10")
    left.axhline(study.curves["mode"], color="white", linewidth=0.9, linestyle="--")
    left.text(
        0.98,
        study.curves["mode"] + 1.0,
        "free mode",
        color="white",
        fontsize=7.5,
        ha="right",
        transform=left.get_yaxis_transform(),
    )
    return figure


@styled
def speed_jump(study: Study) -> Figure:
    """Ripple while the speed rises and falls slowly: one curve where the motion does not jump."""
    jump = study.curves["jump"]
    figure = Figure(figsize=(9.6, 2.7), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(jump["speed"], jump["up"] * 1e3, color=BLUE, label="speed rising")
    axes.plot(jump["speed"], jump["down"] * 1e3, color=ORANGE, linestyle="--", label="speed falling")
    label(axes, "motor speed [r/min]", "load speed ripple, rms [mrad/s]")
    legend(axes)
    return figure


def phase_planes(run: Trajectory, end: float) -> Figure:
    """Phase planes of both angles, unwrapped and wrapped to a motor revolution, up to a time [s]."""
    return _phase_planes(run, end)


@styled
def _phase_planes(run: Trajectory, end: float) -> Figure:
    figure = Figure(figsize=(9.6, 5.4), layout="constrained")
    inside = run.t <= end
    ratio = run.parameters["ratio"]
    load_period = TURN / ratio
    panels: tuple[tuple[Any, Any, str, str, str], ...] = (
        (
            run["theta_m"],
            run["omega_m"] * PER_RPM,
            "motor angle [rad]",
            "motor speed [r/min]",
            "unwrapped: grows by definition",
        ),
        (run["theta_l"], run["omega_l"] * PER_RPM, "load angle [rad]", "load speed [r/min]", "unwrapped"),
        (
            run["theta_m"] % TURN,
            run["omega_m"] * PER_RPM,
            "motor angle [rad], one revolution",
            "motor speed [r/min]",
            "wrapped",
        ),
        (
            (run["theta_l"] - load_period * np.floor(run["theta_m"] / TURN)) * 1e3,
            run["omega_l"] * PER_RPM,
            "load angle [mrad], one motor revolution",
            "load speed [r/min]",
            "wrapped",
        ),
    )
    for position, (x, y, x_name, y_name, title) in enumerate(panels):
        axes = figure.add_subplot(2, 2, position + 1)
        axes.plot(x[inside], y[inside], ".", ms=1.0, color=BLUE, rasterized=True)
        label(axes, x_name, y_name, title)
    return figure


@styled
def held_runs(study: Study) -> Figure:
    """Transmission error over three motor revolutions, and its spectrum, at the three speeds."""
    figure = Figure(figsize=(9.6, 6.0), layout="constrained")
    runs: dict[float, Trajectory] = study.curves["runs"]
    for line, (set_speed, run) in enumerate(runs.items()):
        left, right = figure.add_subplot(3, 2, 2 * line + 1), figure.add_subplot(3, 2, 2 * line + 2)
        turns = run["theta_m"] / TURN
        shown = turns > turns[-1] - min(3.0, turns[-1])
        left.plot(
            turns[shown] - turns[-1],
            run["theta_e"][shown] * 1e6,
            color="#c3c9cf",
            linewidth=3.0,
            label="kinematic error",
        )
        left.plot(turns[shown] - turns[-1], run["te"][shown] * 1e6, color=BLUE, label="transmission error")
        label(left, "motor revolutions before the end", f"{set_speed:g} r/min\nTE [µrad]")
        steady = run.t >= validation_runs.RUN_IN
        signal = run["te"][steady] - run["te"][steady].mean()
        window = np.hanning(len(signal))
        amplitude = 2.0 * np.abs(np.fft.rfft(signal * window)) / window.sum()
        right.plot(np.fft.rfftfreq(len(signal), 1e-3), np.maximum(amplitude * 1e6, FLOOR), color=BLUE, linewidth=0.8)
        right.set_yscale("log")
        right.set_xscale("log")
        right.set_xlim(0.1, 500.0)
        right.set_ylim(10.0 * FLOOR, 300.0)
        label(right, "frequency [Hz], to the Nyquist frequency", "amplitude [µrad]")
        if line == 0:
            legend(left)
    return figure


@styled
def released(study: Study) -> Figure:
    """Windup after a start from zero angles and from a relaxed spring."""
    figure = Figure(figsize=(9.6, 2.8), layout="constrained")
    axes = figure.add_subplot()
    for run, color, name in (
        (study.curves["released"], ORANGE, "zero angles: the initial TE is let go"),
        (study.curves["runs"][15.0], BLUE, "relaxed spring"),
    ):
        shown = run.t <= 0.6
        axes.plot(run.t[shown], run["windup"][shown] * 1e6, color=color, label=name)
    label(axes, "time [s]", "windup [µrad]")
    legend(axes)
    return figure


@styled
def rmse_curve(study: Study) -> Figure:
    """Error of the Fourier fit over the number of orders."""
    figure = Figure(figsize=(9.6, 3.0), layout="constrained")
    draw_rmse(figure.add_subplot(), study.curves["fit"].curves["selection"])
    return figure


def draw_rmse(axes: Any, selection: Any) -> None:
    """RMSE, held-out RMSE, knee and suggestion over the number of orders."""
    numbers = np.arange(1, len(selection.rmse) + 1)
    axes.plot(numbers, selection.rmse * 1e6, "o-", ms=3.5, color=BLUE, label="RMSE of the fit")
    axes.plot(numbers, selection.held_out * 1e6, "x--", ms=4.0, color=ORANGE, label="on left-out revolutions")
    marks = {selection.suggested: "suggested"}
    marks[selection.knee] = "knee and suggested" if selection.knee in marks else "knee"
    for (number, name), color, dash in zip(marks.items(), (RED, GREY), ("--", ":"), strict=False):
        axes.axvline(number, color=color, linewidth=0.9, linestyle=dash, label=f"{name}: {number}")
    axes.set_yscale("log")
    axes.set_xticks([1, 5, 10, 15, 20] if len(numbers) <= 20 else numbers[::5])
    plain_log(axes.yaxis)
    label(axes, "number of orders", "RMSE [µrad]")
    legend(axes, 4)


@styled
def te_over_speed(study: Study) -> Figure:
    """Peak-to-peak and rms transmission error over held speeds."""
    figure = Figure(figsize=(9.6, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    held = study.curves["held"]
    for load, color in zip(cases.LOADS, SERIES, strict=False):
        for axes, metric in ((left, "te_pp"), (right, "te_rms")):
            axes.plot(
                validation_runs.SPEEDS,
                validation_runs.te(held, metric, load) * 1e6,
                "o-",
                ms=3.5,
                color=color,
                label=f"J_l {load:g} kg m²",
            )
    label(left, "motor speed [r/min]", "TE peak to peak [µrad]")
    label(right, "motor speed [r/min]", "TE rms [µrad]")
    legend(left)
    return figure


@styled
def start_stop(study: Study) -> Figure:
    """Input and output speed of start and stop at 100 r/min."""
    from hdfast.report.plots import _speeds

    figure = Figure(figsize=(9.6, 3.9), layout="constrained")
    _speeds(study.curves["stop"], *figure.subplots(2, 1, sharex=True))
    return figure
