"""The folder of a virtual bench: recordings, the campaign file that describes them, and the truth behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hdfast import catalogue
from hdfast.files import json_ready, prepare, write_json, write_text
from hdfast.recordings import Recording, save
from hdfast.sensors import SensorStage
from hdfast.sensors.facts import facts_of
from hdfast.toml_write import dump

CAMPAIGN, TRUTH = "campaign.toml", "truth.json"
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
    """
    target = prepare(out)
    names = []
    for recording in recordings:
        name = f"{recording.name.replace(' ', '_').replace('/', '')}.{suffix}"
        save(recording, target / name)
        names.append(name)
    columns = sorted({column for recording in recordings for column in recording.columns})
    sections = {
        "title": f"Virtual bench: {kind}",
        "drive": {name: drive[name] for name in NAMEPLATE if name in drive},
        "sensors": {name: facts for name, facts in facts_of(sensors).items() if name in columns},
        "recording": [{"file": name} for name in names],
    }
    write_text(target / CAMPAIGN, dump(sections))
    numbers = {"kind": kind, "seed": seed, "version": catalogue.build_info()["version"], "truth": dict(truth)}
    write_json(target / TRUTH, json_ready(numbers))
    return target / CAMPAIGN
