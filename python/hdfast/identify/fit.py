"""What every identification returns: estimates, the sections of a model file, figures and tables for a page."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hdfast.checks import Floats
from hdfast.identify.estimate import Estimates
from hdfast.identify.left_out import number
from hdfast.identify.tolerances import standing
from hdfast.sections import OF_A_CAMPAIGN
from hdfast.spring import COEFFICIENTS
from hdfast.terms import terms
from hdfast.toml_write import dump

SPRING = ("spring", *(name for names in COEFFICIENTS.values() for name in names))


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of an identification.

    Attributes:
        kind: "stiffness", "kinematic_error", "friction", "starting_torque" or "coastdown".
        title: one line for the page.
        estimates: every number with its 90 % interval.
        sections: what the model file gets, by section: drive, kinematic_error, terms.
        notes: what was assumed, what is missing, what the fit cannot hold.
        numbers: further results by name, ready for JSON.
        tables: name -> (header, rows of text).
        curves: arrays for the figures by name.
        points: name -> (unit, array) of one length, written as the table of the result folder.
        decided: effects of `[[terms]]` on which the test decides: declared ones go, whether it found them or not.
        model: sections of the base model with the identified values in them, as `hdfast.config` reads them.
    """

    kind: str
    title: str
    estimates: Estimates
    sections: dict[str, Any]
    notes: list[str]
    numbers: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, tuple[list[str], list[list[str]]]] = field(default_factory=dict)
    curves: dict[str, Any] = field(default_factory=dict, repr=False)
    points: dict[str, tuple[str, Floats]] = field(default_factory=dict, repr=False)
    base: Mapping[str, Any] = field(default_factory=dict, repr=False)
    source: str = field(default="", repr=False)
    decided: Collection[str] = ()
    model: dict[str, Any] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        model, left_out = merge(self.base, self.sections, self.decided)
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "notes", [*self.notes, *left_out])

    @property
    def table(self) -> Estimates:
        """The estimates; prints as a table."""
        return self.estimates

    def model_text(self) -> str:
        """The model file, TOML with the intervals as comments."""
        notes: dict[tuple[str, ...], str] = {
            ("drive", item.name): f"{item.unit}; 90 %: {item.low:.6g} .. {item.high:.6g}" for item in self.estimates
        }
        return f"# Identified by hdfast identify {self.kind.replace('_', '-')}\n" + dump(self.model, notes)

    def report(self, folder: str | Path) -> Path:
        """Write the page, the model file, the JSON and the points; returns the page."""
        from hdfast.report import identify_page

        return identify_page.write(self, folder)

    def __repr__(self) -> str:
        return f"{self.title}\n{self.estimates!r}\n" + "\n".join(self.notes)


def merge(
    base: Mapping[str, Any], found: Mapping[str, Any], decided: Collection[str]
) -> tuple[dict[str, Any], list[str]]:
    """A model file with identified values, and notes on what of the base it no longer holds.

    What only a campaign has is dropped without a note, as are effects of sensors and terms this version does not know.
    Effects on which a test decides go, found or not; so do the other spring law when the spring was identified, and
    tolerances that the identified values cannot have.
    """
    known, drive = terms().ids, found.get("drive", {})
    declared = [term for term in base.get("terms", []) if term.get("effect") in known and "channel" not in term]
    listed = [dict(term) for term in found.get("terms", [])]
    replaced = {
        "drive": joined(plain(base.get("drive", {})), drive),
        "kinematic_error": dict(found.get("kinematic_error", {})) or plain(base.get("kinematic_error", {})),
        "terms": [dict(term) for term in declared if term["effect"] not in decided] + listed,
    }
    merged = {key: value for key, value in base.items() if key not in OF_A_CAMPAIGN} | replaced
    lost = {term["effect"] for term in declared if term["effect"] in decided} - {term["effect"] for term in listed}
    gone = set(SPRING) - set(drive) if "spring" in drive else set()
    model, notes = standing(merged, gone)
    notes = [*(f"the model file no longer declares {effect}" for effect in sorted(lost)), *notes]
    return {key: value for key, value in model.items() if value not in ({}, [])}, notes


def joined(drive: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """A section [drive] with the keys of another in place of its own; a spring in it replaces the whole spring."""
    rivals = SPRING if any(key in other for key in SPRING) else ()
    return {key: value for key, value in drive.items() if key not in rivals} | dict(other)


def plain(section: Mapping[str, Any]) -> dict[str, Any]:
    """A section of a campaign file with its values alone: tolerances and tooth counts left out."""
    kept = {key: value for key, value in section.items() if key not in ("sigma", "fixed") and key[:6] != "teeth_"}
    return {key: number(value) for key, value in kept.items()}
