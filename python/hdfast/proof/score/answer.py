"""An answer to one case: `verdict.json`, or why there is none."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hdfast.drive_file import UNKNOWN
from hdfast.errors import shorten

VERDICTS = ("no_evidence", "found", "undecided", "depends_on", "sensor", "not_reproducible", "data_rejected")
CLAIMS = ("found", "sensor", "depends_on")
PLACES = ("motor", "mesh", "load", "actuator", "sensor", "structure")
REQUIRED = (
    "verdict",
    "effects",
    "where",
    "fit",
    "masking",
    "not_showable",
    "next_experiment",
    "seed",
    "version",
)
NUMBERS = ("baseline_nrmse", "extended_nrmse", "noise_floor_nrmse")
BAND = ("band_hz", "measured_std")
LARGEST, LATEST = 1e100, 1e6  # of a number, and of a time [s]
SHAPES: dict[str, Any] = {"effects": list, "where": dict | None, "fit": dict | None, "masking": list}


@dataclass(frozen=True)
class Answer:
    """One answer.

    Attributes:
        fault: "" for a valid answer, else "missing", "invalid", "late" or "crashed".
        verdict: the parsed `verdict.json`; empty with a fault.
        seconds: wall time of the diagnosis [s].
        detail: what is wrong with it.
    """

    fault: str = ""
    verdict: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    detail: str = ""

    @property
    def kind(self) -> str:
        """The verdict's word, or the fault."""
        return self.fault or str(self.verdict["verdict"])

    @property
    def listed(self) -> list[dict[str, Any]]:
        """Effects in the order of falling probability, `unknown` left out."""
        effects = [e for e in self.verdict.get("effects", []) if e["effect"] != UNKNOWN]
        return sorted(effects, key=lambda e: -float(e.get("probability") or 0.0))

    @property
    def claims(self) -> list[dict[str, Any]]:
        """Effects that the answer claims: those of `found` and `sensor`; candidates of other verdicts are no claims."""
        return self.listed if self.kind in ("found", "sensor") else []

    @property
    def named(self) -> list[str]:
        """Ids that the answer claims."""
        return [e["effect"] for e in self.claims]

    @property
    def considered(self) -> set[str]:
        """Every id among effects and their rivals."""
        return {e["effect"] for e in self.listed} | {r for e in self.listed for r in e.get("rivals", [])}

    @property
    def confidence(self) -> float | None:
        """Probability of the leading effect, or None without one."""
        return float(self.listed[0]["probability"]) if self.listed else None


def read_answer(folder: Path, seconds: float = 0.0, fault: str = "", detail: str = "") -> Answer:
    """Read `verdict.json` of a folder; whatever does not meet the schema is an answer with a fault."""
    if fault:
        return Answer(fault, seconds=seconds, detail=detail)
    try:
        verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"), parse_constant=_refuse)
    except FileNotFoundError:
        return Answer("missing", seconds=seconds, detail="no verdict.json")
    except (OSError, ValueError, RecursionError) as error:
        return Answer("invalid", seconds=seconds, detail=str(error))
    complaint = complain(verdict)
    return Answer("invalid", seconds=seconds, detail=complaint) if complaint else Answer("", verdict, seconds)


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no JSON")


def complain(verdict: Any) -> str:
    """What a parsed verdict violates of the schema, or an empty text."""
    if not isinstance(verdict, dict):
        return "not an object"
    absent = [key for key in REQUIRED if key not in verdict]
    if absent:
        return f"without {', '.join(absent)}"
    if verdict["verdict"] not in VERDICTS:
        return f"verdict = {verdict['verdict']!r}"
    for key, kind in SHAPES.items():
        if not isinstance(verdict[key], kind):
            return f"{key} = {shorten(verdict[key])}"
    complaints = [_of_effect(effect) for effect in verdict["effects"]]
    if any(complaints):
        return next(filter(None, complaints))
    if not all(map(_is_displaced, verdict["masking"])):
        return f"masking = {shorten(verdict['masking'])}"
    where, heldout = verdict["where"] or {}, (verdict["fit"] or {}).get("heldout") or {}
    for key, fits in (("orders", _is_number), ("windows", _is_window), ("depends_on", _is_text)):
        listed = where.get(key) or []
        if not isinstance(listed, list) or not all(map(fits, listed)):
            return f"where: {key} = {shorten(listed)}"
    if not _is_heldout(heldout):
        return f"fit: heldout = {shorten(heldout)}"
    if verdict["verdict"] in CLAIMS and not verdict["effects"]:
        return f"{verdict['verdict']} without an effect"
    return ""


def _is_text(value: Any) -> bool:
    """Text that can be published: half a surrogate pair is JSON and no UTF-8."""
    return isinstance(value, str) and value.isprintable()


def _is_number(value: Any) -> bool:
    """Also of 1e400, which is JSON and no float."""
    return isinstance(value, int | float) and abs(value) < LARGEST


def _are_numbers(entry: Any, keys: Iterable[str]) -> bool:
    """Whether an object states a number, null or nothing under each key."""
    return isinstance(entry, dict) and all(entry.get(key) is None or _is_number(entry[key]) for key in keys)


def _is_displaced(row: Any) -> bool:
    return _are_numbers(row, ("extended",)) and _is_text(row.get("parameter"))


def _is_heldout(value: Any) -> bool:
    channels = value.get("channels") or {} if _are_numbers(value, NUMBERS) else None
    return isinstance(channels, dict) and all(_are_numbers(own, BAND) for own in channels.values())


def _are_parameters(value: Any) -> bool:
    """Objects by name; what else stands under a name says nothing."""
    if not isinstance(value, dict | None):
        return False
    stated = [entry for entry in (value or {}).values() if isinstance(entry, dict)]
    return all(_are_numbers(entry, ("value", "sigma")) for entry in stated)


def _is_window(value: Any) -> bool:
    """Begin and end [s], and the recording."""
    if not isinstance(value, list) or len(value) != 3 or not _is_text(value[2]):
        return False
    return all(_is_number(end) and abs(end) < LATEST for end in value[:2])


def _of_effect(effect: Any) -> str:
    if not isinstance(effect, dict) or not _is_text(effect.get("effect")):
        return "an effect without id"
    probability, rivals, parameters = effect.get("probability"), effect.get("rivals", []), effect.get("parameters")
    if not isinstance(probability, int | float) or not 0 <= probability <= 1:
        return f"{effect['effect']}: probability = {shorten(probability)}"
    if effect.get("place") not in (*PLACES, None):
        return f"{effect['effect']}: place = {effect.get('place')!r}"
    if not isinstance(rivals, list) or not all(map(_is_text, rivals)):
        return f"{effect['effect']}: rivals = {shorten(rivals)}"
    return "" if _are_parameters(parameters) else f"{effect['effect']}: parameters = {shorten(parameters)}"
