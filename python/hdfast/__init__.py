"""Batch simulation of the torsional vibration of harmonic drives.

`sweep` runs many rows of parameters, `simulate` one row with its trajectory; `params` lists the parameters,
`Model` the choice of equations and `Scenario` what is done to the drive. `diagnose` finds what the model of a drive
leaves out of its recordings, `compare` and `calibrate` hold the two side by side and refit the model.

Rooms: `tolerance` (studies from distributions to yield; call it), `identify` (parameters from recordings), `bench`
(recordings of a virtual rig), `recordings` (files and campaigns), `health` (checks of recordings).
"""

from __future__ import annotations

import importlib
from importlib.metadata import version
from typing import Any

from hdfast.catalogue import build_info, metrics, signals, statuses
from hdfast.errors import (
    ConfigError,
    InputError,
    Interrupted,
    MissingPackageError,
    ParameterError,
    RowError,
)
from hdfast.jacobian import jacobian
from hdfast.model import Model
from hdfast.params import column, defaults, params
from hdfast.result import SweepResult
from hdfast.scenario import Scenario
from hdfast.simulate import Trajectory, simulate
from hdfast.sweep import sweep
from hdfast.terms import terms

__version__ = version("hdfast")

__all__ = [
    "Calibration",
    "Comparison",
    "ConfigError",
    "Diagnosis",
    "InputError",
    "Interrupted",
    "MissingPackageError",
    "Model",
    "ParameterError",
    "RowError",
    "Scenario",
    "SweepResult",
    "Trajectory",
    "build_info",
    "calibrate",
    "column",
    "compare",
    "defaults",
    "diagnose",
    "jacobian",
    "metrics",
    "params",
    "signals",
    "simulate",
    "statuses",
    "sweep",
    "terms",
]


MODULES = ("bench", "health", "identify", "proof", "recordings", "reference", "sensors", "studies", "tolerance")
ROOMS = {
    "Calibration": "calibration",
    "Comparison": "comparison",
    "Diagnosis": "diagnosis",
    "calibrate": "calibration",
    "compare": "comparison",
    "diagnose": "diagnosis",
}


def __dir__() -> list[str]:
    return sorted({*globals(), *ROOMS, *MODULES})


def __getattr__(name: str) -> Any:
    if name in MODULES:
        return importlib.import_module(f"hdfast.{name}")
    room = ROOMS.get(name)
    if room is not None:
        return getattr(importlib.import_module(f"hdfast.{room}"), name)
    raise AttributeError(f"module 'hdfast' has no attribute {name!r}")
