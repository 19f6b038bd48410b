"""The folder of a virtual bench: recordings, the campaign file that describes them, and the truth behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hdfast import catalogue
from hdfast.files import CAMPAIGN, json_ready, prepare_results, write_json, write_text
from hdfast.recordings import Recording, save
from hdfast.sensors import SensorStage
from hdfast.sensors.facts import facts_of
from hdfast.toml_write import dump

TRUTH = "truth.json"
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
        InputError: the folder cannot be written, or holds another campaign file and no truth.
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
    target = prepare_results(out, campaign, (TRUTH,))
    for name, recording in files.items():
        save(recording, target / name)
    write_text(target / CAMPAIGN, campaign)
    numbers = {"kind": kind, "seed": seed, "version": catalogue.build_info()["version"], "truth": dict(truth)}
    write_json(target / TRUTH, json_ready(numbers))
    return target / CAMPAIGN
