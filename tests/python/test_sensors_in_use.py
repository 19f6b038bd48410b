"""Sensors where a user meets them: sweep, simulate, files, benches."""

from __future__ import annotations

import dataclasses
import json
import math

import hdfast
import numpy as np
import pytest
from hdfast import bench, config
from hdfast.cli import main
from hdfast.recordings import load, load_campaign
from hdfast.sensors import SensorFacts, SensorStage, stage_of
from hdfast.sensors.facts import facts_of

FILE = """
[[terms]]
effect = "coulomb_friction"
parameters = { T_c = 0.02 }
[[terms]]
effect = "encoder_eccentricity"
channel = "load_angle"
parameters = { eccentricity = { value = 1e-5, sigma = 0.5 }, psi = 0.3 }
[sensors]
load_angle = { resolution = 6e-6, noise = 1e-6, delay_s = 1e-3 }
motor_torque = { lowpass_hz = 100.0, averaged = true }
[scenario]
t_end = 6.0
"""


def test_exact_sweep_records_what_the_sensors_read_and_leaves_the_motion_alone():
    t = np.linspace(0.0, 5.0, 126)
    rows = {"J_l": np.array([0.3, 0.6, 0.9])}
    stage = SensorStage([("encoder_eccentricity", "load_angle"), ("sensor_delay", "motor_angle")], {"tau_y": 0.004})
    values = {"eccentricity": np.array([0.0, 1e-5, 2e-5]), "psi": 0.5}
    options = {"t_eval": t, "metrics": [], "signals": ["te", "theta_l", "theta_m", "omega_m"]}
    found = hdfast.sweep(rows | values, sensors=stage, **options)
    plain = hdfast.sweep(rows, **options)
    for name in options["signals"]:
        assert np.array_equal(found.samples[name], plain.samples[name])
    angle = plain.samples["theta_l"]
    expected = angle + 2.0 * values["eccentricity"][:, None] / 0.05 * np.sin(angle + 0.5)
    np.testing.assert_allclose(found.recorded["load_angle"], expected, atol=1e-15)
    later = hdfast.sweep(rows, **(options | {"t_eval": np.maximum(t - 0.004, 0.0)}))
    np.testing.assert_allclose(found.recorded["motor_angle"], later.samples["theta_m"], atol=2e-6)
    assert set(found.recorded) == {"motor_angle", "load_angle", "motor_torque", "output_torque"}


def test_exact_rows_on_grids_of_their_own_and_rows_that_fail():
    grids = [np.linspace(0.0, 1.0, 11), np.linspace(0.0, 2.0, 41)]
    stage = SensorStage([("sensor_delay", "load_angle")], {"tau_y": 0.0})
    rows = {"J_m": np.array([3e-4, 3e-4, -1.0])}
    found = hdfast.sweep(rows, t_eval=grids, t_eval_index=[1, 0, 1], signals=["theta_l"], metrics=[], sensors=stage)
    read, true = found.recorded["load_angle"], found.samples["theta_l"]
    assert read.shape == true.shape == (3, 41)
    np.testing.assert_allclose(read, true, atol=1e-12)
    assert np.isnan(read[1, 11:]).all()
    assert np.isnan(read[2]).all()


def test_exact_simulate_gives_a_recording_that_replays():
    stage = stage_of({"motor_angle": SensorFacts(resolution=1e-3)})
    run = hdfast.simulate(scenario=hdfast.Scenario.start_stop(t_end=4.0), sensors=stage)
    assert run.recorded.resolution == {"motor_angle": 1e-3}
    assert np.max(np.abs(run.recorded["motor_angle"] - run["theta_m"])) <= 0.5e-3 * (1 + 1e-9)
    again = hdfast.simulate(scenario=hdfast.Scenario.replay(run.recorded, input="motor_torque"))
    assert np.max(np.abs(again["theta_m"] - run["theta_m"])) < 0.05
    assert hdfast.simulate().recorded is None


