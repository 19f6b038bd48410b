"""Rare events: how often a drive leaves its limits when that happens less than once in ten thousand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.tolerance.intervals import CONFIDENCE, Estimate, clopper_pearson, student

ACCEPTANCE = 0.44
FIRST_STEP = 0.6
LEAST = 1e-15  # a parameter is drawn through its probability, which next to 1 has steps of 1e-16


@dataclass(frozen=True)
class RareEvent:
    """Probability of a margin below 0.

    Attributes:
        probability: with its interval; 0 with an upper limit when no replicate reached the event.
        replicates: (R,) probability of every replicate.
        levels: largest number of levels any replicate took.
        evaluations: rows that were simulated.
        missing: how many of them failed or lack the metric, which counted as the event.
    """

    probability: Estimate
    replicates: tuple[float, ...]
    levels: int
    evaluations: int
    missing: int = 0

    @property
    def note(self) -> str:
        """What the figure has to say besides, empty when no row is missing."""
        return f"; {self.missing} of its rows failed, which counts as outside here" if self.missing else ""

    @property
    def ppm(self) -> Estimate:
        """In parts per million."""
        p = self.probability
        return Estimate(1e6 * p.value, 1e6 * p.low, 1e6 * p.high)


def subset_simulation(
    margin: Callable[[Floats], Floats],
    dimensions: int,
    *,
    rows: int = 1000,
    share: float = 0.1,
    replicates: int = 8,
    seed: int = 1,
    smallest: float = 1e-9,
    confidence: float = CONFIDENCE,
) -> RareEvent:
    """Subset simulation (Au and Beck 2001) with adaptive conditional sampling (Papaioannou et al. 2015).

    Every level keeps the `share` of rows nearest to the event and walks on from there, so that a probability of 1e-6
    takes six levels of `rows` rows and not 1e8 rows. Margins that tie (a duration that is mostly 0) may leave no level
    nearer to the event; rows of the last level are then counted as they are, and no limit is below what that can show.

    Args:
        margin: (m, d) independent standard normal scores to (m,) margins; below 0 is the event, 0 is not, NaN counts
            as it.
        rows: per level and replicate.
        replicates: independent runs; the interval comes from their spread (lognormal, Cox's method).
        smallest: levels stop below this probability, 1e-15 to 0.1; beyond, the tail of a single parameter has no more
            values.

    Raises:
        InputError: naming argument, value and allowed range.
    """
    checks.whole("rows", rows, 100, 10**7)
    checks.whole("replicates", replicates, 2, 1000)
    checks.number("share", share, 0.01, 0.5)
    checks.whole("seed", seed, 0, checks.MAX_SEED)
    checks.number("smallest", smallest, LEAST, 0.1)
    checks.number("confidence", confidence, 1e-6, 1.0 - 1e-6)
    return _Levels(margin, dimensions, rows, share, replicates, seed, smallest).run(confidence)


class _Levels:
    """All replicates side by side, so that one sweep serves one step of all of them."""

    def __init__(
        self, margin: Callable[[Floats], Floats], dimensions: int, rows: int, share: float, replicates: int, seed: int,
        smallest: float,
    ) -> None:  # fmt: skip
        self.margin, self.rows, self.share, self.smallest = margin, rows, share, smallest
        self.seeds = max(1, round(rows * share))
        self.generator = np.random.default_rng([seed, 4])
        self.scores = self.generator.standard_normal((replicates, rows, dimensions))
        self.evaluations = 0
        self.values = self.evaluate(self.scores)
        self.probability = np.ones(replicates)
        self.most = np.zeros(replicates)  # limit where the probability found is 0
        self.open = np.ones(replicates, dtype=bool)

    def evaluate(self, scores: Floats) -> Floats:
        flat = scores.reshape(-1, scores.shape[-1])
        self.evaluations += len(flat)
        values = np.asarray(self.margin(flat), dtype=float)
        return np.where(np.isnan(values), -np.inf, values).reshape(scores.shape[:-1])

    def run(self, confidence: float) -> RareEvent:
        levels = 1
        while True:
            threshold = np.partition(self.values, self.seeds - 1, axis=1)[:, self.seeds - 1]
            within = np.mean(self.values <= threshold[:, None], axis=1)
            self.count(self.open & ((threshold < 0.0) | (within == 1.0)), self.rows if levels == 1 else self.seeds)
            self.probability[self.open] *= within[self.open]
            lost = self.open & (self.probability < self.smallest)
            self.probability[lost], self.most[lost] = 0.0, self.smallest
            self.open &= ~lost
            if not self.open.any():
                break
            self.walk(threshold)
            levels += 1
        found = tuple(self.probability.tolist())
        return RareEvent(_combine(self.probability, self.most, confidence), found, levels, self.evaluations)

    def count(self, last: NDArray[np.bool_], independent: int) -> None:
        """End replicates at this level: those that arrived, and those of so many ties that no further level is nearer.

        Args:
            last: (R,) which.
            independent: how many of the rows of a level are independent; bounds an event that none of them shows.
        """
        self.most[last] = self.probability[last] * clopper_pearson(0, independent)[1]
        self.probability[last] *= np.mean(self.values[last] < 0.0, axis=1)
        self.open &= ~last

    def walk(self, threshold: Floats) -> None:
        """Refill the open replicates from rows of the level; a step is kept when it stays within the threshold."""
        which = np.flatnonzero(self.open)
        lots = self.generator.random((len(which), self.rows))
        lots[self.values[which] > threshold[which][:, None]] = 2.0  # rows that tie are drawn, not taken by their order
        chosen = np.argsort(lots, axis=1)[:, : self.seeds]
        scores = np.take_along_axis(self.scores[which], chosen[:, :, None], axis=1)
        values = np.take_along_axis(self.values[which], chosen, axis=1)
        kept_scores, kept_values = [scores], [values]
        step = np.full(len(which), FIRST_STEP)
        for k in range(1, math.ceil(self.rows / self.seeds)):
            stay = np.sqrt(1.0 - step**2)
            noise = self.generator.standard_normal(scores.shape)
            candidate = stay[:, None, None] * scores + step[:, None, None] * noise
            reached = self.evaluate(candidate)
            accept = reached <= threshold[which][:, None]
            scores = np.where(accept[:, :, None], candidate, scores)
            values = np.where(accept, reached, values)
            kept_scores.append(scores)
            kept_values.append(values)
            step = np.clip(step * np.exp((accept.mean(axis=1) - ACCEPTANCE) / math.sqrt(k)), 0.01, 1.0)
        self.scores[which] = np.concatenate(kept_scores, axis=1)[:, : self.rows]
        self.values[which] = np.concatenate(kept_values, axis=1)[:, : self.rows]


def _combine(found: Floats, most: Floats, confidence: float) -> Estimate:
    count = len(found)
    nothing = found == 0.0
    if np.any(nothing):
        return Estimate(float(np.mean(found)), 0.0, float(max(np.max(found), np.max(most[nothing]))))
    logs = np.log(found)
    variance = float(np.var(logs, ddof=1))
    centre = float(np.mean(logs)) + variance / 2.0
    reach = student(count, confidence) * math.sqrt(variance / count + variance**2 / (2 * (count - 1)))
    return Estimate(float(np.mean(found)), math.exp(centre - reach), math.exp(min(0.0, centre + reach)))
