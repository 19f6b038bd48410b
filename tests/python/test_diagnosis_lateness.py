"""Delays as a campaign states them: what all channels share is none, the motor's own shifts its angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import simulated_recordings as simulated
import small_campaign
from hdfast.diagnosis import diagnose
from hdfast.diagnosis.band import Band
from hdfast.diagnosis.baseline import baseline
from hdfast.diagnosis.extended import extended_model
from hdfast.diagnosis.lateness import lateness, neglected, on_time
from hdfast.diagnosis.prepare import MARGIN, prepare
from hdfast.diagnosis.session import nominal, set_up_usable
from hdfast.diagnosis.shapes import in_sensor, positive
from hdfast.diagnosis.source import Source
from hdfast.errors import InputError
from hdfast.recordings import load_campaign
from hdfast.recordings.columns import read_column_map

PERIOD = 2e-3
COLUMNS = {name: np.arange(100.0) for name in ("t", "motor_angle", "motor_torque", "load_angle")}
DELAYED = '\n[[terms]]\neffect = "sensor_delay"\nchannel = "{}"\nparameters = {{ tau_y = {} }}\n'
DELAYED_ANGLE = simulated.TEXT + "[sensors]\nmotor_angle = { delay_s = 4e-3 }\n"


def source(recording):
    return Source("r", recording, "fit", "A", np.ones(len(recording["t"]), dtype=bool))


def late(sensors="", terms=""):
    campaign = simulated.campaign([COLUMNS], simulated.TEXT + sensors + terms)
    return {name: round(1e3 * value, 9) for name, value in lateness(campaign, PERIOD).items()}


def test_exact_what_all_channels_share_is_no_delay():
    every = "".join(f"{name} = {{ delay_s = 4e-3 }}\n" for name in ("motor_angle", "motor_torque", "load_angle"))
    assert set(late("[sensors]\n" + every).values()) == {0.0}
    assert set(late().values()) == {0.0}


def test_exact_the_motors_delay_is_ahead_of_the_others():
    assert late("[sensors]\nmotor_angle = { delay_s = 4e-3 }\n") == {
        "motor_angle": 4.0,
        "motor_torque": 0.0,
        "load_angle": 0.0,
    }
    assert late(terms=DELAYED.format("motor_angle", 4e-3))["motor_angle"] == 4.0


def test_exact_a_mean_is_half_an_interval_late():
    mean = "{} = {{ averaged = true }}\n"
    assert late("[sensors]\n" + mean.format("load_angle"))["load_angle"] == 1.0
    both = late("[sensors]\n" + mean.format("load_angle") + mean.format("motor_angle"))
    assert set(both.values()) == {0.0}
    assert late("[sensors]\n" + mean.format("motor_angle")) == {
        "motor_angle": 1.0,
        "motor_torque": 1.0,
        "load_angle": 0.0,
    }


def test_exact_a_late_angle_is_read_earlier():
    t = np.arange(2000) / 1000.0
    recording = {"t": t, "motor_angle": np.where(t == 1.0, np.nan, np.sin(5.0 * (t - 4e-3)))}
    campaign = simulated.campaign([recording | {"motor_torque": t}], DELAYED_ANGLE)
    (found,) = on_time(campaign, [source(recording)])
    inside = (t < 1.99) & (t != 1.0)
    np.testing.assert_allclose(found.recording["motor_angle"][inside], np.sin(5.0 * t[inside]), atol=1e-4)
    assert np.isnan(found.recording["motor_angle"][t == 1.0])
    assert np.isnan(found.recording["motor_angle"][t > t[-1] - 4e-3 + 1e-9]).all()


@pytest.mark.parametrize(("all_late", "own"), [(0.0, 30e-3), (4e-3, 30e-3), (30e-3, 30e-3), (4e-3, 0.0)])
def test_exact_a_late_load_torque_is_read_with_the_motion_it_acted_on(all_late, own):
    t = np.arange(2000) / 1000.0
    recording = {name: np.sin(5.0 * (t - all_late)) for name in ("motor_angle", "motor_torque")}
    recording |= {"t": t, "load_torque": np.sin(5.0 * (t - own))}
    late = {"motor_angle": all_late, "motor_torque": all_late, "load_torque": own}
    facts = "".join(f"{name} = {{ delay_s = {delay} }}\n" for name, delay in late.items())
    campaign = simulated.campaign([recording], f"{simulated.TEXT}[sensors]\n{facts}")
    (found,) = on_time(campaign, [source(recording)])
    inside = slice(40, -40)
    told = [found.recording[name][inside] for name in ("load_torque", "motor_angle")]
    np.testing.assert_allclose(*told, atol=1e-4)
    assert not baseline(campaign, 0.1, 1e-3).sensors


@pytest.mark.parametrize(
    ("stated", "named"),
    [
        ("[sensors]\nload_torque = { delay_s = 4e-3, noise = 0.1 }\n", None),
        ("[sensors]\nload_torque = { lowpass_hz = 3 }\n", "lowpass_hz not"),
        ("[sensors]\nload_torque = { lowpass_hz = 3, averaged = true }\n", "lowpass_hz and averaged not"),
        ('[[terms]]\neffect = "sensor_lowpass"\nchannel = "load_torque"\n', "sensor_lowpass not"),
    ],
)
def test_exact_what_is_not_used_of_the_load_torques_sensor_is_told(stated, named):
    told = neglected(simulated.campaign([COLUMNS | {"load_torque": COLUMNS["t"]}], f"{simulated.TEXT}{stated}"))
    assert not told if named is None else named in told[0]
    assert not neglected(simulated.campaign([COLUMNS], f"{simulated.TEXT}{stated}"))


def test_exact_a_scale_that_is_not_fitted_is_told_where_its_error_is_stated():
    stated = read_column_map({name: {"sigma": 0.1} for name in ("motor_torque", "load_torque")})
    for columns, told in ((COLUMNS | {"load_torque": COLUMNS["t"]}, ["columns.load_torque.sigma"]), (COLUMNS, [])):
        campaign = replace(simulated.campaign([columns]), columns=stated)
        assert [one.partition(" ")[0] for one in neglected(campaign)] == told


@pytest.mark.parametrize("late", [0.0, 20e-3])
def test_exact_where_a_late_angle_has_no_number_of_its_own_nothing_is_judged(late):
    """A motion that goes on at a steady speed would stop dead at the end."""
    t = np.arange(2000) / 1000.0
    recording = {"t": t, "motor_angle": 50.0 * (t - late), "motor_torque": np.sin(20.0 * t)}
    campaign = simulated.campaign([recording], f"{simulated.TEXT}[sensors]\nmotor_angle = {{ delay_s = {late} }}\n")
    (one,) = on_time(campaign, [source(recording)])
    band = Band(500.0, 50.0, 200.0)
    unit = prepare(one, band, 121.0)
    judged = unit.judged["motor_torque"]
    np.testing.assert_allclose(unit.speed[judged], 50.0, rtol=1e-3)
    assert unit.t[judged][-1] == pytest.approx(t[-1] - late - MARGIN / band.motion, abs=4e-3)


def test_exact_a_delay_as_long_as_the_recording_is_refused_with_its_unit():
    t = np.arange(2000) / 1000.0
    recording = dict.fromkeys(("t", "motor_angle", "motor_torque"), t)
    campaign = simulated.campaign([recording], f"{simulated.TEXT}[sensors]\nmotor_angle = {{ delay_s = 4 }}\n")
    with pytest.raises(InputError, match=r"^r: motor_angle is stated to be 4 s later .* 2 s; delays are in seconds$"):
        on_time(campaign, [source(recording)])


@pytest.mark.parametrize("averaged", ["load_angle", "motor_angle"])
def test_exact_means_over_different_intervals_are_as_late_as_those_of_the_slowest_recording(averaged):
    """What the motor angle runs ahead of the load's is the same in a fast and in a slow recording."""
    recordings = []
    for step in (1e-3, 1e-2):
        t = np.arange(0.0, 4.0, step)
        columns = {name: np.sin(5.0 * (t - (0.5 * step if name == averaged else 0.0))) for name in COLUMNS}
        recordings.append(columns | {"t": t})
    text = simulated.TEXT + f"[sensors]\n{averaged} = {{ averaged = true }}\n"
    campaign = simulated.campaign(recordings, text)
    delay = lateness(campaign, 1e-2)["load_angle"]
    for one in on_time(campaign, [source(recording) for recording in recordings]):
        t, inside = one.recording["t"], slice(20, -20)
        ahead = np.sin(5.0 * (t - delay)) - one.recording["load_angle"]
        angle = np.sin(5.0 * t) - one.recording["motor_angle"]
        np.testing.assert_allclose(angle[inside], 0.0, atol=4e-4)
        np.testing.assert_allclose(ahead[inside], 0.0, atol=4e-4)


