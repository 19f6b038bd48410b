"""Recordings: columns by name, scales, missing samples, every kind of file, campaign files."""

from __future__ import annotations

import math
import re
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import recorded_files
from hdfast import Scenario, checks
from hdfast.errors import ConfigError, InputError, MissingPackageError
from hdfast.recordings import Recording, gather, load, load_campaign, load_table, save, units
from hdfast.recordings.formats import Source

T = np.linspace(0.0, 1.0, 101)


def recording():
    return Recording("run", {"t": T, "motor_angle": 3.0 * T, "motor_torque": 0.0 * T})


@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz"])
def test_exact_every_kind_of_file_returns_what_was_saved(suffix, tmp_path):
    save(recording(), tmp_path / f"run.{suffix}")
    found = load(tmp_path / f"run.{suffix}")
    assert list(found) == ["t", "motor_angle", "motor_torque"]
    for name, values in recording().items():
        np.testing.assert_array_equal(found[name], values)


def test_exact_names_and_scales_are_mapped(tmp_path):
    (tmp_path / "run.csv").write_text("# rig 7\nt,enc,extra\n" + "".join(f"{x},{100 * x},1\n" for x in T))
    found = load(tmp_path / "run.csv", {"motor_angle": {"name": "enc", "scale": -0.01}})
    np.testing.assert_allclose(found["motor_angle"], -T)
    assert found.notes == ("columns left out: extra",)


def test_exact_missing_samples_are_masked_and_noted():
    angle = np.where(np.arange(101) % 10 == 3, np.nan, 3.0 * T)
    time = T.copy()
    time[50] = np.nan
    [found] = gather({"t": time, "motor_angle": angle})
    t, motor = found.need("a test", "t", "motor_angle")
    assert len(t) == len(motor) == 90
    assert "1 samples without time left out" in found.notes


def test_exact_missing_columns_are_named_with_unit_and_purpose():
    with pytest.raises(InputError, match=r"a stiffness test needs load_angle \[rad\], load_torque \[N m\]"):
        recording().need("a stiffness test", "load_angle", "load_torque")


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({"motor_angel": "x"}, "did you mean 'motor_angle'"),
        ({"motor_angle": {"name": "x", "gain": 2.0}}, "gain"),
        ({"motor_angle": {"name": "enc", "scale": 0.0}}, "scale = 0"),
        ({"motor_angle": "enc2"}, "no column 'enc2' for motor_angle"),
    ],
)
def test_exact_wrong_maps_are_named(columns, text):
    with pytest.raises(InputError, match=text):
        gather({"t": T, "enc": T}, columns)


def test_exact_time_must_run_forward():
    with pytest.raises(InputError, match="must strictly increase"):
        Recording("run", {"t": np.zeros(20)})


def test_exact_few_samples_that_repeat_a_time_are_left_out():
    t = np.arange(20.0)
    t[[5, 6, 12]] = t[4], t[4], t[11]
    [found] = gather({"t": t, "motor_angle": np.arange(20.0)})
    assert found["motor_angle"].tolist() == [n for n in range(20) if n not in (5, 6, 12)]
    assert found.notes == ("3 samples that repeat the time before them left out",)
    with pytest.raises(InputError, match="must strictly increase"):
        gather({"t": np.repeat(np.arange(10.0), 2), "motor_angle": np.arange(20.0)})


def test_exact_a_recording_is_replayed():
    scenario = Scenario.replay(recording())
    assert scenario.t_end == 1.0


def test_exact_campaign_reads_recordings_columns_and_sensors(tmp_path):
    save(recording(), tmp_path / "run.parquet")
    text = '[sensors]\nmotor_angle = { resolution = 4.8e-5 }\n[[recording]]\nfile = "run.parquet"\nrole = "fit"\n'
    (tmp_path / "c.toml").write_text(text)
    campaign = load_campaign(tmp_path / "c.toml")
    assert campaign.recordings[0].resolution == {"motor_angle": 4.8e-5}
    (tmp_path / "c.toml").write_text(text + "rolle = 1\n")
    with pytest.raises(ConfigError, match=r"line 6.*did you mean 'role'"):
        load_campaign(tmp_path / "c.toml")


