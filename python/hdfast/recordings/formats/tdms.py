"""TDMS measurement files, by nptdms: a channel is "group/channel", or its own name where no other has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.errors import InputError, require_package
from hdfast.recordings.formats.source import Source, Wanted, check_size, numbers

MARK = b"TDSm"


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted channels; without a channel `t` the time of a waveform is computed from its increment.

    The column `t` is then the time of the waveform with the most samples; others are interpolated on it and noted.
    `wf_start_time` counts where both state it. A channel that is no waveform has its samples at those times.

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
    with opened as file:
        channels = {f"{group.name}/{channel.name}": channel for group in file.groups() for channel in group.channels()}
        own = [channel.name for channel in channels.values()]
        named = {channel.name: channel for channel in channels.values() if own.count(channel.name) == 1}
        names = [
            full if full in wanted or name not in named else name for full, name in zip(channels, own, strict=True)
        ]
        chosen = [(name, channel) for name, channel in {**channels, **named}.items() if name in wanted]
        chosen.sort(key=lambda item: len(item[1]), reverse=True)
        waveforms = [channel for _, channel in chosen if "t" not in named and channel.properties.get("wf_increment")]
        source = Source(["t", *names] if waveforms else names, {})
        for name, channel in chosen:
            check_size(path, len(channel))
            values = numbers(path, name, channel[:])
            if channel in waveforms:
                source.join(name, _times(channel, waveforms[0]), values)
            else:
                source.columns[name] = values
            unit = channel.properties.get("unit_string")
            if isinstance(unit, str) and unit:
                source.units[name] = unit
    return source


def _times(channel: Any, first: Any) -> Floats:
    start, zero = (waveform.properties.get("wf_start_time") for waveform in (channel, first))
    t: Floats = channel.time_track()
    return t if start is None or zero is None else t + (start - zero) / np.timedelta64(1, "s")
