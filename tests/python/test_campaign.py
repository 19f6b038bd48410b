"""Campaign files: what is stated, what stands in, where a complaint points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hdfast import Model, config, health
from hdfast.cli import main
from hdfast.errors import ConfigError, InputError
from hdfast.recordings import Controller, Recording, load, load_campaign, recorded, save
from hdfast.sensors import SensorFacts

T = np.linspace(0.0, 1.0, 101)
FILES = {
    "motor.csv": {"t": T, "motor_angle": 3.0 * T, "motor_torque": 0.0 * T},
    "both.csv": {"t": T, "motor_angle": 3.0 * T, "motor_torque": 0.0 * T, "load_angle": T / 40.0},
}
FULL = """
title = "joint"
[drive]
ratio = 121
J_m = 2.5e-4
J_l = { value = 0.6, sigma = 0.2 }
k1 = { value = 3.1e4, sigma = 0.05 }
teeth_flexspline = 240
teeth_circular = 242
fixed = "flexspline"
[drive.sigma]
J_m = 0.03
[kinematic_error]
orders = [1, "120/121"]
cos = [3e-5, 0.0]
sin = [4e-5, 1e-5]
sigma = [1e-5, 2e-5]
[[terms]]
effect = "coulomb_friction"
parameters = { T_c = { value = 0.03, sigma = 0.2 } }
[[terms]]
effect = "cogging"
parameters = { order = 24, T_cog = 0.01, psi_1 = 0.5 }
[[terms]]
effect = "sensor_delay"
channel = "load_angle"
parameters = { tau_y = { value = 1e-3, sigma = 0.1 } }
[controller]
kind = "pi"
kp = 0.05
ki = 0.8
limit = 3.0
period = 1e-3
[sensors]
motor_angle = { resolution = 4.8e-5, noise = 0.0 }
[sensors.load_angle]
resolution = 1.2e-5
noise = 1e-6
lowpass_hz = 300.0
delay_s = 1e-3
averaged = true
mounted_on = "rig"
[columns]
motor_torque = { scale = 2.0, sigma = 0.03 }
"""
BOTH = '[[recording]]\nfile = "both.csv"\n'
MOTOR = '[[recording]]\nfile = "motor.csv"\n'


@pytest.fixture
def campaign(tmp_path):
    for name, columns in FILES.items():
        save(Recording(name, columns), tmp_path / name)

    def make(text):
        (tmp_path / "c.toml").write_text(text)
        return load_campaign(tmp_path / "c.toml")

    return make


def test_exact_every_section_is_read(campaign, tmp_path):
    entry = 'role = "heldout"\ngroup = "B"\nstarted_at_s = 60.0\ninput = "motor_torque"\n'
    found = campaign(FULL + BOTH + entry)
    [item] = found.recordings
    assert (item.role, item.group, item.started_at_s, item.input) == ("heldout", "B", 60.0, "motor_torque")
    assert item.file == tmp_path / "both.csv"
    assert found.controller == Controller("pi", 0.05, 0.8, 3.0, 1e-3)
    assert found.sensors["load_angle"] == SensorFacts(1.2e-5, 1e-6, 300.0, 1e-3, True, "rig")
    assert item.resolution == {"motor_angle": 4.8e-5, "load_angle": 1.2e-5}
    assert found.drive.teeth == {"teeth_flexspline": 240, "teeth_circular": 242, "fixed": "flexspline"}
    assert found.model == Model(orders=[1, "120/121"], terms=["coulomb_friction", "cogging"])
    [delay] = found.drive.effects
    assert (delay.effect, delay.channel, delay.values) == ("sensor_delay", "load_angle", {"tau_y": 1e-3})
    assert delay.sigma == {"tau_y": pytest.approx(1e-4)}
    assert found.sensor_stage.value("load_angle_sensor_lowpass_tau_s") == pytest.approx(1.0 / (600.0 * math.pi))


def test_exact_priors_are_deviations_in_the_unit_of_the_parameter(campaign):
    found = campaign(FULL + BOTH).priors
    expected = {
        "ratio": (121.0, 0.0), "J_m": (2.5e-4, 7.5e-6), "J_l": (0.6, 0.12), "k1": (3.1e4, 1550.0), "k3": (0.0, 0.0),
        "te_cos_1": (3e-5, 1e-5), "te_sin_120/121": (1e-5, 2e-5), "T_c": (0.03, 0.006), "order": (24.0, 0.0),
        "T_cog": (0.01, 0.003), "psi_1": (0.5, math.pi / math.sqrt(3.0)),
    }  # fmt: skip
    for name, (value, sigma) in expected.items():
        assert (found[name].value, found[name].sigma) == pytest.approx((value, sigma)), name
        assert found[name].stated is (name != "k3")
    assert not found["B_sp"].stated
    assert found["B_sp"].sigma == found["B_sp"].value == 20.0


def test_exact_tolerances_that_are_not_stated_follow_the_contract(campaign):
    drive = "[drive]\nratio = 100\nJ_m = 1e-4\nk1 = 1e4\nB_m = 1e-3\n"
    error = "[kinematic_error]\norders = [2]\ncos = [3e-5]\nsin = [4e-5]\n"
    found = campaign(drive + error + '[[terms]]\neffect = "coulomb_friction"\nparameters = { T_c = 0.02 }\n' + BOTH)
    sigma = {name: prior.sigma / abs(prior.value) for name, prior in found.priors.items() if prior.value}
    assert (sigma["ratio"], sigma["J_m"], sigma["k1"]) == pytest.approx((0.0, 0.1, 0.1))
    assert (sigma["B_m"], sigma["T_c"]) == pytest.approx((0.5, 0.3))
    assert found.priors["te_cos_2"].sigma == pytest.approx(0.3 * 5e-5)
    assert found.channel_sigma == {
        "motor_angle": 0.0, "motor_torque": 0.05, "load_angle": 0.0, "load_torque": 0.05, "output_torque": 0.05,
        "speed_reference": 0.0, "temperature": 0.0,
    }  # fmt: skip


def test_exact_what_is_not_stated_is_open_as_far_as_it_can_be_unknown(campaign):
    """Phases anywhere, counts exactly the default's; the range of a spring says nothing of its law."""
    cogging = '[[terms]]\neffect = "cogging"\nparameters = { T_cog = 0.01 }\n'
    found = campaign("[drive]\nphi_max = 1e-3\n" + cogging + BOTH).priors
    assert (found["psi_1"].value, found["psi_1"].sigma) == pytest.approx((0.0, math.pi / math.sqrt(3.0)))
    assert (found["order"].value, found["order"].sigma) == (24.0, 0.0)
    assert found["k3"].value == found["k3"].sigma == 1.3445e10
    assert not any(found[name].stated for name in ("psi_1", "order", "k3"))


