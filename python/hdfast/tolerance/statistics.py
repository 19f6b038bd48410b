"""What is said about one metric: moments, percentiles, tolerance intervals, capability."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from hdfast import checks
from hdfast.checks import Floats
from hdfast.tolerance.intervals import CONFIDENCE, Estimate, Groups, mean, percentile, standard_deviation
from hdfast.tolerance.policy import Usable

PERCENTILES = (0.135, 1.0, 5.0, 50.0, 95.0, 99.0, 99.865)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
STEEP = 8.5  # standard deviations beyond which the normal law has nothing in double precision


@dataclass(frozen=True)
class Summary:
    """Statistics of one metric in its unit.

    Attributes:
        metric, unit: what it is about.
        rows: values used; `missing` rows failed or lack the metric, `note` says what was done about them.
        mean: with Student's interval. NaN under "worst" with missing rows, as is the standard deviation.
        deviation: standard deviation.
        skewness, kurtosis: standardised third moment, fourth moment minus 3; both 0 for a normal law.
        low, high: smallest and largest value.
        percentiles: by percentage, each with its limits.
        tolerance: limits between which at least 95 % of all units lie, with 95 % confidence; no law assumed. Infinite
            when the rows do not suffice, NaN when they are not independent.
    """

    metric: str
    unit: str
    rows: int
    missing: int
    note: str
    mean: Estimate
    deviation: float
    skewness: float
    kurtosis: float
    low: float
    high: float
    percentiles: dict[float, Estimate]
    tolerance: tuple[float, float]


def summarise(
    metric: str,
    unit: str,
    usable: Usable,
    groups: Groups | None = None,
    percentages: Sequence[float] = PERCENTILES,
    confidence: float = CONFIDENCE,
) -> Summary:
    """Statistics of the values that passed the gate; `groups` belong to these values."""
    values = usable.values
    ordered = values if groups is not None else np.sort(values)
    whole = not (usable.missing and usable.policy == "worst")
    nothing = Estimate(math.nan, math.nan, math.nan)
    deviation, skewness, kurtosis = _moments(values) if whole else (math.nan,) * 3
    return Summary(
        metric=metric,
        unit=unit,
        rows=len(values),
        missing=usable.missing,
        note=usable.note,
        mean=mean(values, groups, confidence) if whole else nothing,
        deviation=deviation,
        skewness=skewness,
        kurtosis=kurtosis,
        low=float(np.min(values)) if len(values) else math.nan,
        high=float(np.max(values)) if len(values) else math.nan,
        percentiles={q: percentile(ordered, q / 100.0, groups, confidence) for q in percentages},
        tolerance=tolerance_interval(values, 0.95, confidence) if groups is None else (math.nan, math.nan),
    )


def _moments(values: Floats) -> tuple[float, float, float]:
    if len(values) < 2:
        return (math.nan,) * 3
    deviation = standard_deviation(values, 1)
    if deviation == 0.0:
        return 0.0, math.nan, math.nan
    score = (values - np.mean(values)) / deviation
    return deviation, float(np.mean(score**3)), float(np.mean(score**4)) - 3.0


def sample_size(coverage: float, confidence: float = CONFIDENCE, *, sides: int = 1) -> int:
    """Independent rows whose largest value (sides=1) or range (sides=2) holds `coverage` of all rows (Wilks 1941).

    Raises:
        InputError: a coverage or confidence that no number of rows reaches, or other sides.
    """
    for name, value in (("coverage", coverage), ("confidence", confidence)):
        checks.number(name, value, 1e-6, 1.0 - 1e-6)
    checks.whole("sides", sides, 1, 2)

    def holds(count: int) -> bool:
        if sides == 1:
            return 1.0 - coverage**count >= confidence
        return 1.0 - count * coverage ** (count - 1) + (count - 1) * coverage**count >= confidence

    high = 2
    while not holds(high):
        high *= 2
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def tolerance_interval(values: Floats, coverage: float, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Limits between which, with the confidence given, at least `coverage` of all units lie; no law is assumed.

    Args:
        values: (n,) independent, any order.

    Returns:
        Order statistics placed symmetrically (Wilks 1941); infinite when n is too small, see `sample_size`.
    """
    ordered = np.sort(values)
    count = len(ordered)
    left_out = _left_out(count, coverage, confidence)
    return (float(ordered[left_out - 1]), float(ordered[count - left_out])) if left_out else (-math.inf, math.inf)


