"""The page of a virtual bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.files import PAGE, write_text
from hdfast.printing import html_table
from hdfast.recordings import COLUMNS, Recording
from hdfast.report import html
from hdfast.report.look import label
from hdfast.report.plots import BLUE, styled

MOST_POINTS = 4000


@styled
def columns(recording: Recording) -> Figure:
    """Every recorded column over time."""
    names = [name for name in recording.columns if name != "t"]
    figure = Figure(figsize=(9.6, 1.5 * len(names)), layout="constrained")
    shown = np.unique(np.linspace(0, len(recording["t"]) - 1, MOST_POINTS).astype(np.int64))
    for position, name in enumerate(names):
        axes = figure.add_subplot(len(names), 1, position + 1)
        axes.plot(recording["t"][shown], recording[name][shown], color=BLUE, linewidth=0.8)
        last = position == len(names) - 1
        label(axes, "time [s]" if last else "", f"{name.replace('_', ' ')}\n[{COLUMNS[name][0]}]")
        axes.tick_params(labelbottom=last)
    return figure


def write(kind: str, recordings: Sequence[Recording], truth: Mapping[str, Any], target: Path, source: str) -> Path:
    """Write the page into an existing folder and return it."""
    pictures = [html.picture(columns(item), f"{item.name}: {len(item['t']):,} samples.") for item in recordings]
    rows = [[name, f"{value:.6g}"] for name, value in truth.items()]
    sections = [
        html.Section("Recordings", figures=pictures),
        html.Section("The truth behind them (SI units)", tables=[html_table(["name", "value"], rows, (1,))]),
    ]
    page = html.render(f"Virtual bench: {kind}", "Recordings of a known drive.", [], sections, source, None)
    write_text(target / PAGE, page)
    return target / PAGE
