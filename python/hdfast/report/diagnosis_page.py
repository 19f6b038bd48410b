"""The page of a diagnosis: the answer on the first screen, what it rests on below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from hdfast.diagnosis.structure import NUISANCE
from hdfast.diagnosis.verdict import Verdict
from hdfast.health.finding import NOTE, REJECT, WARNING
from hdfast.printing import html_table, moment
from hdfast.report import diagnosis_details as details
from hdfast.report.diagnosis_screen import TAGS, Card, cards, headline
from hdfast.report.diagnosis_swings import missing_tones, swings_section
from hdfast.report.diagnosis_tables import (
    PAIR_HEADER,
    correlations,
    experiment_rows,
    parameter_table,
    plus_minus,
    pull,
    screened,
    spoken,
    trial_table,
    words,
)
from hdfast.report.diagnosis_views import Trace, traces
from hdfast.report.html import Section, fill, picture
from hdfast.report.mismatch_sections import recordings_section, spectra_section, state_section

if TYPE_CHECKING:
    from hdfast.diagnosis.diagnose import Diagnosis

SEVERITIES = (REJECT, WARNING, NOTE)


def page(diagnosis: Diagnosis) -> str:
    """The page as HTML; the same diagnosis gives the same bytes."""
    content, verdict = _told(diagnosis), diagnosis.evidence
    tag, color = TAGS[content["verdict"]]
    campaign = diagnosis.campaign
    parts = [campaign.title] if campaign.title else []
    screen: list[Card] = []
    if verdict is None:
        sections = [_health(content), _rejected(diagnosis)]
    else:
        found = traces(verdict)
        screen = cards(content, verdict, found)
        units = verdict.session.replay.plant.units
        held = verdict.session.held
        fitted = f"{len(units)} recording{'s' * (len(units) != 1)} fitted"
        parts.append(f"{fitted}, {len(held.plant.units) if held else 0} kept for the proof")
        band = verdict.session.replay.plant.band
        parts.append(f"compared at {band.rate:.0f} Hz below {band.motion:.0f} Hz")
        sections = [*_sections(content, verdict, found), _health(content)]
    sections.append(_notes(content))
    parts.append(f"seed {content['seed']}")
    return fill(
        "diagnosis.html.j2",
        title=campaign.title or "Diagnosis",
        lead="; ".join(parts) + ".",
        tag=tag,
        color=color,
        headline=headline(content),
        cards=screen,
        sections=[section for section in sections if section.texts or section.figures or section.tables],
        source=campaign.text,
    )


def _told(diagnosis: Diagnosis) -> dict[str, Any]:
    """The content with the sentences that may name a recording in words."""
    content = diagnosis.content
    names = [one.name for one in diagnosis.campaign.recordings]
    return {
        **content,
        "sentence": spoken(content["sentence"], names),
        "notes": [spoken(note, names) for note in content["notes"]],
        "health": [row | {"sentence": spoken(row["sentence"], names)} for row in content["health"]],
    }


def _sections(content: Mapping[str, Any], verdict: Verdict, found: list[Trace]) -> list[Section]:
    first, last = ([_experiment(content)], []) if content["verdict"] == "undecided" else ([], [_experiment(content)])
    final, where = verdict.session.search.final, content["where"]
    return [
        *first,
        _time(content, found),
        state_section(found, final.value("ratio"), final.value("J_l")),
        spectra_section(found, where["orders"], missing_tones(where), verdict.session.replay.plant.band),
        swings_section(verdict),
        _parameters(content, verdict),
        *_rounds(verdict),
        _limits(content),
        *last,
        recordings_section(found),
    ]


def _time(content: Mapping[str, Any], found: list[Trace]) -> Section:
    figure = details.time_strips(found, content["where"]["windows"])
    caption = (
        "Size of the mismatch along every recording, in standard deviations of the sensor noise. White: not judged."
    )
    if content["where"]["windows"]:
        caption += " Black bars on top: the windows of the verdict."
    shares = content["where"]["phase_shares"]
    shown = ", ".join(f"{phase} {100 * share:.0f} %" for phase, share in shares.items() if share)
    texts = [f"Share of the mismatch by phase of motion: {shown}."] if shown else []
    return Section("When", texts, [picture(figure, caption)])


def _parameters(content: Mapping[str, Any], verdict: Verdict) -> Section:
    session = verdict.session
    masked = [row["parameter"] for row in content["masking"]]
    before, after = session.baseline, verdict.extended or session.baseline
    names = [name for name in before.structure.names if name not in NUISANCE]
    pulls = np.array([pull(before, name) for name in names])
    moved = None
    extended = verdict.extended is not None
    if extended:
        moved = np.array([pull(after, name) if name in after.structure.names else np.nan for name in names])
    texts = []
    if masked:
        texts.append(f"Had swallowed part of the effect, and moved when it was added: {', '.join(masked)}.")
    if content["displaced"]:
        texts.append(f"The nominal model fits only with {', '.join(content['displaced'])} beyond 3 σ of their priors.")
    pairs = correlations(after, session.replay.layout)
    tables = [parameter_table(session.replay.layout, before, after if extended else None, masked)]
    if pairs:
        tables.append(html_table(PAIR_HEADER, pairs, right=(1,)))
    figure = details.pulls(names, pulls, moved, masked)
    caption = "Where calibration moved every parameter"
    caption += ", and where the extended model puts it. Red: had swallowed an effect." if extended else "."
    return Section("What the parameters had swallowed", texts, [picture(figure, caption)], tables)


def _rounds(verdict: Verdict) -> list[Section]:
    found = []
    for number, one in enumerate(verdict.session.search.rounds, start=1):
        outcome = f"{spoken(one.accepted.candidate.label)} accepted" if one.accepted else "nothing accepted"
        text = (
            f"{len(one.signatures)} candidates screened, family-wise p = {one.screen.smallest_p:.3f}; "
            f"{len(one.trials)} refitted together with every parameter. {screened(one)}"
        )
        tables = [trial_table(one)] if one.trials else []
        found.append(Section(f"How candidates were judged, round {number}: {outcome}", [text], tables=tables))
    return found


def _limits(content: Mapping[str, Any]) -> Section:
    hidden = [
        [words(row["effect"]), row["shape"], _left(row), _least(row), spoken(row["reason"])]
        for row in content["not_showable"]
    ]
    seen = [
        _range(words(effect), list(rows)) for effect, rows in groupby(content["detectable"], key=itemgetter("effect"))
    ]
    tables = []
    if hidden:
        header = ["not showable", "as", "left after a refit", "smallest amplitude seen", "why"]
        tables.append(html_table(header, hidden, right=(2, 3)))
    if seen:
        header = ["would have been seen", "at best from", "as", "at worst from", "as"]
        tables.append(html_table(header, seen, right=(1, 3)))
    texts = ["An effect is not showable when refitting the drive's parameters swallows it, when only an implausible "
             "size of it would stand out, or when the recordings or the model lack what it acts on."]  # fmt: skip
    return Section("What these recordings can show", texts if hidden else [], tables=tables)


def _range(effect: str, rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Of an effect the shape that shows best and the one that hides best."""
    best, worst = rows[0], rows[-1]
    least = "not at all" if worst["minimum_detectable"] is None else _least(worst)
    return [effect, _least(best), best["shape"], *([least, worst["shape"]] if len(rows) > 1 else ["", ""])]