def test_exact_file_means_the_same_everywhere(tmp_path, capsys):
    path = tmp_path / "extended_model.toml"
    path.write_text(FILE)
    settings = config.load(path)
    assert settings.model.terms == ("coulomb_friction",)
    assert settings.sensor_stage.value("eccentricity") == 1e-5
    assert settings.sensor_stage.value("tau_s") == pytest.approx(1.0 / (200.0 * np.pi))
    assert main(["simulate", str(path), "--out", str(tmp_path / "one")]) == 0
    assert "recording.parquet" in capsys.readouterr().out
    recording = load(tmp_path / "one" / "recording.parquet")
    late = np.maximum(recording["t"] - 1e-3, 0.0)
    run = hdfast.simulate(settings.drive, model=settings.model, scenario=settings.scenario, t_eval=late)
    seen = run["theta_l"] + 4e-4 * np.sin(run["theta_l"] + 0.3)
    assert np.max(np.abs(recording["load_angle"] - seen)) < 3e-6 + 6e-6
    assert main(["bench", "startstop", str(path), "--out", str(tmp_path / "bench"), "--load-bits", "12"]) == 0
    campaign = load_campaign(tmp_path / "bench" / "campaign.toml")
    [made] = campaign.recordings
    assert made.resolution["load_angle"] == 2.0 * np.pi / 2**12
    assert campaign.sensors["load_angle"].delay_s == 1e-3
    assert campaign.sensors["motor_torque"].averaged is True
    (tmp_path / "sweep.toml").write_text(FILE + "[run]\nrows = 3\n")
    assert main(["sweep", str(tmp_path / "sweep.toml")]) == 0


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('[[terms]]\neffect = "aliasing"\n', "channel of aliasing = None"),
        (
            '[[terms]]\neffect = "sensor_noise"\nchannel = "load_angle"\nparameters = { noise = 1e-5 }\n' * 2,
            r"line 5: \[\[terms\]\] names sensor_noise on load_angle twice \(allowed: once per channel\)",
        ),
        ('[[terms]]\neffect = "delay"\nchannel = "load_angle"\n', "line 3: delay acts on the drive"),
        ('[[terms]]\neffect = "aliasing"\nchannel = "load_angle"\nparameters = { f = 3.0 }\n', "allowed: f_s"),
    ],
)  # fmt: skip
def test_exact_wrong_files_are_named(text, named, tmp_path):
    path = tmp_path / "drive.toml"
    path.write_text(text)
    with pytest.raises(hdfast.ConfigError, match=named):
        config.load(path)


def test_exact_wrong_calls_are_named():
    stage = SensorStage([("quantisation", "load_angle")])
    with pytest.raises(hdfast.InputError, match="t_eval"):
        hdfast.sweep({}, sensors=stage)
    with pytest.raises(hdfast.InputError, match="SensorStage"):
        hdfast.simulate({}, sensors=["quantisation"])
    with pytest.raises(hdfast.InputError, match="resolution = -1"):
        hdfast.simulate({"resolution": -1.0}, sensors=stage)


def test_exact_description_reads_back():
    facts = SensorFacts(1e-5, 2e-6, 80.0, 1e-3, True)
    found = facts_of(stage_of({"load_angle": facts}))["load_angle"]
    assert dataclasses.asdict(SensorFacts(**found)) == pytest.approx(dataclasses.asdict(facts))
    assert "load_angle" not in facts_of(bench.rig(load_angle=SensorFacts()))
    assert facts_of(SensorStage([("sensor_delay", "load_angle")], {"tau_y": -1e-3})) == {}
    assert facts_of(SensorStage([("sensor_averaging", "load_angle")], {"window_share": 0.5})) == {}


def test_exact_a_bench_takes_the_command_line_before_declared_effects(tmp_path):
    declared = (
        ("load_angle", "sensor_delay", "tau_y = 3e-3"),
        ("load_angle", "sensor_noise", "noise = 1e-4"),
        ("load_angle", "quantisation", "resolution = 1e-3"),
        ("motor_angle", "quantisation", "resolution = 1e-3"),
        ("output_torque", "sensor_noise", "noise = 0.5"),
    )
    path, out = tmp_path / "drive.toml", tmp_path / "bench"
    path.write_text(
        "".join(
            f'[[terms]]\neffect = "{effect}"\nchannel = "{channel}"\nparameters = {{ {value} }}\n'
            for channel, effect, value in declared
        )
    )
    asked = ["--delay", "2e-3", "--angle-noise", "2e-6", "--load-bits", "12", "--torque-noise", "0.1"]
    for options, late, noise, step, torque in (([], 3e-3, 1e-4, 1e-3, 0.5), (asked, 2e-3, 2e-6, math.tau / 4096, 0.1)):
        assert main(["bench", "startstop", str(path), "--out", str(out), "--quiet", *options]) == 0
        stated = load_campaign(out / "campaign.toml").sensors
        found = stated["load_angle"]
        assert (found.delay_s, found.noise, found.resolution) == (late, noise, step)
        assert (stated["output_torque"].noise, stated["motor_angle"].resolution) == (torque, 1e-3)


