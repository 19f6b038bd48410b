"""A motor torque that is recorded after the motion it makes is told, and one that is on time is not."""

from __future__ import annotations

import numpy as np
import pytest
from hdfast import health
from simulated_recordings import RATIO, TEXT, campaign, columns

NAME = "torque_lag"


@pytest.fixture(scope="module")
def clean():
    return [columns(7, kind, 1000.0, 1e-3, 17)[0] for kind in ("profile", "sine", "ladder", "multisine")]


def late(found, lag):
    return found | {"motor_torque": np.interp(found["t"] - lag, found["t"], found["motor_torque"])}


def told(recordings, text=TEXT):
    """Severity and lag [ms] of the finding of each recording."""
    found = health.check(campaign(recordings, text))
    mine = [[f for f in one.findings if f.check == NAME] for one in found.recordings]
    return [(one[0].severity, float(one[0].sentence.split(" by ")[1].split(" ms")[0])) if one else None for one in mine]


@pytest.mark.parametrize(
    ("lag", "severity"), [(20.0, "warning"), (40.0, "warning"), (60.0, "reject"), (300.0, "reject")]
)
def test_exact_a_late_motor_torque_is_told_of_every_recording(clean, lag, severity):
    for one in told([late(found, 1e-3 * lag) for found in clean]):
        assert one is not None
        assert one[0] == severity
        assert one[1] == pytest.approx(lag, abs=3.0)


def test_exact_a_motion_that_tells_nothing_itself_follows_the_others(clean):
    steady = clean[0] | {"motor_angle": 30.0 * clean[0]["t"], "load_angle": 30.0 * clean[0]["t"] / RATIO}
    assert [one is not None for one in told([steady, late(clean[0], 0.1)])] == [True, True]
    assert told([steady]) == [None]


def test_exact_a_recording_that_is_on_time_beside_late_ones_is_left_alone(clean):
    assert [one is not None for one in told([late(clean[0], 0.1), clean[2], clean[3]])] == [True, False, False]


@pytest.mark.parametrize(("lag", "severity"), [(-30, None), (-80, "reject"), (-300, "reject")])
def test_exact_a_torque_before_its_motion_is_an_actuators_until_it_is_too_far_ahead(clean, lag, severity):
    for one in told([late(found, 1e-3 * lag) for found in clean]):
        assert (one and one[0]) == severity
        assert one is None or one[1] == pytest.approx(-lag, abs=3.0)


def test_exact_a_torque_that_only_becomes_quiet_is_not_explained_there(clean):
    """Ahead of a rest nothing of the torque is left, and nothing explained."""
    t = clean[0]["t"]
    found = clean[0] | {"motor_torque": np.where((t > 0.55) & (t < 0.95), 1.0, 0.02) * np.sin(40.0 * t)}
    assert told([found]) == [None]


@pytest.mark.parametrize(
    "statement",
    [
        "[sensors]\nmotor_torque = { delay_s = 0.1 }\n",
        '[[terms]]\neffect = "sensor_delay"\nchannel = "motor_torque"\nparameters = { tau_y = 0.1 }\n',
    ],
)
def test_exact_a_stated_or_declared_delay_is_none_to_mend(clean, statement):
    assert told([late(found, 0.1) for found in clean], TEXT + statement) == [None] * len(clean)


def test_exact_what_rejects_all_recordings_is_said_once(clean):
    complaint = health.check(campaign([late(found, 0.1) for found in clean])).complaint
    assert complaint.startswith("run0, run1, run2, run3: motor_torque follows")
    assert complaint.count("motor_torque follows") == 1


def test_exact_a_stated_delay_of_the_angles_is_none_to_mend(clean):
    stated = TEXT + "[sensors]\nmotor_angle = { delay_s = 0.1 }\nload_angle = { delay_s = 0.1 }\n"
    assert told([late(found, -0.1) for found in clean], stated) == [None] * len(clean)