def test_exact_base_follows_the_channels_unless_it_is_stated(campaign):
    assert campaign(MOTOR).base == "one_inertia"
    assert campaign(MOTOR + BOTH).base == "two_inertia"
    assert campaign('[drive]\nbase = "two_inertia"\n' + MOTOR).model.base == "two_inertia"
    assert campaign(MOTOR).model.order_labels == []


def test_exact_base_counts_no_column_that_is_not_used(campaign, tmp_path):
    numbers = np.where(T < 0.6, T / 40.0, np.nan)
    for load_angle, base in ((numbers, "two_inertia"), (np.nan * numbers, "one_inertia")):
        save(Recording("half", FILES["motor.csv"] | {"load_angle": load_angle}), tmp_path / "half.csv")
        assert campaign(MOTOR + '[[recording]]\nfile = "half.csv"\n').base == base


def test_exact_spring_follows_the_coefficients(campaign):
    found = campaign("[drive]\nK1 = 2e4\nK2 = 3e4\nK3 = 4e4\nT1 = 5\nT2 = 9\n" + BOTH)
    assert found.model.spring == "piecewise"
    assert found.priors["T2"].sigma == pytest.approx(0.9)
    with pytest.raises(ConfigError, match="mixes two spring laws: k1, K1"):
        campaign("[drive]\nk1 = 1\nK1 = 2\n" + BOTH)


def test_exact_an_extended_model_is_a_campaign_and_a_sweep(campaign, tmp_path):
    found = campaign(FULL)
    assert (found.recordings, found.base) == ([], "two_inertia")
    swept = config.load(tmp_path / "c.toml")
    assert swept.model == found.model
    assert {name: found.priors[name].value for name in swept.drive} == swept.drive


def test_exact_scales_reach_the_recording(campaign):
    text = '[columns]\nmotor_angle = { name = "load_angle", scale = 40.0 }\n' + BOTH
    np.testing.assert_allclose(campaign(text).recordings[0]["motor_angle"], T)


