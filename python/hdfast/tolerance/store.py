"""Where finished rows are kept: in memory, or in a folder with a manifest that survives a kill at any moment."""

from __future__ import annotations

import io
import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.files import MANIFEST, prepare, write_atomically, write_json
from hdfast.tolerance.sample import MAX_ROWS
from hdfast.tolerance.task import Piece
from hdfast.tolerance.trajectories import TrajectoryStore, checksum

FORMAT = 1
ROWS = "rows"
HALF_WRITTEN = (
    ".*.json-*",
    ".*.html-*",
    ".*.csv-*",
    ".*.parquet-*",
    ".*.toml-*",
    f"{ROWS}/.*.parquet-*",
    "*.zarr/**/*.partial",
)
CHUNK = 16_384
DIFFERS = {
    "input_sha256": "the file differs",
    "tables_sha256": "a table of measured values differs",
    "plan_sha256": "the distributions differ",
    "draws_sha256": "its rows are drawn otherwise",
    "settings_sha256": "drive, model, scenario, numerical settings or trajectories differ",
}


class MemoryStore:
    """Rows of a study without a folder."""

    files = "rows.parquet"

    def __init__(self) -> None:
        self.pieces: dict[int, Piece] = {}
        self.chunk = CHUNK

    def done(self, start: int, stop: int) -> bool:
        """True when these rows are there."""
        return start in self.pieces and self.pieces[start].stop == stop

    def put(self, piece: Piece) -> None:
        """Keep a finished chunk."""
        self.pieces[piece.start] = piece

    @property
    def poison(self) -> list[tuple[int, str]]:
        """Rows that took their process down, with what happened."""
        return [entry for start in sorted(self.pieces) for entry in self.pieces[start].poison]

    def table(self) -> Any:
        """All rows as a `pyarrow.Table`."""
        import pyarrow as pa

        return pa.concat_tables([self.pieces[start].table for start in sorted(self.pieces)])

    def column(self, name: str) -> Floats:
        """(n,) values in row order."""
        return np.concatenate([self.pieces[start].table.column(name).to_numpy() for start in sorted(self.pieces)])

    def status(self) -> NDArray[np.object_]:
        """(n,) status names in row order."""
        parts = [_names(self.pieces[start].table.column("status")) for start in sorted(self.pieces)]
        return np.concatenate(parts)

    def rows(self, numbers: list[int]) -> list[dict[str, Any]]:
        """All columns of some rows."""
        found = []
        for number in numbers:
            piece = next(p for p in self.pieces.values() if p.start <= number < p.stop)
            found.append(piece.table.slice(number - piece.start, 1).to_pylist()[0])
        return found


