"""Proposed manoeuvres: inside the limits of the recordings, and better than motions at random."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import small_campaign
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


def test_exact_models_whose_torques_differ_by_their_zero_are_not_told_apart(friction):
    """Recordings that move give up their means, and so does one that is imagined."""
    own, sensor = "motor_torque_sensor_offset_drift", (("sensor_offset_drift", "motor_torque"),)
    off = friction.baseline.structure.with_terms((), (), sensor, {f"{own}_offset": 0.05, f"{own}_drift": 0.0}, ())
    contest = Contest(("one", "the other"), (friction.baseline, replace(friction.baseline, structure=off)))
    found = propose(friction.replay, contest, np.random.default_rng(0))
    assert found is None or found.odds < 0.5


def test_exact_models_that_agree_are_not_told_apart(friction):
    contest = Contest(("one", "the other"), (friction.baseline, friction.baseline))
    assert propose(friction.replay, contest, np.random.default_rng(0)) is None
