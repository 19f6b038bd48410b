"""An answer to one case: `verdict.json`, or why there is none."""

from __future__ import annotations

import json
import math
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
    def named(self) -> list[str]:
        """Ids that the answer claims: those of `found` and `sensor`; candidates of other verdicts are no names."""
        return [e["effect"] for e in self.listed] if self.kind in ("found", "sensor") else []

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
    except (OSError, ValueError) as error:
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
    if not all(isinstance(row, dict) and isinstance(row.get("parameter"), str) for row in verdict["masking"]):
        return f"masking = {shorten(verdict['masking'])}"
    where, heldout = verdict["where"] or {}, (verdict["fit"] or {}).get("heldout") or {}
    for key, fits in (("orders", _is_number), ("windows", _is_window)):
        listed = where.get(key) or []
        if not isinstance(listed, list) or not all(map(fits, listed)):
            return f"where: {key} = {shorten(listed)}"
    channels = heldout.get("channels") or {} if isinstance(heldout, dict) else None
    if not isinstance(channels, dict) or not all(isinstance(own, dict) for own in channels.values()):
        return f"fit: heldout = {shorten(heldout)}"
    if verdict["verdict"] in CLAIMS and not verdict["effects"]:
        return f"{verdict['verdict']} without an effect"
    return ""


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _is_window(value: Any) -> bool:
    """Begin and end [s], and the recording."""
    return isinstance(value, list) and len(value) == 3 and all(map(_is_number, value[:2])) and isinstance(value[2], str)


def _of_effect(effect: Any) -> str:
    if not isinstance(effect, dict) or not isinstance(effect.get("effect"), str):
        return "an effect without id"
    probability, rivals, parameters = effect.get("probability"), effect.get("rivals", []), effect.get("parameters")
    if not isinstance(probability, int | float) or not math.isfinite(probability) or not 0 <= probability <= 1:
        return f"{effect['effect']}: probability = {probability!r}"
    if effect.get("place") not in (*PLACES, None):
        return f"{effect['effect']}: place = {effect.get('place')!r}"
    if not isinstance(rivals, list) or not all(isinstance(rival, str) for rival in rivals):
        return f"{effect['effect']}: rivals = {shorten(rivals)}"
    return "" if isinstance(parameters, dict | None) else f"{effect['effect']}: parameters = {shorten(parameters)}"
