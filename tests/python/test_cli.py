from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import hdfast
import pyarrow.parquet as pq
import pytest
from hdfast.cli import main
from hdfast.files import write_text
from processes import interruptible

EXAMPLE = Path(__file__).parents[2] / "examples" / "shf-25-120.toml"
SMALL = """title = "small <drive>"
[scenario]
t_end = 1.2
t_off = 0.8
[tolerance.J_l]
distribution = "uniform"
lower = 0.4
upper = 0.6
[spec.te_pp]
upper = 1.0
[run]
rows = 12
seed = 5
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


def test_exact_rooms_need_no_import_of_their_own():
    names = "bench health identify proof recordings reference sensors studies tolerance"
    program = "import hdfast, sys; print(*(getattr(hdfast, name).__name__ for name in sys.argv[1:]))"
    command = [sys.executable, "-c", program, *names.split()]
    found = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert found.split() == [f"hdfast.{name}" for name in names.split()]


def test_exact_the_command_starts_without_what_only_some_commands_need():
    heavy = ["scipy.signal", "scipy.stats", "scipy.special", "scipy.optimize", "matplotlib", "pyarrow", "numba", "h5py"]
    code = f"import sys, hdfast.cli; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_exact_bare_command_says_what_to_try(capsys):
    assert main([]) == 0
    text = capsys.readouterr().out
    assert re.findall(r"^  hdfast (\w+)", text, re.MULTILINE) == ["params", "sweep", "diagnose"]
    assert hdfast.__version__ in text


@pytest.mark.parametrize("command", ["sweep", "simulate", "params", "info"])
def test_exact_help_shows_an_example(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"example:\n  hdfast {command}" in capsys.readouterr().out


def test_exact_sweep_writes_the_folder(small, tmp_path, capsys):
    out = tmp_path / "deep" / "out"
    assert main(["sweep", str(small), "--out", str(out), "--threads", "1"]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["index.html", "input.toml", "rows.parquet", "summary.json"]
    captured = capsys.readouterr()
    assert "te_pp" in captured.out
    assert "P95" in captured.out
    assert captured.err == ""
    assert (out / "input.toml").read_text() == SMALL
    table = pq.read_table(out / "rows.parquet")
    assert table.num_rows == 12
    assert table.schema.field("te_pp").metadata[b"unit"] == b"rad"
    assert table.schema.metadata[b"seed"] == b"5"
    assert table.schema.metadata[b"hdfast_version"] == hdfast.__version__.encode()
    assert {"J_l", "ratio", "omega_set", "status", "te_pp"} <= set(table.column_names)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["version"] == hdfast.__version__
    assert summary["seed"] == 5
    assert summary["status"] == {"finished": 12}
    assert summary["metrics"]["te_pp"]["unit"] == "rad"
    assert summary["specifications"]["te_pp"]["yield"] == 1


@pytest.mark.parametrize("command", ["sweep", "tolerance"])
def test_exact_a_file_without_tolerances_is_told_that_its_rows_are_equal(command, small, capsys):
    small.write_text("[scenario]\nt_end = 0.5\nt_off = 0.4\n[run]\nrows = 4\n")
    main([command, str(small)])
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("hdfast: note: the file has no [tolerance.<name>], so all rows are the same drive")
    main([command, str(small), "--quiet"])
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", ["sweep", "simulate", "tolerance"])
def test_exact_a_drive_that_its_friction_holds_at_the_start_is_told(command, small, capsys):
    """The torque that sustains the speed is less than what breaks the drive away."""
    friction = '[[terms]]\neffect = "stribeck_friction"\nparameters = {{ T_c = 0.05, breakaway_ratio = {} }}\n'
    for ratio, told in ((1.0, False), (5.0, True)):
        small.write_text(SMALL + friction.format(ratio))
        main([command, str(small)])
        assert ("the nominal drive never moves" in capsys.readouterr().err) is told
        main([command, str(small), "--quiet"])
        assert "never moves" not in capsys.readouterr().err


def test_exact_same_seed_same_rows(small, tmp_path, undrawn):
    for name in ("a", "b"):
        main(["sweep", str(small), "--out", str(tmp_path / name), "--quiet"])
    main(["sweep", str(small), "--out", str(tmp_path / "c"), "--quiet", "--seed", "6", "--rows", "7"])
    first, second, third = (pq.read_table(tmp_path / name / "rows.parquet") for name in "abc")
    assert first.to_pandas().equals(second.to_pandas())
    assert third.num_rows == 7
    assert first["J_l"][0] != third["J_l"][0]


def test_exact_json_and_quiet(small, tmp_path, capsys):
    assert main(["sweep", str(small), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 12
    assert main(["sweep", str(small), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert main(["simulate", str(small), "--json", "--out", str(tmp_path / "one")]) == 0
    assert json.loads(capsys.readouterr().out)["status"] == "finished"
    assert main(["simulate", str(small), "--quiet"]) == 0
    assert main(["info", "--quiet"]) == 0
    assert main(["params", "--quiet"]) == 0
    assert capsys.readouterr().out == ""


def test_exact_specification_not_met_is_exit_code_1(small, capsys):
    small.write_text(SMALL.replace("upper = 1.0", "upper = 1e-9"))
    assert main(["sweep", str(small)]) == 1
    assert "NO" in capsys.readouterr().out


def test_exact_simulate_writes_the_folder(small, tmp_path, capsys):
    out = tmp_path / "one"
    assert main(["simulate", str(small), "--out", str(out)]) == 0
    assert sorted(p.name for p in out.iterdir()) == ["index.html", "input.toml", "summary.json", "trajectory.parquet"]
    table = pq.read_table(out / "trajectory.parquet")
    assert table.schema.field("te").metadata[b"unit"] == b"rad"
    assert table["t"][-1].as_py() == 1.2
    assert "te_pp" in capsys.readouterr().out


def test_exact_json_has_null_where_a_number_is_infinite(small, tmp_path, capsys):
    small.write_text(SMALL.replace("[scenario]\n", "[scenario]\nstop = 'brake'\ntau_max = inf\n"))
    out = tmp_path / "one"
    assert main(["simulate", str(small), "--out", str(out), "--json"]) == 0
    printed = strict(capsys.readouterr().out)
    assert printed == strict((out / "summary.json").read_text())
    assert printed["parameters"]["tau_max"] is None
    assert printed["parameters"]["J_l"] == 0.5
    assert main(["terms", "--json"]) == 0
    assert strict(capsys.readouterr().out)


def strict(text):
    """What the standard allows, which knows no NaN and no Infinity."""

    def refuse(constant):
        raise AssertionError(constant)

    return json.loads(text, parse_constant=refuse)


def test_exact_a_drive_that_fails_is_exit_code_1(small, capsys):
    small.write_text(SMALL + "max_steps = 5\n")
    assert main(["simulate", str(small)]) == 1
    assert "max_steps" in capsys.readouterr().out


def test_exact_commas_group_thousands(small, capsys):
    assert main(["sweep", str(small), "--rows", "1,000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 1000
    for text in ("1,5", "1,50,000", ",100", "1_"):
        with pytest.raises(SystemExit):
            main(["sweep", str(small), "--rows", text])
        assert "is not a whole number" in capsys.readouterr().err


def test_exact_params_and_info(capsys):
    assert main(["params", "--spring", "piecewise"]) == 0
    assert "K1" in capsys.readouterr().out
    assert main(["params", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["name"] == "ratio"
    assert main(["info"]) == 0
    text = capsys.readouterr().out
    assert "dop853" in text
    assert "peak_windup" in text
    assert main(["info", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["build"]["version"] == hdfast.__version__


def test_exact_terms_are_listed_and_shown_in_full(capsys):
    assert main(["terms"]) == 0
    listed = capsys.readouterr().out.splitlines()[2:]
    assert [line.split()[0] for line in listed] == hdfast.terms().ids
    assert main(["terms", "coulomb_friction", "sensor_delay"]) == 0
    shown = capsys.readouterr().out
    for term in (hdfast.terms()["coulomb_friction"], hdfast.terms()["sensor_delay"]):
        assert {term.equation, term.source} <= {line[12:] for line in shown.splitlines()}
        assert all(f"{part.name} " in shown and part.meaning in shown for part in term.parameters)
    assert main(["terms", "coulomb_friction", "--json"]) == 0
    assert [row["id"] for row in json.loads(capsys.readouterr().out)] == ["coulomb_friction"]
    assert main(["terms", "backlash", "--quiet"]) == 0
    assert capsys.readouterr().out == ""


def test_exact_lines_of_terms_end_at_the_edge_of_a_terminal(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert main(["terms"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) == 60


@pytest.mark.parametrize("kind", ["stiffness", "kinematic-error", "friction", "starting-torque", "coastdown"])
def test_exact_examples_of_bench_and_identify_fit_together(kind, capsys):
    for command, text in (("bench", f"--out out/bench-{kind}\n"), ("identify", f"out/bench-{kind}/campaign.toml")):
        with pytest.raises(SystemExit):
            main([command, kind, "--help"])
        assert text in capsys.readouterr().out


@pytest.mark.parametrize(
    ("kind", "unread"),
    [
        ("stiffness", set()),
        ("kinematic-error", set()),
        ("startstop", set()),
        ("friction", {"--load-bits", "--angle-noise", "--delay"}),
        ("starting-torque", {"--load-bits", "--angle-noise", "--delay", "--torque-noise"}),
        ("coastdown", {"--load-bits", "--angle-noise", "--delay", "--torque-noise"}),
    ],
)
def test_exact_bench_has_options_only_of_sensors_that_its_recordings_hold(kind, unread, capsys):
    with pytest.raises(SystemExit):
        main(["bench", kind, "--help"])
    listed = set(re.findall(r"--[a-z-]+", capsys.readouterr().out))
    sensors = {"--motor-bits", "--load-bits", "--angle-noise", "--torque-noise", "--delay"}
    assert sensors - listed == unread


def test_exact_bench_takes_dry_friction_from_the_file_and_names_what_it_leaves_out(small, tmp_path, capsys):
    terms = '[[terms]]\neffect = "hysteresis"\n[[terms]]\neffect = "coulomb_friction"\nparameters = { T_c = 0.02 }\n'
    small.write_text(small.read_text() + terms)
    assert main(["bench", "coastdown", str(small), "--out", str(tmp_path / "own")]) == 0
    assert "in the file, not in this test: hysteresis\n" in capsys.readouterr().out
    for asked, level in (([], 0.02), (["--coulomb", "0.05"], 0.05)):
        assert main(["bench", "coastdown", str(small), "--out", str(tmp_path / "own"), "--json", *asked]) == 0
        said = json.loads(capsys.readouterr().out)
        assert (said["truth"]["T_c"], said["left_out"]) == (level, ["hysteresis"])


def test_regress_bench_does_not_write_over_a_campaign_file_that_it_did_not_make(small, tmp_path, capsys):
    own = tmp_path / "own"
    own.mkdir()
    (own / "campaign.toml").write_text("# my own campaign")
    assert main(["bench", "coastdown", str(small), "--out", str(own)]) == 2
    assert "holds another campaign.toml" in capsys.readouterr().err
    assert [(file.name, file.read_text()) for file in own.iterdir()] == [("campaign.toml", "# my own campaign")]


def test_regress_bench_leaves_no_recordings_of_an_earlier_one_and_all_other_files(small, tmp_path):
    own = tmp_path / "own"
    assert main(["bench", "coastdown", str(small), "--out", str(own), "--quiet"]) == 0
    first = {file.name for file in own.glob("*.parquet")}
    (own / "mine.parquet").write_text("my own")
    assert first
    assert main(["bench", "coastdown", str(small), "--out", str(own), "--format", "csv", "--quiet"]) == 0
    assert [file.name for file in own.glob("*.parquet")] == ["mine.parquet"]
    assert {file.stem for file in own.glob("*.csv")} == {Path(name).stem for name in first}


@pytest.mark.parametrize("command", ["sweep", "simulate", pytest.param("tolerance", marks=pytest.mark.long)])
@pytest.mark.parametrize("name", ["input.toml", "data/measured.csv"])
def test_regress_results_are_not_written_over_files_of_the_users_own(command, name, small, tmp_path, capsys, undrawn):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "measured.csv").write_text("te_scale\n0.9\n1.1\n")
    text = SMALL + '[tolerance.te_scale]\ndistribution = "empirical"\nfile = "data/measured.csv"\n'
    small.write_text(text)
    own = tmp_path / "own"
    (own / "data").mkdir(parents=True)
    (own / name).write_text("my own")
    arguments = [command, str(small), "--out", str(own), "--quiet"]
    assert main(arguments) == 2
    assert f"own' holds another {name}, which would be replaced" in capsys.readouterr().err
    assert [(file, file.read_text()) for file in own.rglob("*") if file.is_file()] == [(own / name, "my own")]
    (own / name).write_bytes((small if name == "input.toml" else tmp_path / name).read_bytes().replace(b"\n", b"\r\n"))
    assert main(arguments) < 2
    if command != "tolerance":
        small.write_text("# changed\n" + text)
        assert main(arguments) < 2
    assert (own / "input.toml").read_text() == small.read_text()


@pytest.mark.parametrize(
    ("first", "second", "left"),
    [
        ("simulate", "sweep", "trajectory.parquet"),
        ("sweep", "simulate", "rows.parquet"),
        pytest.param("sweep", "tolerance", "rows.parquet", marks=pytest.mark.long),
    ],
)
def test_regress_results_of_another_file_do_not_stay_beside_those_of_the_copy(
    first, second, left, small, tmp_path, undrawn
):
    out = tmp_path / "out"
    assert main([first, str(small), "--out", str(out), "--quiet"]) == 0
    assert main([second, str(small), "--out", str(out), "--quiet"]) == 0
    assert (out / left).exists()
    if second == "tolerance":
        (out / "manifest.json").unlink()
    small.write_text(SMALL.replace("0.6", "0.7"))
    assert main([second, str(small), "--out", str(out), "--quiet"]) == 0
    assert not (out / left).exists()
    assert (out / "input.toml").read_text() == small.read_text()


def test_regress_a_study_that_begins_takes_back_the_results_of_another_file_at_once(small, tmp_path):
    out = tmp_path / "out"
    assert main(["sweep", str(small), "--out", str(out), "--quiet"]) == 0
    small.write_text(SMALL.replace("0.6", "0.7"))
    with pytest.raises(ZeroDivisionError):
        hdfast.tolerance(small, out=out, progress=lambda done, total: 1 // 0)
    assert {path.name for path in out.iterdir()} <= {"manifest.json", "rows"}


@pytest.mark.parametrize("command", ["sweep", "simulate"])
def test_regress_the_rows_of_a_study_keep_their_input(command, small, tmp_path, capsys, undrawn):
    out = tmp_path / "out"
    assert main(["tolerance", str(small), "--out", str(out), "--quiet"]) == 0
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert main([command, str(small), "--out", str(out), "--quiet"]) == 2
    assert "out' holds the rows of a tolerance study: name another folder" in capsys.readouterr().err
    with pytest.raises(hdfast.InputError, match="holds the rows of a tolerance study"):
        hdfast.tolerance(small).report(out)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_exact_module_is_the_command():
    found = subprocess.run([sys.executable, "-m", "hdfast", "--version"], capture_output=True, text=True, check=True)
    assert hdfast.__version__ in found.stdout


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["sweep", "missing.toml"], "missing.toml: no such file"),
        (["sweep"], "FILE.toml"),
        (["swep"], "did you mean 'sweep'?"),
        (["study", "spede"], "did you mean 'speed'?"),
        (["sweep", str(EXAMPLE), "--rows", "0"], "--rows = 0"),
        (["sweep", str(EXAMPLE), "--rows", "ten"], "'ten' is not a whole number"),
        (["sweep", str(EXAMPLE), "--seed", "-1"], "--seed"),
        (["sweep", str(EXAMPLE), "--threads", "0"], "--threads"),
        (["sweep", str(EXAMPLE), "--colour"], "hdfast sweep: unknown option --colour (see hdfast sweep --help)"),
        (["sweep", str(EXAMPLE), "--row", "5"], "hdfast sweep: unknown option --row; did you mean '--rows'?"),
        (["sweep", str(EXAMPLE), "--row=5"], "unknown option --row; did you mean '--rows'?"),
        (["params", "J_l"], "hdfast params: unexpected 'J_l' (see hdfast params --help)"),
        (
            ["bench", "friction", "a.toml", "--out", "x", "--sed", "5"],
            "hdfast bench friction: unknown option --sed; did",
        ),
        (["bench", "coastdown", str(EXAMPLE), "--out", "x", "--delay", "0.1"], "unknown option --delay"),
        (["bench", "startstop", str(EXAMPLE), "--out", "x", "--delay", "-0.001"], "--delay = -0.001 s is out of range"),
        (["bench", "startstop", str(EXAMPLE), "--out", "x", "--delay", "nan"], "(allowed: a number from 0 to 10 s)"),
        (["identify", "starting-torque", "a.csv", "--ratio", "121"], "unknown option --ratio"),
        (["sweep", str(EXAMPLE), "--out", "/dev/null/x"], "cannot be written"),
        (["sweep", str(EXAMPLE), "--out", str(EXAMPLE)], "cannot be written: it is a file, not a folder"),
        (["params", "--spring", "steel"], "steel"),
        (["bench", "coastdown"], "FILE.toml"),
        (
            ["bench", "stiffness", str(EXAMPLE), "--out", "x", "--torque", "67", "40", "67.0000001"],
            "--torque = 67 is given more than once",
        ),
        (
            ["bench", "stiffness", str(EXAMPLE), "--out", "x", "--torque-rate", "2", "2"],
            "--torque-rate = 2 is given more than once",
        ),
        (["params", "--terms", "coulom"], "did you mean 'coulomb_friction'? (see hdfast terms)"),
        (["terms", "back"], "did you mean 'backlash'?"),
    ],
)
def test_exact_wrong_input_is_one_line_and_exit_code_2(arguments, text, capsys):
    try:
        code = main(arguments)
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    assert code == 2
    assert text in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_exact_wrong_file_names_line_and_key(small, capsys):
    small.write_text(SMALL.replace("t_off", "t_of"))
    assert main(["sweep", str(small)]) == 2
    assert "small.toml, line 4: [scenario] unknown key 't_of'; did you mean 't_off'" in capsys.readouterr().err


def test_exact_progress_goes_to_stderr_when_asked(small, capsys):
    assert main(["sweep", str(small), "--progress", "--quiet"]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "row" in captured.err


def test_exact_interrupt_keeps_finished_rows(small, tmp_path):
    small.write_text(SMALL + 'metrics = ["te_pp"]\n')
    out = tmp_path / "out"
    out.mkdir()
    for name in ("index.html", "summary.json"):
        (out / name).write_text("of an earlier run")
    command = [sys.executable, "-m", "hdfast.cli", "sweep", str(small), "--rows", "100000", "--out", str(out)]
    process = interruptible(
        [*command, "--progress", "--threads", "1"],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ},
    )
    seen = b""
    deadline = time.monotonic() + 60
    while not re.search(rb"[1-9]\d*/100000", seen) and time.monotonic() < deadline:
        seen += os.read(process.stderr.fileno(), 4096)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert b"of 100000 rows finished" in errors
    summary = json.loads((out / "summary.json").read_text())
    assert summary["interrupted"]
    assert summary["status"]["finished"] > 0
    assert summary["status"]["cancelled"] > 0
    assert summary["specifications"] == {}
    assert summary["rows_per_second"] < 100_000 / summary["seconds"]
    assert not (out / "index.html").exists()


def test_exact_what_cannot_be_written_is_named(small, tmp_path, capsys):
    (tmp_path / "out" / "rows.parquet").mkdir(parents=True)
    assert main(["sweep", str(small), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert re.search(r"rows\.parquet' cannot be written: Is a directory", capsys.readouterr().err)
    assert list((tmp_path / "out").glob(".*")) == []
    with pytest.raises(hdfast.InputError, match=r"x\.txt' cannot be written: Not a directory"):
        write_text(small / "x.txt", "")


def test_exact_a_folder_keeps_no_recording_of_an_earlier_drive(small, tmp_path, undrawn):
    small.write_text(SMALL + "[sensors]\nload_angle = { resolution = 6e-6 }\n")
    assert main(["simulate", str(small), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert (tmp_path / "out" / "recording.parquet").exists()
    small.write_text(SMALL + '[[terms]]\neffect = "coulomb_friction"\n')
    assert main(["simulate", str(small), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    assert not (tmp_path / "out" / "recording.parquet").exists()
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["model"]["terms"] == ["coulomb_friction"]


def test_exact_unknown_vector_code_is_one_line_and_exit_code_2(small, monkeypatch, capsys):
    monkeypatch.setenv("HDFAST_SIMD", "mmx")
    for arguments in (["info"], ["sweep", str(small)]):
        assert main(arguments) == 2
        error = capsys.readouterr().err
        assert "HDFAST_SIMD" in error
        assert "'mmx'" in error
        assert error.count("\n") == 1
    assert main(["params", "--quiet"]) == 0
