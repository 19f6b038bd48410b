"""Configuration files: TOML with the sections drive, kinematic_error, terms, scenario, tolerance, spec and run."""

from __future__ import annotations

import inspect
import math
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from hdfast import catalogue, checks
from hdfast.errors import ConfigError, InputError, choose, nearest, shorten
from hdfast.model import Model
from hdfast.params import ParameterTable, layout
from hdfast.scenario import Scenario
from hdfast.terms import terms
from hdfast.tolerance.correlation import Correlation
from hdfast.tolerance.designs import DESIGNS
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.limits import Spec, read_spec
from hdfast.tolerance.policy import POLICIES
from hdfast.tolerance.reading import read_correlation, read_tolerance
from hdfast.tolerance.sample import MAX_ROWS, Plan
from hdfast.tolerance.trajectories import Trajectories, read_trajectories
from hdfast.toml_lines import Lines

SECTIONS = (
    "title", "drive", "kinematic_error", "terms", "scenario", "tolerance", "correlation", "batches", "spec", "run",
    "trajectories",
)  # fmt: skip
MODEL_KEYS = ("base", "spring")
ERROR_KEYS = ("orders", "cos", "sin", "amplitude", "phase", "scale")
TERM_KEYS = ("effect", "parameters")
SPEC_KEYS = ("lower", "upper", "min_yield")
RUN_KEYS = (
    "rows", "seed", "method", "rtol", "atol", "max_steps", "metrics", "threads",
    "sampling", "replicates", "block", "levels", "failed",
)  # fmt: skip
KINDS = ("start_stop", "speed_profile", "torque_profile")


@dataclass(frozen=True)
class Run:
    """How a file wants to be run."""

    rows: int = 1000
    seed: int = 1
    method: str = "auto"
    rtol: float = 1e-6
    atol: float = 1.0
    max_steps: int = 1_000_000
    metrics: tuple[str, ...] | None = None
    threads: int | None = None
    sampling: str = "monte_carlo"
    replicates: int = 16
    block: int = 1000
    levels: int = 3
    failed: str = "refuse"


@dataclass(frozen=True)
class Config:
    """A checked configuration file.

    Attributes:
        title: one line for reports.
        drive: nominal value of every parameter named in the file, the kinematic error included.
        tolerances: distribution of each parameter that varies.
        correlation: dependence between them, or None.
        batch_size: rows that share what `batch_share` of their tolerances says.
        specs: limits by metric.
        trajectories: signals a study keeps over time, or None.
        text: the file as read.
    """

    title: str
    model: Model
    table: ParameterTable
    drive: dict[str, float]
    scenario: Scenario
    tolerances: dict[str, Tolerance]
    correlation: Correlation | None
    batch_size: int
    specs: dict[str, Spec]
    run: Run
    trajectories: Trajectories | None
    text: str

    def nominal(self) -> dict[str, float]:
        """Every parameter of the nominal drive by name, scenario columns included."""
        values = {row.name: row.default for row in self.table}
        return {**values, **self.scenario.values, **self.drive}

    def plan(self, seed: int | None = None, sampling: str | None = None) -> Plan:
        """What is drawn, with the file's own seed and sampling unless given."""
        run = self.run
        return Plan(
            tuple(self.tolerances.values()),
            sampling=run.sampling if sampling is None else sampling,
            seed=run.seed if seed is None else seed,
            replicates=run.replicates,
            block=run.block,
            levels=run.levels,
            correlation=self.correlation,
            batch_size=self.batch_size,
        )


def load(path: str | Path) -> Config:
    """Read and check a configuration file.

    Raises:
        ConfigError: with the line number and, for an unknown key, the nearest known one.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not a UTF-8 text file ({error.reason})") from None
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    return parse(text, str(path))


def parse(text: str, name: str = "configuration") -> Config:
    """As `load`, from text; `name` stands for the file in messages."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"{name}: {error}") from None
    return _Reader(data, Lines(text), name).config(text)


