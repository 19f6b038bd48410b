"""A campaign file: nominal drive with its tolerances, sensors, controller, and the recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from hdfast import checks
from hdfast.drive_file import DriveFile, read_drive
from hdfast.errors import ConfigError, InputError, choose, nearest, shorten
from hdfast.model import Model, parse_order
from hdfast.recordings.columns import COLUMNS, ColumnMap, read_column_map
from hdfast.recordings.formats import KINDS, Source, read
from hdfast.recordings.load import to_table, wanted
from hdfast.recordings.priors import TORQUE_SCALE, Prior, priors
from hdfast.recordings.replay import INPUTS
from hdfast.recordings.rig import Controller, read_controller
from hdfast.recordings.table import Table
from hdfast.sections import Sections
from hdfast.sensors.facts import SensorFacts, read_sensors, stage_of
from hdfast.sensors.stage import SensorStage
from hdfast.toml_lines import Path as Keys

ROLES = ("fit", "heldout")
RECORDING_KEYS = ("file", "role", "group", "started_at_s", "input")
DELAY = "sensor_delay"
LOAD_SIDE = ("load_angle", "output_torque")
TORQUES = ("motor_torque", "load_torque", "output_torque")


@dataclass(frozen=True, eq=False)
class CampaignRecording(Table):
    """One [[recording]] as it was read; `hdfast.health.check` judges it.

    Attributes:
        file: where it was read from.
        role: "fit" or "heldout".
        group: same rig, day and temperature; folds of a cross-validation are whole groups.
        started_at_s: its begin on the clock of the campaign [s].
        input: "reference", "motor_torque", "motor_motion", or None where the campaign leaves it open.
    """

    file: Path = Path()
    role: str = ROLES[0]
    group: str = "A"
    started_at_s: float = 0.0
    input: str | None = None


@dataclass(frozen=True, eq=False)
class Campaign:
    """A checked campaign file.

    Attributes:
        title: one line for reports.
        recordings: the recordings in the order of the file; none in an extended model.
        drive: what the file states of the drive, nothing filled in.
        sensors: what is stated of each channel.
        controller: the speed controller, or None where it is unknown.
        columns: where a standard column stands in the files.
        data: the sections as read, for a file that is to be written again.
        text: the file as read.
        folder: of the file.
    """

    title: str
    recordings: list[CampaignRecording] = field(repr=False)
    drive: DriveFile
    sensors: Mapping[str, SensorFacts]
    controller: Controller | None
    columns: Mapping[str, ColumnMap]
    data: Mapping[str, Any] = field(repr=False)
    text: str = field(repr=False)
    folder: Path = Path()

    @cached_property
    def base(self) -> str:
        """The base model: as stated, else "one_inertia" when no recording has a filled channel of the load side."""
        if self.drive.base is not None:
            return self.drive.base
        seen = any(item.filled(name) for item in self.recordings for name in LOAD_SIDE)
        return "two_inertia" if seen or not self.recordings else "one_inertia"

    @cached_property
    def model(self) -> Model:
        """The equations; without a section [kinematic_error] the drive has no kinematic error.

        Raises:
            InputError: the base does not go together with the declared terms.
        """
        return self.drive.model(self.base, orders=())

    @property
    def orders(self) -> list[float]:
        """Stated orders of the kinematic error, cycles per motor revolution."""
        return [float(parse_order(order)) for order in self.drive.orders or ()]

    @cached_property
    def priors(self) -> dict[str, Prior]:
        """What is known beforehand of every parameter of the model, by column name."""
        return priors(self.drive, self.base)

    @cached_property
    def sensor_stage(self) -> SensorStage:
        """What a simulated recording passes through: the stated facts and the declared effects of sensors."""
        return stage_of(self.sensors, self.drive.effects)

    @cached_property
    def delays(self) -> dict[str, float]:
        """Delay of each channel that one is known of [s], stated or declared."""
        facts = {name: replace(own, averaged=None) for name, own in self.sensors.items()}
        stage = stage_of(facts, self.drive.effects)
        return {name: float(stage.value(f"{name}_{DELAY}_tau_y")) for effect, name in stage.effects if effect == DELAY}

    @cached_property
    def channel_sigma(self) -> dict[str, float]:
        """Relative standard deviation of the scale of each channel; 0.05 for torques unless stated, else 0."""
        stated = {name: entry.sigma for name, entry in self.columns.items() if entry.sigma is not None}
        default = {name: TORQUE_SCALE if name in TORQUES else 0.0 for name in COLUMNS if name != "t"}
        return default | {name: sigma for name, sigma in stated.items() if name != "t"}


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file, or an extended model, and its recordings; their paths count from the file's folder.

    Raises:
        ConfigError: the file is no TOML, has an unknown section or key, or a value that cannot be.
        InputError: a recording cannot be read.
    """
    file = Sections.read(path)
    columns = _columns(file)
    drive, sensors, controller = read_drive(file), read_sensors(file), read_controller(file)
    folder = Path(path).parent
    recordings = _Recordings(file, columns, sensors, folder).read()
    return Campaign(file.title, recordings, drive, sensors, controller, columns, file.data, file.text, folder)


