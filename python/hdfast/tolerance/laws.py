"""Distribution laws: one function each from probability to value, and one entry in `LAWS`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from hdfast.checks import Floats

if TYPE_CHECKING:
    from hdfast.tolerance.distributions import Tolerance

LEAST, MOST = 2.0**-54, 1.0 - 2.0**-53  # probabilities next to 0 and 1, of a finite score


@dataclass(frozen=True)
class Law:
    """A distribution as a file names it.

    Attributes:
        quantile: inverse distribution function, (tolerance, u) to values.
        keys: what its section may hold, besides what every section may hold.
        required: what its section must hold.
        centre: the key of its centre, which defaults to the nominal value.
    """

    quantile: Callable[[Tolerance, Floats], Floats]
    keys: tuple[str, ...]
    required: tuple[str, ...]
    centre: str = ""


def normal_scores(u: Floats) -> Floats:
    """Normal scores of probabilities, finite for those of 0 and 1 too."""
    return np.asarray(scipy.special.ndtri(np.clip(u, LEAST, MOST)))


def normal(law: Tolerance, u: Floats) -> Floats:
    """Normal law cut to [lower, upper]; the upper tail is reached from above, where it has digits."""
    low, high = ((bound - law.centre) / law.width for bound in (law.lower, law.upper))
    return np.asarray(law.centre + law.width * _cut_scores(u, low, high))


def lognormal(law: Tolerance, u: Floats) -> Floats:
    """Lognormal law cut to [lower, upper]; `width` is the standard deviation of the logarithm."""
    with np.errstate(divide="ignore"):
        low, high = (np.log(np.array([law.lower, law.upper]) / law.centre) / law.width).tolist()
    return np.asarray(law.centre * np.exp(law.width * _cut_scores(u, low, high)))


def _cut_scores(u: Floats, low: float, high: float) -> Floats:
    if low > 0.0:
        return -_cut_scores(1.0 - u, -high, -low)
    floor, ceiling = float(scipy.special.ndtr(low)), float(scipy.special.ndtr(high))
    return normal_scores(floor + u * (ceiling - floor))


def uniform(law: Tolerance, u: Floats) -> Floats:
    """Every value of [lower, upper] equally likely."""
    return law.lower + u * (law.upper - law.lower)


def triangular(law: Tolerance, u: Floats) -> Floats:
    """Triangle over [lower, upper] with its mode at `centre`."""
    span = law.upper - law.lower
    rise = law.centre - law.lower
    return np.where(
        u * span < rise,
        law.lower + np.sqrt(u * span * rise),
        law.upper - np.sqrt((1.0 - u) * span * (span - rise)),
    )


def beta(law: Tolerance, u: Floats) -> Floats:
    """Beta law with the exponents `shape`, stretched over [lower, upper]."""
    return np.asarray(law.lower + (law.upper - law.lower) * scipy.special.betaincinv(*law.shape, u))


def discrete(law: Tolerance, u: Floats) -> Floats:
    """The values `points` with the probabilities `shape`."""
    steps = np.cumsum(law.shape)[:-1]
    return np.asarray(law.points)[np.searchsorted(steps, u, side="right")]


def empirical(law: Tolerance, u: Floats) -> Floats:
    """Measured values `points`, joined by straight lines; nothing beyond the smallest and the largest is drawn."""
    count = len(law.points)
    return np.interp(u, (np.arange(count) + 0.5) / count, law.points)


LAWS = {
    "normal": Law(normal, ("mean", "sigma"), ("sigma",), "mean"),
    "truncated_normal": Law(normal, ("mean", "sigma"), ("sigma", "lower", "upper"), "mean"),
    "uniform": Law(uniform, (), ("lower", "upper")),
    "triangular": Law(triangular, ("mode",), ("lower", "upper"), "mode"),
    "lognormal": Law(lognormal, ("median", "sigma_log"), ("sigma_log",), "median"),
    "beta": Law(beta, ("a", "b"), ("a", "b", "lower", "upper")),
    "discrete": Law(discrete, ("values", "weights"), ("values",)),
    "empirical": Law(empirical, ("values", "file", "column"), ()),
    "capability": Law(normal, ("nominal", "tolerance", "cp", "cpk", "side", "inspected"), ("tolerance",), "nominal"),
}
