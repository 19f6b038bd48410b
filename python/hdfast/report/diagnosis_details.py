"""Figures of the details of a diagnosis: time, state, orders and frequencies, parameters, every recording."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.checks import Floats
from hdfast.report.diagnosis_axes import CHANNELS, MEASURED, UNITS, draw_dependence, draw_orders, draw_spectrum
from hdfast.report.diagnosis_plots import NOISY_TOP, heat
from hdfast.report.diagnosis_views import Trace, level
from hdfast.report.look import label, legend, literal
from hdfast.report.plots import BLUE, GREY, INK, ORANGE, RED, scaled, styled
from hdfast.scenario_parts import PER_RPM

WIDTH, CELLS = 11.0, 200
VARIABLES = ("motor_speed", "transmitted_torque", "load_phase", "motor_phase")


@styled
def time_strips(found: Sequence[Trace], windows: Sequence[Sequence[Any]]) -> Figure:
    """Size of the mismatch since each start, one row per recording and channel; black bars: the reported windows."""
    first, second = found[0].models
    parts = {f"{first} model": "missing"} | ({f"{second} model": "left"} if second else {})
    figure = Figure(figsize=(WIDTH, 0.8 + 0.3 * len(found)), layout="constrained")
    grid = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    loud = [np.nanquantile(np.abs(one.missing), 0.99) / one.floor for one in found if np.isfinite(one.missing).any()]
    top = float(max([NOISY_TOP, *loud]))
    image: Any = None
    for axes, (title, part) in zip(grid, parts.items(), strict=True):
        for row, trace in enumerate(found):
            edges, start = np.linspace(trace.t[0], trace.t[-1], CELLS + 1), trace.t[0] - trace.unit.before
            image = axes.imshow(
                level(trace, getattr(trace, part), edges)[None], cmap=heat(), vmin=1.0, vmax=top, aspect="auto",
                interpolation="none", extent=(edges[0] - start, edges[-1] - start, row + 0.38, row - 0.38),
            )  # fmt: skip
            for begin, end, name in windows if part == "missing" else ():
                if name == trace.unit.name and trace.unit.role == "fit":
                    ends = [begin - start, end - start]
                    axes.plot(ends, [row - 0.42] * 2, color=INK, linewidth=2.0, solid_capstyle="butt")
        begins = [trace.unit.before for trace in found]
        axes.set_xlim(
            min(begins), max(begin + float(np.ptp(trace.t)) for begin, trace in zip(begins, found, strict=True))
        )
        axes.set_ylim(len(found) - 0.45, -0.55)
        axes.grid(visible=False)
        axes.tick_params(axis="y", length=0)
        label(axes, "time since the start [s]", "", title)
    grid[0].set_yticks(np.arange(len(found)), [_named(trace) for trace in found], fontsize=7.5)
    figure.colorbar(image, ax=grid, label="rms / noise", fraction=0.02, pad=0.01)
    return figure


def _named(trace: Trace) -> str:
    held = ", held out" if trace.unit.role == "heldout" else ""
    return f"{literal(trace.unit.name)}{held}: {CHANNELS[trace.channel]}"


@styled
def state_views(found: Sequence[Trace], channel: str, ratio: float, inertia: float) -> Figure:
    """What is missing on one channel against speed, torque through the gear and both phases."""
    own = [trace for trace in found if trace.channel == channel]
    figure = Figure(figsize=(WIDTH, 5.8), layout="constrained")
    for axes, variable in zip(figure.subplots(2, 2).flat, VARIABLES, strict=True):
        draw_dependence(axes, own, variable, ratio, inertia)
    handles, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=4)
    return figure


@styled
def spectra(
    found: Sequence[Trace], channel: str, orders: Sequence[float], tones: Sequence[float], corner: float
) -> Figure:
    """Spectra of the mismatch over orders and over frequency, before and after, with the named lines."""
    own = [trace for trace in found if trace.channel == channel]
    figure = Figure(figsize=(WIDTH, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_orders(left, own, orders, corner)
    draw_spectrum(right, own, [trace.t for trace in own], tones, corner)
    right.set_xlabel("frequency [Hz]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


@styled
def phase_planes(found: Sequence[Trace], channel: str) -> Figure:
    """One channel of every recording against motor speed, measured and as the first model predicts."""
    own = [trace for trace in found if trace.channel == channel]
    columns = min(3, len(own))
    lines = math.ceil(len(own) / columns)
    figure = Figure(figsize=(WIDTH, 2.6 * lines + 0.35), layout="constrained")
    grid = figure.subplots(lines, columns, squeeze=False)
    factor, unit = scaled(np.concatenate([trace.measured for trace in own]), UNITS[channel])
    for axes, trace in zip(grid.flat, own, strict=False):
        speed = trace.unit.speed * PER_RPM
        every = max(1, len(speed) // 1500)
        axes.plot(speed[::every], trace.measured[::every] * factor, color=MEASURED, linewidth=2.4, label="measured")
        first = trace.baseline[::every] * factor
        axes.plot(speed[::every], first, color=ORANGE, linewidth=0.9, label=f"{trace.models[0]} model")
        axes.set_title(literal(trace.unit.name), loc="left")
        axes.set_ylabel(f"{CHANNELS[channel]} [{unit}]")
    for axes in grid.flat[len(own) :]:
        axes.axis("off")
    for axes in grid[-1]:
        axes.set_xlabel("motor speed [r/min]")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


@styled
def pulls(
    names: Sequence[str], before: Floats, after: Floats | None, marked: Sequence[str], first: str = "nominal"
) -> Figure:
    """How far every parameter lies from its nominal value in standard deviations of the prior, before and after.

    Args:
        names: parameters.
        before, after: distances of the calibrated nominal and the extended model (P,), NaN for a parameter that a model
            does not have; None without an extension.
        marked: parameters that had swallowed an effect.
        first: name of the model without the extension.
    """
    figure = Figure(figsize=(WIDTH, 0.75 + 0.235 * len(names)), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(names))
    axes.axvspan(-1.0, 1.0, color=GREY, alpha=0.15, linewidth=0.0, label="±1 σ of the prior")
    axes.axvline(0.0, color=INK, linewidth=0.7)
    if after is not None:
        for y, begin, end in zip(place, before, after, strict=True):
            axes.plot([begin, end], [y, y], color=MEASURED, linewidth=1.6, zorder=1)
        axes.plot(after, place, "o", ms=5.0, color=BLUE, label="extended model")
    axes.plot(before, place, "o", ms=5.0, color=ORANGE, label=f"{first} model")
    axes.set_yticks(place, names)
    for tick, name in zip(axes.get_yticklabels(), names, strict=True):
        if name in marked:
            tick.set_color(RED)
            tick.set_fontweight("bold")
    axes.set_ylim(len(names) - 0.4, -0.6)
    shown = [own for own in (before, after) if own is not None]
    reach = 1.1 * max(2.0, *(float(np.nanmax(np.abs(own), initial=0.0)) for own in shown))
    axes.set_xlim(-reach, reach)
    axes.set_xlabel("distance from the nominal value [σ of the prior]")
    axes.grid(visible=False, axis="y")
    legend(axes)
    return figure


@styled
def recordings(found: Sequence[Trace], channel: str) -> Figure:
    """One channel of every recording with both predictions."""
    own = [trace for trace in found if trace.channel == channel]
    first, second = own[0].models
    lines = math.ceil(len(own) / 2)
    figure = Figure(figsize=(WIDTH, 1.85 * lines + 0.35), layout="constrained")
    grid = figure.subplots(lines, 2, squeeze=False)
    factor, unit = scaled(np.concatenate([trace.measured for trace in own]), UNITS[channel])
    for axes, trace in zip(grid.flat, own, strict=False):
        every = max(1, len(trace.t) // 800)
        t = trace.t[::every]
        axes.plot(t, trace.measured[::every] * factor, color=MEASURED, linewidth=2.6, label="measured")
        axes.plot(t, trace.baseline[::every] * factor, color=ORANGE, linewidth=0.9, label=f"{first} model")
        if second:
            axes.plot(t, trace.extended[::every] * factor, color=BLUE, linewidth=0.9, label=f"{second} model")
        axes.set_title(literal(trace.unit.name) + (", held out" if trace.unit.role == "heldout" else ""), loc="left")
        axes.set_ylabel(f"[{unit}]")
    for axes in grid.flat[len(own) :]:
        axes.axis("off")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3)
    return figure


@styled
def raw(columns: Sequence[tuple[str, Mapping[str, Floats]]]) -> Figure:
    """Recordings as they were read, for those that were rejected: (name, columns) each."""
    figure = Figure(figsize=(WIDTH, 1.7 * len(columns) + 0.3), layout="constrained")
    grid = figure.subplots(len(columns), 2, squeeze=False)
    for row, (name, table) in enumerate(columns):
        t = table.get("t")
        for axes, channel, unit in zip(grid[row], ("motor_angle", "motor_torque"), ("rad", "N m"), strict=True):
            if t is not None and channel in table and len(t):
                every = max(1, len(t) // 800)
                axes.plot(t[::every], table[channel][::every], color=BLUE, linewidth=0.9)
            else:
                axes.text(0.5, 0.5, "not recorded", ha="center", va="center", transform=axes.transAxes, color=GREY)
            axes.set_title(f"{literal(name)}: {channel.replace('_', ' ')}", loc="left")
            axes.set_ylabel(f"[{unit}]")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]")
    return figure
