"""The page of a calibration: what was known, what the recordings say, and how well it fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hdfast.calibration.calibrate import MODELS
from hdfast.printing import html_table, percent
from hdfast.report import diagnosis_details as details
from hdfast.report import diagnosis_plots as plots
from hdfast.report.diagnosis_tables import PAIR_HEADER, correlations, parameter_table, pull
from hdfast.report.diagnosis_views import telling, traces_of
from hdfast.report.html import Section, picture, render
from hdfast.report.mismatch_sections import (
    ROLES,
    recordings_section,
    spectra_section,
    state_section,
    told_section,
)

if TYPE_CHECKING:
    from hdfast.calibration.calibrate import Calibration

WIDE = (9.6, 3.8)
FAR = 3.0


def page(found: Calibration) -> str:
    """The page as HTML."""
    setup, fitted = found.setup, found.fit
    layout = setup.replay.layout
    shown = []
    for replay, (given, calibrated) in reversed(found.mismatches.values()):
        shown += traces_of(replay, (given, calibrated), MODELS)
    trace, window = telling(shown)
    names = fitted.structure.names
    far = [name for name in names if abs(pull(fitted, name)) > FAR]
    pairs = correlations(fitted, layout)
    tables = [parameter_table(layout, fitted, None)] + ([html_table(PAIR_HEADER, pairs, right=(1,))] if pairs else [])
    figure = details.pulls(names, np.array([pull(fitted, name) for name in names]), None, far, "calibrated")
    texts = (
        [f"Beyond {FAR:g} σ of their priors, which physics the model lacks may do: {', '.join(far)}."] if far else []
    )
    sections = [
        *told_section("Warnings", found.warnings),
        Section(
            "What calibration changes most",
            figures=[picture(plots.overlay(trace, window, WIDE), "Grey band: ±2 σ of the sensor noise.")],
        ),
        Section("Parameters", texts, [picture(figure, "Distance of every estimate from its prior.")], tables),
        recordings_section(shown),
        state_section(shown, fitted.value("ratio"), fitted.value("J_l")),
        spectra_section(shown, (), (), setup.replay.plant.band),
        *told_section("Notes", setup.notes),
    ]
    facts = [
        (f"error, {ROLES[role]} recordings", f"{percent(error['given'])} → {percent(error['calibrated'])}")
        for role, error in found.nrmse.items()
    ]
    lead = (
        f"{len(names)} parameters fitted to {len(setup.replay.plant.units)} recordings, within what is known of them."
    )
    return render(setup.campaign.title or "Calibration", lead, facts, sections, setup.campaign.text, None)
