"""What every identification returns: estimates, the sections of a model file, figures and tables for a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hdfast.checks import Floats
from hdfast.identify.estimate import Estimates
from hdfast.identify.left_out import number, replaced
from hdfast.sections import OF_A_CAMPAIGN
from hdfast.spring import COEFFICIENTS
from hdfast.terms import terms
from hdfast.toml_write import dump


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

    @property
    def table(self) -> Estimates:
        """The estimates; prints as a table."""
        return self.estimates

    @property
    def model(self) -> dict[str, Any]:
        """The sections of the base model with the identified values in them, as `hdfast.config` reads them."""
        return merge(self.base, self.sections)

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


def merge(base: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """A model file with identified values.

    What only a campaign has is dropped, as are effects of sensors and terms this version does not know; keys and
    tolerances of the other spring law go when the spring was identified.
    """
    known = terms().ids
    merged = {key: value for key, value in base.items() if key not in OF_A_CAMPAIGN}
    merged["drive"] = plain(base.get("drive", {}))
    error = plain(base.get("kinematic_error", {}))
    merged |= {"kinematic_error": error} if error else {}
    if "terms" in merged:
        merged["terms"] = [term for term in merged["terms"] if term.get("effect") in known and "channel" not in term]
    for section, values in found.items():
        if section == "terms":
            merged[section] = replaced(merged.get(section, []), values)
            continue
        if section == "kinematic_error":
            merged[section] = dict(values)
            continue
        rivals = {name for names in COEFFICIENTS.values() for name in names} if "spring" in values else set()
        merged[section] = {k: v for k, v in merged.get(section, {}).items() if k not in rivals} | dict(values)
        kept = rivals - set(values)
        if "tolerance" in merged:
            merged["tolerance"] = {k: v for k, v in merged["tolerance"].items() if k not in kept}
    return {key: value for key, value in merged.items() if value not in ({}, [])}


def plain(section: Mapping[str, Any]) -> dict[str, Any]:
    """A section of a campaign file with its values alone: tolerances and tooth counts left out."""
    kept = {key: value for key, value in section.items() if key not in ("sigma", "fixed") and key[:6] != "teeth_"}
    return {key: number(value) for key, value in kept.items()}
