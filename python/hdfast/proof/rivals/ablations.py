"""The diagnosis with one of its parts replaced by what it stands against, for one answer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis import holdout, left_out, projector, score, screen, select, whiten
from hdfast.diagnosis.evidence import Index, Layout
from hdfast.diagnosis.fitted import Fit


@dataclass(frozen=True)
class Ablation:
    """A part that is taken out.

    Attributes:
        text: what is done instead.
        owner: module or class that holds the part.
        part: its name there.
        instead: what stands in its place.
    """

    text: str
    owner: ModuleType | type
    part: str
    instead: Any


def _as_they_are(_: projector.Projector, values: Floats, __: Floats | None = None) -> Floats:
    return values


def _each_alone(observed: screen.Screen, found: list[screen.Signature]) -> screen.Screen:
    """Each statistic by itself against the chi-squared law, as if no other candidate had been tried."""
    widths = {one.candidate.label: one.left.shape[1] for one in found}
    p = {label: float(scipy.stats.chi2.sf(value**2, widths[label])) for label, value in observed.statistic.items()}
    needed = {label: float(np.sqrt(scipy.stats.chi2.isf(0.01, width))) for label, width in widths.items()}
    return screen.Screen(observed.statistic, p, needed, observed.spread)


def _fitted(fit: Fit, white: whiten.Whitener, layout: Layout, _: Index) -> left_out.LeftOut:
    return left_out.LeftOut(fit.mismatch, white(layout, fit.mismatch), [])


_screen = screen.screen

ABLATIONS: Mapping[str, Ablation] = {
    "no_whitening": Ablation("mismatch scaled, not filtered", whiten, "ORDER", 0),
    "no_max_t": Ablation(
        "each candidate screened by itself, without the largest of all under the null",
        select,
        "screen",
        lambda replay, fit, found, rng: _each_alone(_screen(replay, fit, found, rng), found),
    ),
    "no_leverage": Ablation("null without leverage correction", projector.Projector, "levered", _as_they_are),
    "no_projection": Ablation("signatures as they are before a refit", projector.Projector, "left", _as_they_are),
    "no_left_out": Ablation("gain and error on the recordings that were fitted", score, "left_out", _fitted),
    "no_holdout": Ablation("every improvement taken for proven", holdout.Proof, "shows", True),
}


@contextmanager
def without(name: str) -> Iterator[None]:
    """The diagnosis without one of its parts, inside.

    Raises:
        AttributeError: the part is no longer there.
    """
    one = ABLATIONS[name]
    before = getattr(one.owner, one.part)
    setattr(one.owner, one.part, one.instead)
    try:
        yield
    finally:
        setattr(one.owner, one.part, before)
