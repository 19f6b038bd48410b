"""Where the recordings of real machines are found."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]


def data_folder() -> Path:
    """Folder of the recordings: HDFAST_DATA, or shared/data beside the project."""
    return Path(os.environ.get("HDFAST_DATA") or ROOT.parent / "shared" / "data")


def read(name: str) -> dict[str, np.ndarray]:
    """The arrays of one recording; skips the test where it is missing."""
    path = data_folder() / f"{name}.npz"
    if not path.is_file():
        pytest.skip(f"no recording {name}.npz in {data_folder()}: set HDFAST_DATA, see docs/recordings.md")
    with np.load(path, allow_pickle=False) as archive:
        return {key: archive[key] for key in archive.files}
