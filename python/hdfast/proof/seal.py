"""Commit to labels before any answer exists, and notice every later change.

`seal.json` is public: SHA-256 of salt and labels together, and of every file of every case. Salt and labels stay in
the sealed folder until the answers have been hashed; a case is opened once for every tool.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hdfast import files
from hdfast.errors import InputError

LABELS, SALT, OPENED, PLAN = "labels.json", "salt", "opened.json", "plan.json"


class SealError(InputError):
    """Data, labels, salt or answers are not those that were committed to, or the set was opened before."""


def same_plan(cases: Path, sealed: Path, public: Path, wanted: dict[str, Any]) -> None:
    """Note what a set is made from, or check that it is made from the same; a plan of which nothing was made is no set.

    Raises:
        SealError: the folder holds another set, a sealed one without its labels, or other cases.
    """
    plan = sealed / PLAN
    made = public.exists() or (cases.exists() and not (cases.is_dir() and not any(cases.iterdir())))
    if made and not plan.exists():
        if public.exists():
            raise SealError(f"{plan}: not found: without its labels no answer to a set can be scored")
        raise SealError(f"{cases}: is there, and not of a set of cases (give another --out)")
    if made and _read(plan) != wanted:
        raise SealError(f"{sealed.parent}: holds another set (give another --out, or what it was made with)")
    if not made:
        files.prepare(sealed)
        files.write_json(plan, wanted)


def commitment(salt: str, labels: bytes) -> str:
    """SHA-256 of salt and labels in hexadecimal."""
    return hashlib.sha256(salt.encode() + labels).hexdigest()


def close(cases: Path, sealed: Path, public: Path, labels: dict[str, Any]) -> None:
    """Write salt and labels, then publish the commitment and the checksums; the set is sealed once they are public.

    Raises:
        SealError: the set is sealed already, or the cases are not those that the labels are of.
    """
    if public.exists():
        raise SealError(f"{public}: the set is sealed already")
    if wrong := sorted({one.name for one in cases.iterdir()} ^ labels.keys()):
        listed = f"{', '.join(wrong[:5])}{' ...' if len(wrong) > 5 else ''}"
        raise SealError(f"{cases}: not the cases of this set: {listed} (give another --out)")
    salt = secrets.token_hex(32)
    written = (json.dumps(labels, indent=1, sort_keys=True) + "\n").encode()
    sealed.mkdir(parents=True, exist_ok=True)
    files.write_atomically(sealed / SALT, lambda stream: stream.write(salt.encode()))
    files.write_atomically(sealed / LABELS, lambda stream: stream.write(written))
    files.write_json(public, {"labels": commitment(salt, written), "files": checksums(cases)})


def checksums(folder: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by relative path."""
    return {str(p.relative_to(folder)): files.sha256(p) for p in sorted(folder.rglob("*")) if p.is_file()}


def verify_data(cases: Path, public: Path) -> None:
    """Check every file of every case.

    Raises:
        SealError: a file was changed, added or removed.
    """
    committed, found = _read(public)["files"], checksums(cases)
    changed = sorted(k for k in committed.keys() | found.keys() if committed.get(k) != found.get(k))
    if changed:
        raise SealError(f"{cases}: not as sealed: {', '.join(changed[:5])}{' ...' if len(changed) > 5 else ''}")


def verify_labels(sealed: Path, public: Path) -> dict[str, Any]:
    """Check salt and labels, and return the labels.

    Raises:
        SealError: they are missing or do not give the committed checksum.
    """
    try:
        written, salt = (sealed / LABELS).read_bytes(), (sealed / SALT).read_text()
    except FileNotFoundError as missing:
        raise SealError(f"{missing.filename}: not found") from None
    if commitment(salt, written) != _read(public)["labels"]:
        raise SealError(f"{sealed}: labels or salt are not those that were sealed")
    labels: dict[str, Any] = json.loads(written)
    return labels


def still_closed(sealed: Path, tool: str, cases: Iterable[str]) -> None:
    """Check that none of these cases was scored for a tool: a further answer to one could know its label.

    Raises:
        SealError: they were opened for this tool.
    """
    if seen := sorted(_cases(_merged(_rounds(sealed, tool))) & set(cases)):
        listed = f"{', '.join(seen[:5])}{' ...' if len(seen) > 5 else ''}"
        raise SealError(f"{sealed}: opened before for answers of {tool} to {listed}; they take no further ones")


def open_for(sealed: Path, public: Path, tool: str, answers: Path) -> dict[str, Any]:
    """Open the labels for the answers of one tool; to an opened case it has no others, to further cases it may.

    Raises:
        SealError: labels or salt were changed, or a case was opened for another answer of this tool.
    """
    labels = verify_labels(sealed, public)
    given, rounds = checksums(answers), _rounds(sealed, tool)
    scored = _merged(rounds)
    further = {path: value for path, value in given.items() if _case(path) not in _cases(scored)}
    if given != scored | further:
        raise SealError(f"{sealed}: opened before, for other answers of {tool}; this set is a regression set now")
    if further or not rounds:
        opened = _read(sealed / OPENED) if (sealed / OPENED).exists() else {}
        files.write_json(sealed / OPENED, {**opened, tool: [*rounds, further]})
    return labels


def opened_later(sealed: Path, tool: str) -> int:
    """How many cases a tool answered after others had been opened for it."""
    first, *later = map(_cases, _rounds(sealed, tool))
    return len(set().union(*later) - first)


def _rounds(sealed: Path, tool: str) -> list[dict[str, str]]:
    """Checksums of a tool's scored answers by path, one table per time that the labels were opened for it."""
    marker = sealed / OPENED
    found: list[dict[str, str]] = _read(marker).get(tool, []) if marker.exists() else []
    return found


def _merged(rounds: Iterable[dict[str, str]]) -> dict[str, str]:
    return {path: value for one in rounds for path, value in one.items()}


def _case(path: str) -> str:
    return path.split("/", maxsplit=1)[0]


def _cases(checksums: Iterable[str]) -> set[str]:
    return {_case(path) for path in checksums}


def _read(path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SealError(f"{path}: not found") from None
    return found