def test_exact_steps_of_a_bench_fall_at_random_and_its_zero_is_exact():
    t = np.arange(100) * 1e-3
    sensors = bench.rig(load_angle=SensorFacts(resolution=0.01))
    made = [bench.record(sensors, "x", t, {"load_angle": t, "temperature": 0.0 * t + 20.0}, seed) for seed in (1, 2)]
    assert not np.array_equal(made[0]["load_angle"], made[1]["load_angle"])
    for recording in made:
        np.testing.assert_allclose(np.diff(np.unique(recording["load_angle"])), 0.01)
        assert np.array_equal(recording["temperature"], 0.0 * t + 20.0)
    zero = bench.record(sensors, "x", t, {"load_angle": 0.0 * t}, 7)["load_angle"]
    assert np.max(np.abs(zero)) < 0.5e-2


def test_exact_a_bench_writes_an_unbounded_torque_as_null(tmp_path):
    (tmp_path / "drive.toml").write_text("[scenario]\nstop = 'brake'\ntau_max = inf\n")
    assert main(["bench", "startstop", str(tmp_path / "drive.toml"), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert json.loads((tmp_path / "out" / "truth.json").read_text())["truth"]["tau_max"] is None


def test_exact_a_bench_follows_its_drive_between_slow_readings():
    """A load that swings at 40 Hz, read 13 ms late and 50 times per second."""
    late, drive = 0.013, {"te_scale": 0.0}
    clean = {name: SensorFacts() for name in ("motor_angle", "motor_torque", "output_torque")}
    sensors = bench.rig(50.0, load_angle=SensorFacts(delay_s=late), **clean)
    scenario = hdfast.Scenario.start_stop(t_end=2.0)
    made = bench.startstop(drive, scenario=scenario, sensors=sensors)
    t = made["t"][2:]
    true = hdfast.simulate(drive, scenario=scenario, t_eval=t - late, signals=["theta_l"], metrics=[], rtol=1e-8)
    np.testing.assert_allclose(made["load_angle"][2:], true["theta_l"], atol=1e-7)
    np.testing.assert_array_equal(np.diff(made["t"]).round(9), 0.02)


STAGE = SensorStage([("sensor_delay", "load_angle")])
BRIEF = {"t_eval": np.linspace(0.0, 0.5, 501), "signals": ["te"], "metrics": [], "sensors": STAGE, "threads": 1}


def interrupted_while_read(monkeypatch, rows, portions, **options):
    """The result of a sweep whose sensors an interrupt stops after so many portions, and the rows that reached them."""
    reached, linearise = [], SensorStage.linearise

    def stopping(self, *arguments, **named):
        if len(reached) == portions:
            raise KeyboardInterrupt
        reached.append(named["rows"])
        return linearise(self, *arguments, **named)

    monkeypatch.setattr(SensorStage, "linearise", stopping)
    with pytest.raises(hdfast.Interrupted) as caught:
        hdfast.sweep(rows, **BRIEF, **options)
    return caught.value.result, np.concatenate(reached) if reached else np.array([], dtype=int)


def test_exact_an_interrupt_while_the_sensors_read_keeps_the_rows_that_were_read(monkeypatch):
    rows = {"J_l": np.linspace(0.4, 0.6, 300)}
    whole = hdfast.sweep(rows, **BRIEF)
    result, read = interrupted_while_read(monkeypatch, rows, portions=2)
    assert result.interrupted
    assert 0 < len(read) < 300
    assert np.flatnonzero(result.finished).tolist() == read.tolist()
    assert result.status_counts() == {"finished": len(read), "cancelled": 300 - len(read)}
    for name, values in {**result.samples, **result.recorded}.items():
        assert np.array_equal(values[read], whole[name][read])
        assert np.isnan(np.delete(values, read, axis=0)).all()


def test_exact_an_interrupt_while_the_sensors_read_cancels_no_row_that_has_failed(monkeypatch):
    inertias = np.full(300, 0.5)
    inertias[250] = -1.0
    result, read = interrupted_while_read(monkeypatch, {"J_l": inertias}, portions=1)
    assert 250 not in read
    assert result.status_counts()["bad_parameters"] == 1
    assert "bad_parameters" in result.message(250)


def test_exact_rows_that_an_interrupt_cancels_do_not_pass_the_sensors(monkeypatch):
    def stop(done, total):
        raise KeyboardInterrupt

    result, read = interrupted_while_read(
        monkeypatch, {"J_l": np.linspace(0.4, 0.6, 3_000)}, portions=3_000, progress=stop
    )
    assert set(result.status_counts()) <= {"finished", "cancelled"}
    assert np.flatnonzero(result.finished).tolist() == read.tolist()
    assert len(read) < 3_000