def columns(size=500):
    rng = np.random.default_rng(4)
    return {
        "t": np.arange(size) / 1000.0 + 1e-5 * rng.random(size),
        "motor_angle": rng.standard_normal(size).cumsum(),
        "motor_torque": rng.standard_normal(size) * 1e-3,
        "load_angle": rng.standard_normal(size) * 1e5,
    }


@pytest.mark.parametrize("name", recorded_files.KINDS)
def test_exact_every_kind_of_file_gives_identical_arrays(name, tmp_path):
    found = load(recorded_files.write(tmp_path / name, columns()))
    assert set(found) == set(columns())
    for column, values in columns().items():
        assert found[column].dtype == np.float64
        np.testing.assert_array_equal(found[column], values)


@pytest.mark.parametrize("name", [*recorded_files.KINDS[:-2], "run.tdms"])
def test_exact_a_campaign_is_the_same_from_every_kind_of_file(name, tmp_path):
    recorded_files.write(tmp_path / name, columns())
    (tmp_path / "c.toml").write_text(f'[columns]\nmotor_angle = {{ scale = 0.1 }}\n[[recording]]\nfile = "{name}"\n')
    [found] = load_campaign(tmp_path / "c.toml").recordings
    np.testing.assert_array_equal(found["motor_angle"], columns()["motor_angle"] * 0.1)
    assert found.samples == 500


TEXTS = {
    "semicolon": "t;motor_angle\n0.0;1.5\n0.1;-2e-3\n",
    "tab": "t\tmotor_angle\n0.0\t1.5\n0.1\t-2e-3\n",
    "decimal comma": "t;motor_angle\n0,0;1,5\n0,1;-2e-3\n",
    "byte order mark": "\ufefft,motor_angle\n0.0,1.5\n0.1,-2e-3\n",
    "blanks": " t , motor_angle \n 0.0 , 1.5 \n 0.1 , -2e-3 \n",
    "comments": "# rig 7\n\nt,motor_angle\n# begin\n0.0,1.5\n\n0.1,-2e-3",
    "units": "t,motor_angle\n[s],[rad]\n0.0,1.5\n0.1,-2e-3\n",
    "trailing separator": "t;motor_angle;\n0,0;1,5;\n0,1;-2e-3;\n",
    "separator line": "sep=;\nt;motor_angle\n0,0;1,5\n0,1;-2e-3\n",
    "quotes": '"t","motor_angle"\n"0.0","1.5"\n"0.1","-2e-3"\n',
    "carriage returns": "t,motor_angle\r0.0,1.5\r0.1,-2e-3\r",
    "further columns": "t,note,motor_angle\n0.0,start,1.5\n0.1,,-2e-3\n",
}


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_exact_text_tables(kind, encoding, tmp_path):
    (tmp_path / "run.csv").write_bytes(TEXTS[kind].encode(encoding))
    found = load_table(tmp_path / "run.csv")
    np.testing.assert_array_equal(found["t"], [0.0, 0.1])
    np.testing.assert_array_equal(found["motor_angle"], [1.5, -2e-3])


def test_exact_a_text_of_windows_is_read(tmp_path):
    (tmp_path / "run.csv").write_bytes("t;Öl;motor_angle\n0;1;1,5\n1;1;2,5\n".encode("cp1252"))
    found = load_table(tmp_path / "run.csv")
    np.testing.assert_array_equal(found["motor_angle"], [1.5, 2.5])
    assert found.notes == ("read as Windows-1252 text", "columns left out: Öl")


@pytest.mark.parametrize("end", ["", "  "])
def test_exact_a_last_line_that_does_not_end_may_be_cut_and_is_noted(end, tmp_path):
    (tmp_path / "run.csv").write_text("t,motor_angle\n0,1.25\n1,2.5" + end)
    found = load_table(tmp_path / "run.csv")
    np.testing.assert_array_equal(found["motor_angle"], [1.25, 2.5])
    assert found.notes == ("the last line has no line end: if the file was cut short, so may be its last number",)


