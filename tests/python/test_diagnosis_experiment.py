"""Proposed manoeuvres: inside the limits of the recordings, and better than motions at random."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_campaign
from hdfast.diagnosis import experiment
from hdfast.diagnosis.experiment import NOTHING, Contest, propose
from hdfast.diagnosis.manoeuvres import Limits, Manoeuvre, Segment, drawn, known, varied
from hdfast.diagnosis.session import run, usable
from hdfast.diagnosis.stages import stages
from hdfast.health import check
from hdfast.recordings import load_campaign
from hypothesis import given
from hypothesis import strategies as st

RATE = 500.0


@given(
    st.floats(0.1, 300.0), st.floats(1.0, 1e4), st.floats(0.1, 1e4), st.floats(2.0, 10.0), st.integers(0, 2**31),
)  # fmt: skip
def test_exact_motions_keep_to_the_limits(speed, acceleration, travel, duration, seed):
    rng = np.random.default_rng(seed)
    limits = Limits(speed, acceleration, -0.3 * travel, 0.7 * travel, duration)
    motions = known(limits) + drawn(limits, 2, rng)
    for one in motions + [varied(own, limits, rng) for own in motions[:2]]:
        t, angle, speeds = one.motion(RATE)
        assert t[-1] <= duration * (1.0 + 1e-9)
        assert np.abs(speeds).max() <= speed * (1.0 + 1e-9)
        assert angle.min() >= limits.low - 1e-2 * travel
        assert angle.max() <= limits.high + 1e-2 * travel
        slopes = np.diff(speeds) * RATE
        assert np.abs(slopes).max() <= acceleration * (1.0 + 1e-6)


@pytest.mark.parametrize("noise", [1e-3, 0.05])
def test_exact_noise_at_a_steady_speed_is_no_acceleration(noise):
    """Of two recordings that hold their speed nobody knows how it was reached; a third that gains it tells."""
    t = np.arange(0.0, 4.0, 1.0 / RATE)
    rng = np.random.default_rng(0)

    def moving(speed, acceleration):
        shaken = speed + noise * rng.standard_normal(len(t))
        return SimpleNamespace(t=t, angle=np.cumsum(shaken) / RATE, speed=shaken, acceleration=acceleration)

    steady = [moving(speed, noise * RATE * rng.standard_normal(len(t))) for speed in (20.0, -10.0)]
    held = Limits.of(steady)
    assert held.speed == pytest.approx(20.0, rel=0.02)
    assert held.acceleration == pytest.approx(held.speed / (0.25 * held.duration))
    gaining = moving(3.0 * t, np.full(len(t), 3.0))
    assert Limits.of([*steady, gaining]).acceleration == 3.0


def test_exact_wider_limits_ask_for_more_step_by_step():
    own = Limits(20.0, 300.0, -10.0, 40.0, 5.0)
    longer, farther, faster = own.wider(100.0)
    assert longer == replace(own, duration=15.0, beyond=("duration",))
    assert farther.high - farther.low == pytest.approx(1.1 * 2.0 * np.pi * 100.0)
    assert farther.duration == 30.0
    assert (faster.speed, faster.acceleration) == (40.0, 600.0)
    assert faster.duration == pytest.approx(1.1 * 2.0 * np.pi * 100.0 / 40.0)
    assert faster.beyond == ("duration", "angle", "speed", "acceleration")
    turned_already = replace(own, high=800.0)
    assert [one.beyond for one in turned_already.wider(100.0)] == [
        ("duration",),
        ("duration", "speed", "acceleration"),
    ]


@pytest.mark.parametrize(
    ("odds", "chosen"),
    [
        ({(): 6.0}, ()),
        ({(): 0.1, ("angle",): 6.0}, ("angle",)),
        ({(): 0.1, ("angle",): 4.0}, ("angle", "speed")),
        ({(): 2.0, ("duration",): 6.0}, ("duration",)),
        ({(): 0.1, ("duration",): 6.0}, ("angle", "speed")),
        ({(): 0.1, ("angle", "speed"): 4.0}, ()),
    ],
)
def test_exact_as_little_more_is_asked_for_as_decides(monkeypatch, odds, chosen):
    """More time alone is tried where three times the evidence would be enough."""
    odds = {("angle", "speed"): 99.0, **odds}
    own = Limits(1.0, 1.0, 0.0, 1.0, 2.0)
    wider = [replace(own, duration=6.0, beyond=each) for each in (("duration",), ("angle",), ("angle", "speed"))]
    monkeypatch.setattr(experiment.Limits, "of", lambda _: own)
    monkeypatch.setattr(experiment.Limits, "wider", lambda *_: iter(wider))
    monkeypatch.setattr(
        experiment,
        "_best",
        lambda _, contest, limits, *__: SimpleNamespace(odds=odds.get(limits.beyond, 0.0), limits=limits),
    )
    replay = SimpleNamespace(plant=SimpleNamespace(units=[]))
    contest = SimpleNamespace(fits=[SimpleNamespace(value=lambda _: 100.0)])
    assert propose(replay, contest, None).limits.beyond == chosen


def test_exact_a_motion_is_its_segments():
    t, angle, speed = Manoeuvre("made", (Segment(2.0, 1.0, 1.0), Segment(0.0, 1.0, 0.5)), start=1.0).motion(1000.0)
    assert t[-1] == pytest.approx(3.499)
    assert speed[[0, 500, 1500, 2500, 3400]] == pytest.approx([0.0, 1.0, 2.0, 1.0, 0.0], abs=1e-9)
    assert angle[-1] == pytest.approx(1.0 + 1.0 + 2.0 + 1.0, abs=1e-6)


@pytest.fixture(scope="module")
def friction(tmp_path_factory):
    """A session that has found Coulomb friction."""
    patch = pytest.MonkeyPatch()
    small_campaign.shorten_library(patch)
    folder = tmp_path_factory.mktemp("friction")
    campaign = load_campaign(small_campaign.write(folder, ["coulomb_friction"], {"coulomb_friction_T_c": 0.03}))
    with stages(False) as told:
        session = run(campaign, usable(check(campaign)), 0, None, told)
    patch.undo()
    return session


def test_regress_the_proposal_tells_friction_from_nothing(friction):
    final = friction.search.final
    contest = Contest(("coulomb_friction", NOTHING), (final, friction.baseline))
    found = propose(friction.replay, contest, np.random.default_rng(0))
    assert found.odds >= max(5.0, 1.2 * found.usual)
    content = found.to_dict()
    assert content["decides"]
    assert "the motor torque about its mean is" in content["difference"]
    assert json.loads(json.dumps(content)) == content


@pytest.mark.long
def test_exact_models_whose_torques_differ_by_their_zero_are_not_told_apart(friction):
    """Recordings that move give up their means, and so does one that is imagined."""
    own, sensor = "motor_torque_sensor_offset_drift", (("sensor_offset_drift", "motor_torque"),)
    off = friction.baseline.structure.with_terms((), (), sensor, {f"{own}_offset": 0.05, f"{own}_drift": 0.0}, ())
    contest = Contest(("one", "the other"), (friction.baseline, replace(friction.baseline, structure=off)))
    found = propose(friction.replay, contest, np.random.default_rng(0))
    assert found is None or found.odds < 0.5


def test_exact_speeds_below_those_recorded_count_where_their_direction_is_certain(friction):
    """Recordings at steady speeds say nothing of slower ones, which their encoder would show as well."""
    contest = Contest(("coulomb_friction", NOTHING), (friction.search.final, friction.baseline))
    plant = friction.replay.plant
    fast = [
        replace(unit, judged={name: mask & (np.abs(unit.speed) > 7.0) for name, mask in unit.judged.items()})
        for unit in plant.units
    ]
    at_speed = replace(friction.replay, plant=replace(plant, units=fast))
    slow = [Manoeuvre("slow", (Segment(2.0, 0.5, 1.0), Segment(-2.0, 0.5, 1.0)))]
    imagined = experiment._imagined(at_speed, contest, slow)
    judged = np.abs(imagined.plant.units[0].speed[imagined.plant.units[0].judged["motor_torque"]])
    assert judged.max() == pytest.approx(2.0, rel=1e-3)
    assert judged.min() >= min(unit.slowest for unit in plant.units)


def test_exact_models_that_agree_are_not_told_apart(friction):
    contest = Contest(("one", "the other"), (friction.baseline, friction.baseline))
    assert propose(friction.replay, contest, np.random.default_rng(0)) is None


@pytest.mark.long
def test_exact_a_motion_that_leaves_one_of_the_others_open_decides_nothing(friction):
    final, names = friction.search.final, ("coulomb_friction", NOTHING, "its twin")
    contest = Contest(names, (final, friction.baseline, final))
    assert propose(friction.replay, contest, np.random.default_rng(0)) is None
