"""Diagnoses of simulated drives: the name is right, or nothing is said; and the same bytes every time."""

from __future__ import annotations

import json
from pathlib import Path

import diagnosed
import hdfast
import numpy as np
import pytest

EFFECTS = {
    "coulomb_friction": {"T_c": 0.03},
    "gravity_unbalance": {"T_gravity": 4.0},
    "load_dependent_friction": {"c_drive": 0.2, "c_back": 0.2},
}


def test_regress_nothing_is_found_in_a_complete_model(tmp_path: Path) -> None:
    found = hdfast.diagnose(diagnosed.write(tmp_path))
    assert found.verdict == "no_evidence"
    assert found.effects == []


@pytest.mark.parametrize("effect", EFFECTS)
def test_regress_a_single_effect_is_named_with_its_size(tmp_path: Path, effect: str) -> None:
    found = hdfast.diagnose(diagnosed.write(tmp_path, [effect], EFFECTS[effect], seed=1))
    assert found.verdict == "found"
    assert [one["effect"] for one in found.effects] == [effect]
    estimated = found.effects[0]["parameters"]
    for name, value in EFFECTS[effect].items():
        assert estimated[name]["value"] == pytest.approx(value, rel=0.1)
    errors = found.to_dict()["fit"]["heldout"]
    assert errors["extended_nrmse"] < 0.5 * errors["baseline_nrmse"]


def test_regress_friction_is_named_from_the_motor_side_alone(tmp_path: Path) -> None:
    file = diagnosed.write(tmp_path, ["coulomb_friction"], EFFECTS["coulomb_friction"], seed=2, motor_only=True)
    found = hdfast.diagnose(file)
    assert [one["effect"] for one in found.effects] == ["coulomb_friction"]
    reasons = {one["effect"]: one["reason"] for one in found.to_dict()["not_showable"]}
    assert "load angle" in reasons["backlash"]


def test_exact_same_bytes_on_any_number_of_threads(tmp_path: Path) -> None:
    file = diagnosed.write(tmp_path / "campaign", ["coulomb_friction"], EFFECTS["coulomb_friction"])
    for threads in (1, 2):
        hdfast.diagnose(file, threads=threads).report(tmp_path / str(threads))
    for name in ("verdict.json", "report.html", "extended_model.toml"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes(), name


def test_exact_rejected_recordings_give_the_reason(tmp_path: Path) -> None:
    file = diagnosed.write(tmp_path)
    for run in tmp_path.glob("*.npz"):
        columns = dict(np.load(run))
        columns["motor_angle"] = np.zeros_like(columns["t"])
        np.savez(run, **columns)
    found = hdfast.diagnose(file)
    assert found.verdict == "data_rejected"
    assert "run0.npz" in found.to_dict()["sentence"]
    json.dumps(found.to_dict(), allow_nan=False)
