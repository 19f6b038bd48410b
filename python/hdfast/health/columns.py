"""Columns: what was noted while loading, the required ones are there, and enough of their samples are numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdfast.checks import Floats
from hdfast.health.finding import NOTE, REJECT, WARNING
from hdfast.health.subject import LARGEST, REQUIRED, Subject
from hdfast.recordings.columns import CHANNELS, COLUMNS, FEWEST_FINITE, ColumnMap
from hdfast.recordings.table import Table
from hdfast.recordings.units import factor, named_with_unit

NAME = "columns"
EXAMPLE = 'motor_angle = { name = "angle_deg", scale = 0.0174533 }'
FEWEST = 8


def check(subject: Subject) -> None:
    """Reject a recording without a required column or with less than half of one; count what is missing elsewhere."""
    recording = subject.recording
    absent = ", ".join(name for name in REQUIRED if name not in recording)
    if absent:
        there = f"no column for {absent} (the file has: {recording.listing})"
        subject.find(NAME, REJECT, f"{there}; name it in [columns], as in  {_entries(recording) or EXAMPLE}")
    for name in recording:
        share = float(np.mean(np.isfinite(subject.clean(name)))) if recording.samples else 0.0
        if share < FEWEST_FINITE:
            severity, what = (REJECT, "the recording") if name in REQUIRED else (WARNING, "the column")
            sentence = f"{100.0 * share:.3g} % of {name} are numbers; {what} is not used"
            if name == "t":
                sentence = _stamp(recording[name]) or sentence
            subject.unused.add(name)
            subject.find(NAME, severity, sentence, value=share, limit=FEWEST_FINITE)
        elif share < 1.0:
            missing = recording.samples - round(share * recording.samples)
            subject.find(
                NAME, NOTE, f"{missing} samples of {name} are missing and masked", value=share, limit=FEWEST_FINITE
            )


def _entries(recording: Table) -> str:
    """What names the missing columns that the file has under their own names with a unit; nothing where it has none."""
    found = []
    for column in recording.file_columns:
        name, unit = named_with_unit(column)
        scale = factor(unit, COLUMNS[name][0]) if name in REQUIRED and name not in recording else None
        if scale is not None:
            found.append(f'{name} = {{ name = "{column}", scale = {scale:.9g} }}')
    return "  ".join(found)


def _stamp(t: Floats) -> str:
    """What is said of times too large for seconds; nothing of others."""
    reach = float(np.max(np.abs(t[np.isfinite(t)]), initial=0.0))
    if reach < LARGEST:
        return ""
    return f"t reaches {reach:.3g} s: a time stamp in ms, us or ns? scale it in [columns] t"


def loaded(subjects: Sequence[Subject]) -> None:
    """Hand on what was noted while loading a recording, and warn of columns that it lacks and another one can use.

    Where a required column is missing, what the file has is said already.
    """
    common = [name for name in CHANNELS if any(name in one.recording and name not in one.unused for one in subjects)]
    for subject in subjects:
        recording, columns = subject.recording, subject.campaign.columns
        if not set(REQUIRED) <= set(recording):
            continue
        absent = [columns.get(name, ColumnMap(name)).absence(name) for name in common if name not in recording]
        for note in recording.notes:
            if note not in absent:
                subject.find(NAME, NOTE, note)
        for sentence in absent:
            subject.find(NAME, WARNING, f"{sentence}, which other recordings have")


def together(subject: Subject) -> None:
    """Reject a recording with too few samples that have a time and every required column."""
    whole = int(subject.mask().sum())
    if whole < FEWEST:
        sentence = f"{whole} samples have all of {', '.join(REQUIRED)} (allowed: at least {FEWEST})"
        subject.find(NAME, REJECT, sentence, value=whole, limit=FEWEST)
