"""A campaign file: nominal drive, sensors, columns and the list of recordings."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hdfast.errors import ConfigError, InputError, choose
from hdfast.recordings.load import load
from hdfast.recordings.recording import Recording
from hdfast.toml_lines import Lines

SECTIONS = ("title", "drive", "kinematic_error", "terms", "controller", "sensors", "columns", "recording", "scenario")
RECORDING_KEYS = ("file", "role", "group", "started_at_s", "input")


@dataclass(frozen=True)
class Campaign:
    """A checked campaign file.

    Attributes:
        title: one line for reports.
        recordings: the recordings in the order of the file.
        data: the sections as read.
        text: the file as read.
    """

    title: str
    recordings: list[Recording] = field(repr=False)
    data: Mapping[str, Any] = field(repr=False)
    text: str = field(repr=False)


def load_campaign(path: str | Path) -> Campaign:
    """Read a campaign file and its recordings; their paths count from the file's folder.

    Raises:
        ConfigError: the file is no TOML, has an unknown section or key, or lists no recording.
        InputError: a recording cannot be read.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError(f"{path}: {error}") from None
    lines = Lines(text)
    _known(path, lines, data, SECTIONS, ())
    entries = data.get("recording", [])
    if not isinstance(entries, list) or not entries:
        raise ConfigError(f"{path}: no section [[recording]] with the key 'file'")
    recordings = []
    for entry in entries:
        _known(path, lines, entry, RECORDING_KEYS, ("recording",))
        if not isinstance(entry.get("file"), str):
            raise ConfigError(f"{path}: [[recording]] needs the key 'file'")
        recordings.append(_with_sensors(load(path.parent / entry["file"], data.get("columns")), data))
    return Campaign(str(data.get("title", path.stem)), recordings, data, text)


def _known(
    path: Path, lines: Lines, found: Mapping[str, Any], allowed: tuple[str, ...], inside: tuple[str, ...]
) -> None:
    for key in found:
        try:
            choose("key", key, allowed)
        except InputError as error:
            line = lines.of((*inside, key))
            raise ConfigError(f"{path}{f', line {line}' if line else ''}: {error}", line) from None


def _with_sensors(recording: Recording, data: Mapping[str, Any]) -> Recording:
    steps = {
        name: float(entry["resolution"]) for name, entry in data.get("sensors", {}).items() if "resolution" in entry
    }
    return replace(recording, resolution=steps)
