"""False alarms, names, sets, laws outside the list, and utility."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from hdfast.proof.score.intervals import wilson
from hdfast.proof.score.judge import NAMED_FROM, RIGHT, RIGHT_CLASS, Case
from hdfast.proof.score.value import Score, share, statistic

SINGLE = ("single", "sensor_only")
STRENGTHS, NEAR = (0.7, 1.5, 3.0, 8.0), 0.3
GROUPS = {
    "friction": ("coulomb_friction", "stribeck_friction", "load_dependent_friction", "load_side_friction",
                 "thermal_viscous", "position_dependent_friction", "asymmetric_friction", "nonlinear_viscous",
                 "presliding_friction"),
    "stiffness and hysteresis": ("hysteresis", "backlash", "soft_windup", "viscoelastic", "load_compliance",
                                 "mesh_stiffness_variation"),
    "load torque": ("gravity_unbalance", "external_periodic_torque"),
    "geometry": ("te_harmonic", "te_load_dependence"),
    "actuator": ("torque_ripple", "torque_gain", "actuator_lag", "delay", "cogging"),
    "sensor": ("encoder_eccentricity", "sensor_lowpass", "sensor_delay", "clock_skew", "ratio_error",
               "sensor_offset_drift"),
}  # fmt: skip


def scores(cases: list[Case]) -> list[Score]:
    """Scores of what was claimed."""
    nulls = [c for c in cases if c.stratum == "null"]
    single = [c for c in cases if c.stratum in SINGLE]
    strong = [c for c in single if c.strength >= NAMED_FROM]
    good = {RIGHT, RIGHT_CLASS}
    out = [
        share("false alarms", [c.claimed for c in nulls], "<= 1 %", lambda v: v <= 0.01 + 1e-12,
              "null cases with a claim or without a valid answer"),
        share("false concern", [c.answer.kind == "undecided" for c in nulls], "<= 5 %", lambda v: v <= 0.05),
        share("identification", [c.outcome in good for c in strong], ">= 80 %", lambda v: v >= 0.8,
              "single effects of at least 1.5 detectable amplitudes: right name, or right class where undecidable"),
        share("identification, large", [c.outcome in good for c in strong if c.strength >= 3.0],
              note="of at least 3 detectable amplitudes"),
        share("identification, absorbed", [c.outcome in good for c in strong if "absorbed" in c.label["kind"]],
              ">= 60 %", lambda v: v >= 0.6),
        share("identification, masked", [c.outcome in good for c in strong if _masked(c)]),
        share("identification, motor only", [c.outcome in good for c in strong if c.label.get("motor_only")]),
    ]  # fmt: skip
    out += [
        share(f"identification, {group}", [c.outcome in good for c in strong if c.ids[0] in ids])
        for group, ids in GROUPS.items()
    ]
    named = [c for c in strong if c.answer.named or c.answer.fault]
    out += [
        share("selective accuracy", [c.outcome in good for c in named], ">= 95 %", lambda v: v >= 0.95),
        share("coverage", [bool(c.answer.named) for c in strong], ">= 60 %", lambda v: v >= 0.6),
        statistic("utility per case", cases, _mean_utility),
    ]
    return out + _sets(cases) + _outside(cases) + _undecidable(cases)


def _masked(case: Case) -> bool:
    return any(kind.startswith("masked_by") for kind in case.label["kind"])


def _mean_utility(cases: list[Case]) -> float:
    return float(np.mean([c.utility for c in cases]))


def _sets(cases: list[Case]) -> list[Score]:
    sets = [c for c in cases if c.stratum == "set"]

    def precision(chosen: list[Case]) -> float:
        right = sum(len(set(c.right_names)) for c in chosen)
        wrong = sum(len(c.wrong_names) for c in chosen)
        return right / (right + wrong) if right + wrong else float("nan")

    def recall(chosen: list[Case]) -> float:
        there = [_showable(c) for c in chosen]
        found = sum(len(set(c.right_names) & ids) for c, ids in zip(chosen, there, strict=True))
        return found / max(sum(map(len, there)), 1)

    return [
        statistic("sets: precision", sets, precision, ">= 0.9", lambda v: v >= 0.9),
        statistic("sets: recall", sets, recall, ">= 0.7", lambda v: v >= 0.7),
    ]


def _showable(case: Case) -> set[str]:
    return {e["id"] for e in case.label["effects"] if float(e["amplitude_over_mda"]) >= 1.0}


def _outside(cases: list[Case]) -> list[Score]:
    chosen = [c for c in cases if c.stratum == "outside"]
    return [
        share("outside the list: not named", [not c.answer.named and not c.answer.fault for c in chosen], ">= 80 %",
              lambda v: v >= 0.8),
        share("outside the list: variable and memory", [c.depends_rightly for c in chosen], ">= 60 %",
              lambda v: v >= 0.6),
    ]  # fmt: skip


def _undecidable(cases: list[Case]) -> list[Score]:
    chosen = [c for c in cases if c.stratum == "undecidable"]
    return [
        share("undecidable: right class", [c.outcome in (RIGHT, RIGHT_CLASS) for c in chosen]),
        share("undecidable: asks", [c.answer.kind == "undecided" and bool(c.answer.verdict.get("next_experiment"))
                                    for c in chosen], note="undecided, with a proposed experiment"),
    ]  # fmt: skip


def power_curve(cases: list[Case]) -> list[dict[str, Any]]:
    """Share of single effects found, by amplitude over detectable amplitude."""
    out = []
    for row in _by_size([c for c in cases if c.stratum in SINGLE]):
        low, high = wilson(row["found"], row["count"])
        out.append({**row, "low": low, "high": high, "value": row["found"] / row["count"] if row["count"] else None})
    return out


def by_effect(cases: list[Case]) -> list[dict[str, Any]]:
    """How many single effects of each kind were found, of how many, by amplitude over detectable amplitude."""
    single = [c for c in cases if c.stratum in SINGLE]
    return [
        {"effect": effect, "sizes": _by_size([c for c in single if c.ids[0] == effect])}
        for effect in sorted({c.ids[0] for c in single})
    ]


def _by_size(cases: list[Case]) -> list[dict[str, Any]]:
    """Of cases near each strength: how many there are and how many were found."""
    rows = []
    for strength in STRENGTHS:
        near = [c for c in cases if abs(np.log(max(c.strength, 1e-9) / strength)) < NEAR]
        found = sum(c.outcome in (RIGHT, RIGHT_CLASS) for c in near)
        rows.append({"amplitude_over_mda": strength, "count": len(near), "found": found})
    return rows


def confusion(cases: list[Case]) -> list[dict[str, Any]]:
    """How often a single effect was answered by which leading name, verdict or fault."""
    pairs = Counter(
        (c.ids[0], c.answer.named[0] if c.answer.named else c.answer.kind) for c in cases if c.stratum in SINGLE
    )
    return [{"truth": truth, "answer": answer, "count": n} for (truth, answer), n in sorted(pairs.items())]
