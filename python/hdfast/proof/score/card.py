"""All scores of a set of cases, in the order in which they are published."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from hdfast.proof.score import confidence, identification, localisation, parameters
from hdfast.proof.score.answer import Answer
from hdfast.proof.score.judge import ABSTAINED, MISSED, PARTLY, Case, judge
from hdfast.proof.score.value import Score

UNAVAILABLE = {
    "experiment": "needs a service that simulates the requested manoeuvre",
    "state bins": "verdict.json holds no ranking of state bins",
}


@dataclass(frozen=True)
class ScoreCard:
    """Scores, judged cases and failures of one set.

    Attributes:
        scores: in the order of publication.
        cases: every case with its outcome.
        unavailable: scores of the plan that this run cannot give, with the reason.
    """

    scores: list[Score]
    cases: list[Case]
    unavailable: dict[str, str]

    @property
    def failures(self) -> list[dict[str, Any]]:
        """Every false alarm, wrong name, effect of 1.5 detectable amplitudes without a name, fault and time-out."""
        return [failure(case) for case in self.cases if case.fails]

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values; numbers that do not exist are None."""
        return {
            "scores": [s.to_dict() for s in self.scores],
            "unavailable": self.unavailable,
            "failures": self.failures,
            "cases": [summary(case) for case in self.cases],
            "power": identification.power_curve(self.cases),
            "by_effect": identification.by_effect(self.cases),
            "confusion": identification.confusion(self.cases),
            "reliability": confidence.diagram(self.cases),
        }


def score(labels: dict[str, dict[str, Any]], answers: dict[str, Answer]) -> ScoreCard:
    """Score answers against labels; a case without an answer counts as missing."""
    absent = Answer("missing", detail="not answered")
    cases = [judge(name, label, answers.get(name, absent)) for name, label in sorted(labels.items())]
    parts: Sequence[Callable[[list[Case]], list[Score]]] = (
        identification.scores,
        localisation.scores,
        parameters.scores,
        confidence.scores,
    )
    return ScoreCard([s for part in parts for s in part(cases)], cases, dict(UNAVAILABLE))


def failure(case: Case) -> dict[str, Any]:
    """One line of the list of failures."""
    if case.answer.fault:
        kind = {"late": "time-out", "crashed": "crash"}.get(case.answer.fault, "invalid answer")
    elif case.outcome in (MISSED, ABSTAINED):
        kind = case.outcome
    elif case.outcome == PARTLY:
        kind = f"{', '.join(case.unnamed)} missed"
    else:
        kind = "false alarm" if case.stratum == "null" else "wrong name"
    minor = {n["id"] for n in case.label.get("nuisance", [])}
    return {
        "case": case.name,
        "failure": kind,
        "stratum": case.stratum,
        "truth": case.ids,
        "amplitude_over_mda": case.strength,
        "answer": case.answer.kind,
        "named": case.answer.named,
        "named_nuisance": sorted(minor & set(case.answer.named)),
        "detail": case.answer.detail,
    }


def summary(case: Case) -> dict[str, Any]:
    """One case of the published list."""
    certificate = {k: case.label.get(k) for k in ("kind", "visibility", "refit_nrmse_over_noise", "closest_rival")}
    return {
        "case": case.name,
        **certificate,
        "truth": case.ids,
        "amplitude_over_mda": case.strength,
        "answer": case.answer.kind,
        "named": case.answer.named,
        "probability": case.answer.confidence,
        "outcome": case.outcome,
        "utility": case.utility,
        "seconds": round(case.answer.seconds, 2) if math.isfinite(case.answer.seconds) else None,
    }
