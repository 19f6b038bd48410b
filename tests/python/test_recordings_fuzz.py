"""Malformed recordings and campaigns: a sentence that names the file, never another exception, nothing written."""

from __future__ import annotations

import io
import re
import zipfile

import numpy as np
import pytest
import recorded_files
from hdfast import checks, health
from hdfast.errors import ConfigError, InputError
from hdfast.recordings import load, load_campaign, load_table
from hdfast.recordings.formats import mdf
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from simulated_recordings import campaign

N = 64
T = np.arange(N) / 100.0
GOOD = {"t": T, "motor_angle": np.sin(T), "motor_torque": 0.1 * np.cos(T), "load_angle": np.sin(T) / 121.0}


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """The bytes of one good file per kind."""
    folder = tmp_path_factory.mktemp("good")
    return {name: recorded_files.write(folder / name, GOOD).read_bytes() for name in recorded_files.KINDS}


def refusal(load_it, path):
    """The text of the InputError, empty when the file was read."""
    try:
        load_it(path)
    except InputError as error:
        return str(error)
    return ""


def refuse_or_read(path, data):
    """Load bytes; a refusal is an InputError with the name of the file in one line."""
    path.write_bytes(data)
    found = refusal(load_table, path)
    assert not found or path.name in found
    assert "\n" not in found
    assert [item.name for item in path.parent.iterdir()] == [path.name]
    return found


@pytest.mark.parametrize("name", recorded_files.KINDS)
def test_exact_truncated_files_are_refused_or_read(name, originals, tmp_path):
    data = originals[name]
    for share in (0.1, 0.8) if name == "run.mf4" else (0.0, 0.02, 0.1, 0.3, 0.5, 0.8, 0.97):
        path = tmp_path / name
        found = refuse_or_read(path, data[: int(share * len(data))])
        assert found or name in ("run.csv", "run.tdms", "run.mf4"), share
        for column, values in {} if found else load_table(path).columns.items():
            cut = name == "run.csv" and column == "load_angle"  # a text may end within its last number
            whole = len(values) - cut
            np.testing.assert_array_equal(values[:whole], GOOD[column][:whole])


@pytest.mark.parametrize("name", recorded_files.KINDS)
def test_exact_other_contents_are_refused(name, originals, tmp_path):
    rng = np.random.default_rng(1)
    others = [b"", b"\n", b"\0" * 600, b"PK\x03\x04", b"<html></html>", rng.bytes(5000)]
    others += [data for other, data in originals.items() if other.split(".")[1] != name.split(".")[1]]
    for data in others[::6] if name == "run.mf4" else others:
        if not (name == "run.csv" and data == originals["run.csv"]):
            found = refuse_or_read(tmp_path / name, data)
            assert found or (name == "run.h5" and data == originals["v73.mat"])
            for column, values in {} if found else load_table(tmp_path / name).columns.items():
                np.testing.assert_array_equal(values, GOOD[column])


@pytest.mark.parametrize("name", recorded_files.KINDS)
def test_exact_flipped_bytes_are_refused_or_read(name, originals, tmp_path, long):
    for seed in range(200 if long else 1 if name == "run.mf4" else 6):
        rng = np.random.default_rng(seed)
        data = bytearray(originals[name])
        for place in rng.integers(0, len(data), 1 + 3 * (seed % 12)):
            data[place] = rng.integers(0, 256)
        if not refuse_or_read(tmp_path / name, bytes(data)):
            columns = load_table(tmp_path / name).columns
            assert set(columns) <= set(GOOD)
            assert {values.dtype for values in columns.values()} <= {np.dtype(float)}
            assert len({values.shape for values in columns.values()}) <= 1


@pytest.mark.parametrize("name", recorded_files.KINDS)
def test_exact_sizes_beyond_the_memory_are_refused(name, originals, tmp_path, monkeypatch):
    monkeypatch.setattr(checks, "memory_limit", lambda: 4 * 8 * (N - 1))
    monkeypatch.setattr(mdf, "read", mdf.channels)
    assert "need" in refuse_or_read(tmp_path / name, originals[name])


