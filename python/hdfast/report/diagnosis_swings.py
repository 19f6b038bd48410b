"""What swings in the recorded signals themselves, at one frequency at different speeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hdfast.diagnosis.prepare import Unit
from hdfast.diagnosis.steady import SPEED, Stretch, stretches
from hdfast.diagnosis.swings import Swing, spectrum_of
from hdfast.diagnosis.verdict import Verdict
from hdfast.report.diagnosis_axes import CHANNELS
from hdfast.report.html import Section, picture
from hdfast.report.look import SERIES, label
from hdfast.report.plots import RED, styled

WIDTH, MOST = 11.0, 7
BEYOND = 4.0
NAMES = CHANNELS | {SPEED: "motor speed"}


def missing_tones(where: Mapping[str, Any]) -> list[float]:
    """Frequencies of lines that the model misses, without those that stand in the recorded signals."""
    standing = [one["frequency_hz"] for one in where["swings"]]
    return [tone for tone in where["frequencies_hz"] if tone not in standing]


def swings_section(verdict: Verdict) -> Section:
    """Spectra of the recorded signals at every steady speed, with what they share."""
    session, found = verdict.session, verdict.where.swings
    units = [unit for replay in (session.replay, session.held) if replay is not None for unit in replay.plant.units]
    texts = [
        f"The recorded {NAMES[one.channel]} swings at {one.frequency:.2g} Hz, to {0.5 * one.resolution:.1g} Hz, at "
        f"different speeds (family-wise p = {one.p:.1g}): it is fixed in time, not in the angle. What stands in the "
        "recordings themselves is no claim of an effect: a model that is replayed on that motion swings with it."
        for one in found
    ]
    figures = [
        picture(
            swinging(units, channel, [one for one in found if one.channel == channel]),
            f"Spectrum of the {NAMES[channel]} in every steady stretch, over its own median; dashed: what is fixed in "
            "time. A line that is fixed in the angle stands at another frequency at every speed.",
        )
        for channel in dict.fromkeys(one.channel for one in found)
    ]
    return Section("What swings in the recordings at different speeds", texts, figures)


@styled
def swinging(units: Sequence[Unit], channel: str, found: Sequence[Swing]) -> Figure:
    """Spectra of one channel over frequency, one curve per steady stretch, with the frequencies found."""
    own = [one for unit in units for one in stretches(unit) if channel in one.signals]
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    axes = figure.add_subplot()
    end = BEYOND * max(one.frequency for one in found)
    for one, color in zip(_spread(sorted(own, key=lambda stretch: stretch.speed)), SERIES, strict=False):
        spectrum = spectrum_of(one.t, one, channel)
        places = np.arange(spectrum.cell, end, spectrum.cell / 8.0)
        power = spectrum.at(places)
        axes.semilogy(places, power / np.median(power), color=color, linewidth=1.1, label=f"{one.speed:.3g} rev/s")
    for line in found:
        axes.axvline(line.frequency, color=RED, linewidth=0.9, linestyle="--", zorder=0)
        axes.annotate(
            f"{line.frequency:.2g}", (line.frequency, 1.0), xycoords=("data", "axes fraction"), fontsize=7.5, color=RED,
            ha="center",
        )  # fmt: skip
    axes.set_xlim(0.0, end)
    label(axes, "frequency [Hz]", "power over its median")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper left", ncols=MOST)
    return figure


def _spread(own: Sequence[Stretch]) -> list[Stretch]:
    """At most as many stretches as can be told apart by colour, from the slowest to the fastest."""
    chosen = np.unique(np.linspace(0, len(own) - 1, min(MOST, len(own))).round().astype(np.int64))
    return [own[index] for index in chosen.tolist()]
