"""TOML text from sections of numbers, names and lists."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def dump(sections: Mapping[str, Any], comments: Mapping[tuple[str, ...], str] | None = None) -> str:
    """Write top-level keys, then sections, sections of sections and lists of sections.

    Args:
        sections: what `tomllib.loads` would return.
        comments: text behind the line of a key, by path.
    """
    notes = comments or {}
    plain = {key: value for key, value in sections.items() if not _is_section(value)}
    lines = _pairs(plain, (), notes)
    for key, value in sections.items():
        if _is_section(value):
            for entry in value if isinstance(value, list) else [value]:
                lines += ["", *_section(entry, (key,), notes, listed=isinstance(value, list))]
    return "\n".join(lines).lstrip("\n") + "\n"


def _is_section(value: Any) -> bool:
    listed = isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)
    return isinstance(value, Mapping) or listed


def _section(entry: Mapping[str, Any], path: tuple[str, ...], notes: Mapping[Any, str], *, listed: bool) -> list[str]:
    nested = {} if listed else {key: value for key, value in entry.items() if isinstance(value, Mapping)}
    own = _pairs({key: value for key, value in entry.items() if key not in nested}, path, notes)
    name = ".".join(_key(part) for part in path)
    lines = [f"[[{name}]]" if listed else f"[{name}]", *own] if own or not nested else []
    for key, value in nested.items():
        lines += ([""] if lines else []) + _section(value, (*path, key), notes, listed=False)
    return lines


def _pairs(entry: Mapping[str, Any], path: tuple[str, ...], notes: Mapping[Any, str]) -> list[str]:
    lines = []
    for key, value in entry.items():
        note = notes.get((*path, key))
        lines.append(f"{_key(key)} = {_value(value)}" + (f"  # {note}" if note else ""))
    return lines


def _key(key: str) -> str:
    bare = key.replace("_", "a").replace("-", "a")
    return key if bare.isalnum() and bare.isascii() else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        number = float(value)
        if math.isnan(number) or math.isinf(number):
            return "nan" if math.isnan(number) else ("inf" if number > 0 else "-inf")
        return repr(int(value)) if isinstance(value, int) else repr(number)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + " }"
    return "[" + ", ".join(_value(item) for item in value) + "]"
