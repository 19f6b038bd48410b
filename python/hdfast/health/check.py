"""The list of checks and their order."""

from __future__ import annotations

from collections.abc import Callable

from hdfast.health import (
    columns,
    coverage,
    events,
    freezes,
    jumps,
    leakage,
    nameplate,
    output_torque,
    reference,
    saturation,
    sides,
    steps,
    timing,
    torque_lag,
    torque_sign,
    units,
    wrapping,
)
from hdfast.health.result import Health, RecordingHealth
from hdfast.health.subject import Subject
from hdfast.recordings import Campaign

ON_EACH: tuple[Callable[[Subject], None], ...] = (
    steps.resolution,
    steps.held,
    coverage.check,
    saturation.check,
    sides.check,
    torque_sign.check,
    units.check,
    reference.check,
    output_torque.check,
    events.check,
)


def check(campaign: Campaign) -> Health:
    """Examine every recording of a campaign; nothing is changed, and one rejected recording does not reject the others.

    A recording whose columns, time or angles cannot be used is not examined further.
    """
    subjects = [Subject(campaign, recording) for recording in campaign.recordings]
    for subject in subjects:
        columns.check(subject)
        if "t" in subject.recording:
            timing.check(subject)
        if not subject.rejected:
            columns.together(subject)
        if not subject.rejected:
            wrapping.check(subject)
        if not subject.rejected:
            freezes.check(subject)
            jumps.check(subject)
    columns.loaded(subjects)
    readable = [subject for subject in subjects if not subject.rejected]
    for subject in readable:
        for examine in ON_EACH:
            examine(subject)
    torque_lag.check(readable)
    leakage.check(readable)
    found = [
        RecordingHealth(
            subject.recording,
            subject.findings,
            subject.facts,
            subject.timed,
            subject.mask(),
            subject.checked if subject in readable else None,
        )
        for subject in subjects
    ]
    return Health(found, nameplate.check(campaign), coverage.coverage(readable), subjects)
