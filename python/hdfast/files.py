"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import secrets
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from hdfast.errors import InputError

CAMPAIGN, INPUT, PAGE, REPORT = "campaign.toml", "input.toml", "index.html", "report.html"
COMPARISON, CALIBRATION, VERDICT = "comparison.json", "calibration.json", "verdict.json"
TRUTH, FIT, CLAIMS, MANIFEST, SUMMARY = "truth.json", "fit.json", "claims.json", "manifest.json", "summary.json"
COMPUTED = ("rows.parquet", "trajectory.parquet", "recording.parquet")
REPORTED = (SUMMARY, PAGE, "statistics.csv", "statistics.parquet", "worst.csv", "worst.parquet")
RESERVED = (INPUT, MANIFEST, "rows", "trajectories.zarr", *COMPUTED, *REPORTED)
SWEPT = (SUMMARY, MANIFEST)  # sweep, simulate and tolerance take turns in a folder
TELLING = (COMPARISON, CALIBRATION, VERDICT, TRUTH, FIT, CLAIMS, *SWEPT)  # of which command the results in a folder are


def prepare(folder: str | Path) -> Path:
    """Create the folder and check that files can be written.

    Raises:
        InputError: it cannot be created or written.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path, prefix=".hdfast-"):
            pass
    except OSError as error:
        reason = "it is a file, not a folder" if path.is_file() else error.strerror
        raise InputError(f"out = {str(folder)!r} cannot be written: {reason}") from None
    return path


def prepare_own(folder: str | Path, own: Sequence[str]) -> Path:
    """As `prepare`, for the results of one command.

    Args:
        folder: where results go.
        own: what the command writes, one of `TELLING` among it.

    Raises:
        InputError: the folder cannot be written, or holds results of another command.
    """
    for name in _told(folder):
        if name not in own:
            raise InputError(
                f"out = {str(folder)!r} holds {name}, as results of another command do: name another folder"
            )
    return prepare(folder)


def _told(folder: str | Path) -> list[str]:
    """Files of the folder that say whose results it holds."""
    return [name for name in TELLING if (Path(folder) / name).exists()]


@contextlib.contextmanager
def alone_in(folder: str | Path) -> Iterator[Path]:
    """As `prepare`, with nobody else's run in the folder meanwhile; a process that ends in any way leaves it free.

    Raises:
        InputError: the folder cannot be created or written, or another run is at work there.
    """
    import fcntl  # not on every system

    path = prepare(folder)
    held = os.open(path, os.O_RDONLY)
    try:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"out = {str(folder)!r}: another run is at work there (wait for its end, or name another folder)"
            ) from None
        except OSError:
            pass  # a file system without locks: nobody can be told
        yield path
    finally:
        os.close(held)


def prepare_results(folder: str | Path, campaign: str, own: Sequence[str], home: Path | None = None) -> Path:
    """As `prepare`, for results beside a copy of their campaign file; one that is no copy is not written over.

    Args:
        folder: where results go.
        campaign: text of the campaign file.
        own: what the command writes beside the copy, one of `TELLING` among it.
        home: folder of the campaign file that is read; what it holds is never a copy.

    Raises:
        InputError: the folder cannot be written, holds another campaign file that is no copy beside results, or results
            of another command.
    """
    copies = {CAMPAIGN: campaign.encode()}
    if home is not None and Path(folder).resolve() == home.resolve():
        _require_copies(folder, copies)
    return _prepare_copies(folder, copies, own)


def prepare_inputs(folder: str | Path, inputs: Mapping[str, bytes], own: Sequence[str] = SWEPT) -> Path:
    """As `prepare`, for results with a copy of what they came from; a foreign file that differs is not written over.

    Args:
        folder: where results go.
        inputs: content of each copy by its name in the folder.
        own: what the command writes beside the copies, one of `TELLING` among it.

    Raises:
        InputError: the folder cannot be written, holds another file of such a name and no results, results of another
            command, or a tolerance study, whose rows would lose their input.
    """
    if (Path(folder) / MANIFEST).exists():
        raise InputError(f"out = {str(folder)!r} holds the rows of a tolerance study: name another folder")
    return _prepare_copies(folder, inputs, own)


def prepare_study(folder: str | Path, inputs: Mapping[str, bytes]) -> Path:
    """As `prepare_inputs`, for the rows of a tolerance study, which continue those that the folder may hold."""
    return _prepare_copies(folder, inputs, SWEPT)


def _prepare_copies(folder: str | Path, copies: Mapping[str, bytes], own: Sequence[str]) -> Path:
    """As `prepare`; results there are the command's own, and what has the name of a copy is one where there are any."""
    bare = not _told(folder)
    path = prepare_own(folder, own)
    if bare:
        _require_copies(folder, copies)
    return path


def _require_copies(folder: str | Path, copies: Mapping[str, bytes]) -> None:
    """Refuse a folder that holds anything else under the names of the copies."""
    for name, content in copies.items():
        path = Path(folder) / name
        if path.exists() and not _holds(path, content):
            raise InputError(
                f"out = {str(folder)!r} holds another {name}, which would be replaced: name another folder"
            )


def _holds(path: Path, content: bytes) -> bool:
    """Whether a file holds these bytes, or their text."""
    try:
        return path.read_bytes() == content or _reads(path, content.decode())
    except (OSError, UnicodeDecodeError):
        return False


def _reads(path: Path, text: str) -> bool:
    """Whether a file holds a text, whatever its ends of lines."""
    try:
        return path.read_text(encoding="utf-8-sig") == text
    except (OSError, UnicodeDecodeError):
        return False


def remove(paths: Iterable[Path]) -> None:
    """Remove what is there of earlier results, so that a run that is cut short leaves none beside its own.

    Raises:
        InputError: a file cannot be removed.
    """
    for path in paths:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"{str(path)!r} cannot be replaced: {error.strerror or error}") from error


def retract(folder: Path, inputs: Mapping[str, bytes]) -> None:
    """Remove what was reported earlier, and what came from another input; a folder without results keeps all it holds.

    Args:
        folder: where results go.
        inputs: content of each copy by its name in the folder.

    Raises:
        InputError: a file cannot be removed.
    """
    if any((folder / name).exists() for name in (MANIFEST, SUMMARY)):
        other = [name for name, content in inputs.items() if not _holds(folder / name, content)]
        remove(folder / name for name in (*REPORTED, *other, *(COMPUTED if other else ())))


def write_atomically(path: Path, write: Callable[[BinaryIO], Any]) -> None:
    """Write through a temporary file of the same folder.

    Raises:
        InputError: the file cannot be written: the disk is full, a folder has its name, or a file that of its folder.
    """
    temporary = path.parent / f".{path.name}-{secrets.token_hex(4)}"
    try:
        with temporary.open("xb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"{str(path)!r} cannot be written: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def write_text(path: Path, text: str) -> None:
    """A UTF-8 text file, atomically."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Any file, atomically."""
    write_atomically(path, lambda stream: stream.write(content))


def write_json(path: Path, numbers: Any) -> None:
    """JSON with a final newline; NaN and infinities are refused, see `json_ready`."""
    write_text(path, json.dumps(numbers, indent=2, allow_nan=False) + "\n")


def json_ready(value: Any) -> Any:
    """The same in plain numbers for JSON, which knows neither NaN nor infinity: null in their place."""
    if isinstance(value, Mapping):
        return {str(key): json_ready(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_ready(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def sha256(path: Path) -> str:
    """Checksum of a file in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
