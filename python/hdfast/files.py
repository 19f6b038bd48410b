"""Files that appear whole or not at all."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from hdfast.errors import InputError


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
        raise InputError(f"out = {str(folder)!r} cannot be written: {error.strerror}") from None
    return path


def write_atomically(path: Path, write: Callable[[BinaryIO], Any]) -> None:
    """Write through a temporary file of the same folder."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-")
    try:
        with os.fdopen(handle, "wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """A UTF-8 text file, atomically."""
    write_atomically(path, lambda stream: stream.write(text.encode()))


def write_json(path: Path, numbers: Any) -> None:
    """JSON with a final newline; NaN is refused."""
    text = json.dumps(numbers, indent=2, allow_nan=False) + "\n"
    write_atomically(path, lambda stream: stream.write(text.encode()))


def sha256(path: Path) -> str:
    """Checksum of a file in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
