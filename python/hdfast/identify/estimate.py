"""An identified number with its uncertainty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import scipy

from hdfast.printing import text_table

CONFIDENCE = 0.90
LARGE = 30.0  # deviations from which the size of two numbers scatters as each of them does
HEADER = ["quantity", "value", "unit", "90 % interval", "relative"]


@dataclass(frozen=True)
class Estimate:
    """A number, its standard deviation and its two-sided 90 % interval, all in `unit`."""

    name: str
    value: float
    unit: str
    sigma: float
    low: float
    high: float
    meaning: str = ""

    def covers(self, truth: float) -> bool:
        """True when the interval holds the truth."""
        return self.low <= truth <= self.high


def estimate(
    name: str, value: float, unit: str, sigma: float, freedom: float = math.inf, meaning: str = ""
) -> Estimate:
    """An estimate whose 90 % interval follows Student's t with `freedom` degrees of freedom."""
    half = float(scipy.stats.t.ppf(0.5 + CONFIDENCE / 2.0, max(freedom, 1.0))) * sigma
    return Estimate(name, float(value), unit, float(sigma), float(value - half), float(value + half), meaning)


def amplitude(
    name: str, size: float, unit: str, sigma: float, freedom: float = math.inf, meaning: str = ""
) -> Estimate:
    """The size hypot(a, b) of two numbers that scatter by sigma each, with an interval that may begin at zero.

    size^2/sigma^2 is noncentral chi-squared with two degrees of freedom (Rice 1945). The upper end of a size below
    what noise alone gives, sqrt(2) sigma, is that of such a size.
    """
    found = estimate(name, size, unit, sigma, freedom, meaning)
    scatter = (found.high - found.low) / (2.0 * float(scipy.stats.norm.ppf(0.5 + CONFIDENCE / 2.0)))
    if not 0.0 < scatter < math.inf or size > LARGE * scatter:
        return found
    square, tail = (size / scatter) ** 2, 0.5 * (1.0 - CONFIDENCE)
    low = scipy.special.chndtrinc(square, 2.0, 1.0 - tail) if square > -2.0 * math.log(tail) else 0.0
    high = scipy.special.chndtrinc(max(square, 2.0), 2.0, tail)
    return replace(found, low=scatter * math.sqrt(low), high=scatter * math.sqrt(high))


def mean(found: Sequence[Estimate]) -> Estimate:
    """Weighted mean of estimates of one quantity; scatter beyond their standard deviations widens it (Birge 1932)."""
    first = found[0]
    if len(found) == 1:
        return first
    weights = [item.sigma**-2 for item in found]
    value = sum(weight * item.value for weight, item in zip(weights, found, strict=True)) / sum(weights)
    scatter = sum(weight * (item.value - value) ** 2 for weight, item in zip(weights, found, strict=True))
    birge = max(scatter / (len(found) - 1), 1.0)
    return estimate(first.name, value, first.unit, math.sqrt(birge / sum(weights)), meaning=first.meaning)


def rows(estimates: Sequence[Estimate]) -> list[list[str]]:
    """The estimates as rows of text under `HEADER`."""
    return [
        [
            item.name,
            f"{item.value:.5g}",
            item.unit,
            f"{item.low:.5g} .. {item.high:.5g}" if math.isfinite(item.sigma) else "not known",
            f"{100.0 * item.sigma / abs(item.value):.2g} %" if item.value and math.isfinite(item.sigma) else "-",
        ]
        for item in estimates
    ]


class Estimates(tuple[Estimate, ...]):
    """Estimates in order; found by name, printed as a table."""

    __slots__ = ()

    def named(self, name: str) -> Estimate:
        """The estimate of that name.

        Raises:
            KeyError: there is none.
        """
        for item in self:
            if item.name == name:
                return item
        raise KeyError(name)

    def __repr__(self) -> str:
        return text_table(HEADER, rows(self), right=(1,))