WRONG_TEXTS = [
    ("t,motor_angle\n0,1\n1,x\n", "line 3, column 'motor_angle': 'x' is not a number"),
    ("# c\nt,motor_angle\n0,1\n1,2,3\n", "line 4: 3 values, the header line has 2 names"),
    (
        "t,motor_angle\n0,1\n0,001,2\n",
        "line 3: 3 values, the header line has 2 names; decimal commas need ; or tab between columns",
    ),
    ("t,t\n0,1\n", "line 1: two columns are named 't': rename one"),
    ('t,motor_angle\n"0,1","0,2"\n', "line 2, column 't': '0,1' has a decimal comma; decimal commas need ; or tab"),
    ("t,motor_angle\n2026-11-30T10:15:00.5,1\n", "is not a number; write times in seconds"),
    ("t,motor_angle\n10:15:00,1\n", "'10:15:00' is not a number; write times in seconds"),
    ("t;motor_angle\n0;1.234.567,5\n", "is not a number; write it without marks between thousands"),
    ("0,1\n1,2\n", "line 1: the header line holds the number '0'"),
    ("t;motor_angle\n0,5;1.5\n", "line 2, column 'motor_angle': '1.5' mixes decimal comma and decimal point"),
    ("t;motor_angle\n0.5;1.5\n0.6;1.234,5\n", "line 3, column 'motor_angle': '1.234,5' is not a number"),
    ("t,motor_angle\n", "no samples after the header line"),
    ("\n\n", "the file is empty"),
    ("# nothing\n", "no header line"),
    ("t,motor_angle\n0,1\0\n", "line 2: not a text file"),
    ("t,motor_angle\n0,1\nt,motor_angle\n1,2\n", "line 3, column 't': 't' is not a number"),
]


@pytest.mark.parametrize(("text", "message"), WRONG_TEXTS)
def test_exact_wrong_texts_name_file_line_and_column(text, message, tmp_path):
    (tmp_path / "run.csv").write_text(text)
    with pytest.raises(InputError, match=r"run\.csv.*" + re.escape(message)):
        load(tmp_path / "run.csv")


def test_exact_fields_of_structs_and_groups_have_paths(tmp_path):
    import h5py
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"log": {"time": T, "enc": {"motor": 2.0 * T}}, "name": "rig"})
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["log/time"], file["log/enc/motor"] = T, 2.0 * T
        file["log/enc/motor"].attrs["unit"] = "deg"
    for name, dot in (("run.mat", "."), ("run.h5", "/")):
        found = load(tmp_path / name, {"t": f"log{dot}time", "motor_angle": f"log{dot}enc{dot}motor"})
        np.testing.assert_array_equal(found["motor_angle"], 2.0 * T)
    assert found.units == {"motor_angle": "deg"}


@pytest.mark.parametrize("compressed", [False, True])
def test_against_scipy_mat_files(compressed, tmp_path):
    from scipy.io import loadmat, savemat

    rng = np.random.default_rng(2)
    made = {
        "t": T,
        "motor_angle": rng.integers(-100, 100, (1, 101)).astype(np.int16),
        "motor_torque": rng.random((101, 1)).astype(np.float32),
        "load_angle": rng.integers(0, 2**40, 101),
        "log": {"speed": 2.0 * T, "deep": {"x": -T}, "text": "rig"},
        "cells": np.array([1, "a"], dtype=object),
        "picture": np.ones((3, 4)),
        "sign": T > 0.5,
    }
    savemat(tmp_path / "run.mat", made, do_compression=compressed)
    names = {"speed_reference": "log.speed", "temperature": "log.deep.x", "load_torque": "sign"}
    found = load_table(tmp_path / "run.mat", names)
    expected = loadmat(tmp_path / "run.mat", simplify_cells=True)
    for name in ("t", "motor_angle", "motor_torque", "load_angle"):
        np.testing.assert_array_equal(found[name], expected[name])
    np.testing.assert_array_equal(found["speed_reference"], expected["log"]["speed"])
    np.testing.assert_array_equal(found["temperature"], expected["log"]["deep"]["x"])
    np.testing.assert_array_equal(found["load_torque"], expected["sign"])
    assert "columns left out:" in found.notes[0]
    for wrong in ("log.text", "picture", "cells"):
        with pytest.raises(InputError, match=f"column '{wrong}'"):
            load_table(tmp_path / "run.mat", {"temperature": wrong})


