"""Figures of the blind benchmark."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.report.look import label, plain_log
from hdfast.report.plots import BLUE, GREY, INK, styled


@styled
def power(rows: list[dict[str, Any]]) -> Figure:
    """Share of single effects found, over amplitude in detectable amplitudes."""
    figure = Figure(figsize=(4.8, 3.2), layout="constrained")
    axes = figure.add_subplot()
    known = [row for row in rows if row["value"] is not None]
    x, y = [r["amplitude_over_mda"] for r in known], np.array([r["value"] for r in known])
    spans = np.array(
        [[v - r["low"] for v, r in zip(y, known, strict=True)], [r["high"] - v for v, r in zip(y, known, strict=True)]]
    )
    if known:
        axes.errorbar(x, y, yerr=np.clip(spans, 0.0, None), fmt="o-", color=BLUE, capsize=3)
    axes.set_xscale("log")
    axes.set_xlim(0.5, 12.0)
    axes.set_ylim(-0.03, 1.03)
    plain_log(axes.xaxis)
    label(axes, "amplitude / smallest detectable amplitude", "share found")
    return figure


@styled
def reliability(rows: list[dict[str, Any]]) -> Figure:
    """How often an answer was right, over the probability it stated."""
    figure = Figure(figsize=(4.8, 3.2), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8, linestyle="--")
    axes.scatter(
        [r["stated"] for r in rows], [r["right"] for r in rows], s=[8 + 3 * r["count"] for r in rows], color=BLUE
    )
    for row in rows:
        axes.annotate(
            str(row["count"]), (row["stated"], row["right"]), xytext=(6, -10), textcoords="offset points", color=INK
        )
    axes.set_xlim(0, 1.03)
    axes.set_ylim(-0.03, 1.03)
    label(axes, "stated probability", "share that was right")
    return figure