@pytest.mark.long
def test_exact_a_declared_delay_is_fitted_within_its_sigma_and_kept_in_the_model(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch, ("sensor_delay", "coulomb_friction"))
    path = small_campaign.write(tmp_path)
    for one in path.parent.glob("r*.npz"):
        columns = dict(np.load(one))
        for name in ("motor_angle", "load_angle"):
            columns[name] = np.interp(columns["t"] - 4e-3, columns["t"], columns[name])
        np.savez(one, **columns)
    text = path.read_text()
    path.write_text(
        text + DELAYED.format("motor_angle", 4e-3) + DELAYED.format("load_angle", "{ value = 7e-3, sigma = 0.5 }")
    )
    found = diagnose(path)
    assert found.verdict == "no_evidence"
    (tmp_path / "again.toml").write_text(found.model)
    again = load_campaign(tmp_path / "again.toml").drive.effects
    assert {one.channel: one.values["tau_y"] for one in again if one.effect == "sensor_delay"} == pytest.approx(
        {"motor_angle": 4e-3, "load_angle": 4e-3}, rel=0.1
    )
    reread = baseline(
        replace(load_campaign(tmp_path / "again.toml"), recordings=load_campaign(path).recordings), 0.05, PERIOD
    )
    assert ("sensor_delay", "motor_angle") not in reread.sensors