class FolderStore:
    """Rows of a study in a folder: one Parquet file per chunk, and a manifest with its SHA-256.

    A chunk counts once the manifest names it and the checksum agrees; anything else is done again.

    Args:
        folder: where.
        fingerprint: what decides the content of the rows; a folder made with another one is refused.
        chunk: rows per file; a folder that is resumed keeps its own.
        resume: continue what the folder holds instead of refusing to overwrite it.
        signals: names of the signals that are stored over time.
        times: (T,) their sample times [s], None without.

    Raises:
        InputError: the folder holds another study, or one and `resume` was not asked for.
    """

    files = f"{ROWS}/"

    def __init__(
        self,
        folder: Path,
        fingerprint: Mapping[str, Any],
        *,
        chunk: int = CHUNK,
        resume: bool = False,
        signals: tuple[str, ...] = (),
        times: Floats | None = None,
    ) -> None:
        self.folder = prepare(folder)
        self.fingerprint = dict(fingerprint)
        self.chunk = chunk
        self.entries: dict[int, dict[str, Any]] = {}
        self._lock = threading.Lock()
        begun = (self.folder / MANIFEST).exists()
        if begun:
            if not resume:
                raise InputError(
                    f"out = {str(folder)!r} holds a study already: continue it with resume (--resume) or take another "
                    "folder"
                )
            self._read()
        prepare(self.folder / ROWS)
        for left in [file for pattern in HALF_WRITTEN for file in self.folder.glob(pattern)]:
            left.unlink(missing_ok=True)
        self.trajectories = None
        if times is not None:
            self.trajectories = TrajectoryStore(self.folder, signals, times, self.chunk, "a" if begun else "w")

    def _read(self) -> None:
        with self._reading():
            manifest = json.loads((self.folder / MANIFEST).read_text(encoding="utf-8"))
            checks.whole("format", manifest["format"], FORMAT, FORMAT)
            self.chunk = checks.whole("chunk", manifest["chunk"], 1, MAX_ROWS)
            found, entries = dict(manifest["fingerprint"]), manifest["chunks"]
        differing = [key for key in {**self.fingerprint, **found} if found.get(key) != self.fingerprint.get(key)]
        if differing:
            what = _difference(differing[0], found, self.fingerprint)
            raise InputError(f"out = {str(self.folder)!r} holds another study: {what}; take another folder")
        with self._reading():
            self.entries = {entry["start"]: entry for entry in entries if self._intact(entry)}

    @contextmanager
    def _reading(self) -> Iterator[None]:
        try:
            yield
        except (ValueError, LookupError, TypeError, OSError) as error:
            raise InputError(f"{self.folder / MANIFEST} cannot be read ({error}): take another folder") from None

    def check_rows(self, rows: int) -> None:
        """Refuse to run fewer rows than there are.

        Raises:
            InputError: the folder holds more rows.
        """
        stored = max((entry["start"] + entry["rows"] for entry in self.entries.values()), default=0)
        if stored > rows:
            raise InputError(f"out = {str(self.folder)!r} holds {stored} rows (allowed: n of at least {stored})")

    def require_own(self, folder: Path) -> None:
        """Refuse to speak of these rows in another folder.

        Raises:
            InputError: it is another one.
        """
        if folder.resolve() != self.folder.resolve():
            raise InputError(f"out = {str(folder)!r}: the study has its rows elsewhere (allowed: {str(self.folder)!r})")

    def require_unchanged(self) -> None:
        """Refuse to speak for a folder whose rows have become others since.

        Raises:
            InputError: another run has stored rows there, or the manifest cannot be read.
        """
        with self._reading():
            found = json.loads((self.folder / MANIFEST).read_text(encoding="utf-8"))["chunks"]
        if found != self._chunks:
            raise InputError(
                f"out = {str(self.folder)!r}: another run has stored rows there since (read them with resume, --resume)"
            )

    def _intact(self, entry: Mapping[str, Any]) -> bool:
        files = {entry["file"]: entry["sha256"], **entry.get("trajectories", {})}
        return all(checksum(self.folder / name) == expected for name, expected in files.items())

    def done(self, start: int, stop: int) -> bool:
        """True when these rows are there and intact."""
        return start in self.entries and self.entries[start]["rows"] == stop - start

    def put(self, piece: Piece) -> None:
        """Store a finished chunk: its files first, the manifest last."""
        import hashlib

        import pyarrow.parquet as pq

        buffer = io.BytesIO()
        pq.write_table(piece.table, buffer, compression="zstd", compression_level=1, use_dictionary=["status"])
        content = buffer.getvalue()
        name = f"{ROWS}/{piece.start:012d}.parquet"
        shards = self.trajectories.put(piece) if self.trajectories is not None else {}
        write_atomically(self.folder / name, lambda stream: stream.write(content))
        entry: dict[str, Any] = {
            "start": piece.start,
            "rows": piece.stop - piece.start,
            "file": name,
            "sha256": hashlib.sha256(content).hexdigest(),
        }
        if shards:
            entry["trajectories"] = shards
        if piece.poison:
            entry["poison"] = [{"row": row, "reason": reason} for row, reason in piece.poison]
        with self._lock:
            self.entries[piece.start] = entry
            self._write()

    @property
    def _chunks(self) -> list[dict[str, Any]]:
        return [self.entries[start] for start in sorted(self.entries)]

    def _write(self) -> None:
        write_json(
            self.folder / MANIFEST,
            {"format": FORMAT, "fingerprint": self.fingerprint, "chunk": self.chunk, "chunks": self._chunks},
        )

    @property
    def poison(self) -> list[tuple[int, str]]:
        """Rows that took their process down, with what happened."""
        return [(bad["row"], bad["reason"]) for entry in self._chunks for bad in entry.get("poison", [])]

    def column(self, name: str) -> Floats:
        """(n,) values in row order; one column is in memory at a time."""
        import pyarrow.parquet as pq

        parts = [
            pq.read_table(self.folder / entry["file"], columns=[name]).column(name).to_numpy() for entry in self._chunks
        ]
        return np.concatenate(parts)

    def status(self) -> NDArray[np.object_]:
        """(n,) status names in row order."""
        import pyarrow.parquet as pq

        files = [self.folder / entry["file"] for entry in self._chunks]
        return np.concatenate([_names(pq.read_table(file, columns=["status"]).column("status")) for file in files])

    def rows(self, numbers: list[int]) -> list[dict[str, Any]]:
        """All columns of some rows."""
        import pyarrow.parquet as pq

        found = []
        for number in numbers:
            start = max(begin for begin in self.entries if begin <= number)
            table = pq.read_table(self.folder / self.entries[start]["file"])
            found.append(table.slice(number - start, 1).to_pylist()[0])
        return found


def _difference(key: str, there: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """What differs between two fingerprints, in words."""
    if key not in there:
        return f"an earlier version of hdfast, which may have drawn other rows, wrote it without {key}"
    return DIFFERS.get(key, f"{key} is {there[key]!r} there and {here.get(key)!r} here")


def _names(column: Any) -> NDArray[np.object_]:
    """Strings of a dictionary column without a copy of each."""
    whole = column.combine_chunks() if hasattr(column, "combine_chunks") else column
    if hasattr(whole, "chunks"):
        whole = whole.chunk(0)
    names: NDArray[np.object_] = np.array(whole.dictionary.to_pylist(), dtype=object)
    found: NDArray[np.object_] = names[whole.indices.to_numpy()]
    return found
