"""What sensors and actuators do: a low-pass that a recorder's channels share, a zero that drifts, a late torque."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import small_campaign
from hdfast.diagnosis import diagnose, session
from hdfast.diagnosis.accept import of_its_own, own_gain
from hdfast.diagnosis.left_out import groups
from hdfast.recordings import load_campaign
from scipy.signal import lsim, savgol_filter

LAG = 5e-3


def logged(path):
    """The recordings of a campaign behind a filter of first order, solved by SciPy."""
    for one in path.parent.glob("r*.npz"):
        columns = dict(np.load(one))
        for name in ("motor_angle", "load_angle", "motor_torque"):
            late = lsim(([1.0], [LAG, 1.0]), columns[name] - columns[name][0], columns["t"])[1]
            columns[name] = columns[name][0] + late
        np.savez(one, **columns)
    return path


def test_against_scipy_a_low_pass_that_all_sensors_share_is_named(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch, ("sensor_lowpass", "sensor_delay", "coulomb_friction"))
    path = logged(small_campaign.write(tmp_path))
    found = diagnose(path)
    assert [one["effect"] for one in found.content["effects"]] == ["sensor_lowpass"]
    assert found.verdict == "sensor"
    fitted = found.evidence.session.search.final
    assert fitted.value("motor_angle_sensor_lowpass_tau_s") == pytest.approx(LAG, rel=0.1)
    assert fitted.value("load_angle_sensor_lowpass_tau_s") == pytest.approx(LAG, rel=0.1)

    (tmp_path / "again.toml").write_text(found.model)
    again = load_campaign(tmp_path / "again.toml")
    reread = session.baseline(replace(again, recordings=load_campaign(path).recordings), 0.05, 0.002)
    assert set(reread.sensors) == set(fitted.structure.sensors)
    assert reread.fixed["load_angle_sensor_lowpass_tau_s"] == pytest.approx(LAG, rel=0.1)


@pytest.mark.long
def test_against_scipy_a_declared_low_pass_of_all_sensors_is_no_mismatch(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch, ("sensor_lowpass", "sensor_delay", "coulomb_friction"))
    path = logged(small_campaign.write(tmp_path))
    corner = 1.0 / (2.0 * np.pi * LAG)
    text = path.read_text()
    for name in ("motor_angle", "load_angle", "motor_torque"):
        text = text.replace(f"{name} = {{ ", f"{name} = {{ lowpass_hz = {corner!r}, ")
    path.write_text(text)
    assert diagnose(path).verdict == "no_evidence"


@pytest.mark.long
def test_exact_noise_of_the_angle_is_no_low_pass(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch, ("sensor_lowpass", "sensor_delay", "coulomb_friction"))
    path = small_campaign.write(tmp_path, angle_noise=5e-6)
    found = diagnose(path)
    screened = found.evidence.session.search.rounds[0].screen
    assert found.verdict == "no_evidence"
    assert all(screened.p[label] > 0.05 for label in screened.p if "sensor_lowpass" in label)


def test_exact_a_fast_drift_of_the_torques_zero_is_named(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch, ("sensor_offset_drift", "coulomb_friction", "thermal_viscous"))
    path = small_campaign.write(tmp_path)
    runs = {one: dict(np.load(one)) for one in path.parent.glob("r*.npz")}
    drift = 0.6 * max(float(np.std(columns["motor_torque"])) for columns in runs.values())
    for one, columns in runs.items():
        np.savez(one, **columns | {"motor_torque": columns["motor_torque"] + drift * columns["t"]})
    found = diagnose(path)
    assert found.verdict == "sensor"
    (effect,) = found.content["effects"]
    assert effect["evidence"]["shape"] == "on motor_torque"
    assert effect["parameters"]["drift"]["value"] == pytest.approx(drift, rel=0.1)


def test_exact_a_late_actuator_has_to_gain_beside_what_a_refit_with_it_moves(tmp_path, monkeypatch):
    """A recorded torque ahead of the drive's by a lag; then the same fit with hardly any lag left in it."""
    small_campaign.shorten_library(monkeypatch, ("actuator_lag", "coulomb_friction"))
    path = small_campaign.write(tmp_path)
    for one in path.parent.glob("r*.npz"):
        columns = dict(np.load(one))
        smooth = savgol_filter(columns["motor_torque"], 15, 3, deriv=1, delta=0.002)
        np.savez(one, **columns | {"motor_torque": columns["motor_torque"] + LAG * smooth})
    found = diagnose(path)
    assert [one["effect"] for one in found.content["effects"]] == ["actuator_lag"]
    seen = found.evidence.session.search.rounds[0]
    replay, joint = found.evidence.session.replay.commanded(seen.before), seen.accepted.fit
    folds = groups(replay.plant, replay.layout)
    gained, candidate = seen.accepted.gain, seen.accepted.candidate
    assert of_its_own(candidate, own_gain(replay, joint, seen.before, folds), gained)
    moved = joint.coordinates.copy()
    moved[joint.structure.names.index("actuator_lag_tau_e")] = np.log(1e-6)
    none = replace(joint, coordinates=moved, mismatch=replay.mismatch(joint.structure, moved[None])[0])
    assert not of_its_own(candidate, own_gain(replay, none, seen.before, folds), gained)
