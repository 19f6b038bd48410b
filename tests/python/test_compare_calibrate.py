from __future__ import annotations

import json
import re

import hdfast
import numpy as np
import pytest
import small_campaign
from hdfast.calibration.calibrate import MODELS, Calibration
from hdfast.cli import main
from hdfast.comparison.compare import LOST, Comparison
from hdfast.diagnosis.session import LESS
from hdfast.errors import InputError
from hdfast.recordings import load_campaign

TRUE = {"J_m": 3.5e-4, "B_m": 1.2e-3}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Recordings of a drive whose motor inertia and damping are not those of the campaign."""
    return small_campaign.write(tmp_path_factory.mktemp("off"), parameters=TRUE)


@pytest.fixture(scope="module")
def calibrated(path):
    return hdfast.calibrate(path)


def test_exact_a_drive_as_given_differs_where_it_is_wrong(path, tmp_path):
    wrong = hdfast.compare(path)
    right = hdfast.compare(small_campaign.write(tmp_path))
    assert wrong.to_dict()["nrmse"]["fit"] > 1.5 * right.to_dict()["nrmse"]["fit"]
    assert {(row["recording"], row["channel"]) for row in wrong.errors} == {
        (f"r{number}.npz", channel) for number in range(4) for channel in ("motor_torque", "te")
    }


def test_against_the_truth_calibration_finds_what_was_off(calibrated):
    known = {row["parameter"]: row for row in calibrated.parameters}
    row = known["J_m"]
    assert abs(row["value"] - TRUE["J_m"]) < min(3.0 * row["sigma"], 1e-5)
    assert row["sigma"] < 0.7 * row["prior_sigma"]
    damping = known["B_m"]["value"] + known["B_ml"]["value"]
    assert damping == pytest.approx(TRUE["B_m"] + small_campaign.DRIVE["B_ml"], rel=0.15)
    assert row["pull"] == pytest.approx(np.log(row["value"] / row["prior"]) / (row["prior_sigma"] / row["prior"]))


def test_exact_a_campaign_in_memory_gives_the_numbers_of_its_file_on_any_threads(path, calibrated):
    loaded = load_campaign(path)
    assert hdfast.compare(loaded, threads=2).to_dict() == hdfast.compare(path).to_dict()
    assert hdfast.calibrate(loaded, threads=1).to_dict() == calibrated.to_dict()
    for call in (hdfast.compare, hdfast.calibrate):
        with pytest.raises(InputError, match="threads = 0 is out of range"):
            call(path, threads=0)


def test_exact_calibration_predicts_what_it_was_not_fitted_to(calibrated):
    held = calibrated.to_dict()["nrmse"]["heldout"]
    assert held["calibrated"] < 0.5 * held["given"]


def test_exact_other_commands_load_the_calibrated_model(calibrated, tmp_path):
    file = tmp_path / "model.toml"
    file.write_text(calibrated.model)
    loaded = load_campaign(file)
    assert loaded.priors["J_m"].value == pytest.approx(calibrated.fit.value("J_m"), rel=1e-12)
    assert loaded.title.endswith("calibrated")


def test_exact_a_calibrated_model_predicts_as_it_was_fitted(tmp_path):
    """The torque reads 4 % too much: the model's column says so."""
    path = small_campaign.write(tmp_path, parameters=TRUE)
    for number in range(4):
        table = dict(np.load(tmp_path / f"r{number}.npz"))
        np.savez(tmp_path / f"r{number}.npz", **table | {"motor_torque": 1.04 * table["motor_torque"]})
    calibrated = hdfast.calibrate(path)
    entries = path.read_text().partition("[[recording]]")
    again = tmp_path / "again.toml"
    again.write_text(calibrated.model + "\n" + "".join(entries[1:]))
    assert load_campaign(again).columns["motor_torque"].scale == pytest.approx(1.0 / 1.04, rel=0.02)
    unscaled = tmp_path / "unscaled.toml"
    unscaled.write_text(re.sub("scale = .*", "scale = 1.0", again.read_text()))
    right, wrong = (hdfast.compare(file).nrmse for file in (again, unscaled))
    for role, error in right.items():
        assert error < 1.02 * calibrated.nrmse[role]["calibrated"]
        assert error < 0.9 * wrong[role]


