"""Effects put into recordings: what is put in is known exactly, the rest of the recording stays."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import small_campaign
from hdfast.errors import InputError
from hdfast.health import leakage
from hdfast.proof.bridge import cases, controls
from hdfast.proof.bridge.detectable import detectable
from hdfast.proof.bridge.injections import INJECTIONS
from hdfast.proof.bridge.machine import Machine, Recorded, calibrated
from hdfast.proof.folders import Folders
from hdfast.proof.generator.effects import EFFECTS
from hdfast.proof.score import Answer
from hdfast.proof.score.judge import judge
from hdfast.recordings import load_campaign
from hdfast.terms import terms

RATE, RATIO, NOISE = 500.0, 100.0, 0.01
BARE = ("t", "motor_angle", "motor_torque")
SECTIONS = {
    "title": "recorded drive",
    "drive": {"base": "one_inertia", "ratio": RATIO, "J_m": {"value": 1e-4, "sigma": 0.05}, "B_m": 1e-4},
    "kinematic_error": {"orders": [], "cos": [], "sin": []},
    "terms": [{"effect": "coulomb_friction", "parameters": {"T_c": {"value": 0.05, "sigma": 0.1}}}],
    "columns": {"motor_torque": {"name": "motor_torque", "scale": 1.0, "sigma": 0.05}},
}


def recorded(seed, role):
    rng = np.random.default_rng(seed)
    t = np.arange(4000) / RATE
    angle = 30.0 * t + 40.0 * np.sin(1.3 * t + seed) + 3.0 * np.cos(4.1 * t)
    speed, rest = np.gradient(angle, t), NOISE * rng.standard_normal(len(t))
    acceleration = np.gradient(speed, t)
    columns = {
        "t": t,
        "motor_angle": angle,
        "motor_torque": 1e-4 * acceleration + 1e-3 * speed + 0.05 * np.sign(speed) + rest,
        "load_angle": angle / RATIO,
        "output_torque": 5.0 + rest,
    }
    left = {"motor_torque": rest, "load_angle": 1e-6 * rng.standard_normal(len(t)), "output_torque": rest}
    return Recorded(columns, role, "A", 0.0, angle, speed, acceleration, left)


@pytest.fixture(scope="module")
def machine():
    ones = (recorded(1, "fit"), recorded(2, "fit"), recorded(3, "heldout"))
    return Machine(SECTIONS, ones, ("coulomb_friction",), (), RATIO, 100.0)


def test_exact_a_folder_of_other_cases_is_left_alone(tmp_path):
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "mine.csv").write_text("t\n")
    (tmp_path / "campaign.toml").touch()
    with pytest.raises(InputError, match="not of a set of cases"):
        cases.make(Folders(tmp_path), [tmp_path / "campaign.toml"], 1, lambda *_: None)
    assert (tmp_path / "cases" / "mine.csv").exists()


def test_exact_a_campaign_that_could_not_be_used_may_be_mended(machine, tmp_path, monkeypatch):
    path = tmp_path / "campaign.toml"
    path.write_text("title = 'nothing held out'\n")

    def refuse(_):
        raise InputError("nothing is held out")

    monkeypatch.setattr(cases, "calibrated", refuse)
    with pytest.raises(InputError, match="nothing is held out"):
        cases.make(Folders(tmp_path / "set"), [path], 3, lambda *_: None)
    path.write_text("title = 'mended'\n")
    monkeypatch.setattr(cases, "calibrated", lambda _: machine)
    cases.make(Folders(tmp_path / "set"), [path], 3, lambda *_: None)
    assert (tmp_path / "set" / "seal.json").exists()


def injection(effect, channel="motor_torque"):
    return next(one for one in INJECTIONS if (one.effect, one.channel) == (effect, channel))


@pytest.mark.parametrize("one", INJECTIONS, ids=lambda one: f"{one.effect} on {one.channel}")
def test_exact_one_channel_changes_and_in_proportion(machine, one):
    first = machine.recordings[0]
    shape = one.shape(machine, np.random.default_rng(3))
    small = 1e-3 * one.typical(machine)
    changed, twice = one.on(first, small, shape), one.on(first, 2.0 * small, shape)
    for name, values in first.columns.items():
        assert np.array_equal(changed[name], values) == (name != one.channel)
    once, double = (x[one.channel] - first.columns[one.channel] for x in (changed, twice))
    if one.effect != "sensor_lowpass":
        np.testing.assert_allclose(double, 2.0 * once, rtol=5e-3, atol=1e-2 * np.abs(double).max())
    assert one.effect in EFFECTS
    assert one.place == EFFECTS[one.effect].place


def test_exact_a_weight_is_not_put_into_the_torque_alone(machine):
    """It would turn a recorded output as well."""
    bare = [replace(one, columns={k: v for k, v in one.columns.items() if k in BARE}) for one in machine.recordings]
    assert not injection("gravity_unbalance").applies(machine)
    assert injection("gravity_unbalance").applies(replace(machine, recordings=tuple(bare)))
    assert injection("cogging").applies(machine)


@pytest.mark.parametrize("one", INJECTIONS, ids=lambda one: f"{one.effect} on {one.channel}")
def test_exact_labels_state_parameters_of_the_catalogue(one):
    assert one.parameter in {parameter.name for parameter in terms()[one.effect].parameters}


def test_exact_labels_state_values_as_the_catalogue_counts_them(machine):
    assert injection("stribeck_friction").value(machine, 0.01) == pytest.approx(1.2)
    assert injection("position_dependent_friction").value(machine, 0.01) == pytest.approx(0.2)
    disc = {parameter.name: parameter.default for parameter in terms()["encoder_eccentricity"].parameters}
    offset = injection("encoder_eccentricity", "load_angle").value(machine, 1e-4)
    assert 2.0 * offset / disc["disc_diameter"] == pytest.approx(1e-4)
    _, label = cases.injected(machine, injection("position_dependent_friction"), 3.0, np.random.default_rng(2))
    (effect,) = label["effects"]
    assert effect["true_parameters"] == {"friction_ripple": pytest.approx(effect["amplitude"] / 0.05)}


def test_exact_a_motor_with_ripple_delivers_the_recorded_torque(machine):
    first, shape = machine.recordings[0], {"order": 10.0, "psi": 0.4}
    read = injection("torque_ripple").on(first, 0.3, shape)["motor_torque"]
    np.testing.assert_allclose(read * (1.0 + 0.3 * np.cos(10.0 * first.angle + 0.4)), first.columns["motor_torque"])


def test_exact_a_late_channel_shows_what_was(machine):
    first = machine.recordings[0]
    late = injection("sensor_delay").on(first, 10.0 / RATE, {})["motor_torque"]
    np.testing.assert_allclose(late[10:], first.columns["motor_torque"][:-10], atol=1e-9)


def test_exact_a_filter_lags_behind_a_ramp_by_its_time_constant(machine):
    one = machine.recordings[0]
    ramp = Recorded(**{**vars(one), "columns": {**one.columns, "motor_torque": 2.0 * one.t}})
    lag = injection("sensor_lowpass").change(ramp, 0.1, {})
    assert lag[-1] == pytest.approx(-2.0 * 0.1, rel=0.02)


def test_against_the_matched_filter_in_white_noise(machine):
    """A line far from what a refit absorbs: size sqrt(sum of squares) over the noise, 4.5 of it are detectable."""
    line, shape = injection("cogging"), {"order": 2.0, "psi": 0.3}
    signal = np.concatenate([np.cos(2.0 * one.angle + 0.3) for one in machine.fitted])
    white = 4.5 * NOISE / np.sqrt(signal @ signal)
    assert detectable(machine, line, shape) == pytest.approx(white, rel=0.1)


def test_exact_a_line_beyond_the_band_is_not_detectable(machine):
    assert detectable(machine, injection("cogging"), {"order": 24.0, "psi": 0.3}) == np.inf


def test_exact_random_phases_keep_every_amplitude():
    values = np.random.default_rng(4).standard_normal(501) + 2.0
    turned = controls.random_phases(values, np.random.default_rng(5))
    np.testing.assert_allclose(np.abs(np.fft.rfft(turned)), np.abs(np.fft.rfft(values)), atol=1e-9)
    assert abs(np.corrcoef(values, turned)[0, 1]) < 0.2


@pytest.mark.parametrize("name", controls.CONTROLS)
def test_exact_controls_keep_motion_and_model(machine, name):
    made = controls.CONTROLS[name](machine, np.random.default_rng(6))
    assert sorted(one.role for one in made).count("heldout") == (2 if name == "exchanged" else 1)
    for before, after in zip(machine.recordings, made, strict=True):
        assert np.array_equal(before.columns["motor_angle"], after.columns["motor_angle"])
        moved = after.columns["motor_torque"] - before.columns["motor_torque"]
        assert np.std(moved) == pytest.approx(
            np.sqrt(2) * NOISE if name in ("shuffled", "transplanted") else 0, rel=0.1
        )


def test_exact_a_case_is_a_campaign_and_its_label_can_be_judged(machine, tmp_path):
    made, label = cases.injected(machine, injection("sensor_delay"), 8.0, np.random.default_rng(7))
    cases.write(tmp_path / "case", machine, made, np.random.default_rng(8))
    campaign = load_campaign(tmp_path / "case" / "campaign.toml")
    read = sorted(float(one.columns["motor_torque"].sum()) for one in campaign.recordings)
    assert read == pytest.approx(sorted(float(one.columns["motor_torque"].sum()) for one in made))
    assert [one.role for one in campaign.recordings] == [one.role for one in made]
    assert "delay" not in campaign.text
    assert label["effects"][0]["amplitude"] > 1.0 / RATE
    told = {"effect": "sensor_delay", "place": "sensor", "probability": 0.9, "rivals": ["delay"]}
    assert judge("x", label, Answer("", {"verdict": "sensor", "effects": [told]})).outcome == "right"
    told |= {"effect": "delay", "rivals": ["sensor_delay"]}
    assert judge("x", label, Answer("", {"verdict": "found", "effects": [told]})).outcome == "right_class"


@pytest.mark.long
def test_exact_recordings_of_a_machine_are_examined_once(tmp_path, monkeypatch):
    examined = []

    def examine(subjects, original=leakage.check):
        examined.append([subject.recording.name for subject in subjects])
        original(subjects)

    monkeypatch.setattr(leakage, "check", examine)
    small_campaign.shorten_library(monkeypatch)
    machine = calibrated(small_campaign.write(tmp_path))
    assert [len(one) for one in examined] == [4]
    assert [one.role for one in machine.recordings] == ["fit", "fit", "fit", "heldout"]


def test_exact_a_set_is_made_once_and_sealed(machine, tmp_path, monkeypatch):
    folders, path = Folders(tmp_path / "set"), tmp_path / "campaign.toml"
    path.write_text("title = 'any'\n")
    monkeypatch.setattr(cases, "calibrated", lambda _: machine)
    cases.make(folders, [path], 3, lambda *_: None)
    labels = json.loads((folders.sealed / "labels.json").read_text())
    assert {label["kind"][0] for label in labels.values()} == {"null", "single"}
    assert set(labels) == {case.name for case in folders.cases.iterdir()}
    before = folders.seal.read_bytes()
    cases.make(folders, [path], 3, lambda *_: None)
    assert folders.seal.read_bytes() == before
    with pytest.raises(cases.seal.SealError, match="another set"):
        cases.make(folders, [path], 4, lambda *_: None)
