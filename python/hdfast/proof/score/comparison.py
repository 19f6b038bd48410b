"""The scores of several tools on the same cases, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdfast.proof.score.card import ScoreCard
from hdfast.proof.score.value import Score, statistic

COMPARED = (
    "utility per case",
    "false alarms",
    "false concern",
    "identification",
    "selective accuracy",
    "sets: precision",
    "sets: recall",
    "held-out gap closed",
)


def ahead(own: ScoreCard, other: ScoreCard) -> Score:
    """How much more utility per case the own tool has, paired over cases."""
    differences = [a.utility - b.utility for a, b in zip(own.cases, other.cases, strict=True)]
    return statistic("utility ahead", differences, lambda values: float(np.mean(values)))


def line(card: ScoreCard, lead: Score | None) -> dict[str, Any]:
    """What is compared of one tool, as plain values; `lead` is the own tool's over it."""
    known = {one.name: one for one in card.scores}
    return {
        "scores": {name: known[name].to_dict() for name in COMPARED},
        "ahead": None if lead is None else lead.to_dict(),
    }


def beaten(leads: Mapping[str, Score]) -> Score:
    """The score of the mark that every rival is beaten: the lead over the best of them."""
    name = min(leads, key=lambda rival: leads[rival].value)
    best = leads[name]
    note = f"paired over cases; the best rival is {name}"
    return Score(
        "utility ahead of the best rival", best.value, best.low, best.high, best.count, "> 0", best.value > 0.0, note
    )
