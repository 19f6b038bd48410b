"""Bench, identify and study from the command line: files, exit codes, pages."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hdfast import cli, config, params
from hdfast.studies import STUDIES, Study

EXAMPLE = str(Path(__file__).parents[2] / "examples" / "shf-25-120.toml")


@pytest.mark.parametrize(
    ("kind", "options", "key"),
    [
        ("stiffness", ["--torque-rate", "8"], "k1"),
        ("kinematic-error", ["--revolutions", "6"], "te_cos_2"),
        ("friction", ["--format", "csv", "--rate", "200"], None),
        ("coastdown", ["--format", "npz"], None),
        ("starting-torque", ["--rate", "200"], None),
    ],
)
def test_exact_bench_then_identify_then_sweep(kind, options, key, tmp_path, capsys):
    bench, out = tmp_path / "bench", tmp_path / "found"
    assert cli.main(["bench", kind, EXAMPLE, "--out", str(bench), *options, "--quiet"]) == 0
    inertia = ["--inertia", "3.34e-4"] if kind == "coastdown" else []
    campaign = str(bench / "campaign.toml")
    arguments = ["identify", kind, campaign, "--model", EXAMPLE, "--out", str(out), "--json", *inertia]
    assert cli.main(arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["estimates"]
    assert {path.name for path in out.iterdir()} == {
        "index.html",
        "model.toml",
        "fit.json",
        "points.parquet",
        "input.toml",
    }
    settings = config.load(out / "model.toml")
    if key:
        truth = json.loads((bench / "truth.json").read_text())["truth"]
        assert settings.drive[key] == pytest.approx(truth[key], rel=0.02)
    assert cli.main(["sweep", str(out / "model.toml"), "--rows", "4", "--quiet"]) == 0


def test_exact_bench_of_a_start_and_stop(tmp_path):
    assert cli.main(["bench", "startstop", EXAMPLE, "--out", str(tmp_path), "--quiet"]) == 0
    assert (tmp_path / "startstop.parquet").exists()
    assert "<svg" in (tmp_path / "index.html").read_text()


@pytest.mark.parametrize("command", [["study", "speed"], ["bench", "stiffness"], ["identify", "stiffness"]])
def test_exact_results_of_another_command_are_refused_before_anything_is_computed(command, tmp_path, capsys):
    (tmp_path / "verdict.json").write_text("{}")
    assert cli.main([*command, "no such file", "--out", str(tmp_path)]) == 2
    assert "holds verdict.json, as results of another command do" in capsys.readouterr().err


def test_exact_study_writes_page_rows_and_claims(tmp_path, capsys):
    assert cli.main(["study", "load-inertia", EXAMPLE, "--out", str(tmp_path)]) == 0
    assert "S13 start A" in capsys.readouterr().out
    claims = json.loads((tmp_path / "claims.json").read_text())["claims"]
    assert {claim["claim"] for claim in claims} == {"S13 start f", "S13 start A", "S13 stop f", "S13 stop A"}
    assert (tmp_path / "rows_J_l.parquet").exists()
    page = (tmp_path / "index.html").read_text()
    assert page.count("<svg") >= 2
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )


@pytest.mark.parametrize(
    "text",
    [
        "[kinematic_error]\norders = [2, 4, 6]\ncos = [6e-5, 1e-5, 2e-6]\nsin = [7e-5, 0.0, 1e-6]\n",
        "[kinematic_error]\norders = [2]\n",
        "[kinematic_error]\norders = []\n",
        "[drive]\nte_cos_1 = 1e-5\n",
        "[drive]\nJ_m = 2e-4\n",
    ],
)
def test_against_config_a_study_has_the_kinematic_error_of_the_file(text, tmp_path, monkeypatch):
    """Every order as a sweep of the file has it, zero where the file's list lacks it."""
    path, seen = tmp_path / "drive.toml", []
    path.write_text(text)

    def study(drive, _threads):
        seen.append({row.name: row.default for row in params()} | drive)
        return Study("speed", "", "", {}, [])

    monkeypatch.setitem(STUDIES, "speed", study)
    assert cli.main(["study", "speed", str(path), "--quiet"]) == 0
    nominal = config.load(path).nominal()
    assert {name: nominal.get(name, 0.0) for name in seen[0] if name.startswith("te_")} == {
        name: value for name, value in seen[0].items() if name.startswith("te_")
    }


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["identify", "friction", "missing.csv"], "no such file"),
        (["identify", "kinematic-error", "{run}"], "--ratio"),
        (["identify", "stiffness", "{run}", "--ratio", "121"], "load_angle"),
        (["identify", "stiffness", "{run}", "--column", "motor_angel=x"], "did you mean 'motor_angle'"),
        (["identify", "stiffness", "{run}", "--column", "t"], "is not NAME=COLUMN"),
        (["study", "stiffness", "{piecewise}"], "allowed for a study"),
        (
            ["study", "stiffness", "{heavy}"],
            "J_l = 3 kg m^2 (allowed for a study: 0.5 or left out; its loads are 0.5, 2, 12)",
        ),
        (["study", "validate", "{undamped}"], "B_m, B_ml, B_l are 0 (allowed for a study: one of them"),
        (["study", "speed", "{impossible}"], "k1 = -1"),
        (["study", "all", "{backward}"], "ratio = -121 is out of range"),
        (["study", "validate", "{stiff}"], "torsional mode at 3097 Hz (allowed for validate: below 1000 Hz)"),
        (["study", "speed", "{moving}"], "omega_set, tau_load in [drive] (allowed for a study: none, its motions"),
        (["study", "stiffness", "{rubbing}"], "terms coulomb_friction (allowed for a study: none)"),
    ],
)
def test_exact_wrong_input_ends_with_two(arguments, text, tmp_path, capsys):
    run, piecewise = tmp_path / "run.csv", tmp_path / "piecewise.toml"
    run.write_text("t,motor_angle\n" + "".join(f"{i},{i}\n" for i in range(20)))
    piecewise.write_text('[drive]\nspring = "piecewise"\n')
    heavy, rubbing = tmp_path / "heavy.toml", tmp_path / "rubbing.toml"
    heavy.write_text("[drive]\nJ_l = 3\n")
    rubbing.write_text('[[terms]]\neffect = "coulomb_friction"\n')
    undamped, impossible = tmp_path / "undamped.toml", tmp_path / "impossible.toml"
    undamped.write_text("[drive]\nB_m = 0\nB_ml = 0\nB_l = 0\n")
    impossible.write_text("[drive]\nk1 = -1\n")
    backward, stiff = tmp_path / "backward.toml", tmp_path / "stiff.toml"
    backward.write_text("[drive]\nratio = -121\n")
    stiff.write_text("[drive]\nk1 = 1.7e8\n")
    moving = tmp_path / "moving.toml"
    moving.write_text("[drive]\nomega_set = 30\ntau_load = 1\n")
    files = {"run": run, "piecewise": piecewise, "heavy": heavy, "rubbing": rubbing}
    files |= {"undamped": undamped, "impossible": impossible, "backward": backward, "stiff": stiff, "moving": moving}
    given = [part.format(**files) for part in arguments]
    assert cli.main(given) == 2
    assert text in capsys.readouterr().err
