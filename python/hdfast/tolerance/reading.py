"""Sections of a file that say what varies: [tolerance.<name>], [correlation] and [batches]."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.errors import InputError, choose, nearest, shorten
from hdfast.files import RESERVED
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.laws import LAWS

COMMON = ("distribution", "relative", "lower", "upper", "batch_share", "cost")
SIDES = ("upper", "lower")

Known = Callable[[Iterable[str], Iterable[str]], None]


def read_tolerance(
    name: str, entry: Mapping[str, Any], nominal: float, known: Known, folder: Path | None = None
) -> Tolerance:
    """Read one [tolerance.<name>] section.

    Args:
        name: the parameter.
        entry: keys `distribution`, those of the distribution in `LAWS`, `lower` and `upper`, and `relative`, which
            makes all numbers multiples of the nominal value. The centre defaults to the nominal value.
        nominal: nominal value of the parameter.
        known: called with the keys found and allowed, raises for an unknown one.
        folder: where a measured table is looked for.

    Raises:
        InputError: naming key, value and what is allowed.
    """
    if "distribution" not in entry:
        raise InputError(f"[tolerance.{name}] needs the key 'distribution' (allowed: {', '.join(LAWS)})")
    distribution = choose("distribution", entry["distribution"], LAWS)
    law = LAWS[distribution]
    known(entry, (*COMMON, *law.keys))
    for required in law.required:
        if required not in entry:
            raise InputError(f"[tolerance.{name}] of distribution {distribution!r} needs the key {required!r}")
    return _Entry(name, distribution, entry, nominal, folder).tolerance()


class _Entry:
    """One section on its way to a tolerance."""

    def __init__(
        self, name: str, distribution: str, entry: Mapping[str, Any], nominal: float, folder: Path | None
    ) -> None:
        self.name, self.distribution, self.entry, self.nominal, self.folder = name, distribution, entry, nominal, folder
        self.where = f"[tolerance.{name}]"
        relative = self.flag("relative")
        if relative and nominal == 0.0:
            raise InputError(f"{self.where} cannot be relative: the nominal value is 0")
        self.factor = nominal if relative else 1.0

    def tolerance(self) -> Tolerance:
        lower, upper = self.bounds()
        shape, points = self.shape_and_points(lower, upper)
        if points:
            lower, upper = min(points), max(points)
        centre, width = self.number(LAWS[self.distribution].centre, self.nominal), self.width()
        if self.distribution == "capability":
            centre, width, lower, upper = self.capability(centre, lower, upper)
        if not lower < upper:
            raise InputError(f"{self.where} lower = {lower:g} is not below upper = {upper:g}")
        if self.distribution == "triangular" and not lower <= centre <= upper:
            raise InputError(f"{self.where} mode = {centre:g} lies outside {lower:g} to {upper:g}")
        if self.distribution == "lognormal":
            if not centre > 0.0:
                stated = "median" if "median" in self.entry else f"the nominal {self.name} of [drive], its median,"
                raise InputError(f"{self.where} is lognormal: {stated} = {centre:g} must be greater than 0")
            lower = max(lower, 0.0)
            if upper <= 0.0:
                raise InputError(f"{self.where} upper = {upper:g} must be positive: the law is lognormal")
        if self.distribution == "beta" and not (math.isfinite(lower) and math.isfinite(upper)):
            raise InputError(f"{self.where} needs finite lower and upper")
        share = checks.number("batch_share", self.entry.get("batch_share", 0.0), 0.0, 1.0)
        cost = checks.positive("cost", self.entry.get("cost", 1.0))
        found = Tolerance(
            self.name, self.distribution, centre, width, lower, upper, shape, points, batch_share=share, cost=cost
        )
        if width and not lower < found.quantile(np.array(0.5)) < upper:
            raise InputError(f"{self.where} {found.describe()}: nothing of the law lies between the bounds")
        return found

    def flag(self, key: str) -> bool:
        return checks.flag(key, self.entry.get(key, False))

    def number(self, key: str, default: float) -> float:
        return checks.finite(key, self.entry[key]) * self.factor if key in self.entry else default

    def bounds(self) -> tuple[float, float]:
        lower, upper = self.number("lower", -math.inf), self.number("upper", math.inf)
        if self.factor < 0.0:
            return (upper if "upper" in self.entry else -math.inf), (lower if "lower" in self.entry else math.inf)
        return lower, upper

    def width(self) -> float:
        if "sigma_log" in self.entry:
            return checks.positive("sigma_log", self.entry["sigma_log"], 5.0)
        if "sigma" in self.entry:
            return checks.positive("sigma", self.entry["sigma"]) * abs(self.factor)
        return 0.0

    def capability(self, nominal: float, lower: float, upper: float) -> tuple[float, float, float, float]:
        """Mean, sigma and bounds of a process with known Cp and Cpk for the drawing value nominal +- tolerance."""
        half = checks.positive("tolerance", self.entry["tolerance"]) * abs(self.factor)
        if "cp" not in self.entry and "cpk" not in self.entry:
            raise InputError(f"{self.where} of distribution 'capability' needs the key 'cp', 'cpk' or both")
        key = "cp" if "cp" in self.entry else "cpk"  # alone it is both
        cp = checks.positive(key, self.entry[key], 100.0)
        cpk = checks.number("cpk", self.entry.get("cpk", cp), -cp, cp)
        side = 1.0 if choose("side", self.entry.get("side", SIDES[0]), SIDES) == SIDES[0] else -1.0
        sigma = half / (3.0 * cp)
        if self.flag("inspected"):
            lower, upper = max(lower, nominal - half), min(upper, nominal + half)
        return nominal + side * (half - 3.0 * cpk * sigma), sigma, lower, upper

    def shape_and_points(self, lower: float, upper: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if self.distribution == "beta":
            shape = tuple(checks.positive(key, self.entry[key], 1e6) for key in ("a", "b"))
            return shape if self.factor > 0.0 else shape[::-1], ()  # a negative nominal value mirrors the law
        if self.distribution == "discrete":
            points = self.numbers("values", self.entry["values"])
            weights = self.numbers("weights", self.entry.get("weights", [1.0] * len(points)))
            if len(weights) != len(points) or np.any(weights < 0.0) or not np.any(weights > 0.0):
                raise InputError(f"weights has {len(weights)} numbers, allowed: {len(points)}, not negative, not all 0")
            weights = np.ldexp(weights, -int(np.frexp(np.max(weights))[1]))  # their sum is a number
            points, weights = self.possible(points[weights > 0.0], weights[weights > 0.0], lower, upper)
            return tuple((weights / np.sum(weights)).tolist()), tuple(points.tolist())
        if self.distribution == "empirical":
            if ("values" in self.entry) == ("file" in self.entry):
                raise InputError(f"{self.where} of distribution 'empirical' needs either 'values' or 'file'")
            given = self.numbers("values", self.entry["values"] if "values" in self.entry else self.measured())
            return (), tuple(self.possible(given, given, lower, upper)[0].tolist())
        return (), ()

    def possible(
        self, points: checks.Floats, weights: checks.Floats, lower: float, upper: float
    ) -> tuple[checks.Floats, checks.Floats]:
        """Values within the bounds in rising order, with their weights; nothing of those beyond is ever drawn."""
        values = points * self.factor
        order = np.argsort(values, kind="stable")
        kept = order[(values[order] >= lower) & (values[order] <= upper)]
        different = len(np.unique(values[kept]))
        if different < 2:
            raise InputError(
                f"{self.where} values has {different} different numbers that can occur from lower = {lower:g} to "
                f"upper = {upper:g}, allowed: at least 2"
            )
        return values[kept], weights[kept]

    def numbers(self, key: str, value: Any) -> checks.Floats:
        array = checks.table(key, value)
        if key == "values" and len(np.unique(array)) < 2:
            raise InputError(f"{key} has {len(np.unique(array))} different numbers, allowed: at least 2")
        return array

    def measured(self) -> Any:
        """A column of a CSV or Parquet table beside the file."""
        from pyarrow import csv, parquet

        name = self.entry["file"]
        if not isinstance(name, str):
            raise InputError(f"file = {shorten(name)} is not the name of a table")
        first = Path(os.path.normpath(name)).as_posix().split("/", maxsplit=1)[0]
        if first in RESERVED:
            raise InputError(f"file = {name!r} is in the place of {first}, a result of hdfast (allowed: other names)")
        path = (self.folder or Path()) / name
        if not path.is_file():
            raise InputError(f"file = {name!r}: no such file beside the configuration")
        try:
            table = parquet.read_table(path) if path.suffix == ".parquet" else csv.read_csv(path)
        except (ValueError, OSError) as error:
            raise InputError(f"file = {name!r} cannot be read: {str(error).splitlines()[0]}") from None
        column = choose("column", self.entry.get("column", self.name), table.column_names)
        if table.column_names.count(column) > 1:
            raise InputError(f"file = {name!r} has {table.column_names.count(column)} columns {column!r}, allowed: 1")
        return table.column(column).to_numpy()


def read_correlation(section: Mapping[str, Any], laws: Mapping[str, Tolerance], known: Known) -> Any:
    """Read [correlation]: `pairs` of [name, name, value] and `kind`, "scores" or "rank"; None without pairs.

    Raises:
        InputError: an unknown name or value, or pairs that contradict each other or the laws.
    """
    from hdfast.tolerance.correlation import KINDS, correlation

    known(section, ("kind", "pairs"))
    if not section:
        return None
    kind = choose("kind", section.get("kind", KINDS[0]), KINDS)
    pairs = section.get("pairs", [])
    if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 3 for pair in pairs):
        raise InputError("pairs is not a list of [name, name, correlation]")
    for name in (name for pair in pairs for name in pair[:2] if isinstance(name, str) and name not in laws):
        hint, there = nearest(name, laws), ", ".join(laws) or "none"
        raise InputError(
            f"pairs: {name!r} needs a section [tolerance.{name}]{hint} (allowed, as they have one: {there})"
        )
    return correlation(pairs, kind, list(laws), laws)
