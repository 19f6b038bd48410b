"""What `hdfast.diagnose` says of real machines, against what was written down before the first run.

`anchors/expected.py` holds what is expected of every machine, `MET` those that are met; docs/diagnosis.md has the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

import hdfast
import pytest
from anchors import article, brfd
from anchors.expected import DRY, EXPECTED, GRAVITY, HYSTERESIS, LATE, LOADED, MEMORY, ONE_SIDED, RIPPLE
from hdfast.health import check
from hdfast.recordings import load_campaign

MET = {
    "emps": (DRY, ONE_SIDED, RIPPLE),
    "ur10e_j1": (DRY,),
    "ur10e_j2": (DRY, GRAVITY),
    "ur10e_j4": (DRY, GRAVITY, RIPPLE),
    "kinova": (RIPPLE,),
    "bam": (GRAVITY, LOADED),
    "bam_trajectory": (GRAVITY, LOADED),
    "brfd": (HYSTERESIS,),
    "tx40": (DRY,),
    "article": (DRY,),
    "article_output": (DRY, LATE),
}
# the same machines from fewer samples, in seconds
SHORT = {"brfd": partial(brfd.write, every=16, until=8.0)}
LONG = ("ur10e_j2", "bam_trajectory", "article", "article_output")
MISSED = {  # what was expected of a machine and is not said of it; docs/diagnosis.md has more
    ("ur10e_j1", RIPPLE): "listed, not named: at 100 Hz out of reach of a replay at most speeds",
    ("heads", MEMORY): "undecided: a spring that relaxes cannot be told from a weight",
    ("heads", "verdicts"): "undecided: a spring that relaxes cannot be told from a weight",
    ("heads", "memory"): "undecided: a spring that relaxes cannot be told from a weight",
    ("heads", "twin"): "its noise is what creeps over minutes: undecided, as what was held out refuses it",
    ("brfd", frozenset({"backlash"})): "it stands in series with the hysteresis, which no term does",
    ("article", LATE): "the replayed motion has passed the sensors, which are all slow",
}


def missed(*keys: tuple[str, Any]) -> list[Any]:
    """The mark of a failure that is known under one of these keys."""
    reason = next((MISSED[key] for key in keys if key in MISSED), None)
    return [pytest.mark.xfail(reason=reason, strict=True, raises=AssertionError)] if reason else []


def asked(field: str, *, each: bool = False) -> list[Any]:
    """Name and what is expected of every machine of which something is, those that do not meet it as failures."""
    found = []
    for name, expected in EXPECTED.items():
        value = getattr(expected, field)
        for one in value if each else [value] if value else []:
            marks = [pytest.mark.long, *missed((name, one), (name, field))]
            found.append(pytest.param(name, one, marks=marks, id=name))
    return found


PUBLISHED = [name for name in MET if EXPECTED[name].heldout_percent is not None]
ORDERED = ("emps", "ur10e_j1", "ur10e_j4", "kinova")
QUIET_TWINS = ("emps", "ur10e_j1", "ur10e_j2", "ur10e_j4", "kinova", "bam", "brfd", "hej90", "tx40", "heads", "article")

Verdicts = Callable[..., dict[str, Any]]


def anchors(names: Iterable[str]) -> list[Any]:
    return [pytest.param(name, marks=[pytest.mark.long] * (name in LONG)) for name in names]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory, long: bool) -> Verdicts:
    """The verdict of an anchor, computed once."""
    found: dict[tuple[str, bool], dict[str, Any]] = {}

    def of(name: str, *, whole: bool = long) -> dict[str, Any]:
        key = name, name in SHORT and not whole
        if key not in found:
            write = SHORT[name] if key[1] else EXPECTED[name].write
            found[key] = hdfast.diagnose(write(tmp_path_factory.mktemp(name))).to_dict()
        return found[key]

    return of


@pytest.mark.parametrize("name", anchors(MET))
def test_against_known_effects(diagnosed: Verdicts, name: str) -> None:
    verdict = diagnosed(name, whole=False)
    named = {effect["effect"] for effect in verdict["effects"]}
    assert verdict["verdict"] == "found"
    for either in MET[name]:
        assert named & either, f"none of {sorted(either)} in {sorted(named)}"
    assert not named & EXPECTED[name].must_not_name


@pytest.mark.parametrize(("name", "either"), asked("must_name", each=True))
def test_against_effects_expected_before_the_first_run(diagnosed: Verdicts, name: str, either: frozenset[str]) -> None:
    assert {effect["effect"] for effect in diagnosed(name)["effects"]} & either


@pytest.mark.parametrize(("name", "allowed"), asked("verdicts"))
def test_against_verdicts_expected_before_the_first_run(
    diagnosed: Verdicts, name: str, allowed: frozenset[str]
) -> None:
    assert diagnosed(name)["verdict"] in allowed


@pytest.mark.parametrize(("name", "effects"), asked("not_showable"))
def test_against_effects_that_a_machine_cannot_show(diagnosed: Verdicts, name: str, effects: frozenset[str]) -> None:
    assert effects <= {one["effect"] for one in diagnosed(name)["not_showable"]}


@pytest.mark.parametrize(("name", "torque"), asked("dry_friction"))
def test_against_published_dry_friction(diagnosed: Verdicts, name: str, torque: float) -> None:
    [size] = [one["parameters"]["T_c"]["value"] for one in diagnosed(name)["effects"] if one["effect"] in DRY]
    assert size == pytest.approx(torque, rel=0.15)


@pytest.mark.parametrize(("name", "memory"), asked("memory"))
def test_against_known_memory(diagnosed: Verdicts, name: str, memory: str) -> None:
    assert diagnosed(name)["where"]["memory"] == memory


@pytest.mark.long
def test_against_the_bench_with_a_slow_sensor_at_its_output(diagnosed: Verdicts) -> None:
    effects = {effect["effect"]: effect for effect in diagnosed("article_output")["effects"]}
    late = effects["sensor_lowpass"]
    dry = next(effect for name, effect in effects.items() if name in DRY)
    assert late["evidence"]["shape"] == "on load_angle"
    assert 1.0 / (2.0 * math.pi * late["parameters"]["tau_s"]["value"]) == pytest.approx(article.BANDWIDTH_HZ, rel=0.01)
    level = dry["parameters"]["T_c"]
    assert level["value"] == pytest.approx(article.FRICTION["T_c"], rel=0.08)
    assert abs(level["value"] - article.FRICTION["T_c"]) < 2.0 * level["sigma"]


def test_exact_an_angle_that_stays_does_not_drift(diagnosed: Verdicts) -> None:
    named = {effect["effect"] for effect in diagnosed("brfd", whole=False)["effects"]}
    assert "hysteresis" in named
    assert "sensor_offset_drift" not in named


def test_regress_a_lag_that_owes_its_gain_to_other_parameters_is_not_named(diagnosed: Verdicts) -> None:
    assert {effect["effect"] for effect in diagnosed("kinova")["effects"]} == {"cogging"}


def test_exact_held_samples_are_told(tmp_path: Path) -> None:
    health = check(load_campaign(EXPECTED["hej90"].write(tmp_path)))
    assert all("held_values" in [finding.check for finding in one.findings] for one in health.recordings)


@pytest.mark.parametrize(("name", "word"), asked("health"))
def test_exact_held_samples_are_no_physics(diagnosed: Verdicts, name: str, word: str) -> None:
    verdict = diagnosed(name)
    assert not verdict["effects"]
    assert any(finding["check"] == f"{word}_values" for finding in verdict["health"])


@pytest.mark.parametrize("name", anchors(PUBLISHED))
def test_against_published_error_on_what_was_held_out(diagnosed: Verdicts, name: str) -> None:
    after = diagnosed(name)["fit"]["heldout"]["channels"]["motor_torque"]["extended_nrmse"]
    assert 100.0 * after <= EXPECTED[name].heldout_percent


@pytest.mark.parametrize("name", ORDERED)
def test_against_known_orders(diagnosed: Verdicts, name: str) -> None:
    listed = diagnosed(name)["where"]["orders"]
    for order in EXPECTED[name].orders:
        assert any(abs(order - one) <= 0.01 * order for one in listed)


def test_against_a_line_fixed_in_frequency_beside_the_orders(diagnosed: Verdicts) -> None:
    """A servo's own swing: it stands in motion and torque alike, and is claimed for no effect."""
    where = diagnosed("kinova")["where"]
    low, high = EXPECTED["kinova"].frequencies_hz or (0.0, 0.0)
    assert [low < one < high for one in where["frequencies_hz"]] == [True]
    assert [one["frequency_hz"] for one in where["swings"]] == where["frequencies_hz"]


@pytest.mark.long
@pytest.mark.parametrize("name", [pytest.param(name, marks=missed((name, "twin"))) for name in QUIET_TWINS])
def test_exact_twin_gives_no_evidence(tmp_path: Any, name: str) -> None:
    real = EXPECTED[name].write(tmp_path / "real")
    assert hdfast.diagnose(EXPECTED[name].control(real, tmp_path / "twin", 1)).verdict == "no_evidence"
