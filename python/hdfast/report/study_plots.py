"""Figures that every study of a parameter has."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.checks import Floats
from hdfast.report.look import DASHES, SERIES, label, legend, plain_log
from hdfast.report.plots import GREY, INK, styled
from hdfast.studies import cases
from hdfast.studies.cases import Grid

COLUMNS: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...] = (
    ("start", "frequency", (("a", "mode_frequency_start"), ("b", "mode_frequency_start"))),
    ("run", "te", (("c", "te_pp"), ("c", "te_rms"))),
    ("stop", "frequency", (("d0", "mode_frequency_stop"), ("e0", "brake_frequency"))),
    ("start", "amplitude", (("a", "mode_amplitude_start"), ("b", "mode_amplitude_start"))),
    ("run", "ripple", (("c", "speed_ripple"), ("c", "speed_ripple_rms"))),
    (
        "stop",
        "amplitude",
        (("d0", "mode_amplitude_stop"), ("d", "residual_ring"), ("e", "residual_ring"), ("e", "spring_torque")),
    ),
)
NAMES = {
    "mode_amplitude_stop": "mode",
    "residual_ring": "residual ring",
    "spring_torque": "spring torque",
    "te_pp": "TE p-p",
    "te_rms": "TE rms",
    "speed_ripple": "ripple p-p",
    "speed_ripple_rms": "ripple rms",
}


def axis(grid: Grid) -> str:
    """Label of the parameter's axis."""
    if grid.parameter == "speed_rpm":
        return "set speed [r/min]"
    return f"{grid.parameter} / nominal"


@styled
def trends(grid: Grid, load: float) -> Figure:
    """Frequencies and amplitudes of start, run and stop over the parameter, the article's points marked."""
    figure = Figure(figsize=(9.6, 5.8), layout="constrained")
    for position, (phase, what, lines) in enumerate(COLUMNS):
        axes = figure.add_subplot(2, 3, position + 1)
        frequency = what == "frequency"
        for (case, metric), color, dash in zip(lines, SERIES, DASHES, strict=False):
            values = grid.of(metric, case, load)
            reference = 1.0 if frequency else _nominal(grid, values)
            name = cases.CASES[case].label.split(",")[0].split(" ", maxsplit=1)[0]
            name = f"{name} {NAMES[metric]}" if metric in NAMES else cases.CASES[case].label.split(",")[0]
            axes.plot(grid.values, values / reference, dash, color=color, label=name)
            axes.plot(grid.values[grid.marked], values[grid.marked] / reference, "o", ms=3.5, color=color)
        axes.set_xscale("log")
        _plain_ticks(axes, grid)
        if not frequency and _wide(axes):
            axes.set_yscale("log")
            plain_log(axes.yaxis)
        unit = "mode frequency [Hz]" if frequency else "relative to nominal [1]"
        label(axes, axis(grid), unit, f"{phase}: {what if what != 'te' else 'transmission error'}")
        axes.legend(loc="best", fontsize=7.0)
    return figure


def _wide(axes: Any) -> bool:
    values = np.concatenate([line.get_ydata() for line in axes.lines])
    values = values[np.isfinite(values) & (values > 0.0)]
    return bool(values.size and values.max() > 4.0 * values.min())


def _plain_ticks(axes: Any, grid: Grid) -> None:
    ticks = [0.25, 0.5, 1.0, 2.0, 5.0, 20.0, 100.0] if grid.parameter != "speed_rpm" else [20, 50, 100, 200, 500]
    ticks = [tick for tick in ticks if tick <= grid.values[-1]]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_xticks([], minor=True)


def _nominal(grid: Grid, values: Floats) -> float:
    nominal = 1.0 if grid.parameter != "speed_rpm" else 100.0
    found = float(np.interp(nominal, grid.values, values))
    return found if np.isfinite(found) and found else 1.0


@styled
def spectra(grid: Grid, load: float) -> Figure:
    """Amplitude-frequency diagrams of the load speed after start and stop at the article's points."""
    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    for position, (case, begin, title) in enumerate(
        (("b", 0.0, "start, released TE"), ("d0", 3.0, "stop, coast without TE"))
    ):
        axes = figure.add_subplot(1, 2, position + 1)
        rows = np.array(grid.rows(case, load))[grid.marked]
        for row, value, color in zip(rows, grid.values[grid.marked], SERIES, strict=False):
            frequency, amplitude = spectrum(grid, int(row), begin)
            unit = " r/min" if grid.parameter == "speed_rpm" else ""
            axes.plot(frequency, amplitude * 1e3, color=color, label=f"{value:g}{unit}")
        axes.set_xlim(0.0, 80.0)
        label(axes, "frequency [Hz]", "load speed amplitude [mrad/s]", title)
        axes.legend(title=axis(grid), loc="upper right", fontsize=7.0, title_fontsize=7.0)
    return figure


def spectrum(grid: Grid, row: int, begin: float, width: float = 1.0) -> tuple[Floats, Floats]:
    """One-sided amplitude spectrum of omega_l - omega_m/i in [begin, begin + width] [s]: (frequency [Hz], [rad/s])."""
    t = grid.result.t_eval[0]
    inside = (t >= begin) & (t < begin + width)
    ratio = grid.result.parameters(row)["ratio"]
    twist = grid.result.samples["omega_l"][row] - grid.result.samples["omega_m"][row] / ratio
    part = twist[inside] - twist[inside].mean()
    size = 8 * len(part)
    return np.fft.rfftfreq(size, t[1] - t[0]), 2.0 * np.abs(np.fft.rfft(part, size)) / len(part)


@styled
def energies(grid: Grid, load: float) -> Figure:
    """Energy that each damper takes over start, run and stop."""
    figure = Figure(figsize=(9.6, 3.0), layout="constrained")
    axes = figure.add_subplot()
    for place, color in zip(("motor", "wave_generator", "load", "mesh"), SERIES, strict=False):
        values = grid.of(f"loss_{place}", "d", load)
        axes.plot(grid.values, values, color=color, label=place.replace("_", " "))
        axes.plot(grid.values[grid.marked], values[grid.marked], "o", ms=3.5, color=color)
    axes.plot(grid.values, grid.of("energy_lost", "d", load), color=INK, linestyle="--", label="together")
    axes.set_xscale("log")
    axes.set_yscale("log")
    plain_log(axes.yaxis)
    _plain_ticks(axes, grid)
    axes.axvline(1.0 if grid.parameter != "speed_rpm" else 100.0, color=GREY, linewidth=0.7, linestyle=":")
    label(axes, axis(grid), "energy lost [J]")
    legend(axes, 5)
    return figure