def opaque(name, kind):
    """A variable of class 17 as MATLAB writes a string or a date: flags, name, "MCOS", its class, no shape."""

    def element(form, data):
        return struct.pack("<II", form, len(data)) + data + b"\0" * (-len(data) % 8)

    parts = (6, struct.pack("<II", 17, 0)), (1, name), (1, b"MCOS"), (1, kind), (14, b"")
    return element(14, b"".join(element(*part) for part in parts))


@pytest.mark.parametrize("packed", [False, True])
def test_exact_strings_and_dates_beside_the_numbers_of_a_mat_file_are_left_out(packed, tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "run.mat", {"t": T, "motor_angle": 2.0 * T})
    with (tmp_path / "run.mat").open("ab") as stream:
        for name, kind in ((b"title", b"string"), (b"begun", b"datetime"), (b"day1", b"table")):
            data = opaque(name, kind)
            shut = zlib.compress(data)
            stream.write(struct.pack("<II", 15, len(shut)) + shut if packed else data)
    found = load(tmp_path / "run.mat")
    np.testing.assert_array_equal(found["motor_angle"], 2.0 * T)
    assert found.notes == ("columns left out: title, begun, day1",)
    with pytest.raises(InputError, match="column 'title' holds no real numbers"):
        load(tmp_path / "run.mat", {"motor_angle": "title"})


@pytest.mark.parametrize(
    ("unit", "factor"), [("mNm", 1e-3), ("MNm", 1e6), ("MNM", None), ("NM", 1.0), ("kN m", 1e3), ("rad", None)]
)
def test_exact_capitals_of_a_unit_count_where_they_tell_two_apart(unit, factor):
    assert units.factor(unit, "N m") == factor


@pytest.mark.parametrize(
    ("column", "rest", "unit"),
    [
        ("angle [deg]", "angle", "deg"), ("angle(deg)", "angle", "deg"), ("Zeit [ms]", "Zeit", "ms"),
        ("motor_angle_deg", "motor_angle", "deg"), ("i [A]", "i", "A"), ("torque_mNm", "torque", "mNm"),
        ("enc_counts", "enc", "counts"), ("torque (N m)", "torque", "N m"),
        ("angle [1]", "angle [1]", ""), ("i_A", "i_A", ""), ("motor_angle", "motor_angle", ""), ("_ms", "_ms", ""),
        ("angle (motor)", "angle (motor)", ""), ("[deg", "[deg", ""), ("x [-]", "x [-]", ""),
    ],
)  # fmt: skip
def test_exact_a_unit_in_a_name(column, rest, unit):
    assert units.named_with_unit(column) == (rest, unit)


@pytest.mark.parametrize(("given", "stated"), [("pos_deg", "deg"), ({"name": "pos_deg", "scale": 1.0}, None)])
def test_exact_the_name_of_a_column_states_its_unit_unless_a_scale_is_stated(given, stated):
    found = gather({"t": T, "pos_deg": T}, {"motor_angle": given})[0]
    assert found.units.get("motor_angle") == stated


@pytest.mark.parametrize("unit", ["deg", b"deg", np.bytes_("deg"), ["deg"], [b"deg"]])
def test_exact_an_attribute_of_an_hdf5_states_a_unit(tmp_path, unit):
    import h5py

    with h5py.File(tmp_path / "run.h5", "w") as file:
        for name in ("t", "motor_angle"):
            file[name] = T
        file["motor_angle"].attrs["unit"] = unit
    found = load(tmp_path / "run.h5")
    assert found.units == {"motor_angle": "deg"}
    with pytest.raises(InputError, match=r"motor_angle in deg, not in rad: .*  --column motor_angle=NAME\*SCALE"):
        found.need("a coast-down", "motor_angle")


def test_exact_packed_numbers_of_an_hdf5_are_unpacked(tmp_path):
    """By the attributes of the netCDF convention: counts times a factor plus an offset, one that means nothing."""
    import h5py

    counts = np.arange(T.size, dtype=np.int16)
    counts[3] = -999
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["t"], file["motor_angle"] = T, counts
        file["motor_angle"].attrs.update({"scale_factor": np.float32(0.5), "add_offset": 2.0, "_FillValue": [-999]})
    found = load(tmp_path / "run.h5").columns["motor_angle"]
    assert np.flatnonzero(np.isnan(found)).tolist() == [3]
    np.testing.assert_array_equal(np.delete(found, 3), np.delete(0.5 * np.arange(T.size) + 2.0, 3))