@pytest.mark.parametrize("stated", ["delay_s = 4e-3", "averaged = true"])
def test_exact_a_fitted_delay_is_read_back_beside_what_is_stated(tmp_path, stated):
    """Of a sensor as late as all others, and of means that are later than they were taken to be."""
    path = small_campaign.write(tmp_path)
    text = path.read_text().replace("load_angle = { ", f"load_angle = {{ {stated}, ")
    if stated.startswith("delay_s"):
        text = text.replace("motor_angle = { ", f"motor_angle = {{ {stated}, ")
        text = text.replace("motor_torque = { ", f"motor_torque = {{ {stated}, ")
    path.write_text(text)
    setup = set_up_usable(load_campaign(path), None)
    structure = nominal(setup)
    if "load_angle_sensor_delay_tau_y" not in structure.names:
        structure = in_sensor("sensor_delay", "load_angle", [positive("tau_y", 1e-3, "s")]).added_to(structure)
    later = structure.start + np.log(1.4) * (np.array(structure.names) == "load_angle_sensor_delay_tau_y")
    values = {name: float(value) for name, value in structure.values(later).items()}
    (tmp_path / "again.toml").write_text(
        extended_model(load_campaign(path), structure, values, dict.fromkeys(values, 1e-3))
    )
    again = replace(load_campaign(tmp_path / "again.toml"), recordings=load_campaign(path).recordings)
    reread = set_up_usable(again, None)
    fitted = setup.replay.mismatch(structure, later[None])
    told = nominal(reread)
    np.testing.assert_allclose(reread.replay.mismatch(told, told.start[None]), fitted, rtol=0.0, atol=1e-9)
    assert np.max(np.abs(fitted - setup.replay.mismatch(structure, structure.start[None]))) > 1e-5
