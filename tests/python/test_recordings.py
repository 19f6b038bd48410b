"""Recordings: columns by name, scales, missing samples, three kinds of file, campaign files."""

from __future__ import annotations

import numpy as np
import pytest
from hdfast import Scenario
from hdfast.errors import ConfigError, InputError
from hdfast.recordings import Recording, gather, load, load_campaign, save

T = np.linspace(0.0, 1.0, 101)


def recording():
    return Recording("run", {"t": T, "motor_angle": 3.0 * T, "motor_torque": 0.0 * T})


@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz"])
def test_exact_every_kind_of_file_returns_what_was_saved(suffix, tmp_path):
    save(recording(), tmp_path / f"run.{suffix}")
    found = load(tmp_path / f"run.{suffix}")
    assert list(found) == ["t", "motor_angle", "motor_torque"]
    for name, values in recording().items():
        np.testing.assert_array_equal(found[name], values)


def test_exact_names_and_scales_are_mapped(tmp_path):
    (tmp_path / "run.csv").write_text("# rig 7\nt,enc,extra\n" + "".join(f"{x},{100 * x},1\n" for x in T))
    found = load(tmp_path / "run.csv", {"motor_angle": {"name": "enc", "scale": -0.01}})
    np.testing.assert_allclose(found["motor_angle"], -T)
    assert found.notes == ("columns left out: extra",)


def test_exact_missing_samples_are_masked_and_noted():
    angle = np.where(np.arange(101) % 10 == 3, np.nan, 3.0 * T)
    time = T.copy()
    time[50] = np.nan
    [found] = gather({"t": time, "motor_angle": angle})
    t, motor = found.need("a test", "t", "motor_angle")
    assert len(t) == len(motor) == 90
    assert "1 samples without time left out" in found.notes


def test_exact_missing_columns_are_named_with_unit_and_purpose():
    with pytest.raises(InputError, match=r"a stiffness test needs load_angle \[rad\], load_torque \[N m\]"):
        recording().need("a stiffness test", "load_angle", "load_torque")


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({"motor_angel": "x"}, "did you mean 'motor_angle'"),
        ({"motor_angle": {"name": "x", "gain": 2.0}}, "gain"),
        ({"motor_angle": {"name": "enc", "scale": 0.0}}, "scale = 0"),
        ({"motor_angle": "enc2"}, "no column 'enc2' for motor_angle"),
    ],
)
def test_exact_wrong_maps_are_named(columns, text):
    with pytest.raises(InputError, match=text):
        gather({"t": T, "enc": T}, columns)


def test_exact_time_must_run_forward():
    with pytest.raises(InputError, match="must strictly increase"):
        Recording("run", {"t": np.zeros(20)})


def test_exact_a_recording_is_replayed():
    scenario = Scenario.replay(recording())
    assert scenario.t_end == 1.0


def test_exact_campaign_reads_recordings_columns_and_sensors(tmp_path):
    save(recording(), tmp_path / "run.parquet")
    text = '[sensors]\nmotor_angle = { resolution = 4.8e-5 }\n[[recording]]\nfile = "run.parquet"\nrole = "fit"\n'
    (tmp_path / "c.toml").write_text(text)
    campaign = load_campaign(tmp_path / "c.toml")
    assert campaign.recordings[0].resolution == {"motor_angle": 4.8e-5}
    (tmp_path / "c.toml").write_text(text + "rolle = 1\n")
    with pytest.raises(ConfigError, match=r"line 6.*did you mean 'role'"):
        load_campaign(tmp_path / "c.toml")