def test_exact_a_unit_that_is_not_known_is_noted(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_arrays(
        [pa.array(T), pa.array(T)],
        schema=pa.schema([("t", pa.float64()), pa.field("motor_angle", pa.float64(), metadata={"unit": "Grad"})]),
    )
    pq.write_table(table, tmp_path / "run.parquet")
    found = load(tmp_path / "run.parquet")
    assert found.notes == ("motor_angle is in 'Grad' by the file, a unit that is not known: taken for rad",)
    assert load(tmp_path / "run.parquet", {"motor_angle": {"scale": 2.0}}).notes == ()


def test_exact_rasters_of_an_mdf_are_joined_on_the_motor_angle(tmp_path):
    from asammdf import MDF, Signal

    with MDF() as file:
        file.append([Signal(3.0 * T, T, name="motor_angle", unit="rad")])
        file.append([Signal(2.0 * T[::5], T[::5], name="motor_torque", unit="A")])
        file.save(tmp_path / "run.mf4")
    found = load(tmp_path / "run.mf4")
    np.testing.assert_allclose(found["motor_torque"], 2.0 * T, atol=1e-12)
    assert "motor_torque interpolated on the times of the other columns" in found.notes
    assert found.rates == pytest.approx({"motor_torque": 0.2 / (T[1] - T[0])})
    assert found.units == {"motor_angle": "rad", "motor_torque": "A"}


def test_exact_a_gap_in_a_raster_of_an_mdf_is_not_bridged(tmp_path):
    """At 100 Hz on the times of 1 kHz: a missing sample is bridged, 0.3 s of them are not; the rate is that between."""
    from asammdf import MDF, Signal

    t = np.linspace(0.0, 2.0, 2001)
    slow = t[::10][np.r_[0:50, 51:100, 130:201]]
    with MDF() as file:
        file.append([Signal(3.0 * t, t, name="motor_angle")])
        file.append([Signal(2.0 * slow, slow, name="load_angle")])
        file.save(tmp_path / "run.mf4")
    found = load(tmp_path / "run.mf4")
    inside = (t > 0.9905) & (t < 1.2995)
    np.testing.assert_allclose(found["load_angle"], np.where(inside, np.nan, 2.0 * t), atol=1e-12)
    assert found.rates == pytest.approx({"load_angle": 100.0})


@pytest.mark.parametrize("clock", ["jittering", "slowing down", "of two samples", "of one sample"])
def test_exact_a_clock_without_gaps_is_bridged_throughout(clock):
    steps = {
        "jittering": np.random.default_rng(1).uniform(0.004, 0.016, 200),
        "slowing down": np.repeat([0.01, 0.05], 100),
        "of two samples": np.ones(1),
        "of one sample": np.ones(0),
    }[clock]
    t = np.concatenate([[0.0], np.cumsum(steps)])
    raster = np.linspace(0.0, t[-1], 3001)
    found = Source([], {})
    found.join("motor_angle", raster, raster)
    found.join("load_angle", t, 2.0 * t)
    np.testing.assert_allclose(found.columns["load_angle"], 2.0 * raster, atol=1e-12)


def test_exact_an_mdf_is_read_on_its_fastest_raster(tmp_path):
    from asammdf import MDF, Signal

    with MDF() as file:
        file.append([Signal(0.5 * T[::10], T[::10], name="load_angle")])
        file.append([Signal(T[::-1] + 1.0, T, name="motor_torque")])
        file.append([Signal(3.0 * T[::2], T[::2], name="motor_angle")])
        file.save(tmp_path / "run.mf4")
    found = load(tmp_path / "run.mf4")
    np.testing.assert_array_equal(found["t"], T)
    np.testing.assert_array_equal(found["motor_torque"], T[::-1] + 1.0)
    np.testing.assert_allclose(found["load_angle"], 0.5 * T, atol=1e-12)
    assert found.notes[:2] == tuple(
        f"{name} interpolated on the times of the other columns" for name in ("motor_angle", "load_angle")
    )


def test_exact_times_since_an_epoch_are_the_nearest_floats(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    t = 1_700_000_000_000_000_001 + 1_000_001 * np.arange(20)
    pq.write_table(pa.table({"t": t, "motor_angle": T[:20]}), tmp_path / "run.parquet")
    np.savez(tmp_path / "run.npz", t=t, motor_angle=T[:20])
    for name in ("run.parquet", "run.npz"):
        np.testing.assert_array_equal(load_table(tmp_path / name)["t"], t.astype(np.float64))


def test_exact_a_text_larger_than_the_memory_is_refused_before_it_is_read(tmp_path, monkeypatch):
    path = tmp_path / "run.csv"
    path.write_text("t,motor_angle\n" + 1000 * "# a line of comment\n" + "0,1\n1,2\n")
    assert load_table(path).samples == 2
    monkeypatch.setattr(checks, "memory_limit", lambda: 4.0 * path.stat().st_size - 1.0)
    monkeypatch.setattr(Path, "read_bytes", lambda _: pytest.fail("it was read"))
    with pytest.raises(InputError, match=r"run\.csv: its lines of text need 2e-05 GB"):
        load_table(path)


def test_exact_a_tdms_waveform_has_the_time_of_its_increment(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    facts = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "rad"}
    with TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([ChannelObject("rig", "motor_angle", 3.0 * T, facts)])
    found = load(tmp_path / "run.tdms")
    np.testing.assert_allclose(found["t"], T, atol=1e-12)
    np.testing.assert_array_equal(found["motor_angle"], 3.0 * T)


def test_exact_waveforms_of_a_tdms_are_joined_on_the_one_with_most_samples(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    begun = np.datetime64("2024-05-01T12:00:00.250")
    late = begun + np.timedelta64(50, "ms")
    rasters = {
        "motor_torque": (T[5::5], {"wf_increment": 0.05, "wf_start_offset": 0.05, "wf_start_time": begun}),
        "motor_angle": (T, {"wf_increment": 0.01, "wf_start_offset": 0.0, "wf_start_time": begun}),
        "load_angle": (T[5::2], {"wf_increment": 0.02, "wf_start_offset": 0.0, "wf_start_time": late}),
        "output_torque": (T, {}),
    }
    with TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([ChannelObject("rig", name, 3.0 * t, facts) for name, (t, facts) in rasters.items()])
    found = load(tmp_path / "run.tdms")
    np.testing.assert_allclose(found["t"], T, atol=1e-12)
    for name, (t, _) in rasters.items():
        expected = np.interp(T, t, 3.0 * t, left=np.nan, right=np.nan)
        np.testing.assert_allclose(found[name], expected, atol=1e-12)
    assert found.rates == pytest.approx({"motor_torque": 20.0, "load_angle": 50.0})
    assert found.notes == tuple(
        f"{name} interpolated on the times of the other columns" for name in ("load_angle", "motor_torque")
    )


def test_exact_a_channel_of_a_tdms_is_listed_once(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    channels = [("rig", "t", T), ("rig", "motor_angle", 3.0 * T), ("day", "note", T), ("rig", "note", T)]
    with TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([ChannelObject(*channel) for channel in channels])
    for mapped in (None, {"motor_angle": "rig/motor_angle"}):
        found = load(tmp_path / "run.tdms", mapped)
        np.testing.assert_array_equal(found["motor_angle"], 3.0 * T)
        assert found.notes == ("columns left out: day/note, rig/note",)


CONVERSIONS = [
    (math.pi / 180.0, np.degrees),
    (2.0 * math.pi / 2**17, lambda rad: rad / (2.0 * math.pi) * 2**17),
    (0.083, lambda torque: torque / 0.083),
]


@pytest.mark.parametrize(("scale", "convert"), CONVERSIONS)
def test_exact_degrees_counts_and_amperes_become_si(scale, convert, tmp_path):
    values = np.random.default_rng(1).uniform(-1e4, 1e4, 101)
    save(Recording("run", {"t": T, "load_angle": convert(values)}), tmp_path / "run.csv")
    found = load(tmp_path / "run.csv", {"load_angle": {"scale": scale}})
    np.testing.assert_allclose(found["load_angle"], values, rtol=1e-12)


def test_exact_an_optional_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    (tmp_path / "run.tdms").write_bytes(b"TDSm")
    with pytest.raises(MissingPackageError, match=r"python -m pip install nptdms  \(extra 'tdms'"):
        load(tmp_path / "run.tdms")
