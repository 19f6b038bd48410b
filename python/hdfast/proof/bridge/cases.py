"""Write semi-synthetic cases of several machines and seal their labels."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from hdfast import files
from hdfast.errors import InputError
from hdfast.proof import seal
from hdfast.proof.bridge.controls import CONTROLS
from hdfast.proof.bridge.detectable import detectable, share
from hdfast.proof.bridge.injections import INJECTIONS, Injection
from hdfast.proof.bridge.machine import Machine, Recorded, calibrated
from hdfast.proof.folders import Folders
from hdfast.toml_write import dump

SIZES = (3.0, 8.0)
LARGEST_SHARE = 0.5
LIMITATIONS = (
    "Semi-synthetic cases: recordings of real machines with the model that the diagnosis itself ended with, into which "
    "one effect was put, or none.",
    "Null cases hold whatever the machine has beyond that model; a claim on them may be right and counts as false.",
    "The detectable amplitude is that of a matched filter in the spectrum of what the model leaves.",
    "Repeats of one manoeuvre are not compared: the campaigns need not have any.",
)


def make(folders: Folders, campaigns: Sequence[Path], seed: int, step: Callable[[int, int], None]) -> None:
    """Make and seal the cases of some campaigns; a sealed set stays as it is.

    Args:
        folders: where they go.
        campaigns: campaign files of real machines, each with something held out.
        seed: of every draw.
        step: told after every machine how many of how many are done.

    Raises:
        InputError: a campaign cannot be used.
        SealError: the folder holds another set, or cases of none.
    """
    for path in campaigns:
        if not path.is_file():
            raise InputError(f"{path}: no campaign file")
    wanted = {"campaigns": [files.sha256(path) for path in campaigns], "seed": seed}
    seal.same_plan(folders.cases, folders.sealed, folders.seal, wanted)
    if folders.seal.exists():
        return
    drawn: list[tuple[Machine, list[Recorded], dict[str, Any]]] = []
    for number, path in enumerate(campaigns):
        drawn += _of(calibrated(path), np.random.default_rng([seed, number]))
        step(number + 1, len(campaigns))
    rng = np.random.default_rng([seed, len(campaigns)])
    names = [f"{x:08x}" for x in rng.choice(2**32, len(drawn), replace=False)]
    shutil.rmtree(folders.cases, ignore_errors=True)
    for name, (machine, recordings, _) in zip(names, drawn, strict=True):
        write(folders.cases / name, machine, recordings, rng)
    labels = {name: label for name, (*_, label) in zip(names, drawn, strict=True)}
    seal.close(folders.cases, folders.sealed, folders.seal, labels)


def _of(machine: Machine, rng: Generator) -> list[tuple[Machine, list[Recorded], dict[str, Any]]]:
    found = [(machine, control(machine, rng), bare(machine, ("null", name))) for name, control in CONTROLS.items()]
    for injection in INJECTIONS:
        if injection.applies(machine):
            found += [(machine, *case) for size in SIZES if (case := injected(machine, injection, size, rng))]
    return found


def injected(
    machine: Machine, injection: Injection, size: float, rng: Generator
) -> tuple[list[Recorded], dict[str, Any]] | None:
    """Recordings with an effect of `size` detectable amplitudes and their label; None where that is no small effect."""
    shape = injection.shape(machine, rng)
    amplitude = size * detectable(machine, injection, shape) + injection.swallowed(machine)
    if not np.isfinite(amplitude) or share(machine, injection, shape, amplitude) > LARGEST_SHARE:
        return None
    changed = [replace(one, columns=injection.on(one, amplitude, shape)) for one in machine.recordings]
    rivals = [{"id": twin, "abs_cos": 1.0} for twin in injection.twins if twin != injection.effect]
    effect = {
        "id": injection.effect,
        "place": injection.place,
        "amplitude": amplitude,
        "amplitude_over_mda": size,
        "true_parameters": {injection.parameter: injection.value(machine, amplitude)},
        "shape": dict(shape),
    }
    told = {
        "effects": [effect],
        "rivals": rivals,
        "closest_rival": rivals[0] if rivals else None,
        "orders": [shape["order"]] if "order" in shape else [],
        "depends_on": list(injection.depends_on),
        "memory": injection.memory,
    }
    return changed, bare(machine, ("single", "semi_synthetic")) | told


def bare(machine: Machine, kind: tuple[str, ...]) -> dict[str, Any]:
    """A label without effect; what is not known of a real machine is left open."""
    return {
        "kind": list(kind),
        "effects": [],
        "rivals": [],
        "closest_rival": None,
        "separable_place": False,
        "windows": [],
        "orders": [],
        "depends_on": [],
        "memory": "none",
        "nuisance": [],
        "baseline_true": {},
        "motor_only": all("load_angle" not in one.columns for one in machine.recordings),
    }


def write(folder: Path, machine: Machine, recordings: Sequence[Recorded], rng: Generator) -> None:
    """A case folder; file names tell nothing."""
    folder.mkdir(parents=True)
    listed = []
    for one in recordings:
        name = f"{rng.integers(0, 2**32):08x}.npz"
        np.savez_compressed(folder / name, **one.columns)  # type: ignore[arg-type]
        listed.append({"file": name, "role": one.role, "group": one.group, "started_at_s": one.started_at_s})
    files.write_text(folder / "campaign.toml", dump({**machine.sections, "recording": listed}))
