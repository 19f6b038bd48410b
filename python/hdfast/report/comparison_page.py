"""The page of a comparison: the drive as given against every recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdfast.printing import percent
from hdfast.report import diagnosis_details as details
from hdfast.report import diagnosis_plots as plots
from hdfast.report.diagnosis_axes import CHANNELS
from hdfast.report.diagnosis_views import telling, traces_of
from hdfast.report.html import Section, picture, render
from hdfast.report.mismatch_sections import (
    ROLES,
    channels_of,
    recordings_section,
    spectra_section,
    state_section,
    told_section,
)

if TYPE_CHECKING:
    from hdfast.comparison.compare import Comparison

WIDE = (9.6, 3.8)


def page(found: Comparison) -> str:
    """The page as HTML."""
    setup = found.setup
    shown = [
        one for replay, stacked in found.mismatch for one in traces_of(replay, (stacked, stacked), ("nominal", ""))
    ]
    trace, window = telling(shown)
    values = setup.campaign.priors
    sections = [
        *told_section("Warnings", found.warnings),
        Section(
            "Where it is furthest off",
            figures=[picture(plots.overlay(trace, window, WIDE), "Grey band: ±2 σ of the sensor noise.")],
        ),
        recordings_section(shown),
        Section(
            "When", figures=[picture(details.time_strips(shown, ()), "Size of the mismatch along every recording.")]
        ),
        Section(
            "Phase planes",
            figures=[
                picture(
                    details.phase_planes(shown, channel),
                    f"{CHANNELS[channel].capitalize()} against motor speed, measured and simulated.",
                )
                for channel in channels_of(shown)
            ],
        ),
        state_section(shown, values["ratio"].value, values["J_l"].value),
        spectra_section(shown, (), (), setup.replay.plant.band),
        *told_section("Notes", setup.notes),
    ]
    facts = [(f"error, {ROLES[role]} recordings", percent(share)) for role, share in found.nrmse.items()]
    lead = "The drive as the campaign states it, nothing fitted, on the recorded motion of its motor."
    return render(setup.campaign.title or "Comparison", lead, facts, sections, setup.campaign.text, None)