def recorded(campaign: str | Path | Campaign) -> Campaign:
    """A campaign that has recordings: as `load_campaign`, or as it is given.

    Raises:
        ConfigError: as `load_campaign`; or the file names no recording.
        InputError: a recording cannot be read.
    """
    found = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    if not found.recordings:
        where = found.title if isinstance(campaign, Campaign) else campaign
        raise ConfigError(f"{where} holds no [[recording]]: a campaign file names at least one (docs/campaign.md)")
    return found


def _columns(file: Sections) -> dict[str, ColumnMap]:
    section = file.section("columns")
    file.known(("columns",), section, COLUMNS)
    found: dict[str, ColumnMap] = {}
    for name, entry in section.items():
        found |= file.guard(("columns", name), read_column_map, {name: entry})
    return found


class _Recordings:
    """Reads the files behind [[recording]]."""

    def __init__(
        self, file: Sections, columns: dict[str, ColumnMap], sensors: Mapping[str, SensorFacts], folder: Path
    ) -> None:
        self.file = file
        self.columns = columns
        self.folder = folder
        self.steps = {name: facts.resolution for name, facts in sensors.items() if facts.resolution is not None}

    def read(self) -> list[CampaignRecording]:
        entries = self.file.listed("recording")
        checked = [self.entry(("recording", number), entry) for number, entry in enumerate(entries)]
        tables = [(facts, read(facts["file"], wanted(self.columns))) for facts in checked]
        for standard, entry in self.columns.items():
            if tables and not any(entry.name in found.columns for _, found in tables):
                there = list(dict.fromkeys(name for _, found in tables for name in found.names))
                raise self.file.error(
                    ("columns", standard),
                    f"no recording has a column {entry.name!r} for {standard}{nearest(entry.name, there)} "
                    f"(they have: {', '.join(there[:40])}{', ...' if len(there) > 40 else ''})",
                )
        names = _names([entry["file"] for entry in entries])
        return [self.recording(name, *table) for name, table in zip(names, tables, strict=True)]

    def entry(self, path: Keys, entry: Mapping[str, Any]) -> dict[str, Any]:
        self.file.known(path, entry, RECORDING_KEYS)
        if not isinstance(entry.get("file"), str):
            raise self.file.error(path, "[[recording]] needs the key 'file', the name of a file")
        facts: dict[str, Any] = {"file": self.file.guard((*path, "file"), _there, self.folder, entry["file"])}
        for key, allowed in (("role", ROLES), ("input", tuple(INPUTS))):
            if key in entry:
                facts[key] = self.file.guard((*path, key), choose, key, entry[key], allowed)
        if "group" in entry:
            facts["group"] = self.file.guard((*path, "group"), _text, "group", entry["group"])
        if "started_at_s" in entry:
            facts["started_at_s"] = self.file.guard(
                (*path, "started_at_s"), checks.finite, "started_at_s", entry["started_at_s"]
            )
        return facts

    def recording(self, name: str, facts: dict[str, Any], found: Source) -> CampaignRecording:
        present = {standard: entry for standard, entry in self.columns.items() if entry.name in found.columns}
        absent = {standard: entry for standard, entry in self.columns.items() if standard not in present}
        table = to_table(name, found, present)
        kept = {standard: values for standard, values in table.columns.items() if standard not in absent}
        notes = (*table.notes, *(entry.absence(standard) for standard, entry in absent.items()))
        whole = (table.name, kept, self.steps, notes, table.units, table.file_columns, table.rates)
        return CampaignRecording(*whole, **facts)


def _there(folder: Path, name: str) -> Path:
    path = folder / name
    try:
        is_folder, exists = path.is_dir(), path.exists()
    except OSError as error:
        raise InputError(f"file = {shorten(name)} cannot be read: {error.strerror}") from error
    if is_folder:
        raise InputError(f"file = {name!r} is a folder")
    if not exists:
        beside = (one.name for one in path.parent.glob("*") if one.suffix.lower() in KINDS)
        raise InputError(f"{path}: no such file{nearest(path.name, beside)}")
    return path


def _names(files: list[str]) -> list[str]:
    """What recordings are called: their files, with folders where two files share a name."""
    bare = [Path(file).name for file in files]
    return [file if bare.count(name) > 1 else name for file, name in zip(files, bare, strict=True)]


def _text(argument: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(f"{argument} = {shorten(value)} is not text")
    return value
