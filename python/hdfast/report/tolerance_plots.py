"""Figures of a tolerance study."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.report.plots import BLUE, GREY, INK, ORANGE, RED, TITLES, bars, scaled, styled
from hdfast.tolerance.convergence import Course
from hdfast.tolerance.effects import Effect, followed
from hdfast.tolerance.intervals import Estimate
from hdfast.tolerance.limits import Spec
from hdfast.tolerance.policy import Usable


def title(metric: str) -> str:
    """A metric in words."""
    return TITLES.get(metric, metric.replace("_", " "))


@styled
def distributions(found: Mapping[str, Usable], units: Mapping[str, str], specs: Mapping[str, Spec]) -> Figure:
    """Histograms with percentiles, limits and the number of rows that are not in them."""
    names = list(found)
    columns = min(3, max(1, len(names)))
    lines = max(1, math.ceil(len(names) / columns))
    figure = Figure(figsize=(9.6, 2.45 * lines), layout="constrained")
    for position, name in enumerate(names):
        axes = figure.add_subplot(lines, columns, position + 1)
        _histogram(axes, name, found[name], units[name], specs.get(name))
    if names:
        _shared_legend(figure, 4)
    return figure


def _shared_legend(figure: Figure, columns: int) -> None:
    """One legend below all axes, every label once."""
    entries: dict[str, Any] = {}
    for axes in figure.axes:
        handles, labels = axes.get_legend_handles_labels()
        entries.update(zip(labels, handles, strict=True))
    figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=columns)


def _histogram(axes: Any, name: str, usable: Usable, unit: str, spec: Spec | None) -> None:
    values = usable.measured
    factor, unit = scaled(values, unit)
    axes.set_title(title(name) + (f"\n{usable.note}" if usable.note else ""), loc="left")
    axes.set_xlabel(f"{name} [{unit}]")
    if not bars(axes, values, factor, most=80):
        return
    for share, style in ((1.0, ":"), (50.0, "-"), (99.0, ":")):
        place = float(np.percentile(values, share)) * factor
        label = "median" if share == 50.0 else "1 % and 99 %"
        axes.axvline(place, color=INK, linewidth=0.9, linestyle=style, label=label)
    for limit in (spec.lower, spec.upper) if spec else ():
        low, high = axes.get_xlim()
        if not math.isfinite(limit):
            continue
        if low - (high - low) <= limit * factor <= high + (high - low):
            axes.axvline(limit * factor, color=RED, linewidth=1.2, linestyle="--", label="limit")
        else:
            axes.text(
                0.97, 0.92, f"limit {limit * factor:.4g} {unit}\nfar outside", ha="right", va="top", color=RED,
                transform=axes.transAxes, fontsize=8,
            )  # fmt: skip


@styled
def contributions(shares: Mapping[str, Mapping[str, Estimate]], parameters: Sequence[str]) -> Figure:
    """Share of the variance by metric and parameter, with bands; words where a share is not known."""
    names = list(shares)
    columns = min(3, max(1, len(names)))
    lines = max(1, math.ceil(len(names) / columns))
    figure = Figure(figsize=(9.6, (0.75 + 0.2 * len(parameters)) * lines), layout="constrained")
    for position, name in enumerate(names):
        axes = figure.add_subplot(lines, columns, position + 1)
        places = np.arange(len(parameters))
        values = np.array([shares[name][parameter].value for parameter in parameters])
        low = np.array([shares[name][parameter].low for parameter in parameters])
        high = np.array([shares[name][parameter].high for parameter in parameters])
        shown = np.clip(values, 0.0, None)
        errors = np.nan_to_num(np.abs(np.vstack([shown - np.clip(low, 0.0, shown), np.maximum(high, shown) - shown])))
        known = np.isfinite(values)
        axes.barh(places[known], 100 * shown[known], color=BLUE, alpha=0.8, height=0.65)
        axes.errorbar(
            100 * shown[known], places[known], xerr=100 * errors[:, known], fmt="none", ecolor=INK, elinewidth=0.9,
            capsize=2,
        )  # fmt: skip
        for place in places[~known]:
            axes.text(2, place, "not known", va="center", color=INK, fontsize=7)
        axes.set_yticks(places, parameters if position % columns == 0 else [""] * len(parameters))
        axes.set_ylim(len(parameters) - 0.5, -0.5)
        axes.set_xlim(0, 105)
        axes.set_title(title(name), loc="left")
        axes.set_xlabel("share of the variance [%]")
        axes.grid(visible=False, axis="y")
    return figure


@styled
def percentile_effects(
    found: Sequence[Effect], metrics: Mapping[str, Spec | None], units: Mapping[str, str], parameters: Sequence[str]
) -> Figure:
    """Change of the percentile followed when a tolerance is held, halved or widened; `metrics` with their limits."""
    figure = Figure(figsize=(9.6, 0.8 + 0.34 * len(parameters)), layout="constrained")
    colors = {0.0: BLUE, 0.5: "#7fa8d1", 1.5: ORANGE}
    for position, (metric, spec) in enumerate(metrics.items()):
        axes = figure.add_subplot(1, len(metrics), position + 1)
        sizes = np.array([effect.percentiles[metric].value for effect in found if metric in effect.percentiles])
        factor, unit = scaled(sizes, units[metric])
        for k, change in enumerate(sorted({effect.factor for effect in found})):
            chosen = {e.parameter: e.percentiles[metric] for e in found if e.factor == change}
            places = np.arange(len(parameters)) + 0.27 * (k - 1)
            values = np.array([chosen[p].value for p in parameters]) * factor
            reach = np.array([chosen[p].high - chosen[p].value for p in parameters]) * factor
            label = "held at its middle" if change == 0.0 else f"spread times {change:g}"
            axes.barh(places, values, height=0.25, color=colors.get(change, GREY), label=label)
            axes.errorbar(values, places, xerr=reach, fmt="none", ecolor=INK, elinewidth=0.7, capsize=1.5)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_yticks(np.arange(len(parameters)), parameters if position == 0 else [""] * len(parameters))
        axes.invert_yaxis()
        axes.set_title(title(metric), loc="left")
        axes.set_xlabel(f"change of P{followed(spec):g} [{unit}]")
        axes.grid(visible=False, axis="y")
    if figure.axes:
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


@styled
def convergence(courses: Sequence[tuple[str, str, Course, float]]) -> Figure:
    """Running estimates with their band: (title, unit, course, level asked for or NaN) each."""
    columns = min(3, max(1, len(courses)))
    lines = max(1, math.ceil(len(courses) / columns))
    figure = Figure(figsize=(9.6, 2.5 * lines), layout="constrained")
    for position, (name, unit, course, asked) in enumerate(courses):
        axes = figure.add_subplot(lines, columns, position + 1)
        values = np.array([estimate.value for estimate in course.estimates])
        factor, shown = (100.0, "%") if unit == "share" else scaled(values, unit)
        low, high = (np.array([getattr(e, side) for e in course.estimates]) * factor for side in ("low", "high"))
        known = np.isfinite(low) & np.isfinite(high)
        axes.fill_between(
            course.rows, low, high, where=known, color=BLUE, alpha=0.2, linewidth=0.0, label="95 % interval"
        )
        axes.plot(course.rows, values * factor, color=BLUE, marker=".", label="estimate")
        if math.isfinite(asked):
            axes.axhline(asked * factor, color=RED, linewidth=1.0, linestyle="--", label="asked for, or limit")
        axes.set_xscale("log")
        axes.set_title(name, loc="left")
        axes.set_xlabel("rows")
        axes.set_ylabel(f"[{shown}]")
    if courses:
        _shared_legend(figure, 3)
    return figure
