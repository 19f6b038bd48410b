"""Configuration files: TOML with drive, kinematic error, terms, sensors, scenario, tolerances, limits and run."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from hdfast import catalogue, checks
from hdfast.drive_file import DriveFile, Effect, read_drive
from hdfast.errors import InputError, RowError, choose, shorten
from hdfast.files import INPUT
from hdfast.model import Model
from hdfast.params import ParameterTable, layout
from hdfast.request import ATOL, MAX_STEPS, RTOL
from hdfast.scenario import Scenario
from hdfast.sections import Sections
from hdfast.sensors import SensorFacts, SensorStage, stage_of
from hdfast.sensors.facts import read_sensors
from hdfast.threads import MAX_THREADS
from hdfast.tolerance.correlation import Correlation
from hdfast.tolerance.designs import DESIGNS
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.limits import Spec, read_spec
from hdfast.tolerance.policy import POLICIES
from hdfast.tolerance.reading import read_correlation, read_tolerance
from hdfast.tolerance.sample import MAX_ROWS, Plan
from hdfast.tolerance.trajectories import Trajectories, read_trajectories
from hdfast.toml_lines import Path as Keys

SPEC_KEYS = ("lower", "upper", "min_yield")
RUN_KEYS = (
    "rows", "seed", "method", "rtol", "atol", "max_steps", "metrics", "threads",
    "sampling", "replicates", "block", "levels", "failed",
)  # fmt: skip
KINDS = ("start_stop", "speed_profile", "torque_profile")
SCENARIO_KEYS = {"speed_rpm": "omega_set", "set_speed_rpm": "omega_set", "load": "tau_load"}


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
    block: int = 100
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
        sensors: what is stated of each channel.
        effects: declared effects that the equations do not hold, those of sensors among them.
        text: the file as read.
        tables: content of the tables of measured values that it names, by their names there.
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
    sensors: dict[str, SensorFacts]
    effects: tuple[Effect, ...]
    text: str
    tables: dict[str, bytes]

    @property
    def checksums(self) -> dict[str, Any]:
        """SHA-256 of the text, and by name those of the tables where there are any."""
        found: dict[str, Any] = {"input_sha256": hashlib.sha256(self.text.encode()).hexdigest()}
        if self.tables:
            found["tables_sha256"] = {n: hashlib.sha256(content).hexdigest() for n, content in self.tables.items()}
        return found

    @property
    def inputs(self) -> dict[str, bytes]:
        """What results hold a copy of, by name: tables beside or below the file, not those elsewhere, and its text."""
        kept = {n: table for n, table in self.tables.items() if not (Path(n).is_absolute() or ".." in Path(n).parts)}
        return {**kept, INPUT: self.text.encode()}

    def nominal(self) -> dict[str, float]:
        """Every parameter of the nominal drive by name, scenario columns included."""
        values = {row.name: row.default for row in self.table}
        return {**values, **self.scenario.values, **self.drive}

    @property
    def sensor_stage(self) -> SensorStage | None:
        """What a recording of the drive passes through, or None where the file states nothing of sensors."""
        stage = stage_of(self.sensors, self.effects, seed=self.run.seed)
        return stage if stage.effects else None

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
    return _Reader(Sections.read(path)).config()


def parse(text: str, name: str = "configuration") -> Config:
    """As `load`, from text; `name` stands for the file in messages."""
    return _Reader(Sections(text, name)).config()


class _Reader:
    """Turns the sections into objects, adding file and line to every complaint."""

    def __init__(self, file: Sections) -> None:
        self.file = file

    def config(self) -> Config:
        drive = read_drive(self.file)
        self.teeth(drive)
        model = self.file.guard(("drive",), drive.model)
        table = layout(model)
        scenario = self.scenario()
        self.possible(model, scenario, drive.values)
        nominal = {row.name: row.default for row in table} | dict(scenario.values) | drive.values
        tolerances = self.tolerances(table, nominal)
        self.heeded(scenario, {"drive": drive.values, "tolerance": tolerances})
        return Config(
            self.file.title,
            model,
            table,
            drive.values,
            scenario,
            tolerances,
            self.correlation(tolerances),
            self.batch_size(tolerances),
            self.specs(),
            self.run(model),
            self.trajectories(scenario.t_end),
            read_sensors(self.file),
            drive.effects,
            self.file.text,
            self.tables(),
        )

    def possible(self, model: Model, scenario: Scenario, drive: Mapping[str, float]) -> None:
        """A nominal drive that cannot be simulated is wrong input, and no row that fails."""
        from hdfast.sweep import sweep

        if not drive:
            return
        row = {name: [value] for name, value in drive.items()}
        try:
            sweep(row, model=model, scenario=scenario, metrics=(), max_steps=1, threads=1, strict=True)
        except RowError as wrong:
            raise self.file.error(self.place(wrong.parameter), str(wrong).removeprefix("row 0: ")) from None

    def place(self, parameter: str) -> Keys:
        """Where the file states a parameter of the drive."""
        for number, entry in enumerate(self.file.listed("terms")):
            for name in entry.get("parameters", {}):
                if parameter in (name, f"{entry['effect']}_{name}"):
                    return ("terms", number, "parameters", name)
        return ("drive", parameter)

    def teeth(self, drive: DriveFile) -> None:
        expected, stated = drive.ratio_by_teeth, drive.values.get("ratio")
        if drive.teeth_disagree or (expected is not None and stated is None):
            raise self.file.error(
                ("drive", "teeth_flexspline"),
                f"the teeth give ratio = {expected:.12g}, [drive] states {'none' if stated is None else stated} "
                "(allowed: that ratio, or no teeth)",
            )

    def scenario(self) -> Scenario:
        section = dict(self.file.section("scenario"))
        kind = section.pop("kind", KINDS[0])
        self.file.guard(("scenario", "kind"), choose, "kind", kind, KINDS)
        make: Callable[..., Scenario] = getattr(Scenario, kind)
        accepted = inspect.signature(make).parameters
        self.file.known(("scenario",), section, ["kind", *accepted])
        for key, value in section.items():
            if isinstance(value, bool) and key != "hold":
                raise self.file.error(("scenario", key), f"{key} = {shorten(value)} is not a number or a name")
        if section.get("stop") == "none":
            section["stop"] = None
        for key, parameter in accepted.items():
            if key not in section and parameter.default is parameter.empty:
                raise self.file.error(("scenario",), f"[scenario] of kind {kind!r} needs the key {key!r}")
        result: Scenario = self.file.guard(self.blamed(section, make), lambda: make(**section))
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
        section = self.file.section("tolerance")
        self.file.known(("tolerance",), section, [row.name for row in table], table.owner)
        found = {}
        for name, entry in section.items():
            path = ("tolerance", name)
            if not isinstance(entry, dict):
                raise self.file.error(path, f"tolerance.{name} = {shorten(entry)} is not a section [tolerance.{name}]")
            known = partial(self.file.known, path)
            found[name] = self.file.guard(
                path, read_tolerance, name, entry, nominal[name], known, Path(self.file.name).parent
            )
        return found

    def heeded(self, scenario: Scenario, stated: Mapping[str, Iterable[str]]) -> None:
        """Refuse columns of the scenario that change nothing in it or that [drive] and [scenario] both state."""
        for section, names in stated.items():
            for name in names:
                if name in scenario.idle:
                    message = f"{name} has no meaning {scenario.idle[name]} (allowed: left out of [{section}])"
                    raise self.file.error((section, name), message)
        for key, value in self.file.section("scenario").items():
            name = SCENARIO_KEYS.get(key, key)
            if name in stated["drive"] and not isinstance(value, list):
                raise self.file.error(("drive", name), f"{name} is stated here and by {key} of [scenario]; keep one")

    def tables(self) -> dict[str, bytes]:
        """Content of the tables that the tolerances, which are read already, name."""
        named = {entry["file"] for entry in self.file.section("tolerance").values() if "file" in entry}
        return {name: (Path(self.file.name).parent / name).read_bytes() for name in sorted(named)}

    def correlation(self, laws: Mapping[str, Tolerance]) -> Correlation | None:
        path = ("correlation",)
        found: Correlation | None = self.file.guard(
            path, read_correlation, self.file.section("correlation"), laws, partial(self.file.known, path)
        )
        return found

    def trajectories(self, t_end: float) -> Trajectories | None:
        path = ("trajectories",)
        found: Trajectories | None = self.file.guard(
            path, read_trajectories, self.file.section("trajectories"), partial(self.file.known, path), t_end
        )
        return found

    def batch_size(self, tolerances: Mapping[str, Tolerance]) -> int:
        section = self.file.section("batches")
        self.file.known(("batches",), section, ("size",))
        shares = {name: tolerance.batch_share for name, tolerance in tolerances.items() if tolerance.batch_share}
        if shares and "size" not in section:
            name, share = next(iter(shares.items()))
            message = f"batch_share = {share:g} has no meaning without a size in [batches] (allowed: 0)"
            raise self.file.error(("tolerance", name, "batch_share"), message)
        size: int = self.file.guard(("batches", "size"), checks.whole, "size", section.get("size", 1), 1, MAX_ROWS)
        return size

    def specs(self) -> dict[str, Spec]:
        found = {}
        for name, entry in self.file.section("spec").items():
            path = ("spec", name)
            metric = self.file.guard(path, catalogue.metric, name).name
            if not isinstance(entry, dict):
                raise self.file.error(path, f"spec.{name} = {shorten(entry)} is not a section [spec.{name}]")
            self.file.known(path, entry, SPEC_KEYS)
            if metric in found:
                raise self.file.error(path, f"[spec.{name}] is {metric} once more (allowed: one section per metric)")
            found[metric] = self.file.guard(path, read_spec, metric, entry)
        return found

    def run(self, model: Model) -> Run:
        section = self.file.section("run")
        self.file.known(("run",), section, RUN_KEYS)
        readers: dict[str, Callable[[Any], Any]] = {
            "rows": lambda value: checks.whole("rows", value, 1, MAX_ROWS),
            "seed": lambda value: checks.whole("seed", value, 0, checks.MAX_SEED),
            "method": lambda value: (catalogue.choose_method(value, terms=bool(model.terms)), value)[1],
            "rtol": lambda value: checks.number("rtol", value, *RTOL),
            "atol": lambda value: checks.number("atol", value, *ATOL),
            "max_steps": lambda value: checks.whole("max_steps", value, 1, MAX_STEPS),
            "metrics": lambda value: tuple(item.name for item in catalogue.choose_metrics(value)),
            "threads": lambda value: checks.whole("threads", value, 1, MAX_THREADS),
            "sampling": lambda value: choose("sampling", value, DESIGNS),
            "replicates": lambda value: checks.whole("replicates", value, 1, 1024),
            "block": lambda value: checks.whole("block", value, 2, 10**6),
            "levels": lambda value: checks.whole("levels", value, 2, 64),
            "failed": lambda value: choose("failed", value, POLICIES),
        }
        return Run(**{key: self.file.guard(("run", key), readers[key], section[key]) for key in section})
