"""MDF4 and MDF3 measurement files, by asammdf in a process of its own: its compiled part may crash on a broken file."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hdfast.errors import InputError, require_package
from hdfast.recordings.formats.source import Source, Wanted, check_size, numbers

REFUSED = 3


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted channels on the raster of the one with the most samples; others are interpolated on it and noted.

    The column `t` is the time of that raster.

    Raises:
        InputError: the file is no MDF file or is broken.
        MissingPackageError: asammdf is not installed.
    """
    require_package("asammdf", "mdf")
    done = subprocess.run(
        [sys.executable, "-m", __name__, str(path), *sorted(wanted)],
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    if done.returncode == REFUSED:
        raise InputError(done.stdout.decode("utf-8", "replace"))
    if done.returncode:
        last = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:] or ["asammdf crashed"]
        raise InputError(f"{path}: cannot be read as MDF ({last[0][:200]})")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as archive:
        facts, *arrays = (archive[name] for name in archive.files)
    said = json.loads(str(facts))
    columns = dict(zip(said["columns"], arrays, strict=True))
    return Source(said["names"], columns, said["units"], tuple(said["notes"]), said["rates"])


def main(path: Path, wanted: Wanted) -> int:
    """Write what was found to the standard output, as an NPZ archive or as the sentence of a refusal."""
    try:
        source = channels(path, wanted)
    except InputError as error:
        sys.stdout.write(str(error))
        return REFUSED
    facts = {**vars(source), "columns": list(source.columns)}
    np.savez(sys.stdout.buffer, np.array(json.dumps(facts)), *source.columns.values())
    return 0


def channels(path: Path, wanted: Wanted) -> Source:
    """As `read`, in this process."""
    from asammdf import MDF

    with MDF(path) as file:
        names = [name for name in file.channels_db if name not in ("time", "t")]
        places = {name: _only(path, name, file.channels_db[name]) for name in sorted(wanted.intersection(names))}
        source = Source(["t", *names], {})
        samples = {name: int(file.groups[group].channel_group.cycles_nr) for name, (group, _) in places.items()}
        for name in sorted(places, key=samples.__getitem__, reverse=True):
            group, index = places[name]
            check_size(path, samples[name])
            signal = file.get(group=group, index=index)
            t = np.asarray(signal.timestamps, dtype=np.float64)
            source.join(name, t, numbers(path, name, signal.samples))
            if signal.unit:
                source.units[name] = str(signal.unit)
    return source


def _only(path: Path, name: str, places: Any) -> tuple[int, int]:
    if len(places) != 1:
        raise InputError(f"{path}: {len(places)} channels are named {name!r} (allowed: one)")
    group, index = places[0]
    return int(group), int(index)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), frozenset(sys.argv[2:])))
