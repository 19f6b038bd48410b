"""Sections about the mismatch of models and recordings that several pages share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hdfast.diagnosis.band import Band
from hdfast.printing import html_table, percent
from hdfast.report import diagnosis_details as details
from hdfast.report.diagnosis_axes import CHANNELS
from hdfast.report.diagnosis_views import Trace
from hdfast.report.html import Section, picture

ERROR_HEADER = ["recording", "", "channel", "sensor noise"]
ROLES = {"fit": "fitted", "heldout": "held-out"}


def channels_of(found: Sequence[Trace]) -> list[str]:
    """Channels that at least one recording has."""
    return [channel for channel in CHANNELS if any(trace.channel == channel for trace in found)]


def state_section(found: Sequence[Trace], ratio: float, inertia: float) -> Section:
    """What is missing over states of the drive."""
    figures = [
        picture(
            details.state_views(found, channel, ratio, inertia),
            f"Missing {CHANNELS[channel]} in all recordings against speed, torque through the gear, load and motor "
            "angle. Solid lines: forward motion; dashed: backward. What flips with the direction is friction.",
        )
        for channel in channels_of(found)
    ]
    return Section("In which state of the drive", figures=figures)


def spectra_section(found: Sequence[Trace], orders: Sequence[float], tones: Sequence[float], band: Band) -> Section:
    """What is missing over orders and frequencies, up to the corner of the band."""
    figures = [
        picture(
            details.spectra(found, channel, orders, tones, band.of(channel)),
            f"Mismatch of the {CHANNELS[channel]} over orders and over frequency; dotted: lines that stand out.",
        )
        for channel in channels_of(found)
    ]
    return Section("At which orders and frequencies", figures=figures)


def told_section(title: str, sentences: Sequence[str]) -> list[Section]:
    """What is told of the recordings; nothing where there is nothing."""
    return [Section(title, texts=list(sentences))] if sentences else []


def recordings_section(found: Sequence[Trace]) -> Section:
    """Every recording with the predictions, and the errors."""
    figures = [
        picture(
            details.recordings(found, channel),
            f"{CHANNELS[channel].capitalize()} of every recording with the predictions, where it is judged.",
        )
        for channel in channels_of(found)
    ]
    names = [name for name in found[0].models if name]
    rows = [
        [
            trace.unit.name,
            ROLES[trace.unit.role],
            CHANNELS[trace.channel],
            percent(trace.error(np.full(1, trace.floor)), 2),
            *(percent(trace.error(part), 2) for part in (trace.missing, trace.left)[: len(names)]),
        ]
        for trace in found
    ]
    header = ERROR_HEADER + [f"{name} model" for name in names]
    texts = ["Error: root mean square of measured minus predicted, as a share of the signal's standard deviation."]
    return Section("Every recording", texts, figures, [html_table(header, rows, right=(3, 4, 5))])
