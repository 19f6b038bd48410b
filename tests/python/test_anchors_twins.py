"""Simulated counterparts of the recordings: the effect is gone, all else is as recorded; the bench of the article."""

from __future__ import annotations

import numpy as np
import pytest
from anchors import article, emps, tx40, ur10e
from anchors.expected import EXPECTED
from anchors.oracle import error, fitted, low_pass, motion, read_folder
from anchors.twin import twin
from hdfast.recordings import load_campaign

RIGID_ANCHORS = {"ur10e_j2": 10.0, "ur10e_j4": 10.0, "tx40": 20.0, "emps": 60.0}


def worth_of_friction_and_gravity(campaign, corner: float) -> float:
    """Error with dry friction and gravity over the error without, in the slow part of the torque held out."""
    sections, records = read_folder(campaign)
    columns, torque = [], []
    for record in records:
        speed, acceleration = motion(record, corner)
        load = record["motor_angle"] / sections["drive"]["ratio"]
        sign = np.tanh(speed / (0.02 * np.abs(speed).max()))
        columns.append([acceleration, speed, np.ones_like(speed), sign, np.sin(load), np.cos(load)])
        torque.append(low_pass(record["motor_torque"], record["t"], corner))
    without, with_both = (
        error(columns[1][:size], fitted(columns[0][:size], torque[0]), torque[1]) for size in (3, len(columns[0]))
    )
    return with_both / without


@pytest.mark.parametrize("name", RIGID_ANCHORS)
def test_exact_twin_has_no_dry_friction_and_no_gravity(tmp_path, name):
    corner = RIGID_ANCHORS[name]
    real = EXPECTED[name].write(tmp_path / "real")
    false = twin(real, tmp_path / "twin", 3, corner)
    assert worth_of_friction_and_gravity(real, corner) < 0.7
    assert worth_of_friction_and_gravity(false, corner) > 0.9


def test_exact_twin_repeats_with_its_seed_and_keeps_clock_and_campaign(tmp_path):
    real = ur10e.write(tmp_path / "real", 4)
    first, again, other = (twin(real, tmp_path / name, seed, 10.0) for name, seed in (("a", 1), ("b", 1), ("c", 2)))
    assert first.read_bytes() == real.read_bytes()
    for one, two, three, origin in zip(*(read_folder(path)[1] for path in (first, again, other, real)), strict=True):
        np.testing.assert_array_equal(one["t"], origin["t"])
        np.testing.assert_array_equal(one["motor_torque"], two["motor_torque"])
        assert not np.array_equal(one["motor_torque"], three["motor_torque"])


def test_exact_twin_noise_has_the_spectrum_of_the_residual(tmp_path):
    real = tx40.write(tmp_path / "real")
    false = twin(real, tmp_path / "twin", 5, 20.0)
    high = []
    for path in (real, false):
        _, (record, _) = read_folder(path)
        spectrum = np.abs(np.fft.rfft(record["motor_torque"])) ** 2
        frequency = np.fft.rfftfreq(len(record["t"]), 1e-3)
        high.append([spectrum[(frequency > low) & (frequency < 2 * low)].sum() for low in (50.0, 100.0, 200.0)])
    np.testing.assert_allclose(high[1], high[0], rtol=0.3)


def test_exact_closed_loop_twin_follows_its_reference(tmp_path):
    real = emps.write(tmp_path / "real")
    false = twin(real, tmp_path / "twin", 3, 60.0)
    for record, simulated in zip(*(read_folder(path)[1] for path in (real, false)), strict=True):
        rest = record["motor_angle"] - simulated["motor_angle"]
        assert np.abs(rest).max() < 2e-3 * np.ptp(record["motor_angle"])


@pytest.mark.parametrize("speed", article.SPEEDS_RPM)
def test_against_the_article_start_is_slower_and_stop_sooner_with_friction(speed):
    times = {}
    for friction in ("none", "stribeck"):
        trajectory = article.run(speed, friction)
        full = speed * 2.0 * np.pi / 60.0
        omega, t = trajectory["omega_m"], trajectory.t
        coast = t > article.T_OFF
        times[friction] = t[np.argmax(omega > 0.9 * full)], t[coast][np.argmax(omega[coast] < 0.05 * full)]
    assert times["stribeck"][0] > 1.2 * times["none"][0]
    assert times["stribeck"][1] - article.T_OFF < 0.3 * (times["none"][1] - article.T_OFF)


def test_against_the_article_recording_lacks_the_high_frequency_part(tmp_path):
    _, records = read_folder(article.write(tmp_path))
    slow = next(record for record in records if record.name == "100rpm_0.npz")
    trajectory = article.run(100.0, "stribeck")
    amplitudes = []
    for t, angle, load in (
        (slow["t"], slow["motor_angle"], slow["load_angle"]),
        (trajectory.t, trajectory["theta_m"], trajectory["theta_l"]),
    ):
        steady = (t > 1.0) & (t < 2.9)
        error = (angle / 121.0 - load)[steady]
        frequency = np.fft.rfftfreq(steady.sum(), t[1] - t[0])
        spectrum = np.abs(np.fft.rfft((error - error.mean()) * np.hanning(steady.sum()))) / steady.sum()
        amplitudes.append(np.sqrt(np.sum(spectrum[(frequency > 20.0) & (frequency < 45.0)] ** 2)))
    assert amplitudes[0] < 0.8 * amplitudes[1]


@pytest.mark.parametrize("name", EXPECTED)
def test_exact_every_anchor_and_its_twin_is_a_campaign(tmp_path, name):
    real = EXPECTED[name].write(tmp_path / "real")
    false = EXPECTED[name].control(real, tmp_path / "twin", 1)
    for path in (real, false):
        campaign = load_campaign(path)
        assert {item.role for item in campaign.recordings} == {"fit", "heldout"}
        assert all({"motor_angle", "motor_torque"} <= set(item) for item in campaign.recordings)
