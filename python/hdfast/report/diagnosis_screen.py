"""The first screen of a diagnosis: one sentence and five cards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import groupby
from operator import itemgetter
from typing import Any

from hdfast.diagnosis.locate import phases
from hdfast.diagnosis.plant import TORQUE
from hdfast.diagnosis.rivals import SURE
from hdfast.diagnosis.unknown import Unknown
from hdfast.diagnosis.verdict import Verdict
from hdfast.printing import enumerated
from hdfast.report import diagnosis_plots as plots
from hdfast.report.diagnosis_swings import missing_tones
from hdfast.report.diagnosis_tables import amplitude, plus_minus, words
from hdfast.report.diagnosis_views import Trace, telling
from hdfast.report.html import Picture, picture
from hdfast.report.look import GREEN, VIOLET
from hdfast.report.plots import BLUE, GREY, ORANGE, RED
from hdfast.terms import terms

TAGS = {
    "found": ("Found", BLUE),
    "sensor": ("Sensor, not physics", BLUE),
    "depends_on": ("Located, not named", VIOLET),
    "undecided": ("Undecided", "#b86a14"),
    "no_evidence": ("No evidence", GREEN),
    "not_reproducible": ("Not reproducible", "#b86a14"),
    "data_rejected": ("Recordings rejected", RED),
}
MOST_LIMITS = 12
MOST_ERRORS = 99  # standard errors that are told by number
NARROW = "\u00a0"
WORTH_A_BAR, WORTH_SAYING = 0.005, 0.05
MEMORIES = {"none": "", "rate_independent": ", path", "fading": ", fading"}
AT = {"mesh": "in the gear mesh", "sensor": "in the sensors", "structure": "in the structure"}


@dataclass(frozen=True)
class Named:
    """An effect as the card shows it."""

    name: str
    size: str
    more: str


@dataclass(frozen=True)
class Card:
    """One question of the first screen."""

    title: str
    width: str
    hint: str = ""
    effects: list[Named] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    figures: list[Picture] = field(default_factory=list)


def headline(content: Mapping[str, Any]) -> str:
    """The verdict in one or two sentences, with sizes and errors."""
    name, effects = content["verdict"], content["effects"]
    held = content["fit"]["heldout"]
    before, after, floor = (held[f"{key}_nrmse"] for key in ("baseline", "extended", "noise_floor"))
    if name in ("found", "sensor") and effects:
        listed = [f"{words(one['effect'])}{_order(one)}{_size(one)} {_at(one['place'])}" for one in effects]
        text = f"The model leaves out {enumerated(listed)}."
        if before is not None and after is not None:
            text += (
                f" Error on recordings kept for the proof: {100 * before:.3g} % → {100 * after:.3g} %; "
                f"white sensor noise alone makes {100 * (floor or 0.0):.2g} %."
            )
        return text
    if name == "no_evidence" and before is not None:
        return (
            f"No evidence of left-out physics: the calibrated nominal model predicts the recordings kept for the "
            f"proof to {100 * before:.3g} %; white sensor noise alone makes {100 * (floor or 0.0):.2g} %."
        )
    return str(content["sentence"])


def _order(effect: Mapping[str, Any]) -> str:
    """Of a line of the kinematic error, several of which may be listed."""
    order = effect["parameters"].get("order") if effect["effect"] == "te_harmonic" else None
    return f" of order {order['value']:.6g}" if order else ""


def _at(place: str) -> str:
    return AT.get(place, f"at the {place}")


def _size(effect: Mapping[str, Any]) -> str:
    found = amplitude(effect)
    if found is None:
        return ""
    size = plus_minus(found[1]["value"], found[1]["sigma"], found[1]["unit"])
    return f" ({size.replace(' ', NARROW)})"


def cards(content: Mapping[str, Any], verdict: Verdict, found: list[Trace]) -> list[Card]:
    """Where, what and how sure, how much better; the signals; what it depends on."""
    telling_trace, window = telling(found)
    session = verdict.session
    variable = next(iter(content["where"]["depends_on"]), "motor_speed")
    variable = plots.VIEW.get(variable, variable)
    ratio = session.search.final.value("ratio")
    channel = telling_trace.channel if verdict.described is None else TORQUE
    role = "a recording kept for the proof" if telling_trace.unit.role == "heldout" else "a fitted recording"
    return [
        _where(content, verdict, found),
        _what(content, verdict),
        _better(content, verdict),
        Card(
            "The most telling moment",
            "six",
            f"of {role}",
            figures=[picture(plots.overlay(telling_trace, window), "Grey band: ±2 σ of the sensor noise.")],
        ),
        Card(
            f"Over the {words(variable)}",
            "three",
            figures=[
                picture(
                    plots.dependence(found, variable, channel, ratio, session.search.final.value("J_l")),
                    f"Lines: medians. {_dependence(content)}",
                )
            ],
        ),
        Card(
            "Over orders",
            "three",
            figures=[
                picture(
                    plots.orders(found, channel, content["where"]["orders"], session.replay.plant.band.of(channel)),
                    _lines(content),
                )
            ],
        ),
    ]


def _lines(content: Mapping[str, Any]) -> str:
    """The strongest lines of the mismatch in words."""
    where = content["where"]
    lines = [f"order {order:.4g}" for order in where["orders"][:2]]
    lines += [f"{tone:.4g} Hz" for tone in missing_tones(where)[:1]]
    text = f"Lines: {', '.join(lines)}." if lines else "No line stands out."
    swinging = [f"{one['frequency_hz']:.2g} Hz" for one in where["swings"]]
    return f"{text} In the recordings themselves, fixed in time: {', '.join(swinging)}." if swinging else text


def _dependence(content: Mapping[str, Any]) -> str:
    where = content["where"]
    if not where["depends_on"]:
        return ""
    memory = {"none": "no memory", "rate_independent": "memory of the path", "fading": "fading memory"}
    return f"Depends on {', '.join(words(name) for name in where['depends_on'])}; {memory[where['memory']]}."


def _where(content: Mapping[str, Any], verdict: Verdict, found: list[Trace]) -> Card:
    where = content["where"]
    color = TAGS[content["verdict"]][1]
    named = content["verdict"] in ("found", "sensor") or where["place"]
    marked = dict.fromkeys(where["place_candidates"], color if named else GREY)
    index = {id(trace.unit): phases(trace.unit) for trace in found}
    explained = verdict.extended is not None
    texts = []
    if where["phase"] != "all":
        texts.append(f"{100 * where['phase_shares'][where['phase']]:.0f} % of it while in phase '{where['phase']}'.")
    caption = "Size of the mismatch" + (" that the extended model explains" if explained else "")
    caption += ", in standard deviations of the sensor noise."
    return Card(
        "Where",
        "four",
        "" if named or not marked else "place not separable",
        texts=texts,
        figures=[
            picture(plots.sketch(marked), ""),
            picture(plots.phase_map(found, index, explained), caption),
        ],
    )


def _what(content: Mapping[str, Any], verdict: Verdict) -> Card:
    if content["verdict"] == "no_evidence":
        return _visible(content)
    if verdict.described is not None:
        return _ranking(verdict.described)
    rows: list[tuple[str, float, bool]] = []
    beaten: list[str] = []
    named = [] if content["verdict"] == "undecided" else verdict.told
    for standing in verdict.standings:
        rows.append((words(standing.name), standing.probability, standing in named))
        shares: dict[str, float] = {}
        for rival in standing.rivals:
            odds = rival.weight / max(1.0 - rival.weight, 1e-6)
            shares[rival.effect] = shares.get(rival.effect, 0.0) + standing.probability * odds
        near = {effect: share for effect, share in shares.items() if share >= WORTH_A_BAR}
        beaten += [words(effect) for effect in shares if effect not in near]
        rows += [(f"or {words(effect)}", share, False) for effect, share in near.items()]
        rest = max(0.0, 1.0 - standing.probability - sum(near.values()))
        if rest >= WORTH_SAYING or len(verdict.standings) == 1:
            rows.append(("or none of these", rest, False))
    if not rows:
        return Card("What", "four", texts=["Nothing that was tried passes every rule of acceptance."])
    caption = f"Put in its place, refitted and beaten: {', '.join(dict.fromkeys(beaten))}." if beaten else ""
    return Card(
        "What, and how sure",
        "four",
        effects=[_named(effect, described=len(content["effects"]) == 1) for effect in content["effects"][:4]],
        figures=[picture(plots.probabilities(rows[:10], SURE), caption)],
    )


def _named(effect: Mapping[str, Any], *, described: bool) -> Named:
    found = amplitude(effect)
    rest = [
        f"{name} = {plus_minus(entry['value'], entry['sigma'], entry['unit'])}"
        for name, entry in effect["parameters"].items()
        if (found is None or name != found[0]) and (entry["sigma"] or name == "order")
    ]
    known = described and effect["effect"] in terms().ids
    text = terms()[effect["effect"]].description if known else ""
    size = "" if found is None else plus_minus(found[1]["value"], found[1]["sigma"], found[1]["unit"])
    return Named(words(effect["effect"]), size, " ".join([text, "; ".join(rest)]).strip())


def _visible(content: Mapping[str, Any]) -> Card:
    """What would have been seen, for a campaign without evidence."""
    rows = []
    for effect, limits in groupby(content["detectable"], key=itemgetter("effect")):
        if effect not in terms().ids:
            continue
        term = terms()[effect]
        typical = next(parameter for parameter in term.parameters if parameter.name == term.amplitude)
        least = [one["minimum_detectable"] or math.inf for one in limits if one["unit"] == typical.unit != "N m/rad"]
        if min(least, default=math.inf) < math.inf and typical.default > 0.0:
            rows.append((words(effect), least[0], least[-1], typical.default, typical.unit))
    rows.sort(key=lambda row: row[1] / row[3])
    if not rows:
        return Card("What would have been seen", "four", texts=["These recordings could have shown no effect."])
    caption = "Dotted: a typical amplitude. Short bars: well visible; pale: up to the shape that hides best."
    return Card(
        "What would have been seen",
        "four",
        "had it been there",
        figures=[picture(plots.detectable(rows[:MOST_LIMITS]), caption)],
    )


def _ranking(described: Unknown) -> Card:
    """State variables by how far a mismatch without a name follows them."""
    rows = [(words(name) + MEMORIES[memory], statistic) for name, memory, statistic in described.ranking]
    return Card(
        "What it depends on best",
        "four",
        "no effect of the library explains it",
        figures=[picture(plots.ranking(rows[:9]), "Dotted: what noise passes in one campaign of a hundred.")],
    )


def _better(content: Mapping[str, Any], verdict: Verdict) -> Card:
    extended = verdict.extended is not None
    groups, texts = [], []
    for part, title in (("heldout", "kept for the proof"), ("fit", "fitted")):
        before, after, floor = (content["fit"][part][f"{key}_nrmse"] for key in ("baseline", "extended", "noise_floor"))
        if before is None:
            continue
        rows = [("nominal", before, ORANGE)]
        if extended and after is None:
            texts.append("The extended model could not be simulated on a recording kept for the proof.")
        elif extended:
            rows.append(("extended", after, BLUE))
        groups.append((title, rows, floor or 0.0))
    proof = verdict.proof
    rests_elsewhere = proof is not None and proof.holds and not proof.shows
    if extended and proof is not None and len(groups[0][1]) == 2 and not rests_elsewhere:
        gained = f"{proof.gain.ratio:.1f}" if proof.gain.ratio < MOST_ERRORS else f"more than {MOST_ERRORS}"
        texts.append(f"Proof: a gain of {gained} standard errors.")
    texts += content["notes"]
    title = "How much better" if extended else "How well it predicts"
    return Card(title, "four", texts=texts, figures=[picture(plots.errors(groups), "")])
