"""Write a case as a user would have it: `campaign.toml` and recordings."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.random import Generator

from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.programme import Run
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.sensors import CHANNELS
from hdfast.proof.generator.stepping import STEP

CAMPAIGN = "campaign.toml"


def write_case(
    folder: Path,
    rig: Rig,
    names: list[str],
    recordings: list[dict[str, Array]],
    noise: dict[str, float],
    rng: Generator,
) -> str:
    """Write campaign and recordings, and return the files' suffix; format and columns are drawn and tell nothing."""
    folder.mkdir(parents=True, exist_ok=False)
    suffix = str(rng.choice(["csv", "npz", "parquet"]))
    columns: dict[str, dict[str, Any]] = {}
    if rng.random() < 0.4:
        columns["motor_angle"] = {"name": "enc_m", "scale": rig.chain.resolution[0]}
    if rng.random() < 0.5:
        columns["motor_torque"] = {"name": "i_q", "scale": float(np.round(rng.uniform(0.05, 0.3), 4))}
    columns.setdefault("motor_torque", {"name": "motor_torque", "scale": 1.0})["sigma"] = round(rig.torque_sigma, 4)
    listed = [f"{name}.{suffix}" for name in names]
    for name, recording in zip(listed, recordings, strict=True):
        _write(folder / name, _as_stated(recording, columns))
    (folder / CAMPAIGN).write_text(_campaign(rig, listed, columns, noise, rng), encoding="utf-8")
    return f".{suffix}"


def add_recording(folder: Path, name: str, run: Run, recording: dict[str, Array]) -> None:
    """One more recording of a written case, with the format and the columns of the others."""
    text = (folder / CAMPAIGN).read_text(encoding="utf-8")
    stated = tomllib.loads(text)
    file = f"{name}{Path(stated['recording'][0]['file']).suffix}"
    _write(folder / file, _as_stated(recording, stated["columns"]))
    (folder / CAMPAIGN).write_text(text + "\n".join([*_entry(file, run), ""]), encoding="utf-8")


def _as_stated(recording: dict[str, Array], columns: dict[str, dict[str, Any]]) -> dict[str, Array]:
    """A recording by the names and in the units that the campaign states."""
    entries = {standard: columns.get(standard, {}) for standard in recording}
    return {
        entry.get("name", standard): recording[standard] / entry.get("scale", 1.0)
        for standard, entry in entries.items()
    }


def _write(path: Path, table: dict[str, Array]) -> None:
    if path.suffix == ".npz":
        np.savez_compressed(path, **table)  # type: ignore[arg-type]
    elif path.suffix == ".parquet":
        pq.write_table(pa.table(table), path)
    else:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(table)
            writer.writerows(zip(*([f"{x:.10g}" for x in values] for values in table.values()), strict=True))


def _campaign(
    rig: Rig, names: list[str], columns: dict[str, dict[str, Any]], noise: dict[str, float], rng: Generator
) -> str:
    lines = ["[drive]", f"ratio = {rig.plant.ratio:g}"]
    for name, value in rig.nominal.items():
        if name != "T_c":
            lines.append(f"{name} = {{ value = {value:.6g}, sigma = {rig.sigma[name]:.3g} }}")
    lines += ["B_ml = 0.0", "s = 0", "k5 = 0.0", f"phi_max = {rig.windup_range:.4g}"]
    error = rig.nominal_error
    lines += [
        "",
        "[kinematic_error]",
        f"orders = {_list(error['orders'])}",
        f"cos = {_list(error['cos'])}",
        f"sin = {_list(error['sin'])}",
        f"sigma = {rig.error_sigma:.3g}",
    ]
    if "T_c" in rig.nominal:
        lines += [
            "",
            "[[terms]]",
            'effect = "coulomb_friction"',
            f"parameters = {{ T_c = {{ value = {rig.nominal['T_c']:.6g}, sigma = {rig.sigma['T_c']:.3g} }} }}",
        ]
    c = rig.controller
    if rig.declared != "absent":
        lines += ["", "[controller]", 'kind = "pi"', f"kp = {c.kp:.6g}", f"ki = {c.ki:.6g}"]
        if rig.declared == "correct":
            lines += [f"limit = {c.limit:.6g}", f"period = {c.samples * STEP:g}"]
    lines += ["", "[sensors]"]
    shown = measured(rig)
    for name, step in zip(CHANNELS, rig.chain.resolution, strict=True):
        if name in shown:
            stated = noise[name] * rng.uniform(0.8, 1.25)
            parts = [f"resolution = {step:.6g}"] if step > 0 else []
            parts += [f"noise = {stated:.3g}", f"averaged = {str(rig.chain.averaged).lower()}"]
            lines.append(f"{name} = {{ {', '.join(parts)} }}")
    lines += ["", "[columns]"]
    for standard, entry in columns.items():
        parts = [f'name = "{entry["name"]}"', f"scale = {entry['scale']:.10g}"]
        if "sigma" in entry:
            parts.append(f"sigma = {entry['sigma']:g}")
        lines.append(f"{standard} = {{ {', '.join(parts)} }}")
    for name, run in zip(names, rig.runs, strict=True):
        lines += _entry(name, run)
    return "\n".join(lines) + "\n"


def _entry(name: str, run: Run) -> list[str]:
    return [
        "",
        "[[recording]]",
        f'file = "{name}"',
        f'role = "{run.role}"',
        f'group = "{run.group}"',
        f"started_at_s = {run.started_at:.1f}",
    ]


def measured(rig: Rig) -> tuple[str, ...]:
    """Measured channels of a rig."""
    shown = ["motor_angle", "motor_torque"]
    if not rig.motor_only:
        shown.append("load_angle")
    if rig.has_output_torque:
        shown.append("output_torque")
    return tuple(shown)


def _list(values: list[float]) -> str:
    return "[" + ", ".join(f"{v:.6g}" for v in values) + "]"
