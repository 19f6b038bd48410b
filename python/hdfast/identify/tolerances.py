"""Tolerances of a model file that its identified values can still have."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from hdfast import config
from hdfast.errors import InputError
from hdfast.tolerance.reading import read_tolerance
from hdfast.toml_write import dump


def standing(model: Mapping[str, Any], gone: Collection[str]) -> tuple[dict[str, Any], list[str]]:
    """The model without tolerances that no longer stand and without their correlations, and a note on each.

    A tolerance does not stand where the drive has no such parameter, or where its law cannot be about the new value. Of
    a file that no command reads anyway nothing is left out.

    Args:
        model: sections of a model file.
        gone: parameters of a spring law that was replaced.
    """
    stated = model.get("tolerance", {})
    rest = {key: value for key, value in model.items() if key not in ("tolerance", "correlation")}
    try:
        nominal = config.parse(dump(rest)).nominal() if stated else {}
    except InputError:
        return dict(model), []
    objections = {name: _objection(name, entry, nominal, gone) for name, entry in stated.items()}
    kept = {name: entry for name, entry in stated.items() if not objections[name]}
    notes = [f"the model file has no tolerance of {name}: {said}" for name, said in objections.items() if said]
    correlation = model.get("correlation", {})
    pairs = correlation.get("pairs", [])
    left = [pair for pair in pairs if set(pair[:2]) <= kept.keys()]
    notes += [f"the model file has no correlation of {a} and {b}" for a, b, *_ in pairs if not {a, b} <= kept.keys()]
    whole = {"tolerance": kept, "correlation": correlation | {"pairs": left} if left else {}}
    return dict(model) | {key: value for key, value in whole.items() if key in model}, notes


def located(model: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The model with absolute paths of the tables of measured values beside it, so that a copy reads them anywhere."""
    stated = model.get("tolerance", {})
    named = {
        name: dict(entry) | {"file": str(folder.absolute() / entry["file"])}
        for name, entry in (stated.items() if isinstance(stated, Mapping) else ())
        if isinstance(entry, Mapping) and isinstance(entry.get("file"), str)
    }
    return dict(model) | ({"tolerance": dict(stated) | named} if named else {})


def _objection(name: str, entry: Any, nominal: Mapping[str, float], gone: Collection[str]) -> str:
    """Why a tolerance cannot stand; nothing where it can, or where a table beside the file says it."""
    if name in gone or name not in nominal:
        return f"the drive has no {name}"
    if not isinstance(entry, Mapping):
        return f"it is no section [tolerance.{name}]"
    if "file" in entry:
        return ""
    try:
        read_tolerance(name, entry, nominal[name], lambda *_: None)
    except InputError as error:
        return str(error)
    return ""
