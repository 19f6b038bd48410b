from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from hdfast.diagnosis import diagnose
from hdfast.health import check
from hdfast.recordings import load, load_campaign

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "concealed-friction"
MADE = runpy.run_path(str(ROOT / "tools" / "concealed_example.py"))


def test_exact_example_is_small_and_healthy():
    campaign = load_campaign(FOLDER / "campaign.toml")
    assert [one.role for one in campaign.recordings] == ["fit"] * 4 + ["heldout"] * 2
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 1.5e6
    health = check(campaign)
    assert health.usable
    assert not health.rejected


def test_exact_nominal_values_are_off_within_their_tolerance():
    for name, (value, sigma) in MADE["NOMINAL"].items():
        assert 0.0 < abs(np.log(MADE["TRUE"][name] / value)) < sigma


def test_regress_the_tool_makes_the_recordings_of_the_example(tmp_path):
    MADE["main"](tmp_path)
    assert (tmp_path / "campaign.toml").read_text() == (FOLDER / "campaign.toml").read_text()
    steps = {"motor_angle": MADE["ENCODER"], "load_angle": MADE["LOAD_ENCODER"], "motor_torque": MADE["CURRENT"]}
    for path in sorted(FOLDER.glob("*.parquet")):
        shipped, made = load(path), load(tmp_path / path.name)
        for channel, step in steps.items():
            np.testing.assert_allclose(made[channel], shipped[channel], atol=1.01 * step)


@pytest.mark.long
def test_against_the_truth_both_concealed_frictions_are_named(tmp_path):
    found = diagnose(FOLDER / "campaign.toml")
    assert found.verdict == "found"
    named = {effect["effect"]: effect["parameters"] for effect in found.effects}
    assert set(named) == set(MADE["FRICTION"])
    for effect, parameters in MADE["FRICTION"].items():
        for name, value in parameters.items():
            sigma = named[effect][name]["sigma"]
            assert named[effect][name]["value"] == pytest.approx(value, rel=0.15, abs=2.0 * sigma)
    held = found.content["fit"]["heldout"]
    assert held["extended_nrmse"] < 1.2 * held["noise_floor_nrmse"] < 0.3 * held["baseline_nrmse"]
    assert {"B_m", "B_ml"} <= {row["parameter"] for row in found.content["masking"]}
    assert found.report(tmp_path).stat().st_size < 4e6
