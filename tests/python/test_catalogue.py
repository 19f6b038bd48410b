"""What the core offers is listed with its meaning, and is what a result says."""

from __future__ import annotations

import platform
import sys

import hdfast
import pytest

BRIEF = hdfast.Scenario.start_stop(t_end=0.1, t_off=0.05)


@pytest.mark.parametrize("listed", [hdfast.metrics, hdfast.signals])
def test_exact_every_quantity_is_described(listed):
    assert listed()
    for name, quantity in listed().items():
        assert quantity.name == name
        assert quantity.unit
        assert quantity.meaning


def test_exact_every_status_has_a_remedy():
    statuses = hdfast.statuses()
    assert list(statuses) == list(range(len(statuses)))
    assert statuses[0].name == "finished"
    assert len({status.name for status in statuses.values()}) == len(statuses)
    for code, status in statuses.items():
        assert status.code == code
        assert status.remedy[0].isupper()
        assert status.remedy.endswith(".")


@pytest.mark.parametrize(
    ("row", "options", "name", "remedy"),
    [
        ({"J_m": -1.0}, {}, "bad_parameters", "Correct the named parameter of this row."),
        ({}, {"max_steps": 5}, "max_steps", "Raise max_steps, loosen rtol, or shorten t_end"),
        ({"B_sp": 1e6}, {"max_steps": 99}, "max_steps", 'is stiff, which method="rodas5p" cures'),
        ({}, {"max_steps": 99, "max_step": 1e-6}, "max_steps", "has too small a max_step"),
    ],
)
def test_exact_a_failed_row_is_told_its_remedy(row, options, name, remedy):
    result = hdfast.sweep(row, scenario=BRIEF, metrics=[], **options)
    status = hdfast.statuses()[int(result.status[0])]
    assert status.name == name
    assert remedy in status.remedy
    assert status.remedy in result.message(0)


def test_exact_build_info_tells_what_was_built():
    info = hdfast.build_info()
    assert info["version"] == hdfast.__version__
    assert (info["profile"], info["debug"]) in {("release", False), ("debug", True)}
    assert info["target"].startswith(platform.machine())
    assert info["target"].endswith(sys.platform)
    assert info["simd"] in info["simd_available"]
    assert info["simd_available"][-2:] == ["portable", "scalar"]
    assert info["lanes"] in (1, 2, 4, 8, 16)


def test_exact_vector_code_that_is_not_there_is_refused(monkeypatch):
    monkeypatch.setenv("HDFAST_SIMD", "mmx")
    with pytest.raises(hdfast.InputError, match=r"HDFAST_SIMD.*mmx"):
        hdfast.build_info()
