"""Views of a mismatch on given axes: against a state of the drive, over orders and over frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.report.diagnosis_views import Trace, middle, spectrum, states
from hdfast.report.look import label, legend, literal
from hdfast.report.plots import BLUE, GREY, INK, ORANGE, RED, scaled

MEASURED = "#a9b1b8"
CHANNELS = {"motor_torque": "motor torque", "te": "transmission error", "output_torque": "output torque"}
UNITS = {"motor_torque": "N m", "te": "rad", "output_torque": "N m"}
MOST_POINTS, BINS = 500, 24
LABEL_SHARE = 0.05
LOWEST_END, HIGHEST_END = 4.5, 16.0


def draw_overlay(upper: Any, lower: Any, trace: Trace, window: tuple[float, float]) -> None:
    """Signal and predictions above, what each leaves below."""
    first, second = trace.models
    inside = (trace.t >= window[0]) & (trace.t <= window[1])
    t = trace.t[inside]
    factor, unit = scaled(trace.measured[inside], UNITS[trace.channel])
    upper.plot(t, trace.measured[inside] * factor, color=MEASURED, linewidth=3.2, label="measured")
    upper.plot(t, trace.baseline[inside] * factor, color=ORANGE, linewidth=1.2, label=f"{first} model")
    if second:
        upper.plot(t, trace.extended[inside] * factor, color=BLUE, linewidth=1.2, label=f"{second} model")
    label(upper, "", f"{CHANNELS[trace.channel]} [{unit}]")
    legend(upper)
    factor, unit = scaled(trace.missing[inside], UNITS[trace.channel])
    lower.axhspan(-2 * trace.floor * factor, 2 * trace.floor * factor, color=GREY, alpha=0.18, linewidth=0.0)
    lower.plot(t, trace.missing[inside] * factor, color=ORANGE, linewidth=1.0)
    if second:
        lower.plot(t, trace.left[inside] * factor, color=BLUE, linewidth=1.0)
    lower.axhline(0.0, color=INK, linewidth=0.6)
    label(lower, f"time in {literal(trace.unit.name)} [s]", f"left over [{unit}]")
    lower.set_xlim(*window)


def draw_dependence(axes: Any, own: Sequence[Trace], variable: str, ratio: float, inertia: float) -> None:
    """Points of the calibrated nominal model and medians of both models over one state variable."""
    x = np.concatenate([states(trace.unit, ratio, inertia)[variable][1] for trace in own])
    text = states(own[0].unit, ratio, inertia)[variable][0]
    forward = np.concatenate([trace.unit.speed > 0.0 for trace in own])
    missing, left = (np.concatenate([getattr(trace, name) for trace in own]) for name in ("missing", "left"))
    known = np.flatnonzero(np.isfinite(missing))
    factor, unit = scaled(missing, UNITS[own[0].channel])
    shown = known[:: max(1, len(known) // MOST_POINTS)]
    axes.axhline(0.0, color=INK, linewidth=0.6)
    axes.plot(x[shown], missing[shown] * factor, ".", color=MEASURED, ms=2.2, zorder=1)
    first, second = own[0].models
    models = [(first, missing, ORANGE)] + ([(second, left, BLUE)] if second else [])
    for name, values, color in models:
        for direction, chosen, style in (("forward", forward, "-"), ("backward", ~forward, "--")):
            place, median = middle(x[chosen], values[chosen] * factor, BINS)
            if place.size:
                axes.plot(
                    place, median, style, color=color, linewidth=1.6, marker="o", ms=2.6, label=f"{name}, {direction}"
                )
    label(axes, text, f"missing {CHANNELS[own[0].channel]} [{unit}]")
    if known.size:
        low, high = np.quantile(missing[known] * factor, (0.002, 0.998))
        reach = 0.12 * float(high - low) or 1.0
        axes.set_ylim(low - reach, high + reach)


def draw_orders(axes: Any, own: Sequence[Trace], named: Sequence[float], corner: float) -> None:
    """Spectrum over orders, as far as the slowest recording reaches within the band of `corner` [Hz]."""
    slowest = min(float(np.quantile(np.abs(trace.unit.speed), 0.9)) for trace in own) / (2.0 * math.pi)
    end = float(np.clip(corner / max(slowest, 1e-6), LOWEST_END, HIGHEST_END))
    draw_spectrum(axes, own, [trace.unit.angle / (2.0 * math.pi) for trace in own], named, end)
    axes.set_xlabel("order [per motor revolution]")


def draw_spectrum(axes: Any, own: Sequence[Trace], x: Sequence[Floats], named: Sequence[float], end: float) -> None:
    """Spectrum of the mismatch over the cycles of x, before and after, with named lines."""
    missing = [trace.missing for trace in own]
    factor, unit = scaled(np.concatenate(missing), UNITS[own[0].channel])
    place, before = spectrum(x, missing, end)
    first, second = own[0].models
    axes.plot(place, before * factor, color=ORANGE, linewidth=0.9, label=f"{first} model")
    if second:
        after = spectrum(x, [trace.left for trace in own], end)[1]
        axes.plot(place, after * factor, color=BLUE, linewidth=0.9, label=f"{second} model")
    shown = -np.inf
    for line in sorted(line for line in named if line <= end):
        axes.axvline(line, color=RED, linewidth=0.9, linestyle=":", zorder=0)
        if line - shown > LABEL_SHARE * end:
            top = ("data", "axes fraction")
            axes.annotate(f"{line:.3g}", (line, 1.0), xycoords=top, fontsize=7.5, color=RED, ha="center")
            shown = line
    if np.isfinite(before).any():
        axes.set_yscale("log")
    axes.set_xlim(0.0, end)
    axes.set_ylabel(f"amplitude [{unit}]")
