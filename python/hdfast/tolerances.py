"""Distributions of parameters: sampled through their inverse distribution function from a seeded generator."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose

KEYS = {
    "normal": ("mean", "sigma", "lower", "upper"),
    "truncated_normal": ("mean", "sigma", "lower", "upper"),
    "uniform": ("lower", "upper"),
    "triangular": ("lower", "mode", "upper"),
    "lognormal": ("median", "sigma_log", "lower", "upper"),
}
REQUIRED = {
    "normal": ("sigma",),
    "truncated_normal": ("sigma", "lower", "upper"),
    "uniform": ("lower", "upper"),
    "triangular": ("lower", "upper"),
    "lognormal": ("sigma_log",),
}


@dataclass(frozen=True)
class Tolerance:
    """Distribution of one parameter.

    Attributes:
        name: the parameter.
        distribution: "normal", "truncated_normal", "uniform", "triangular" or "lognormal".
        centre: mean, mode or median; unused for "uniform".
        width: standard deviation, of the logarithm for "lognormal".
        lower, upper: bounds; nothing outside is ever drawn.
    """

    name: str
    distribution: str
    centre: float
    width: float
    lower: float
    upper: float

    def sample(self, rows: int, seed: int) -> Floats:
        """Draw (rows,) values. The stream depends on seed and parameter name only, not on other tolerances."""
        generator = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        return self.quantile(generator.random(rows))

    def quantile(self, u: Floats) -> Floats:
        """Inverse distribution function."""
        from scipy import stats

        if self.distribution == "uniform":
            values = self.lower + u * (self.upper - self.lower)
        elif self.distribution == "triangular":
            span = self.upper - self.lower
            values = stats.triang.ppf(u, (self.centre - self.lower) / span, self.lower, span)
        elif self.distribution == "lognormal":
            law = stats.lognorm(self.width, scale=self.centre)
            values = law.ppf(_between(law, self.lower, self.upper, u))
        else:
            low, high = ((bound - self.centre) / self.width for bound in (self.lower, self.upper))
            values = stats.truncnorm.ppf(u, low, high, self.centre, self.width)
        return np.clip(values, self.lower, self.upper)

    def describe(self) -> str:
        """One line for reports."""
        if self.distribution == "uniform":
            return f"uniform {self.lower:.6g} to {self.upper:.6g}"
        centre = {"triangular": "mode", "lognormal": "median"}.get(self.distribution, "mean")
        text = f"{self.distribution.replace('_', ' ')}, {centre} {self.centre:.6g}"
        if self.distribution != "triangular":
            text += f", sigma {self.width:.4g}" + (" of the logarithm" if self.distribution == "lognormal" else "")
        bounds = [b for b in (self.lower, self.upper) if math.isfinite(b)]
        return text + (f", within {self.lower:.6g} to {self.upper:.6g}" if bounds else "")


def _between(law: Any, lower: float, upper: float, u: Floats) -> Floats:
    low, high = law.cdf(lower), law.cdf(upper)
    result: Floats = low + u * (high - low)
    return result


def read_tolerance(
    name: str,
    entry: Mapping[str, Any],
    nominal: float,
    known: Callable[[Iterable[str], Iterable[str]], None],
) -> Tolerance:
    """Read one [tolerance.<name>] section.

    Args:
        name: the parameter.
        entry: keys `distribution`, those of the distribution in `KEYS`, and `relative`, which makes all numbers
            multiples of the nominal value. The centre defaults to the nominal value.
        nominal: nominal value of the parameter.
        known: called with the keys found and allowed, raises for an unknown one.

    Raises:
        InputError: naming key, value and what is allowed.
    """
    if "distribution" not in entry:
        raise InputError(f"[tolerance.{name}] needs the key 'distribution' (allowed: {', '.join(KEYS)})")
    distribution = choose("distribution", entry["distribution"], KEYS)
    known(entry, ("distribution", "relative", *KEYS[distribution]))
    for key in REQUIRED[distribution]:
        if key not in entry:
            raise InputError(f"[tolerance.{name}] of distribution {distribution!r} needs the key {key!r}")
    relative = entry.get("relative", False)
    if not isinstance(relative, bool):
        raise InputError(f"relative = {relative!r} is not true or false")
    if relative and nominal == 0.0:
        raise InputError(f"[tolerance.{name}] cannot be relative: the nominal value is 0")
    factor = nominal if relative else 1.0

    def read(key: str, default: float) -> float:
        return checks.finite(key, entry[key]) * factor if key in entry else default

    lower, upper = read("lower", -math.inf), read("upper", math.inf)
    if factor < 0.0:
        lower, upper = (upper if "upper" in entry else -math.inf), (lower if "lower" in entry else math.inf)
    centre = next((read(key, nominal) for key in ("mean", "mode", "median") if key in KEYS[distribution]), nominal)
    width = _width(entry, distribution, factor)
    if not lower < upper:
        raise InputError(f"[tolerance.{name}] lower = {lower:g} is not below upper = {upper:g}")
    if distribution == "triangular" and not lower <= centre <= upper:
        raise InputError(f"[tolerance.{name}] mode = {centre:g} lies outside {lower:g} to {upper:g}")
    if distribution == "lognormal":
        checks.positive("median", centre)
        lower = max(lower, 0.0)
    return Tolerance(name, distribution, centre, width, lower, upper)


def _width(entry: Mapping[str, Any], distribution: str, factor: float) -> float:
    if "sigma_log" in entry:
        return checks.positive("sigma_log", entry["sigma_log"], 5.0)
    if distribution in ("normal", "truncated_normal"):
        return checks.positive("sigma", entry["sigma"]) * abs(factor)
    return 0.0
