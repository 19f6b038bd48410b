"""Whether the motion that an undecided answer asks for decides."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hdfast.proof.score.judge import RIGHT, WRONG, Case
from hdfast.proof.score.value import Score, share, statistic

DOUBT = 0.01  # no answer is taken to be surer than this


def scores(asked: Sequence[Case], drawn: Sequence[Case]) -> list[Score]:
    """Scores of the answers after the motion that was asked for, and after one at random.

    Args:
        asked, drawn: the same cases, answered with the one and with the other.
    """
    return [
        share("second round: right", [_decided(c) for c in asked],
              note="undecided at first, answered again with the motion asked for"),
        share("second round: wrong", [c.outcome == WRONG for c in asked]),
        share("second round, motion at random: right", [_decided(c) for c in drawn],
              note="as long and within the same limits"),
        share("second round, motion at random: wrong", [c.outcome == WRONG for c in drawn]),
        statistic("experiment", list(zip(asked, drawn, strict=True)), _odds_ratio, ">= 10", lambda v: v >= 10.0,
                  "median ratio of the stated odds of the truth, after the motion asked for over after one at random"),
    ]  # fmt: skip


def _decided(case: Case) -> bool:
    """Whether an answer is right and a decision: undecided is no alarm, and still open."""
    return case.outcome == RIGHT and case.answer.kind != "undecided"


def _odds_ratio(pairs: Sequence[tuple[Case, Case]]) -> float:
    return float(np.exp(np.median([np.log(odds(asked) / odds(drawn)) for asked, drawn in pairs])))


def odds(case: Case) -> float:
    """Stated odds of the truth: of the least probable of its effects; of nothing where nothing is left out.

    A claim, or no answer at all, gives nothing no odds.
    """
    stated = {one["effect"]: float(one["probability"]) for one in reversed(case.answer.listed)}
    nothing = 0.0 if case.claimed else 1.0 - max(stated.values(), default=0.0)
    believed = min((stated.get(each, 0.0) for each in case.ids), default=nothing)
    sure = min(max(believed, DOUBT), 1.0 - DOUBT)
    return sure / (1.0 - sure)


def line(first: Case, asked: Case, drawn: Case) -> dict[str, Any]:
    """One case through both rounds, as plain values."""
    return {
        "case": first.name,
        "truth": first.ids,
        "first": [one["effect"] for one in first.answer.listed],
        "asked": _said(asked),
        "drawn": _said(drawn),
    }


def _said(case: Case) -> dict[str, Any]:
    return {"answer": case.answer.kind, "named": case.answer.named, "outcome": case.outcome}
