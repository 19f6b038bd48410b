"""Figures of the first screen of a diagnosis: where, how sure, how much better, and the signals themselves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from hdfast.checks import Floats
from hdfast.diagnosis.locate import PHASES
from hdfast.report.diagnosis_axes import CHANNELS, MEASURED, draw_dependence, draw_orders, draw_overlay
from hdfast.report.diagnosis_views import Trace, telling
from hdfast.report.look import legend
from hdfast.report.plots import BLUE, INK, ORANGE, RED, scaled, styled

PALE = "#eef1f4"
BOXES = {
    "actuator": (0.0, 1.0, 1.5),
    "motor": (2.0, 1.0, 1.5),
    "mesh": (4.0, 1.0, 1.5),
    "load": (6.0, 1.0, 1.5),
    "sensor": (2.0, 0.0, 5.5),
    "structure": (0.0, 0.0, 1.5),
}
NAMES = {"mesh": "gear mesh", "sensor": "sensors", "structure": "structure"}
VIEW = {
    "direction": "motor_speed",
    "load_speed": "motor_speed",
    "torsion": "transmitted_torque",
    "abs_transmitted_torque": "transmitted_torque",
    "motor_torque": "transmitted_torque",
    "lobe_phase": "motor_phase",
    "temperature": "time_since_start",
    "dissipated_energy": "time_since_start",
}
NOISY_TOP = 5.0


@styled
def sketch(marked: Mapping[str, str]) -> Figure:
    """The drive from actuator to load with the places of the mismatch filled.

    Args:
        marked: colour by place.
    """
    figure = Figure(figsize=(4.6, 1.05))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    for place, (x, y, width) in BOXES.items():
        color = marked.get(place)
        box = FancyBboxPatch(
            (x, y), width, 0.62, boxstyle="round,pad=0,rounding_size=0.12", linewidth=0.9,
            facecolor=color or PALE, edgecolor=color or MEASURED,
        )  # fmt: skip
        axes.add_patch(box)
        axes.text(
            x + 0.5 * width, y + 0.3, NAMES.get(place, place), ha="center", va="center", fontsize=9.5,
            color="white" if color else INK, fontweight="bold" if color else "normal",
        )  # fmt: skip
    for x in (1.5, 3.5, 5.5):
        axes.plot([x, x + 0.5], [1.31, 1.31], color=MEASURED, linewidth=2.5, solid_capstyle="butt")
    axes.set_xlim(-0.05, 7.55)
    axes.set_ylim(-0.06, 1.7)
    axes.axis("off")
    return figure


@styled
def phase_map(found: Sequence[Trace], phases: Mapping[int, Floats], explained: bool) -> Figure:
    """Mismatch by channel and phase of motion, in standard deviations of the sensor noise.

    Args:
        found: judged channels of the recordings.
        phases: phase index of every sample by identity of a unit.
        explained: show what the extended model explains of it; else all of it.
    """
    channels = [channel for channel in CHANNELS if any(trace.channel == channel for trace in found)]
    sizes = np.full((len(channels), len(PHASES)), np.nan)
    for row, channel in enumerate(channels):
        for column in range(len(PHASES)):
            squares = [
                ((trace.baseline - trace.extended if explained else trace.missing) / max(trace.floor, 1e-300))[
                    phases[id(trace.unit)] == column
                ]
                for trace in found
                if trace.channel == channel
            ]
            together = np.concatenate(squares)
            if np.isfinite(together).sum() >= 8:
                sizes[row, column] = float(np.sqrt(np.nanmean(together**2)))
    figure = Figure(figsize=(4.6, 0.55 + 0.4 * len(channels)), layout="constrained")
    axes = figure.add_subplot()
    top = max(NOISY_TOP, float(np.nanmax(sizes, initial=0.0)))
    axes.pcolormesh(
        np.arange(len(PHASES) + 1), np.arange(len(channels) + 1), sizes, cmap=heat(), vmin=1.0, vmax=top,
        edgecolors="white", linewidth=1.5,
    )  # fmt: skip
    for row in range(len(channels)):
        for column in range(len(PHASES)):
            size = sizes[row, column]
            text = "·" if np.isnan(size) else (f"{size:.0f}" if size >= 10 else f"{size:.1f}")
            dark = np.isfinite(size) and size > 0.7 * top
            axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color="white" if dark else INK)
    axes.set_xticks(np.arange(len(PHASES)) + 0.5, PHASES)
    axes.set_yticks(np.arange(len(channels)) + 0.5, [CHANNELS[channel] for channel in channels])
    axes.invert_yaxis()
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    return figure


def heat() -> Any:
    """Colours from the noise level to the largest mismatch."""
    from matplotlib.colors import LinearSegmentedColormap

    return LinearSegmentedColormap.from_list("heat", ["#f4f6f8", "#f3cfa6", ORANGE, RED])


@styled
def probabilities(rows: Sequence[tuple[str, float, bool]], sure: float) -> Figure:
    """Probability of each name and of what could stand in its place: (name, probability, named) each."""
    figure = Figure(figsize=(3.9, 0.62 + 0.3 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(rows))
    values = [100.0 * value for _, value, _ in rows]
    axes.barh(place, values, color=[BLUE if named else MEASURED for _, _, named in rows], height=0.62)
    for y, value in enumerate(values):
        axes.text(min(value, 100.0) + 2.0, y, _percent(value), va="center", fontsize=8.5)
    axes.axvline(100.0 * sure, color=INK, linewidth=0.9, linestyle=":")
    axes.text(100.0 * sure, -0.62, "needed to name", ha="center", va="bottom", fontsize=7.5, color=INK)
    axes.set_yticks(place, [name for name, _, _ in rows])
    axes.set_ylim(len(rows) - 0.45, -0.6)
    axes.set_xlim(0.0, 118.0)
    axes.set_xticks([0, 25, 50, 75, 100])
    axes.set_xlabel("probability [%]")
    axes.grid(visible=False, axis="y")
    return figure


def _percent(value: float) -> str:
    return f"{value:.0f} %" if value >= 1.0 else "< 1 %"


@styled
def errors(groups: Sequence[tuple[str, Sequence[tuple[str, float, str]], float]]) -> Figure:
    """Error of prediction of each model: (title, [(name, share of the signals' spread, colour)], noise floor) each."""
    count = sum(len(rows) for _, rows, _ in groups)
    figure = Figure(figsize=(3.9, 0.55 + 0.42 * len(groups) + 0.33 * count), layout="constrained")
    top = 100.0 * max(max(floor, *(value for _, value, _ in rows)) for _, rows, floor in groups)
    grid = figure.subplots(len(groups), 1, sharex=True, squeeze=False, height_ratios=[len(g[1]) for g in groups])
    for axes, (title, rows, floor) in zip(grid[:, 0], groups, strict=True):
        values = [100.0 * value for _, value, _ in rows]
        axes.barh(np.arange(len(rows)), values, color=[color for _, _, color in rows], height=0.66)
        axes.axvline(100.0 * floor, color=INK, linewidth=1.0, linestyle=":")
        for y, value in enumerate(values):
            beyond = max(value, 100.0 * floor) if value > 60.0 * floor else value
            axes.text(beyond + 0.02 * top, y, f"{value:.3g} %", va="center", fontweight="bold")
        axes.set_yticks(np.arange(len(rows)), [name for name, _, _ in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_title(f"{title}; noise {100 * floor:.2g} %", loc="left", fontsize=8.5)
        axes.set_xlim(0.0, 1.25 * top)
        axes.grid(visible=False, axis="y")
    grid[-1, 0].set_xlabel("error, share of the signals' spread [%]")
    return figure


@styled
def overlay(trace: Trace, window: tuple[float, float], size: tuple[float, float] = (6.6, 3.4)) -> Figure:
    """Measured signal with both predictions in a window, and what each leaves."""
    figure = Figure(figsize=size, layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    draw_overlay(upper, lower, trace, window)
    return figure


@styled
def overview(found: Sequence[Trace], variable: str, ratio: float, inertia: float) -> Figure:
    """A diagnosis on one picture: the most telling moment, and what was missing over a state variable."""
    trace, window = telling(found)
    figure = Figure(figsize=(10.4, 4.2), layout="constrained")
    parts: Any = figure.subfigures(1, 2, width_ratios=(3, 2))
    left, right = parts
    upper, lower = left.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    draw_overlay(upper, lower, trace, window)
    axes = right.subplots()
    draw_dependence(axes, [one for one in found if one.channel == trace.channel], variable, ratio, inertia)
    legend(axes, 2)
    return figure


@styled
def dependence(found: Sequence[Trace], variable: str, channel: str, ratio: float, inertia: float) -> Figure:
    """What is missing on one channel against one state variable."""
    figure = Figure(figsize=(3.3, 3.4), layout="constrained")
    axes = figure.add_subplot()
    draw_dependence(axes, [trace for trace in found if trace.channel == channel], variable, ratio, inertia)
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=2, columnspacing=0.8, handlelength=1.4)
    return figure


@styled
def orders(found: Sequence[Trace], channel: str, named: Sequence[float], corner: float) -> Figure:
    """Order spectrum of what is missing on one channel, before and after, with the named lines."""
    figure = Figure(figsize=(3.3, 3.4), layout="constrained")
    axes = figure.add_subplot()
    draw_orders(axes, [trace for trace in found if trace.channel == channel], named, corner)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=1)
    return figure


@styled
def detectable(rows: Sequence[tuple[str, float, float, float, str]]) -> Figure:
    """Smallest amplitude seen: (effect, that of the shape that shows best, that hides best, a typical one, unit).

    That of a shape that never shows is infinite.
    """
    figure = Figure(figsize=(3.9, 0.6 + 0.235 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(rows))
    best, worst = 100.0 * np.array([[least / typical, most / typical] for _, least, most, typical, _ in rows]).T
    ends = np.where(np.isfinite(worst), worst, best)
    low, high = min(1.0, 0.5 * float(best.min(initial=1.0))), 400.0 * max(100.0, float(ends.max(initial=1.0)))
    axes.barh(place, np.minimum(worst, high), color=BLUE, height=0.6, alpha=0.2)
    axes.barh(place, best, color=BLUE, height=0.6, alpha=0.85)
    axes.set_xscale("log")
    axes.axvline(100.0, color=INK, linewidth=0.9, linestyle=":")
    for y, (value, (_, least, most, _, unit)) in enumerate(zip(ends.tolist(), rows, strict=True)):
        told = [end for end in dict.fromkeys((least, most)) if math.isfinite(end)]
        factor, short = scaled(np.array(told), unit)
        span = "\u2013".join(f"{factor * end:.3g}" for end in told)
        axes.text(1.1 * value, y, f"{span} {short if short != '1' else ''}", va="center", fontsize=7.5)
    axes.set_yticks(place, [row[0] for row in rows], fontsize=8.0)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_xlim(low, high)
    axes.set_xlabel("smallest seen [% of a typical one]")
    axes.grid(visible=False, axis="y")
    return figure


@styled
def ranking(rows: Sequence[tuple[str, float]]) -> Figure:
    """How far a mismatch follows every state variable, in units of the 1 % point of noise: (name, statistic) each."""
    figure = Figure(figsize=(3.9, 0.6 + 0.27 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(rows))
    axes.barh(place, [statistic for _, statistic in rows], color=[BLUE, *[MEASURED] * (len(rows) - 1)], height=0.62)
    axes.set_yticks(place, [name for name, _ in rows], fontsize=8.0)
    axes.set_ylim(len(rows) - 0.45, -0.55)
    axes.axvline(1.0, color=INK, linewidth=0.7, linestyle=":")
    axes.set_xlabel("statistic / 1 % point")
    axes.grid(visible=False, axis="y")
    return figure
