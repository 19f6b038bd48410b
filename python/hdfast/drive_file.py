"""The sections [drive], [kinematic_error] and [[terms]], which mean the same in every file that has them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hdfast import checks
from hdfast.errors import choose
from hdfast.model import BASES, SPRINGS, Model, Order
from hdfast.params import ParameterTable, layout
from hdfast.sections import Sections
from hdfast.spring import COEFFICIENTS
from hdfast.terms import terms
from hdfast.toml_lines import Path as Keys

TEETH = ("teeth_flexspline", "teeth_circular", "fixed")
FIXED = ("flexspline", "circular")
ERROR_KEYS = ("orders", "cos", "sin", "amplitude", "phase", "scale", "sigma")
TERM_KEYS = ("effect", "channel", "parameters")
UNKNOWN = "unknown"
UNLIMITED = "tau_max"  # the one parameter that may be infinite
SAME_RATIO = 1e-6


@dataclass(frozen=True)
class Effect:
    """A declared effect that the equations of the drive do not hold: of a sensor, or unknown.

    Attributes:
        effect: its id.
        channel: the channel of a sensor effect, else None.
        values: value by parameter; names as well as numbers where the effect is unknown.
        sigma: standard deviation of those numbers that state one.
    """

    effect: str
    channel: str | None
    values: Mapping[str, Any]
    sigma: Mapping[str, float]


@dataclass(frozen=True)
class DriveFile:
    """What a file states of a drive, nothing filled in.

    Attributes:
        base: base model, or None.
        spring: "polynomial" or "piecewise", as stated or by the coefficients given.
        orders: orders of the kinematic error, or None.
        terms: ids of the terms beyond the nominal model.
        values: value of each parameter in the unit of `hdfast.params`, by its column name.
        sigma: standard deviation in the same unit, where one is stated.
        teeth: `teeth_flexspline`, `teeth_circular` and `fixed`, where they are stated.
        effects: declared effects of sensors, and unknown ones.
        exact_by_mistake: parameters of value 0 with a relative sigma, which leaves them no deviation.
    """

    base: str | None
    spring: str
    orders: Sequence[Order] | None
    terms: tuple[str, ...]
    values: dict[str, float]
    sigma: dict[str, float]
    teeth: dict[str, int | str]
    effects: tuple[Effect, ...]
    exact_by_mistake: tuple[str, ...] = ()

    @property
    def ratio_by_teeth(self) -> float | None:
        """Gear ratio from the numbers of teeth, None where they are not stated."""
        flexspline, circular = self.teeth.get("teeth_flexspline"), self.teeth.get("teeth_circular")
        if not isinstance(flexspline, int) or not isinstance(circular, int) or circular <= flexspline:
            return None
        turning = circular if self.teeth.get("fixed", "flexspline") == "flexspline" else flexspline
        return turning / (circular - flexspline)

    @property
    def teeth_disagree(self) -> bool:
        """Whether the teeth give another ratio than the one stated."""
        by_teeth, stated = self.ratio_by_teeth, self.values.get("ratio")
        return by_teeth is not None and stated is not None and abs(abs(stated) / by_teeth - 1.0) > SAME_RATIO

    def model(self, base: str = BASES[0], orders: Sequence[Order] | None = None) -> Model:
        """The equations; `base` and `orders` stand in for what the file does not state.

        Raises:
            InputError: they do not go together.
        """
        chosen = orders if self.orders is None else self.orders
        given = {} if chosen is None else {"orders": chosen}
        return Model(base=self.base or base, spring=self.spring, terms=self.terms, **given)


def read_drive(file: Sections) -> DriveFile:
    """Read the three sections.

    Raises:
        ConfigError: an unknown key, a value that is no finite number, or values that contradict each other.
    """
    return _Reader(file).drive()


class _Reader:
    """Collects values and deviations from the sections."""

    def __init__(self, file: Sections) -> None:
        self.file = file
        self.values: dict[str, float] = {}
        self.sigma: dict[str, float] = {}
        self.exact_by_mistake: list[str] = []

    def drive(self) -> DriveFile:
        section, error = self.file.section("drive"), self.file.section("kinematic_error")
        base = self.choice(("drive", "base"), section, BASES)
        spring = self.spring(section)
        self.file.known(("kinematic_error",), error, ERROR_KEYS)
        entries = self.entries()
        numbered = list(enumerate(entries))
        named = [(number, entry) for number, entry in numbered if not _of_the_record(entry["effect"])]
        chosen = [entry["effect"] for _, entry in named]
        given = {"orders": error["orders"]} if "orders" in error else {}
        self.file.guard(("kinematic_error", "orders"), lambda: Model(**given))
        model = self.file.guard(("terms",), lambda: Model(spring=spring, terms=chosen, **given))
        table = layout(model)
        teeth = self.teeth(section)
        self.nominal(section, table)
        self.kinematic_error(error, model)
        for number, entry in named:
            self.term(("terms", number, "parameters"), entry, table)
        effects = tuple(self.effect(i, entry) for i, entry in numbered if _of_the_record(entry["effect"]))
        orders, exact = given.get("orders"), tuple(self.exact_by_mistake)
        return DriveFile(base, spring, orders, tuple(chosen), self.values, self.sigma, teeth, effects, exact)

    def choice(self, path: Keys, section: Mapping[str, Any], allowed: Iterable[str]) -> str | None:
        key = str(path[-1])
        return self.file.guard(path, choose, key, section[key], allowed) if key in section else None

    def spring(self, section: Mapping[str, Any]) -> str:
        stated = self.choice(("drive", "spring"), section, SPRINGS)
        found = [kind for kind, names in COEFFICIENTS.items() if set(names) & set(section)]
        if stated is None and len(found) > 1:
            mixed = ", ".join(name for names in COEFFICIENTS.values() for name in names if name in section)
            raise self.file.error(("drive",), f"[drive] mixes two spring laws: {mixed}; keep one, or state spring")
        return stated or (found[0] if found else SPRINGS[0])

    def teeth(self, section: Mapping[str, Any]) -> dict[str, int | str]:
        found: dict[str, int | str] = {
            key: self.file.guard(("drive", key), checks.whole, key, section[key], 10, 10_000)
            for key in TEETH[:2]
            if key in section
        }
        fixed = self.choice(("drive", "fixed"), section, FIXED)
        return found | ({"fixed": fixed} if fixed else {})

    def nominal(self, section: dict[str, Any], table: ParameterTable) -> None:
        names = [row.name for row in table]
        self.file.known(("drive",), section, ["base", "spring", "sigma", *TEETH, *names], table.owner)
        for key, value in section.items():
            if key in names:
                self.number(("drive", key), key, value)
        if self.values.get("ratio") == 0.0:
            raise self.file.error(("drive", "ratio"), "ratio = 0 (allowed: any other number)")
        stated = self.file.table(("drive", "sigma"), section.get("sigma", {}))
        self.file.known(("drive", "sigma"), stated, names, table.owner)
        for key, value in stated.items():
            path = ("drive", "sigma", key)
            if key not in self.values:
                raise self.file.error(path, f"drive.sigma.{key} is given, [drive] has no {key}")
            if key in self.sigma:
                raise self.file.error(path, f"{key} has a sigma in [drive] and another in [drive.sigma]")
            self.deviation(path, key, value)

    def number(self, path: Keys, name: str, entry: Any) -> None:
        """A number, or a table of value and relative sigma."""
        key = str(path[-1])
        check = checks.positive if name == UNLIMITED else checks.finite
        if not isinstance(entry, dict):
            self.values[name] = self.file.guard(path, check, key, entry)
            return
        self.file.known(path, entry, ("value", "sigma"))
        if "value" not in entry:
            raise self.file.error(path, f"{key} has no key 'value'")
        self.values[name] = self.file.guard(path, check, key, entry["value"])
        if "sigma" in entry:
            self.deviation(path, name, entry["sigma"])

    def deviation(self, path: Keys, name: str, relative: Any) -> None:
        share = self.file.guard(path, checks.finite, f"sigma of {name}", relative, 0.0)
        self.sigma[name] = share * abs(self.values[name])
        if share > 0.0 and self.values[name] == 0.0:
            self.exact_by_mistake.append(name)

    def entries(self) -> list[dict[str, Any]]:
        found = self.file.listed("terms")
        for number, entry in enumerate(found):
            path = ("terms", number)
            self.term_keys(path, entry)
            if "effect" not in entry:
                raise self.file.error(path, "[[terms]] needs the key 'effect'")
            effect = entry["effect"]
            term = None if effect == UNKNOWN else self.file.guard((*path, "effect"), terms().__getitem__, effect)
            if "channel" in entry and (term is None or not term.channels):
                raise self.file.error((*path, "channel"), f"{effect} acts on the drive and has no channel")
        return found

    def term_keys(self, path: Keys, entry: Mapping[str, Any]) -> None:
        if "id" in entry:
            raise self.file.error((*path, "id"), "[[terms]] unknown key 'id'; the key is 'effect'")
        named = entry.get("effect")
        own = [parameter.name for term in terms() if term.id == named for parameter in term.parameters]
        for key in entry:
            if key in own:
                raise self.file.error((*path, key), f"{key!r} belongs into parameters = {{ {key} = ... }}")
        self.file.known(path, entry, TERM_KEYS)

    def term(self, path: Keys, entry: Mapping[str, Any], table: ParameterTable) -> None:
        effect = entry["effect"]
        names = [parameter.name for parameter in terms()[effect].parameters]
        columns = {name: name if name in table else f"{effect}_{name}" for name in names}
        given = self.file.table(path, entry.get("parameters", {}))
        self.file.known(path, given, columns)
        for name, value in given.items():
            self.number((*path, name), columns[name], value)

    def effect(self, number: int, entry: Mapping[str, Any]) -> Effect:
        path: Keys = ("terms", number, "parameters")
        given = self.file.table(path, entry.get("parameters", {}))
        inner = _Reader(self.file)
        if entry["effect"] != UNKNOWN:
            return self.of_a_sensor(number, entry, given, inner)
        for name, value in given.items():
            if not isinstance(value, str):
                inner.number((*path, name), name, value)
        named = {name: value for name, value in given.items() if isinstance(value, str)}
        return Effect(UNKNOWN, None, named | inner.values, inner.sigma)

    def of_a_sensor(self, number: int, entry: Mapping[str, Any], given: Mapping[str, Any], inner: _Reader) -> Effect:
        path: Keys = ("terms", number)
        term = terms()[entry["effect"]]
        stated = entry.get("channel")
        channel = self.file.guard((*path, "channel"), choose, f"channel of {term.id}", stated, term.channels)
        for earlier in self.file.listed("terms")[:number]:
            if (earlier["effect"], earlier.get("channel")) == (term.id, channel):
                raise self.file.error(path, f"[[terms]] names {term.id} on {channel} twice (allowed: once per channel)")
        self.file.known((*path, "parameters"), given, [parameter.name for parameter in term.parameters])
        for name, value in given.items():
            inner.number((*path, "parameters", name), name, value)
        return Effect(term.id, channel, inner.values, inner.sigma)

    def kinematic_error(self, error: Mapping[str, Any], model: Model) -> None:
        path: Keys = ("kinematic_error",)
        cartesian, polar = {"cos", "sin"} & set(error), {"amplitude", "phase"} & set(error)
        if cartesian and polar:
            raise self.file.error(path, "[kinematic_error] takes either cos and sin or amplitude and phase")
        for pair, found in ((("cos", "sin"), cartesian), (("amplitude", "phase"), polar)):
            if found and len(found) != 2:
                raise self.file.error(path, f"[kinematic_error] needs {pair[0]} and {pair[1]} together")
        if "scale" in error:
            scale = self.file.guard((*path, "scale"), checks.finite, "scale", error["scale"])
            self.once("te_scale", scale)
        if not cartesian and not polar:
            if "sigma" in error:
                raise self.file.error(
                    (*path, "sigma"), "[kinematic_error] sigma needs cos and sin, or amplitude and phase"
                )
            return
        labels = model.order_labels
        first, second = (
            self.series(error, key, labels) for key in (("cos", "sin") if cartesian else ("amplitude", "phase"))
        )
        for label, a, b in zip(labels, first, second, strict=True):
            self.once(f"te_cos_{label}", a if cartesian else a * math.sin(b))
            self.once(f"te_sin_{label}", b if cartesian else a * math.cos(b))
        if "sigma" in error:
            spread = error["sigma"]
            repeated = dict(error) if isinstance(spread, list) else {"sigma": [spread] * len(labels)}
            for label, value in zip(labels, self.series(repeated, "sigma", labels, 0.0), strict=True):
                self.sigma[f"te_cos_{label}"] = self.sigma[f"te_sin_{label}"] = value

    def once(self, name: str, value: float) -> None:
        """A value of [kinematic_error], which [drive] must not state as well."""
        if name in self.values:
            raise self.file.error(("drive", name), f"{name} is stated here and by [kinematic_error]; keep one")
        self.values[name] = value

    def series(self, error: Mapping[str, Any], key: str, labels: list[str], low: float = -math.inf) -> list[float]:
        path = ("kinematic_error", key)
        value = error[key]
        if not isinstance(value, list) or len(value) != len(labels):
            size = len(value) if isinstance(value, list) else "no list of"
            raise self.file.error(
                path, f"{key} has {size} numbers, orders has {len(labels)} (allowed: the same number)"
            )
        return [self.file.guard(path, checks.finite, f"{key}[{i}]", value[i], low) for i in range(len(value))]


def _of_the_record(effect: str) -> bool:
    """Whether the equations of the drive do not hold the effect."""
    return effect == UNKNOWN or bool(terms()[effect].channels)
