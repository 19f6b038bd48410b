"""The look of a signature."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from hdfast.checks import Floats
from hdfast.report.look import label, legend
from hdfast.report.plots import BLUE, GREY, ORANGE, styled
from matplotlib.figure import Figure

Curve = tuple[Floats, Floats]
WITHOUT, WITH = "without", "with"
FEW = 45  # points up to which each is marked


@dataclass(frozen=True)
class Signature:
    """What to look at.

    Attributes:
        caption: the manoeuvre and what shows.
        x, y: labels of the axes with units.
        curves: computes the curves by label; "without" is drawn first and grey.
        kind: "line", "bars" (vertical lines), or "behind" (the curve with the term lies behind the one without).
    """

    caption: str
    x: str
    y: str
    curves: Callable[[], Mapping[str, Curve]]
    kind: str = "line"


@styled
def draw(signature: Signature) -> Figure:
    """The picture."""
    figure = Figure(figsize=(5.6, 2.9), layout="constrained")
    axes = figure.add_subplot()
    curves = signature.curves()
    for (name, (x, y)), color in zip(curves.items(), (GREY, BLUE, ORANGE), strict=False):
        _curve(axes, signature.kind, x, y, name, color)
    label(axes, signature.x, signature.y)
    legend(axes)
    return figure


def _curve(axes: Any, kind: str, x: Floats, y: Floats, name: str, color: str) -> None:
    if kind == "bars":
        shift = 0.004 * (np.max(x) - np.min(x)) * (1.0 if color == BLUE else -1.0)
        axes.vlines(x + shift, 0.0, y, color=color, lw=2.2, label=name)
        return
    marker = "o" if len(x) <= FEW else None
    order = {"zorder": 3.0 if name == WITHOUT else 2.0} if kind == "behind" else {}
    axes.plot(x, y, color=color, lw=1.4 if name == WITHOUT else 1.0, marker=marker, ms=3.0, label=name, **order)
