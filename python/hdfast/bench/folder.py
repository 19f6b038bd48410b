"""The folder of a virtual bench: recordings, the campaign file that describes them, and the truth behind them."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hdfast import catalogue
from hdfast.files import CAMPAIGN, PAGE, TRUTH, json_ready, prepare_results, remove, write_json, write_text
from hdfast.recordings import Recording, save
from hdfast.sensors import SensorStage
from hdfast.sensors.facts import facts_of
from hdfast.toml_write import dump

RESULTS = (TRUTH, PAGE)
NAMEPLATE = ("ratio", "J_m", "J_l", "B_l", "B_ml", "B_sp")


def write(
    out: str | Path,
    kind: str,
    recordings: Sequence[Recording],
    truth: Mapping[str, Any],
    drive: Mapping[str, float],
    sensors: SensorStage,
    seed: int,
    suffix: str = "parquet",
) -> Path:
    """Write a bench and return its campaign file.

    The campaign file knows what a user would: ratio, inertias and dampings, not what the test is there to find.

    Raises:
        InputError: the folder cannot be written, holds another campaign file and no truth, or results of another
            command.
    """
    files = {f"{item.name.replace(' ', '_').replace('/', '')}.{suffix}": item for item in recordings}
    columns = sorted({column for recording in recordings for column in recording.columns})
    campaign = dump(
        {
            "title": f"Virtual bench: {kind}",
            "drive": {name: drive[name] for name in NAMEPLATE if name in drive},
            "sensors": {name: facts for name, facts in facts_of(sensors).items() if name in columns},
            "recording": [{"file": name} for name in files],
        }
    )
    target = prepare_results(out, campaign, RESULTS)
    remove(target / name for name in _earlier(target))
    for name, recording in files.items():
        save(recording, target / name)
    write_text(target / CAMPAIGN, campaign)
    numbers = {"kind": kind, "seed": seed, "version": catalogue.build_info()["version"], "recordings": list(files)}
    write_json(target / TRUTH, json_ready(numbers | {"truth": dict(truth)}))
    return target / CAMPAIGN


def _earlier(target: Path) -> list[str]:
    """What an earlier bench left in its folder, its recordings as the truth lists them; nothing where it lists none."""
    with contextlib.suppress(OSError, ValueError, LookupError, TypeError):
        recordings = json.loads((target / TRUTH).read_text(encoding="utf-8"))["recordings"]
        return [*RESULTS, CAMPAIGN, *(Path(name).name for name in recordings)]
    return []