class _Reader:
    """Turns the sections into objects, adding file and line to every complaint."""

    def __init__(self, data: dict[str, Any], lines: Lines, name: str) -> None:
        self.data = data
        self.lines = lines
        self.name = name

    def config(self, text: str) -> Config:
        self.known((), self.data, SECTIONS)
        drive = self.section("drive")
        error = self.section("kinematic_error")
        self.known(("kinematic_error",), error, ERROR_KEYS)
        model = self.guard(
            ("kinematic_error",) if error else ("drive",),
            lambda: Model(
                **{key: drive[key] for key in MODEL_KEYS if key in drive},
                **({"orders": error["orders"]} if "orders" in error else {}),
                terms=self.terms(),
            ),
        )
        table = layout(model)
        scenario = self.scenario()
        values = self.drive(drive, table) | self.kinematic_error(error, model) | self.term_parameters(table)
        nominal = {row.name: row.default for row in table} | dict(scenario.values) | values
        title = self.data.get("title", Path(self.name).stem)
        if not isinstance(title, str):
            raise self.error(("title",), f"title = {shorten(title)} is not text")
        tolerances = self.tolerances(table, nominal)
        return Config(
            title,
            model,
            table,
            values,
            scenario,
            tolerances,
            self.correlation(tolerances),
            self.batch_size(),
            self.specs(),
            self.run(),
            self.trajectories(),
            text,
        )

    def error(self, path: tuple[str, ...], message: str) -> ConfigError:
        line = self.lines.of(path)
        where = f"{self.name}, line {line}" if line else self.name
        return ConfigError(f"{where}: {message}", line)

    def guard(self, path: tuple[str, ...], action: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return action(*arguments)
        except ConfigError:
            raise
        except InputError as error:
            raise self.error(path, str(error)) from None

    def known(self, path: tuple[str, ...], found: Iterable[str], allowed: Iterable[str]) -> None:
        names = list(allowed)
        for key in found:
            if key not in names:
                section = f"[{'.'.join(path)}] " if path else ""
                raise self.error(
                    (*path, key), f"{section}unknown key {key!r}{nearest(key, names)} (allowed: {_listed(names)})"
                )

    def section(self, name: str) -> dict[str, Any]:
        value = self.data.get(name, {})
        if not isinstance(value, dict):
            raise self.error((name,), f"{name} = {shorten(value)} is not a section [{name}]")
        return value

    def terms(self) -> list[str]:
        entries = self.data.get("terms", [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise self.error(("terms",), "terms is not a list of sections [[terms]]")
        for entry in entries:
            self.known(("terms",), entry, TERM_KEYS)
            if "effect" not in entry:
                raise self.error(("terms",), "[[terms]] needs the key 'effect'")
            self.guard(("terms", "effect"), lambda name: Model(terms=[name]), entry["effect"])
        return [entry["effect"] for entry in entries]

    def term_parameters(self, table: ParameterTable) -> dict[str, float]:
        values: dict[str, float] = {}
        for entry in self.data.get("terms", []):
            effect = entry["effect"]
            names = [parameter.name for parameter in terms()[effect].parameters]
            columns = {name: name if name in table else f"{effect}_{name}" for name in names}
            given = entry.get("parameters", {})
            self.known(("terms",), given, columns)
            for name, value in given.items():
                number = value.get("value") if isinstance(value, dict) else value
                values[columns[name]] = self.guard(("terms", "parameters"), checks.finite, name, number)
        return values

    def drive(self, drive: dict[str, Any], table: ParameterTable) -> dict[str, float]:
        self.known(("drive",), drive, [*MODEL_KEYS, *(row.name for row in table)])
        return {
            key: self.guard(("drive", key), checks.finite, key, drive[key]) for key in drive if key not in MODEL_KEYS
        }

    def kinematic_error(self, error: Mapping[str, Any], model: Model) -> dict[str, float]:
        path = ("kinematic_error",)
        cartesian, polar = {"cos", "sin"} & set(error), {"amplitude", "phase"} & set(error)
        if cartesian and polar:
            raise self.error(path, "[kinematic_error] takes either cos and sin or amplitude and phase")
        for pair, found in ((("cos", "sin"), cartesian), (("amplitude", "phase"), polar)):
            if found and len(found) != 2:
                raise self.error(path, f"[kinematic_error] needs {pair[0]} and {pair[1]} together")
        values: dict[str, float] = {}
        if "scale" in error:
            values["te_scale"] = self.guard((*path, "scale"), checks.finite, "scale", error["scale"])
        if not cartesian and not polar:
            return values
        first, second = ("cos", "sin") if cartesian else ("amplitude", "phase")
        for label, a, b in zip(
            model.order_labels, self.series(error, first, model), self.series(error, second, model), strict=True
        ):
            values[f"te_cos_{label}"] = a if cartesian else a * math.sin(b)
            values[f"te_sin_{label}"] = b if cartesian else a * math.cos(b)
        return values

    def series(self, error: Mapping[str, Any], key: str, model: Model) -> list[float]:
        path = ("kinematic_error", key)
        value = error[key]
        if not isinstance(value, list) or len(value) != len(model.order_labels):
            size = len(value) if isinstance(value, list) else "no list of"
            raise self.error(
                path, f"{key} has {size} numbers, orders has {len(model.order_labels)} (allowed: the same number)"
            )
        return [self.guard(path, checks.finite, f"{key}[{i}]", value[i]) for i in range(len(value))]

    def scenario(self) -> Scenario:
        section = dict(self.section("scenario"))
        kind = section.pop("kind", KINDS[0])
        self.guard(("scenario", "kind"), choose, "kind", kind, KINDS)
        make: Callable[..., Scenario] = getattr(Scenario, kind)
        accepted = inspect.signature(make).parameters
        self.known(("scenario",), section, ["kind", *accepted])
        for key, value in section.items():
            if isinstance(value, bool) and key != "hold":
                raise self.error(("scenario", key), f"{key} = {shorten(value)} is not a number or a name")
        if section.get("stop") == "none":
            section["stop"] = None
        for key, parameter in accepted.items():
            if key not in section and parameter.default is parameter.empty:
                raise self.error(("scenario",), f"[scenario] of kind {kind!r} needs the key {key!r}")
        result: Scenario = self.guard(self.blamed(section, make), lambda: make(**section))
        return result

    def blamed(self, section: Mapping[str, Any], make: Callable[..., Scenario]) -> tuple[str, ...]:
        """The key that the complaint starts with, else the section."""
        try:
            make(**section)
        except InputError as error:
            key = str(error).split(" ", maxsplit=1)[0].split("[", maxsplit=1)[0]
            if key in section:
                return ("scenario", key)
        return ("scenario",)

    def tolerances(self, table: ParameterTable, nominal: Mapping[str, float]) -> dict[str, Tolerance]:
        section = self.section("tolerance")
        self.known(("tolerance",), section, [row.name for row in table])
        found = {}
        for name, entry in section.items():
            path = ("tolerance", name)
            if not isinstance(entry, dict):
                raise self.error(path, f"tolerance.{name} = {shorten(entry)} is not a section [tolerance.{name}]")
            known = partial(self.known, path)
            found[name] = self.guard(path, read_tolerance, name, entry, nominal[name], known, Path(self.name).parent)
        return found

    def correlation(self, names: Iterable[str]) -> Correlation | None:
        path = ("correlation",)
        found: Correlation | None = self.guard(
            path, read_correlation, self.section("correlation"), names, partial(self.known, path)
        )
        return found

    def trajectories(self) -> Trajectories | None:
        path = ("trajectories",)
        found: Trajectories | None = self.guard(
            path, read_trajectories, self.section("trajectories"), partial(self.known, path)
        )
        return found

    def batch_size(self) -> int:
        section = self.section("batches")
        self.known(("batches",), section, ("size",))
        size: int = self.guard(("batches", "size"), checks.whole, "size", section.get("size", 1), 1, MAX_ROWS)
        return size

    def specs(self) -> dict[str, Spec]:
        found = {}
        for name, entry in self.section("spec").items():
            path = ("spec", name)
            metric = self.guard(path, catalogue.metric, name).name
            if not isinstance(entry, dict):
                raise self.error(path, f"spec.{name} = {shorten(entry)} is not a section [spec.{name}]")
            self.known(path, entry, SPEC_KEYS)
            found[metric] = self.guard(path, read_spec, metric, entry)
        return found

    def run(self) -> Run:
        section = self.section("run")
        self.known(("run",), section, RUN_KEYS)
        readers: dict[str, Callable[[Any], Any]] = {
            "rows": lambda value: checks.whole("rows", value, 1, MAX_ROWS),
            "seed": lambda value: checks.whole("seed", value, 0, 2**63 - 1),
            "method": lambda value: (catalogue.choose_method(value), value)[1],
            "rtol": lambda value: checks.number("rtol", value, 1e-13, 1e-1),
            "atol": lambda value: checks.number("atol", value, 1e-9, 1e9),
            "max_steps": lambda value: checks.whole("max_steps", value, 1, 2**31 - 1),
            "metrics": lambda value: tuple(item.name for item in catalogue.choose_metrics(value)),
            "threads": lambda value: checks.whole("threads", value, 1, 1024),
            "sampling": lambda value: choose("sampling", value, DESIGNS),
            "replicates": lambda value: checks.whole("replicates", value, 1, 1024),
            "block": lambda value: checks.whole("block", value, 2, 10**6),
            "levels": lambda value: checks.whole("levels", value, 2, 64),
            "failed": lambda value: choose("failed", value, POLICIES),
        }
        return Run(**{key: self.guard(("run", key), readers[key], section[key]) for key in section})


def _listed(names: list[str]) -> str:
    return ", ".join(names[:24]) + (", ..." if len(names) > 24 else "")