def npz(**arrays):
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def bomb():
    """A member that declares 10^13 numbers and holds none."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"shape": (10**13,), "fortran_order": False, "descr": "<f8"})
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("t.npy", head.getvalue())
    return stream.getvalue()


ARRAYS = [
    ({"t": T, "motor_angle": np.array([1, "x", None] * 20, dtype=object)}, "column 'motor_angle' holds Python objects"),
    ({"t": T, "motor_angle": np.ones((N, 2))}, r"column 'motor_angle' has shape \(64, 2\)"),
    ({"t": T, "motor_angle": np.array(["a"] * N)}, "column 'motor_angle' has dtype <U1, not real numbers; row 1 holds"),
    ({"t": T, "motor_angle": T + 1j}, "column 'motor_angle' has dtype complex128"),
    ({"t": T, "motor_angle": T > 0.1}, "column 'motor_angle' has dtype bool"),
    ({"t": T, "motor_angle": T[:-1]}, r"'motor_angle' has shape \(63,\), t has \(64,\)"),
    ({"t": np.array(1.0), "motor_angle": T}, r"column 't' has shape \(\)"),
]


@pytest.mark.parametrize(("arrays", "message"), ARRAYS)
def test_exact_arrays_that_are_no_columns_are_named(arrays, message, tmp_path):
    assert re.search(message, refuse_or_read(tmp_path / "run.npz", npz(**arrays)))


def test_exact_a_bomb_is_refused_before_it_opens(tmp_path):
    assert "need" in refuse_or_read(tmp_path / "run.npz", bomb())


def test_exact_columns_of_text_in_tables_are_named(tmp_path):
    import h5py
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({"t": T, "motor_angle": ["1"] * N}), tmp_path / "run.parquet")
    with pytest.raises(InputError, match=r"run\.parquet: column 'motor_angle' holds string, not numbers"):
        load(tmp_path / "run.parquet")
    twice = pa.Table.from_arrays([pa.array(T), pa.array(T)], names=["t", "t"])
    pq.write_table(twice, tmp_path / "run.parquet")
    with pytest.raises(InputError, match="two columns are named 't'"):
        load(tmp_path / "run.parquet")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["t"] = T
        file["motor_angle"] = ["a"] * N
        file["elsewhere"] = h5py.ExternalLink(tmp_path / "other.h5", "t")
    with pytest.raises(InputError, match=r"run\.h5: column 'motor_angle' holds object, not numbers"):
        load(tmp_path / "run.h5")


def test_exact_a_column_in_another_file_is_not_opened(tmp_path):
    import h5py

    (tmp_path / "secret").write_bytes(T.tobytes())
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.create_dataset("t", (N,), "f8", external=[(str(tmp_path / "secret"), 0, 8 * N)])
    with pytest.raises(InputError, match="column 't' lies in another file"):
        load(tmp_path / "run.h5")


def test_exact_folders_missing_files_and_unknown_kinds(tmp_path):
    (tmp_path / "run.csv").mkdir()
    for name, message in (("run.csv", "not a file"), ("no.csv", "no such file"), ("run.xlsx", "unknown kind of file")):
        with pytest.raises(InputError, match=message):
            load(tmp_path / name)


TEXT = st.text(st.sampled_from("0123456789.,;\t\n-+eEnaif# \"'tx\r\ufeffé"), max_size=200)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(TEXT)
def test_exact_any_text_is_read_or_refused(tmp_path, text):
    for head in ("", "t,motor_angle\n", "t;motor_angle\n"):
        (tmp_path / "run.csv").write_text(head + text, encoding="utf-8")
        found = refusal(load_table, tmp_path / "run.csv")
        assert not found or "run.csv" in found


SAMPLE = st.one_of(
    st.floats(-10.0, 10.0), st.sampled_from([0.0, 1.0, float("nan"), float("inf"), -float("inf"), 1e300, -1e13, 5e-324])
)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_exact_health_has_an_answer_for_any_columns(data):
    size = data.draw(st.integers(0, 60))
    column = st.lists(SAMPLE, min_size=size, max_size=size).map(lambda values: np.array(values, dtype=np.float64))
    names = data.draw(st.sets(st.sampled_from(["t", "motor_angle", "motor_torque", "load_angle", "speed_reference"])))
    found = {name: data.draw(column) for name in sorted(names)}
    if data.draw(st.booleans()):
        found["t"] = np.arange(size) / 50.0
    result = health.check(campaign([found, found]))
    assert [item.mask.size for item in result] == [item.source.samples for item in result]
    assert all(item.usable or item.reason for item in result)
    assert repr(result)


FAULTS = {
    "nan": lambda c: c["motor_torque"].__setitem__(slice(5, 50), np.nan),
    "inf": lambda c: c["motor_angle"].__setitem__(7, np.inf),
    "huge": lambda c: c["motor_angle"].__setitem__(slice(None), 1e308),
    "no time": lambda c: c["t"].__setitem__(slice(None), np.nan),
    "zero steps": lambda c: c["t"].__setitem__(slice(None), 0.0),
    "negative steps": lambda c: c["t"].__setitem__(slice(None), -c["t"]),
    "constant": lambda c: [values.__setitem__(slice(None), 1.0) for name, values in c.items() if name != "t"],
    "one sample": lambda c: c.update({name: values[:1] for name, values in c.items()}),
    "no sample": lambda c: c.update({name: values[:0] for name, values in c.items()}),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_exact_a_broken_recording_does_not_break_the_campaign(fault):
    broken = {name: values.copy() for name, values in GOOD.items()}
    FAULTS[fault](broken)
    result = health.check(campaign([GOOD, broken]))
    assert result.recordings[0].usable
    assert result.recordings[1].usable is (fault == "inf")


CAMPAIGN = """title = "x"
[drive]
ratio = 121
J_l = { value = 0.6, sigma = 0.1 }
[drive.sigma]
ratio = 0.0
[kinematic_error]
orders = [1, 2]
cos = [1e-5, 0.0]
sin = [1e-5, 0.0]
sigma = 1e-6
[[terms]]
effect = "coulomb_friction"
parameters = { T_c = 0.03 }
[controller]
kind = "pi"
kp = 0.05
[sensors]
motor_angle = { resolution = 1e-5 }
[columns]
motor_torque = { scale = 2.0, sigma = 0.1 }
[[recording]]
file = "run.csv"
role = "fit"
"""
TOKENS = re.findall(r"\w+|[^\w\s]|\s", CAMPAIGN)
OTHERS = (
    "nan",
    "inf",
    "-1",
    "0",
    '"x"',
    "true",
    "[]",
    "{}",
    "[[terms]]",
    "1979-05-27",
    "\n",
    "=",
    "file",
    "1e9",
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, len(TOKENS) - 1), other=st.sampled_from(["", *OTHERS]), twice=st.booleans())
def test_exact_any_campaign_is_read_or_refused(tmp_path, place, other, twice):
    if not (tmp_path / "run.csv").exists():
        recorded_files.write(tmp_path / "run.csv", GOOD)
    text = "".join([*TOKENS[:place], TOKENS[place] if twice else "", other, *TOKENS[place + 1 :]])
    (tmp_path / "c.toml").write_text(text)
    refused = refusal(load_campaign, tmp_path / "c.toml")
    assert not refused or refused.startswith((f"{tmp_path}/", "run.csv"))
    if not refused:
        found = load_campaign(tmp_path / "c.toml")
        assert found.priors["ratio"].value == found.drive.values.get("ratio", 121.0)
        assert len(health.check(found).recordings) == len(found.recordings)


def test_exact_campaigns_that_are_no_text(tmp_path):
    for data in (b"\xff\xfe\x00", b"\0", b"[" * 5000):
        (tmp_path / "c.toml").write_bytes(data)
        with pytest.raises(ConfigError, match=r"c\.toml"):
            load_campaign(tmp_path / "c.toml")
    with pytest.raises(ConfigError, match="no such file"):
        load_campaign(tmp_path / "missing.toml")


def test_exact_few_whole_samples_are_refused_and_a_sparse_load_angle_is_left_out():
    holes = np.where(np.arange(N) % 2 == 0, np.nan, 1.0)
    alternating = GOOD | {
        "motor_angle": GOOD["motor_angle"] * holes,
        "motor_torque": GOOD["motor_torque"] * holes[::-1],
    }
    sparse = GOOD | {"motor_angle": GOOD["motor_angle"] * holes, "load_angle": GOOD["load_angle"] * holes[::-1]}
    refused, used = health.check(campaign([alternating, sparse])).recordings
    assert not refused.usable
    assert "0 samples have all of t, motor_angle, motor_torque" in refused.reason
    assert used.usable