def _left_out(count: int, coverage: float, confidence: float) -> int:
    """Largest m so that x_(m) and x_(n+1-m) still do; they cover a share with the law Beta(n + 1 - 2m, 2m)."""
    low, high = 0, (count + 1) // 2
    while high - low > 1:
        middle = (low + high) // 2
        good = scipy.stats.beta.sf(coverage, count + 1 - 2 * middle, 2 * middle) >= confidence
        low, high = (middle, high) if good else (low, middle)
    return low


@dataclass(frozen=True)
class Capability:
    """How the spread of a metric compares with its limits.

    Attributes:
        cp: width of the limits over six standard deviations; NaN for a one-sided limit.
        cpk: distance of the mean from the nearer limit over three standard deviations. Its interval assumes a normal
            law and independent rows: exact for one limit (non-central t), of Bissell (1990) for two; else NaN.
        ppk: the same from percentiles (ISO 22514-4): limit and P99.865 or P0.135, each as distance from the median.
    """

    cp: float
    cpk: Estimate
    ppk: float


def capability(
    values: Floats, lower: float, upper: float, groups: Groups | None = None, confidence: float = CONFIDENCE
) -> Capability:
    """Capability of (n,) values against limits, of which one may be infinite; NaN where a value is infinite."""
    count = len(values)
    if count < 2 or not np.all(np.isfinite(values)):
        return Capability(math.nan, Estimate(math.nan, math.nan, math.nan), math.nan)
    centre, deviation = float(np.mean(values)), standard_deviation(values, 1)
    cp = (upper - lower) / (6.0 * deviation) if deviation else math.inf
    sides = [distance for distance in (upper - centre, centre - lower) if math.isfinite(distance)]
    value = min(sides) / (3.0 * deviation) if deviation else math.copysign(math.inf, min(sides))
    limits = (math.nan, math.nan)
    if deviation and groups is None:
        limits = _one_sided(value, count, confidence) if len(sides) == 1 else _bissell(value, count, confidence)
    low, median, high = np.percentile(values, (0.135, 50.0, 99.865)).tolist()
    ratios = [
        (limit - median) / (tail - median)
        for limit, tail in ((upper, high), (lower, low))
        if math.isfinite(limit) and tail != median
    ]
    return Capability(cp if math.isfinite(cp) else math.nan, Estimate(value, *limits), min(ratios, default=math.nan))


def _bissell(value: float, count: int, confidence: float) -> tuple[float, float]:
    reach = float(scipy.stats.norm.ppf(0.5 + confidence / 2.0)) * math.sqrt(
        1.0 / (9.0 * count) + value**2 / (2.0 * (count - 1))
    )
    return value - reach, value + reach


def _one_sided(value: float, count: int, confidence: float) -> tuple[float, float]:
    """Interval of (limit - mean) / (3 sigma): 3 sqrt(n) times its estimate has a non-central t law."""
    root, tail = 3.0 * math.sqrt(count), (1.0 - confidence) / 2.0
    reach = 8.0 * math.sqrt(1.0 / (9.0 * count) + value**2 / (2.0 * (count - 1)))

    def end(target: float) -> float:
        return float(
            scipy.optimize.brentq(
                lambda true: _share_below(root * value, count - 1, root * true) - target, value - reach, value + reach
            )
        )

    return end(1.0 - tail), end(tail)


def _share_below(t: float, freedom: int, shift: float) -> float:
    """Distribution function of the non-central t law: mean of Phi(t s - shift) over s, which is chi / sqrt(freedom).

    That of SciPy 1.17 is NaN in tails that a few rows reach.
    """
    half_freedom = freedom / 2.0
    first = math.sqrt(scipy.special.gammaincinv(half_freedom, 1e-15) / half_freedom)
    last = math.sqrt(scipy.special.gammainccinv(half_freedom, 1e-15) / half_freedom)
    rise = (shift + np.array([-STEEP, STEEP])) / (t or 1e-300)
    pieces = np.sort(np.clip([first, *rise, last], first, last))
    half = np.diff(pieces)[:, None] / 2.0
    s = pieces[:-1, None] + half * (1.0 + NODES)
    logs = (freedom - 1) * np.log(s) - half_freedom * s**2
    shares = half * WEIGHTS * np.exp(logs - np.max(logs))
    return float(np.sum(shares * scipy.special.ndtr(t * s - shift)) / np.sum(shares))
