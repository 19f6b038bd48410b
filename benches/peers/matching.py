"""The tolerance at which a contestant reaches a wanted error of the rms."""

from dataclasses import dataclass

import numpy as np
from processes import Worker, WorkerError
from reference import CHECKED

TARGETS = (1e-4, 1e-6, 1e-8, 1e-10)
LOOSEST, TIGHTEST = -1.0, -14.0  # powers of ten of the tolerance
REFINEMENTS = 2
PATIENCE = 20.0  # [s] of processor time after which nothing tighter is tried


@dataclass
class Match:
    """What a contestant does at a tolerance."""

    rtol: float
    error: float
    peak_error: float | None
    seconds_per_row: float


def probe(worker: Worker, exponent: float, exact: dict, **more: object) -> Match:
    """Median error of the rms, worst error of the peak, and cost."""
    outcome = worker.outcome(10.0**exponent, CHECKED, **more)
    errors = np.abs(outcome["rms"].astype(float) / exact["rms"] - 1)
    peak = None
    if outcome["peak"].dtype != object:
        peak = float(np.max(np.abs(outcome["peak"] / exact["peak"] - 1)))
    error = float(np.median(np.nan_to_num(errors, nan=np.inf)))
    return Match(10.0**exponent, error, peak, outcome["cpu"] / CHECKED)


def matches(worker: Worker, exact: dict, targets: tuple[float, ...] = TARGETS, **more: object) -> dict[float, Match]:
    """The loosest tolerance found for every target that can be reached; `more` goes with every command."""
    seen: dict[float, Match] = {}

    def look(exponent: float) -> Match:
        if exponent not in seen:
            seen[exponent] = probe(worker, exponent, exact, **more)
        return seen[exponent]

    exponent = LOOSEST
    while exponent >= TIGHTEST:
        try:
            match = look(exponent)
            if match.error <= min(targets) or match.seconds_per_row * CHECKED > PATIENCE:
                break
        except WorkerError:
            if worker.process.poll() is not None:
                raise
        exponent -= 1.0
    return {target: refined(target, look, seen) for target in targets if reached(target, seen)}


def reached(target: float, seen: dict[float, Match]) -> bool:
    """Whether any tolerance tried gets there."""
    return any(match.error <= target for match in seen.values())


def refined(target: float, look, seen: dict[float, Match]) -> Match:
    """Halves the gap between the loosest tolerance that reaches the target and the one above it."""
    good = max(exponent for exponent, match in seen.items() if match.error <= target)
    bad = good + 1.0
    for _ in range(REFINEMENTS if bad <= LOOSEST else 0):
        middle = (good + bad) / 2
        good, bad = (middle, bad) if look(middle).error <= target else (good, middle)
    return seen[good]
