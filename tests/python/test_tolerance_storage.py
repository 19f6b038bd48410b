from __future__ import annotations

import hashlib
import json
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import hdfast
import numpy as np
import pyarrow.parquet as pq
import pytest
from hdfast import config
from hdfast.cli import main
from hdfast.tolerance.chunks import halving, ranges, run_here
from hdfast.tolerance.run import fingerprint
from hdfast.tolerance.sample import Plan
from hdfast.tolerance.store import FolderStore, MemoryStore
from hdfast.tolerance.study import Study
from hdfast.tolerance.task import Task
from hdfast.tolerance.trajectories import Trajectories
from processes import interruptible
from toleranced import SMALL

BENCHMARK = Path(__file__).parents[2] / "examples" / "benchmark.toml"
RUN = """import sys, hdfast
hdfast.tolerance(sys.argv[1], n=int(sys.argv[2]), out=sys.argv[3], chunk=25, resume=True, threads=1)"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def columns(study):
    return {name: study.column(name) for name in (*study.plan.names, *study.metrics)}


@pytest.mark.parametrize("sampling", ["monte_carlo", "sobol", "latin_hypercube"])
def test_exact_same_bits_whatever_the_chunks_threads_and_place(small, tmp_path, sampling):
    small.write_text(SMALL + "block = 20\n")
    whole = hdfast.tolerance(small, sampling=sampling, n=60)
    for chunk, threads in ((7, 1), (60, 2), (1000, 1)):
        other = hdfast.tolerance(
            small, sampling=sampling, n=60, chunk=chunk, threads=threads, out=tmp_path / f"{chunk}"
        )
        for name, values in columns(whole).items():
            assert np.array_equal(values, other.column(name)), name
        assert other.percentiles == whole.percentiles
        assert other.worst() == whole.worst()


def test_exact_more_rows_continue_the_first(small, tmp_path):
    out = tmp_path / "out"
    first = hdfast.tolerance(small, n=40, out=out, chunk=16)
    before = {name: values.copy() for name, values in columns(first).items()}
    kept = (out / "rows" / "000000000000.parquet").stat().st_mtime_ns
    more = hdfast.tolerance(small, n=70, out=out, chunk=999, resume=True)
    assert (out / "rows" / "000000000000.parquet").stat().st_mtime_ns == kept
    assert more.store.chunk == 16
    for name, values in before.items():
        assert np.array_equal(more.column(name)[:40], values)
    straight = hdfast.tolerance(small, n=70, out=tmp_path / "straight", chunk=16)
    assert contents(out) == contents(tmp_path / "straight")
    assert straight.yields == more.yields


def stored(folder):
    manifest = folder / "manifest.json"
    return len(json.loads(manifest.read_text())["chunks"]) if manifest.exists() else 0


def killed_somewhere(command, folder, chance):
    """Start a run, kill it a random moment after a random number of further chunks; True when it was still running."""
    process = subprocess.Popen(command)
    target = stored(folder) + chance.randrange(1, 6)
    deadline = time.monotonic() + 60
    while stored(folder) < target and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.002)
    time.sleep(chance.uniform(0.0, 0.03))
    running = process.poll() is None
    process.send_signal(signal.SIGKILL)
    process.wait()
    return running


def test_exact_killed_at_random_moments_and_resumed_gives_identical_bytes(small, tmp_path, long):
    rows, kills = ("10000", 20) if long else ("1500", 2)
    straight, broken = tmp_path / "straight", tmp_path / "broken"
    subprocess.run([sys.executable, "-c", RUN, str(small), rows, str(straight)], check=True)
    chance, command = random.Random(5), [sys.executable, "-c", RUN, str(small), rows, str(broken)]
    for _ in range(kills):
        assert killed_somewhere(command, broken, chance)
    assert 0 < stored(broken) < stored(straight)
    subprocess.run(command, check=True)
    assert contents(broken) == contents(straight)


def test_exact_damaged_missing_and_half_written_files_are_done_again(small, tmp_path):
    out = tmp_path / "out"
    hdfast.tolerance(small, n=50, out=out, chunk=10)
    whole = contents(out)
    (out / "rows" / "000000000010.parquet").write_bytes(b"PAR1 damaged")
    (out / "rows" / "000000000030.parquet").unlink()
    (out / "rows" / ".000000000040.parquet-x7").write_bytes(b"half")
    (out / ".manifest.json-abc").write_bytes(b"{")
    hdfast.tolerance(small, n=50, out=out, chunk=10, resume=True)
    assert contents(out) == whole


def test_exact_other_studies_are_not_mixed(small, tmp_path):
    out = tmp_path / "out"
    hdfast.tolerance(small, n=20, out=out)
    with pytest.raises(hdfast.InputError, match="holds a study already"):
        hdfast.tolerance(small, n=20, out=out)
    with pytest.raises(hdfast.InputError, match=r"another study: seed is 3 there and 99 here"):
        hdfast.tolerance(small, n=20, out=out, seed=99, resume=True)
    with pytest.raises(hdfast.InputError, match="holds 20 rows"):
        hdfast.tolerance(small, n=10, out=out, resume=True)
    with pytest.raises(hdfast.InputError, match="needs out"):
        hdfast.tolerance(small, resume=True)
    (out / "manifest.json").write_text("{")
    with pytest.raises(hdfast.InputError, match="cannot be read"):
        hdfast.tolerance(small, n=20, out=out, resume=True)


def test_regress_two_runs_into_one_folder_are_not_mixed(small, tmp_path):
    """Each once removed the other's half-written files and wrote the rows of its own file beside the other's."""
    other, out, refused = config.parse(SMALL.replace("0.1", "0.5")), tmp_path / "out", []

    def begin_another(done, _total):
        for resume in (False, True):
            with pytest.raises(hdfast.InputError, match="out': another run is at work there"):
                hdfast.tolerance(other, n=40, out=out, resume=resume)
        with pytest.raises(hdfast.InputError, match="another run is at work there"):
            hdfast.tolerance(other, n=2).report(out)
        refused.append(done)

    hdfast.tolerance(small, n=40, chunk=20, out=out, progress=begin_another)
    hdfast.tolerance(small, n=40, chunk=20, out=tmp_path / "alone")
    assert refused
    assert contents(out) == contents(tmp_path / "alone")


def test_regress_no_report_of_rows_that_another_run_has_added_to_since(small, tmp_path, undrawn):
    first = hdfast.tolerance(small, n=20, out=tmp_path / "out")
    hdfast.tolerance(small, n=40, out=tmp_path / "out", resume=True).report(tmp_path / "out")
    whole = contents(tmp_path / "out")
    with pytest.raises(hdfast.InputError, match=r"another run has stored rows there since \(read them with resume"):
        first.report(tmp_path / "out")
    assert contents(tmp_path / "out") == whole


def test_regress_a_report_is_where_the_rows_are(small, tmp_path, undrawn):
    study = hdfast.tolerance(small, n=20, out=tmp_path / "out")
    with pytest.raises(hdfast.InputError, match=r"other': the study has its rows elsewhere \(allowed: '.*out'\)"):
        study.report(tmp_path / "other")
    assert not (tmp_path / "other").exists()
    assert study.report(tmp_path / "out" / ".." / "out").exists()


def test_regress_an_input_with_a_table_runs_from_the_copy_and_a_changed_table_is_noticed(tmp_path, capsys, undrawn):
    text = SMALL.replace(
        'distribution = "lognormal"\nsigma_log = 0.1', 'distribution = "empirical"\nfile = "data/m.csv"'
    )
    (tmp_path / "data").mkdir()
    table, file = tmp_path / "data" / "m.csv", tmp_path / "small.toml"
    table.write_text("te_scale\n0.9\n1.1\n1.2\n")
    file.write_text(text)
    checksum = {"data/m.csv": hashlib.sha256(table.read_bytes()).hexdigest()}
    for command in ("tolerance", "sweep"):
        for source, out in ((file, "one"), (tmp_path / f"{command}-one" / "input.toml", "two")):
            assert main([command, str(source), "--out", str(tmp_path / f"{command}-{out}"), "--quiet"]) == 0
            assert json.loads((tmp_path / f"{command}-{out}" / "summary.json").read_text())["tables_sha256"] == checksum
    assert contents(tmp_path / "tolerance-one") == contents(tmp_path / "tolerance-two")
    again = ["tolerance", str(file), "--out", str(tmp_path / "tolerance-one"), "--resume", "--quiet"]
    table.write_text("te_scale\n0.9\n1.1\n1.3\n")
    assert main(again) == 2
    assert "a table of measured values differs" in capsys.readouterr().err
    table.write_text("te_scale\n0.9\n1.1\n1.2\n")
    file.write_text(text + "# the same rows\n")
    assert main(again) == 2
    assert "the file differs" in capsys.readouterr().err


def test_exact_a_file_in_the_place_of_the_rows_is_named(small, tmp_path):
    (tmp_path / "rows").touch()
    with pytest.raises(hdfast.InputError, match=r"rows' cannot be written: it is a file, not a folder"):
        hdfast.tolerance(small, n=20, out=tmp_path)


def test_exact_rows_that_are_drawn_otherwise_are_not_mixed(small, tmp_path, monkeypatch):
    """An earlier version had the same version number, and batches that meant something else."""
    out = tmp_path / "out"
    hdfast.tolerance(small, n=20, out=out)
    with monkeypatch.context() as otherwise:
        otherwise.setattr(Plan, "_dependent", lambda plan, points, start, stop: 0.99 * points)
        with pytest.raises(hdfast.InputError, match="another study: its rows are drawn otherwise"):
            hdfast.tolerance(small, n=40, out=out, resume=True)
    manifest = json.loads((out / "manifest.json").read_text())
    del manifest["fingerprint"]["draws_sha256"]
    (out / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(hdfast.InputError, match=r"earlier version of hdfast.*take another folder"):
        hdfast.tolerance(small, n=40, out=out, resume=True)


@pytest.mark.parametrize(
    "changed",
    [
        lambda c: {"scenario": hdfast.Scenario.start_stop(t_end=0.6, t_off=0.3)},
        lambda c: {"scenario": hdfast.Scenario.start_stop(t_end=0.6, t_off=0.4, load=([0.0, 0.6], [0.0, 1.0]))},
        lambda c: {"drive": {**c.drive, "B_m": 0.01}},
        lambda c: {"model": hdfast.Model(terms=["coulomb_friction"])},
        lambda c: {"run": replace(c.run, rtol=1e-8)},
        lambda c: {"trajectories": Trajectories(("te",), 0.1)},
    ],
)
def test_exact_a_changed_configuration_is_another_study_although_its_text_is_the_same(small, tmp_path, changed):
    parsed = config.load(small)
    hdfast.tolerance(parsed, n=20, chunk=10, out=tmp_path)
    with pytest.raises(hdfast.InputError, match="another study: drive, model, scenario, numerical settings"):
        hdfast.tolerance(replace(parsed, **changed(parsed)), n=40, out=tmp_path, resume=True)
    same = replace(parsed, title="another", run=replace(parsed.run, threads=2))
    assert hdfast.tolerance(same, n=30, out=tmp_path, resume=True).n == 30
    assert hdfast.tolerance(small, n=40, out=tmp_path, resume=True).n == 40


def test_exact_manifest_names_everything_that_decides_the_rows(small, tmp_path):
    hdfast.tolerance(small, n=30, out=tmp_path / "out", chunk=20)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["fingerprint"]["seed"] == 3
    assert [entry["rows"] for entry in manifest["chunks"]] == [20, 10]
    table = pq.read_table(tmp_path / "out" / "rows" / "000000000000.parquet")
    assert table.schema.field("te_pp").metadata[b"unit"] == b"rad"
    assert table.column_names == ["J_l", "k1", "te_scale", "te_pp", "peak_windup", "te_rms", "status", "steps"]


class Poisoned:
    """The task of a study in which one row raises."""

    def __init__(self, task, row):
        self.task, self.row, self.calls = task, row, 0

    def __call__(self, start, stop):
        self.calls += 1
        if start <= self.row < stop:
            raise MemoryError("too much")
        return self.task(start, stop)

    def poisoned(self, row, reason):
        return self.task.poisoned(row, reason)


def small_task():
    parsed = config.parse(SMALL)
    return Task(parsed, parsed.plan(), ("te_pp", "peak_windup", "te_rms"), 1)


def test_exact_a_poison_row_is_found_and_costs_nobody_else(tmp_path):
    task = small_task()
    store = FolderStore(tmp_path / "out", fingerprint(task), chunk=32)
    work = Poisoned(task, 37)
    run_here(work, ranges(64, 32), store, lambda rows: None)
    clean = MemoryStore()
    run_here(task, ranges(64, 64), clean, lambda rows: None)
    assert store.poison == [(37, "MemoryError: too much")]
    assert work.calls <= 2 + 2 * 5
    assert store.status()[37] == "internal"
    values, good = store.column("te_pp"), np.arange(64) != 37
    assert np.isnan(values[37])
    assert np.array_equal(values[good], clean.column("te_pp")[good])
    again = FolderStore(tmp_path / "out", fingerprint(task), chunk=32, resume=True)
    assert again.poison == store.poison
    study = Study(task.config, task.plan, 64, again, "exclude", task)
    assert study.reason(37) == "row 37: MemoryError: too much"


def test_exact_joined_halves_are_the_bytes_of_one_run(tmp_path):
    task = small_task()

    def flaky(start, stop):
        if stop - start > 8:
            raise OSError("again")
        return task(start, stop)

    one, two = (FolderStore(tmp_path / name, fingerprint(task), chunk=32) for name in "ab")
    one.put(task(0, 32))
    two.put(halving(flaky, 0, 32))
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_exact_trajectories_in_zarr(tmp_path):
    import zarr

    path = tmp_path / "small.toml"
    path.write_text(SMALL + '[trajectories]\nsignals = ["te", "omega_l"]\nstep = 0.01\n')
    hdfast.tolerance(path, n=30, out=tmp_path / "a", chunk=12)
    root = zarr.open_group(str(tmp_path / "a" / "trajectories.zarr"), mode="r")
    assert root["te"].shape == (30, 61)
    assert root["te"].attrs["units"] == "rad"
    parsed = config.load(path)
    plan = parsed.plan()
    direct = hdfast.sweep(
        {**parsed.drive, **plan.draw(0, 30)}, scenario=parsed.scenario, t_eval=root["t"][:], signals=["te"]
    )
    assert np.array_equal(root["te"][:], direct["te"])
    whole = contents(tmp_path / "a")
    (tmp_path / "a" / "trajectories.zarr" / "te" / "c" / "1" / "0").write_bytes(b"damaged")
    hdfast.tolerance(path, n=30, out=tmp_path / "a", chunk=12, resume=True)
    assert contents(tmp_path / "a") == whole
    hdfast.tolerance(path, n=12, out=tmp_path / "b", chunk=12)
    hdfast.tolerance(path, n=30, out=tmp_path / "b", chunk=12, resume=True)
    assert contents(tmp_path / "b") == whole


def test_exact_a_chunk_without_samples_is_stored_and_found_again(tmp_path):
    import zarr

    parsed = config.parse(SMALL + '[trajectories]\nsignals = ["te"]\nstep = 0.1\n')
    task = Task(parsed, parsed.plan(), ("te_pp",), 1)

    def store(*, resume):
        times = parsed.trajectories.times(0.6)
        return FolderStore(tmp_path / "out", fingerprint(task), chunk=1, resume=resume, signals=("te",), times=times)

    first = store(resume=False)
    first.put(task.poisoned(0, "killed"))
    first.put(task(1, 2))
    again = store(resume=True)
    assert again.done(0, 1)
    assert again.done(1, 2)
    samples = zarr.open_group(str(tmp_path / "out" / "trajectories.zarr"), mode="r")["te"][:]
    assert np.all(np.isnan(samples[0]))
    assert np.all(np.isfinite(samples[1]))


@pytest.mark.parametrize("where", ["memory", "folder"])
def test_exact_an_error_of_the_progress_function_is_the_users_and_no_rows_fault(small, tmp_path, where):
    out = tmp_path / "out" if where == "folder" else None

    def complain(done, _total):
        if done:
            raise ValueError("mine")

    with pytest.raises(ValueError, match=r"^mine$"):
        hdfast.tolerance(small, n=40, chunk=20, out=out, progress=complain)
    if out is not None:
        assert hdfast.tolerance(small, n=40, chunk=20, out=out, resume=True).status_counts == {"finished": 40}


def test_exact_the_last_sample_is_not_beyond_the_end(tmp_path):
    """3 * 0.2 > 0.6 in binary."""
    parsed = config.parse(SMALL + '[trajectories]\nsignals = ["te"]\nstep = 0.2\n')
    assert parsed.trajectories.times(0.6).tolist() == [0.0, 0.2, 0.4, 0.6]
    assert hdfast.tolerance(parsed, n=4, out=tmp_path / "out").status_counts == {"finished": 4}


def test_exact_a_study_without_manifest_leaves_no_times_behind(tmp_path):
    """Killed before its first chunk was stored, a study leaves an array t; the next one brings its own."""
    import zarr

    text = SMALL + '[trajectories]\nsignals = ["te"]\nstep = {}\n'
    hdfast.tolerance(config.parse(text.format(0.05)), n=8, out=tmp_path / "out")
    (tmp_path / "out" / "manifest.json").unlink()
    hdfast.tolerance(config.parse(text.format(0.1)), n=8, out=tmp_path / "out")
    hdfast.tolerance(config.parse(text.format(0.1)), n=8, out=tmp_path / "straight")
    root = zarr.open_group(str(tmp_path / "out" / "trajectories.zarr"), mode="r")
    assert np.allclose(root["t"][:], np.arange(7) * 0.1)
    assert contents(tmp_path / "out") == contents(tmp_path / "straight")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("format", 99, "format = 99 is out of range"),
        ("chunk", 0, "chunk = 0 is out of range"),
        ("fingerprint", 5, "cannot be read"),
        ("fingerprint", [], "another study"),
        ("chunks", [{"start": 0, "rows": 20}], "'file'"),
        ("chunks", 3, "cannot be read"),
    ],
)
def test_exact_a_manifest_of_another_kind_is_refused(small, tmp_path, key, value, message):
    out = tmp_path / "out"
    hdfast.tolerance(small, n=20, out=out)
    manifest = json.loads((out / "manifest.json").read_text())
    (out / "manifest.json").write_text(json.dumps(manifest | {key: value}))
    with pytest.raises(hdfast.InputError, match=message):
        hdfast.tolerance(small, n=20, out=out, resume=True)


def test_exact_memory_of_many_rows_stays_small(tmp_path, long):
    """The benchmark problem with its outputs: what many rows take beyond a few (1,000,000 rows with --long)."""
    rows = 1_000_000 if long else 20_000
    script = tmp_path / "run.py"
    script.write_text(
        "import pathlib, sys, hdfast\n"
        "def run(rows, out):\n"
        "    study = hdfast.tolerance(sys.argv[1], n=rows, out=out)\n"
        "    study.yields, study.percentiles\n"
        "    status = pathlib.Path('/proc/self/status').read_text()\n"
        "    return int(status.split('VmHWM:')[1].split()[0]) / 1e3\n"
        "few = run(64, sys.argv[3] + '-few')\n"
        "print(few, run(int(sys.argv[2]), sys.argv[3]) - few)\n"
    )
    command = [sys.executable, str(script), str(BENCHMARK), str(rows), str(tmp_path / "out")]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    few, growth = map(float, done.stdout.split())
    assert few + growth < 1000.0, done.stdout
    assert growth < (700.0 if long else 60.0), done.stdout


def test_exact_ctrl_c_keeps_finished_chunks_and_says_how_to_go_on(tmp_path):
    out = tmp_path / "out"
    command = [sys.executable, "-m", "hdfast.cli", "tolerance", str(BENCHMARK), "--rows", "200000", "--chunk", "2000"]
    process = interruptible([*command, "--out", str(out), "--quiet"], stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not stored(out) and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    errors = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert "continue with --resume" in errors
    assert stored(out) > 0
