"""Trajectories of a study: one Zarr v3 array per signal, one shard per chunk of rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hdfast import catalogue, checks
from hdfast.checks import Floats
from hdfast.errors import InputError, require_package
from hdfast.files import sha256

if TYPE_CHECKING:
    from hdfast.tolerance.task import Piece

FOLDER = "trajectories.zarr"
INNER_ROWS = 256
MAX_SAMPLES = 10**6


@dataclass(frozen=True)
class Trajectories:
    """Which signals a study keeps, sampled every `step` seconds from 0 to the end."""

    signals: tuple[str, ...]
    step: float

    def times(self, t_end: float) -> Floats:
        """(T,) sample times [s]."""
        return np.minimum(np.arange(int(t_end / self.step + 1e-9) + 1, dtype=np.float64) * self.step, t_end)


def read_trajectories(section: Mapping[str, Any], known: Any, t_end: float) -> Trajectories | None:
    """Read [trajectories]: `signals` and `step` [s]; None when the section is missing.

    Raises:
        InputError: an unknown signal, or a step longer than the run or too short for it.
    """
    if not section:
        return None
    known(section, ("signals", "step"))
    for key in ("signals", "step"):
        if key not in section:
            raise InputError(f"[trajectories] needs the key {key!r}")
    signals = tuple(signal.name for signal in catalogue.choose_signals(section["signals"], ()))
    return Trajectories(signals, checks.number("step", section["step"], t_end / MAX_SAMPLES, t_end, "s"))


def checksum(path: Path) -> str:
    """SHA-256 of a file in hexadecimal; empty where there is none, as of a shard without a sample: Zarr writes none."""
    return sha256(path) if path.is_file() else ""


class TrajectoryStore:
    """The arrays (rows, T) of a study's signals on disk; NaN where a row did not get.

    Args:
        folder: of the study.
        signals: names.
        times: (T,) sample times [s].
        chunk: rows per shard.
        mode: "w" begins anew, "a" goes on with what is there.
    """

    def __init__(
        self, folder: Path, signals: tuple[str, ...], times: Floats, chunk: int, mode: Literal["w", "a"]
    ) -> None:
        require_package("zarr", "zarr")
        import zarr

        self.folder, self.chunk = folder, chunk
        root = zarr.open_group(str(folder / FOLDER), mode=mode, zarr_format=3)
        if "t" not in root:
            root.create_array("t", data=times, attributes={"units": "s"})
        inner = next(rows for rows in range(min(INNER_ROWS, chunk), 0, -1) if chunk % rows == 0)
        known = catalogue.signals()
        self.arrays: dict[str, Any] = {}
        for name in signals:
            if name not in root:
                root.create_array(
                    name,
                    shape=(0, len(times)),
                    dtype="float64",
                    chunks=(inner, len(times)),
                    shards=(chunk, len(times)),
                    fill_value=np.nan,
                    attributes={"units": known[name].unit},
                    dimension_names=("row", "t"),
                )
            self.arrays[name] = root[name]

    def put(self, piece: Piece) -> dict[str, str]:
        """Write a chunk; returns the checksum of each of its files by path."""
        written = {}
        for name, array in self.arrays.items():
            if array.shape[0] < piece.stop:
                array.resize((piece.stop, array.shape[1]))
            file = f"{FOLDER}/{name}/c/{piece.start // self.chunk}/0"
            (self.folder / file).unlink(missing_ok=True)  # Zarr would merge with what is there, damaged or not
            array[piece.start : piece.stop] = piece.samples[name]
            written[file] = checksum(self.folder / file)
        return written
