"""TDMS measurement files, by nptdms: a channel is "group/channel", or its own name where no other has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hdfast.errors import InputError, require_package
from hdfast.recordings.formats.source import Source, Wanted, check_size, numbers

MARK = b"TDSm"


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted channels; without a channel `t` the time of a waveform is computed from its increment.

    Raises:
        MissingPackageError: nptdms is not installed.
    """
    require_package("nptdms", "tdms")
    from nptdms import TdmsFile

    with path.open("rb") as stream:
        if stream.read(len(MARK)) != MARK:
            raise InputError(f"{path}: not a TDMS file")
        stream.seek(0)
        return _channels(path, wanted, TdmsFile.open(stream))


def _channels(path: Path, wanted: Wanted, opened: Any) -> Source:
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    with opened as file:
        channels = {f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()}
        own = [channel.name for channel in channels.values()]
        named = {channel.name: channel for channel in channels.values() if own.count(channel.name) == 1}
        for name, channel in {**channels, **named}.items():
            if name not in wanted:
                continue
            check_size(path, len(channel))
            columns[name] = numbers(path, name, channel[:])
            unit = channel.properties.get("unit_string")
            if isinstance(unit, str) and unit:
                units[name] = unit
            if "t" not in {**channels, **named} and "t" not in columns and channel.properties.get("wf_increment"):
                columns["t"] = channel.time_track()
    names = [full if full in wanted or name not in named else name for full, name in zip(channels, own, strict=True)]
    return Source(["t", *names] if "t" in columns and "t" not in named else names, columns, units)
