"""Whether the stated probabilities mean what they say, and how long answers take."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast.proof.score.intervals import calibration_error, calibration_floor, reliability_slope
from hdfast.proof.score.judge import Case
from hdfast.proof.score.value import Score, share, statistic

LIMIT = 120.0
BINS = 10
COUNTED = "all cases whose answer has a name; right where it is concealed"


def _stated(cases: list[Case]) -> list[tuple[float, float]]:
    """Probability of the leading effect, and whether it is in the label.

    That holds in every stratum: no name is right where nothing, or a law outside the list, is concealed, and of two
    that nothing tells apart one is, as an answer says that gives each of them half. `unknown` is no name.
    """
    chosen = [c for c in cases if c.answer.confidence is not None]
    return [(float(c.answer.confidence or 0.0), float(c.leads_rightly)) for c in chosen]


def _arrays(pairs: list[tuple[float, float]]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    stacked = np.array(pairs, dtype=float).reshape(-1, 2)
    return stacked[:, 0], stacked[:, 1]


def scores(cases: list[Case]) -> list[Score]:
    """Calibration of the leading probability, and the wall time."""
    pairs = _stated(cases)
    floor = calibration_floor(_arrays(pairs)[0]) if pairs else float("nan")
    seconds = [c.answer.seconds for c in cases]

    def log_score(chosen: list[tuple[float, float]]) -> float:
        p, right = _arrays(chosen)
        p = np.clip(p, 1e-3, 1 - 1e-3)
        return float(np.mean(right * np.log(p) + (1 - right) * np.log(1 - p)))

    def brier(chosen: list[tuple[float, float]]) -> float:
        p, right = _arrays(chosen)
        return float(np.mean((p - right) ** 2))

    return [
        statistic("log score", pairs, log_score),
        statistic("Brier score", pairs, brier),
        statistic("reliability slope", pairs, lambda x: reliability_slope(*_arrays(x)), "0.8-1.2",
                  lambda v: 0.8 <= v <= 1.2),
        statistic("calibration error", pairs, lambda x: calibration_error(*_arrays(x)), f"< {floor:.3f}",
                  lambda v: v < floor, f"{COUNTED}; mark: 95 % point for perfectly calibrated answers"),
        share("within the time", [s <= LIMIT and c.answer.fault != "late" for s, c in zip(seconds, cases, strict=True)],
              "all", lambda v: v == 1.0, f"{LIMIT:.0f} s per case"),
        statistic("seconds per case", seconds, lambda x: float(np.median(x)), note="median"),
    ]  # fmt: skip


def diagram(cases: list[Case]) -> list[dict[str, Any]]:
    """Reliability diagram: per bin of stated probability its mean, the share that was right and the count."""
    p, right = _arrays(_stated(cases))
    place = np.minimum((p * BINS).astype(int), BINS - 1)
    return [
        {"stated": float(p[inside].mean()), "right": float(right[inside].mean()), "count": int(inside.sum())}
        for inside in (place == b for b in range(BINS))
        if inside.any()
    ]