def test_exact_a_column_missing_in_one_recording_is_noted_and_not_replaced(campaign):
    found = campaign('[columns]\nmotor_torque = { name = "load_angle", scale = 3.0 }\n' + MOTOR + BOTH)
    assert "motor_torque" not in found.recordings[0]
    assert "no column 'load_angle' for motor_torque" in found.recordings[0].notes


def test_exact_a_byte_order_mark_is_no_part_of_the_file(campaign, tmp_path):
    found = campaign(BOTH)
    (tmp_path / "c.toml").write_bytes(b"\xef\xbb\xbf" + BOTH.encode())
    assert load_campaign(tmp_path / "c.toml").text == found.text == BOTH


def test_exact_a_column_missing_in_one_recording_is_a_warning(campaign, tmp_path):
    table = np.column_stack([T, 3.0 * T, 0.0 * T, T / 20.0, T])
    np.savetxt(tmp_path / "out.csv", table, delimiter=",", header="t,motor_angle,motor_torque,out,enc", comments="")
    text = '[columns]\nload_angle = { name = "out", scale = 0.5 }\n' + MOTOR + MOTOR.replace("motor", "out")
    made = campaign(text)
    assert made.recordings[0].notes == ("no column 'out' for load_angle",)
    found = health.check(made).recordings
    [warning] = [one for one in found[0].findings if "no column" in one.sentence]
    assert warning.severity == "warning"
    assert warning.sentence == "motor.csv: no column 'out' for load_angle, which other recordings have"
    [note] = [one for one in found[1].findings if one.check == "columns"]
    assert (note.severity, note.sentence) == ("note", "out.csv: columns left out: enc")


WRONG = [
    (
        '[columns]\nmotor_angle = "enc"\n' + BOTH,
        2,
        "no recording has a column 'enc' for motor_angle \\(they have: t, motor_",
    ),
    ('[columns]\nmotor_angle = "motor_angel"\n' + BOTH, 2, "did you mean 'motor_angle'\\? \\(they have: "),
    (BOTH + '[[recording]]\nfile = "mottor.csv"\n', 4, "mottor.csv: no such file; did you mean 'motor.csv'\\?"),
    (BOTH + '[[recording]]\nfile = "elsewhere/motor.csv"\n', 4, "elsewhere/motor.csv: no such file$"),
    ('[[recording]]\nfile = "."\n', 2, "file = '.' is a folder"),
    (f'[[recording]]\nfile = "{"a" * 300}"\n', 2, "cannot be read: File name too long"),
    (BOTH + MOTOR + 'rolle = "fit"\n', 5, "did you mean 'role'"),
    (BOTH + MOTOR + 'role = "test"\n', 5, "role = 'test' is not known"),
    (BOTH + MOTOR + "started_at_s = nan\n", 5, "started_at_s = nan"),
    (BOTH + "group = 1\n", 3, "group = 1 is not text"),
    (BOTH + 'input = "torque"\n', 3, "input = 'torque'"),
    ("[[recording]]\nrole = 'fit'\n", 1, "needs the key 'file'"),
    ("[drive]\nJ_l = { value = 1, sigm = 2 }\n", 2, "did you mean 'sigma'"),
    ("[drive]\nJ_l = { sigma = 2 }\n", 2, "J_l has no key 'value'"),
    ("[drive]\nJ_l = { value = 2, unit = 'kg cm^2' }\n", 2, "unknown key 'unit' \\(allowed: value, sigma"),
    ("[drive]\nJ_l = { value = 1, sigma = -2 }\n", 2, "sigma of J_l = -2"),
    ("[drive]\nk1 = 1\n[drive.sigma]\nJ_l = 0.1\n", 4, "drive.sigma.J_l is given, \\[drive\\] has no J_l"),
    ("[drive]\nk1 = {value = 1, sigma = 1}\n[drive.sigma]\nk1 = 0.1\n", 4, "another in \\[drive.sigma\\]"),
    ("[drive]\nteeth_flexspline = 2.5\n", 2, "teeth_flexspline = 2.5"),
    ("[drive]\nfixed = 'cup'\n", 2, "fixed = 'cup'"),
    ("[kinematic_error]\norders = [1]\ncos = [1]\nsin = [1]\nsigma = [1, 2]\n", 5, "sigma has 2 numbers"),
    (FULL.replace('"cogging"', '"coging"'), 22, "did you mean 'cogging'"),
    (FULL.replace("psi_1", "psi1"), 23, "unknown key 'psi1'; did you mean 'psi_1'"),
    (FULL.replace('effect = "cogging"', 'id = "cogging"'), 22, "unknown key 'id'; the key is 'effect'"),
    (
        FULL.replace("parameters = { order = 24, ", "T_cog = 1 #"),
        23,
        "'T_cog' belongs into parameters = { T_cog = ... }",
    ),
    ("[sensors]\nmotor_angel = { noise = 1 }\n", 2, "did you mean 'motor_angle'"),
    ("[sensors]\nmotor_angle = { noise = -1 }\n", 2, "sensors.motor_angle.noise = -1"),
    ("[sensors]\nmotor_angle = { averaged = 1 }\n", 2, "is not true or false"),
    ("[sensors.motor_angle]\nresolution = 1e-5\nnoize = 1\n", 3, "did you mean 'noise'"),
    ("[controller]\nkp = 1\n", 1, "needs the key 'kind'"),
    ("[controller]\nkind = 'pid'\nkp = 1\n", 2, "kind = 'pid'"),
    ("[controller]\nkind = 'pi'\nkp = 1\nkd = 2\n", 4, "unknown key 'kd'"),
    ("[columns]\nmotor_torque = { scale = 1, sigma = -1 }\n", 2, "columns.motor_torque.sigma = -1"),
    ("recording = 3\n", 1, "not a list"),
]


