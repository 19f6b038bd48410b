"""A campaign folder: campaign.toml and one NPZ file per recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hdfast.toml_write import dump

RIGID = {"J_l": 0.0, "B_l": 0.0, "B_ml": 0.0}
NO_KINEMATIC_ERROR = {"orders": [], "cos": [], "sin": []}


@dataclass(frozen=True)
class Part:
    """One recording of a campaign: columns (n,) by name in the file, and its keys in [[recording]]."""

    name: str
    columns: Mapping[str, np.ndarray]
    role: str = "fit"
    group: str = "A"
    started_at_s: float = 0.0
    input: str | None = None

    def entry(self) -> dict[str, Any]:
        keys = {"file": f"{self.name}.npz", "role": self.role, "group": self.group, "started_at_s": self.started_at_s}
        return keys | ({"input": self.input} if self.input else {})


def write_campaign(folder: Path, sections: Mapping[str, Any], parts: Iterable[Part]) -> Path:
    """Write the recordings and campaign.toml; returns the path of the latter."""
    folder.mkdir(parents=True, exist_ok=True)
    listed = list(parts)
    for part in listed:
        np.savez_compressed(folder / f"{part.name}.npz", **part.columns)
    path = folder / "campaign.toml"
    path.write_text(dump({**sections, "recording": [part.entry() for part in listed]}), encoding="utf-8")
    return path


def about(value: float, sigma: float) -> dict[str, float]:
    """A nominal value with its relative tolerance."""
    return {"value": value, "sigma": sigma}


def cut(columns: Mapping[str, np.ndarray], share: float) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The first share of the samples and the rest, each with its time from zero."""
    size = int(share * len(columns["t"]))
    halves = ({key: values[:size] for key, values in columns.items()}, {k: v[size:] for k, v in columns.items()})
    return tuple(half | {"t": half["t"] - half["t"][0]} for half in halves)
