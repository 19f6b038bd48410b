"""Recordings as they are identified from: dropouts and spikes are left out of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hdfast.errors import InputError
from hdfast.health.jumps import MOST, elsewhere
from hdfast.health.subject import ANGLES
from hdfast.recordings import Recording
from hdfast.recordings import gather as gather_all


def gather(
    recordings: Any, columns: Mapping[str, Any] | None = None, *, smooth: Iterable[str] = ANGLES
) -> list[Recording]:
    """Recordings as `hdfast.recordings.gather` gives them, with a note on what is left out of columns without jumps.

    Raises:
        InputError: as there, or more than 20 % of a column are dropouts or spikes.
    """
    return [_without_jumps(recording, smooth) for recording in gather_all(recordings, columns)]


def _without_jumps(recording: Recording, names: Iterable[str]) -> Recording:
    columns, notes = dict(recording.columns), list(recording.notes)
    for name in names:
        for away in elsewhere(recording, name) if name in recording else []:
            if away.share > MOST:
                raise InputError(f"{recording.name}: {away.sentence}")
            columns[name] = columns[name].copy()
            columns[name][away.rows] = np.nan
            notes.append(away.sentence)
    return replace(recording, columns=columns, notes=tuple(notes))