def _left(row: Mapping[str, Any]) -> str:
    screened = row["minimum_detectable"] is not None
    return f"{100 * row['visibility']:.0f} %" if screened else "-"


def _least(row: Mapping[str, Any]) -> str:
    return plus_minus(row["minimum_detectable"], None, row["unit"])


def _experiment(content: Mapping[str, Any]) -> Section:
    proposal = content["next_experiment"]
    if proposal is None:
        return Section("What to record next")
    return Section("What to record next", tables=[html_table(["", ""], experiment_rows(proposal))])


def _health(content: Mapping[str, Any]) -> Section:
    header = ["recording", "check", "severity", "what was found", "from [s]", "to [s]"]
    keys = ("file", "check", "severity", "sentence", "t0", "t1")
    listed = sorted(content["health"], key=lambda row: SEVERITIES.index(row["severity"]))
    rows = [["" if row[key] is None else _cell(row[key]) for key in keys] for row in listed]
    return Section("Health of the recordings", tables=[html_table(header, rows)] if rows else [])


def _cell(value: Any) -> str:
    return moment(value) if isinstance(value, float) else str(value)


def _notes(content: Mapping[str, Any]) -> Section:
    return Section("Notes", texts=content["notes"])


def _rejected(diagnosis: Diagnosis) -> Section:
    columns = [(one.name, dict(one)) for one in diagnosis.campaign.recordings[:8]]
    if not columns:
        return Section("Recordings")
    return Section("The recordings as they were read", figures=[picture(details.raw(columns), "")])