@pytest.mark.parametrize(
    ("command", "files"),
    [
        ("compare", {"report.html", "comparison.json", "campaign.toml"}),
        ("calibrate", {"report.html", "calibration.json", "model.toml", "campaign.toml"}),
    ],
)
def test_exact_commands_write_their_folder(command, files, path, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([command, str(path), "--out", str(out)]) == 0
    assert {item.name for item in out.iterdir()} == files
    assert str(out / "report.html") in capsys.readouterr().out
    numbers = json.loads(next(out.glob("c*.json")).read_text())
    assert set(numbers["nrmse"]) == {"fit", "heldout"}
    page = (out / "report.html").read_text()
    assert "A &lt;small&gt; campaign" in page


@pytest.mark.parametrize("command", ["compare", "calibrate"])
def test_exact_angles_in_degrees_are_said_in_every_output(command, tmp_path, capsys, undrawn):
    path = small_campaign.write(tmp_path)
    for number in range(4):
        table = dict(np.load(tmp_path / f"r{number}.npz"))
        np.savez(
            tmp_path / f"r{number}.npz",
            **{name: np.rad2deg(values) if "angle" in name else values for name, values in table.items()},
        )
    out = tmp_path / "out"
    assert main([command, str(path), "--out", str(out)]) == 0
    captured = capsys.readouterr()
    told = [line.removeprefix("hdfast: warning: ") for line in captured.err.splitlines()]
    assert any("motor_angle may be in degrees" in sentence for sentence in told)
    assert told == json.loads(next(out.glob("c*.json")).read_text())["warnings"]
    assert "motor_angle may be in degrees" in (out / "report.html").read_text()
    assert "of motor_torque the model explains nothing or less" in told[-1]
    assert main([command, str(path), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", ["compare", "calibrate"])
def test_exact_what_is_set_aside_is_a_warning(command, tmp_path, capsys, undrawn):
    path = small_campaign.write(tmp_path)
    path.write_text(path.read_text().replace('role = "heldout"', 'role = "fit"'))
    out = tmp_path / "out"
    assert main([command, str(path), "--out", str(out)]) == 0
    said = f"no recording is held out: group 3 was set aside {LESS}"
    assert capsys.readouterr().err == f"hdfast: warning: {said}\n"
    assert json.loads(next(out.glob("c*.json")).read_text())["warnings"] == [said]
    assert said in (out / "report.html").read_text()


def thin(path, number, every):
    """Every so many samples of one recording are left; the others have 500 per second."""
    file = path.parent / f"r{number}.npz"
    table = dict(np.load(file))
    np.savez(file, **{name: values[::every] for name, values in table.items()})


def test_exact_a_recording_that_sets_the_rate_of_all_is_named(tmp_path):
    path = small_campaign.write(tmp_path)
    thin(path, 1, 20)
    said = [sentence for sentence in hdfast.compare(path).warnings if "rate of the slowest" in sentence]
    assert [sentence.split(",")[0] for sentence in said] == ["r1.npz: it has 25 new samples per second"]


def test_exact_a_held_out_recording_so_slow_that_nothing_can_be_judged_is_named(tmp_path):
    path = small_campaign.write(tmp_path)
    thin(path, 3, 100)
    with pytest.raises(InputError, match=r"all of the motion; r3\.npz: it has 5 new samples per second"):
        hdfast.compare(path)


@pytest.mark.parametrize("command", ["compare", "calibrate"])
def test_exact_what_is_noted_of_a_recording_is_on_the_page(command, tmp_path, undrawn):
    path = small_campaign.write(tmp_path)
    table = dict(np.load(tmp_path / "r0.npz"))
    table["motor_torque"][700:703] = np.nan
    np.savez(tmp_path / "r0.npz", **table)
    assert main([command, str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "r0.npz: 3 samples of motor_torque are missing and masked" in page
    assert page.index(">Notes<") > page.index(">Every recording<")


def test_exact_commands_print_sentences_and_tables(path, capsys):
    assert main(["compare", str(path)]) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("Error of the nominal drive (rms over the spread of what was measured): fit ")
    assert captured.out.count("r3.npz") == 2
    assert captured.err == ""
    assert main(["calibrate", str(path)]) == 0
    assert re.match(r"\d+ parameters calibrated, error \(.*\): fit .* -> .*, heldout", capsys.readouterr().out)


def test_exact_a_recording_that_cannot_be_simulated_has_no_error(path, calibrated, tmp_path, undrawn):
    """Null in the numbers, a dash on the page, and it is said."""
    compared = hdfast.compare(path)
    fit, (held, stacked) = compared.mismatch
    lost = Comparison(compared.setup, (fit, (held, np.full_like(stacked, np.nan))))
    again = Calibration(calibrated.setup, calibrated.fit)
    vars(again)["mismatches"] = calibrated.mismatches | {"heldout": (held, np.full((2, len(stacked)), np.nan))}
    for found, name, error in ((lost, "comparison", None), (again, "calibration", dict.fromkeys(MODELS))):
        page = found.report(tmp_path / name).read_text()
        numbers = json.loads((tmp_path / name / f"{name}.json").read_text())
        assert numbers["nrmse"]["heldout"] == error
        assert numbers["warnings"] == found.warnings == [f"r3.npz: {LOST}"]
        assert f"r3.npz: {LOST}" in page
        text = re.sub("<svg.*?</svg>", "", page, flags=re.DOTALL)
        assert "nan" not in re.findall(r"\w+", text)
        assert '<td class="n">-</td>' in text
        assert repr(found).endswith("heldout -" if found is lost else "heldout - -> -")
    assert {row["nrmse"] for row in lost.to_dict()["errors"] if row["recording"] == "r3.npz"} == {None}


@pytest.mark.parametrize("command", ["compare", "calibrate", "diagnose"])
def test_exact_another_campaign_is_not_written_over(command, path, tmp_path, capsys):
    rig = tmp_path / "rig"
    rig.mkdir()
    (rig / "campaign.toml").write_text("[drive]\nratio = 80\n")
    assert main([command, str(path), "--out", str(rig), "--quiet"]) == 2
    assert "holds another campaign.toml" in capsys.readouterr().err
    assert [file.name for file in rig.iterdir()] == ["campaign.toml"]
    assert (rig / "campaign.toml").read_text() == "[drive]\nratio = 80\n"


def test_exact_results_of_one_campaign_do_not_stay_beside_another(path, tmp_path, capsys, undrawn):
    """Another campaign replaces what its own command left; what another command left is refused as it is."""
    out = tmp_path / "out"
    assert main(["calibrate", str(path), "--out", str(out), "--quiet"]) == 0
    before = {file.name: file.read_bytes() for file in out.iterdir()}
    for command in ("compare", "diagnose"):
        assert main([command, str(small_campaign.write(tmp_path)), "--out", str(out), "--quiet"]) == 2
        assert "out' holds calibration.json, as results of another command do" in capsys.readouterr().err
        assert {file.name: file.read_bytes() for file in out.iterdir()} == before
    assert main(["calibrate", str(tmp_path / "campaign.toml"), "--out", str(out), "--quiet"]) == 0
    after = {file.name: file.read_bytes() for file in out.iterdir()}
    assert after.keys() == before.keys()
    assert not set(after.values()) & set(before.values()) - {before["campaign.toml"]}


def test_exact_unusable_recordings_are_refused_with_the_reason(tmp_path):
    path = small_campaign.write(tmp_path)
    for number in range(4):
        table = dict(np.load(tmp_path / f"r{number}.npz"))
        del table["motor_torque"]
        np.savez(tmp_path / f"r{number}.npz", **table)
    with pytest.raises(InputError, match="motor_torque") as told:
        hdfast.compare(path)
    assert str(told.value).count("r0.npz") == 1