@pytest.mark.parametrize(("text", "line", "message"), WRONG)
def test_exact_wrong_files_name_the_line(campaign, text, line, message):
    with pytest.raises(ConfigError, match=message) as caught:
        campaign(text)
    assert caught.value.line == line


def test_exact_lines_above_the_names_of_columns_are_told_as_what_they_are_taken_for(campaign, tmp_path):
    (tmp_path / "headed.csv").write_text("Rig 7\n\nt,motor_angle\n0,1\n1,2\n")
    with pytest.raises(ConfigError, match=r"no recording has a column 't' for t \(they have: Rig 7\)"):
        campaign('[columns]\nt = "t"\n[[recording]]\nfile = "headed.csv"\n')


@pytest.mark.parametrize("command", ["compare", "calibrate", "diagnose", "identify friction"])
def test_regress_a_file_without_recordings_is_wrong_input(command, campaign, tmp_path, capsys):
    file = str(tmp_path / "c.toml")
    without = campaign("[spec.te_pp]\nupper = 3e-4\n")
    assert main([*command.split(), file]) == 2
    said = "holds no [[recording]]: a campaign file names at least one (docs/campaign.md)\n"
    assert capsys.readouterr().err == f"hdfast: {file} {said}"
    with pytest.raises(ConfigError, match=r"^c holds no \[\[recording"):
        recorded(without)


def test_exact_a_file_with_other_names_is_told_its_columns_once(campaign, tmp_path):
    (tmp_path / "deg.csv").write_text("time,pos_deg,torque\n" + "".join(f"{0.1 * n},{n},0\n" for n in range(20)))
    entry = '[[recording]]\nfile = "deg.csv"\n'
    [finding] = health.check(campaign(entry)).recordings[0].findings
    assert finding.sentence == (
        "deg.csv: no column for t, motor_angle, motor_torque (the file has: time, pos_deg, torque); "
        'name it in [columns], as in  motor_angle = { name = "angle_deg", scale = 0.0174533 }'
    )
    named = '[columns]\nt = "time"\nmotor_torque = "torque"\nmotor_angle = { name = "pos_deg", scale = 0.0174533 }\n'
    assert health.check(campaign(named + entry)).usable
    with pytest.raises(InputError, match=r"deg.csv: no column for t \(the file has: time, pos_deg, torque\); map it"):
        load(tmp_path / "deg.csv")
    with pytest.raises(InputError, match=r"a test needs motor_angle \[rad\] \(the file has: time, pos_deg, torque\)"):
        load(tmp_path / "deg.csv", {"t": "time"}).need("a test", "motor_angle")


def test_exact_recordings_of_one_name_are_told_apart_by_their_folders(tmp_path):
    for day in ("day1", "day2"):
        (tmp_path / day).mkdir()
        save(Recording("run", FILES["motor.csv"]), tmp_path / day / "run.csv")
    save(Recording("run", FILES["motor.csv"]), tmp_path / "other.csv")
    files = ["day1/run.csv", "day2/run.csv", "other.csv"]
    path = tmp_path / "campaign.toml"
    path.write_text("[drive]\nratio = 121\n" + "".join(f'[[recording]]\nfile = "{file}"\n' for file in files))
    assert [recording.name for recording in load_campaign(path).recordings] == files
