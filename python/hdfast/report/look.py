"""Small pieces that the figures of identifications and studies share."""

from __future__ import annotations

from typing import Any

from hdfast.report.plots import BLUE, GREY, INK, ORANGE, RED

GREEN, VIOLET = "#2e7d4f", "#6b4c9a"
SERIES = (BLUE, ORANGE, GREEN, VIOLET, RED, GREY, INK)
DASHES = ("-", "--", "-.", ":")  # a curve that lies on another one is still seen


def literal(name: str) -> str:
    """A name that is drawn as it is: Matplotlib reads what stands between two dollar signs as mathematics."""
    return name.replace("$", r"\$")


def label(axes: Any, x: str, y: str, title: str = "") -> None:
    """Axis labels with units, and a title on the left."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left")


def legend(axes: Any, columns: int = 3, markers: float = 1.0) -> None:
    """A legend above the axes, where it hides no data; `markers` enlarges small points in it."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2, markerscale=markers)


def plain_log(axis: Any) -> None:
    """Ticks of a logarithmic axis as plain numbers, also in between when it spans less than two decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    narrow = high < 100.0 * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if narrow else (1.0,), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _position: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
