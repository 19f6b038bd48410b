"""Faults of loggers, encoders and torque cells that look like motion of the drive: each is named with its place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hdfast import Scenario, health
from hdfast.errors import InputError
from hdfast.identify.angles import refuse_apart, refuse_wrapped
from hdfast.recordings import Recording, gather
from simulated_recordings import RATIO, TEXT, campaign, columns

TURN = 2.0 * math.pi
KINDS = ("profile", "sine", "multisine", "ladder")
TO_MOTOR = {"motor_angle": 1.0, "load_angle": RATIO}


def examine(found, text=TEXT):
    return health.check(campaign([found], text)).recordings[0]


def told(result, check, severity):
    return [f.sentence for f in result.findings if (f.check, f.severity) == (check, severity)]


@pytest.fixture(scope="module")
def clean():
    return {kind: columns(7, kind, 1000.0, 1e-3, 17)[0] for kind in KINDS}


@pytest.fixture
def run(clean):
    return {name: values.copy() for name, values in clean["profile"].items()}


def rows(found, chosen):
    return {name: values[chosen].copy() for name, values in found.items()}


# The clock


@pytest.mark.parametrize("size", [0.0055, 0.3])
def test_regress_a_clock_that_was_set_back_is_named_and_not_joined(run, size):
    run["t"][2000:] -= size
    result = examine(run)
    [sentence] = told(result, "time", "reject")
    assert f"the clock was set back by {size:.4g} s after sample 1999 at 1.999 s" in sentence
    assert "split the file there" in sentence


@pytest.mark.parametrize("kind", ["one", "two"])
def test_exact_samples_that_stray_are_no_clock_that_was_set_back(run, kind):
    order = np.arange(4000)
    if kind == "two":
        order[[700, 701]] = [701, 700]
    else:
        run["t"][500] = 0.1
    assert "time runs backward 1 times" in told(examine(rows(run, order)), "time", "warning")[0]


@pytest.mark.parametrize("kind", ["each", "block"])
def test_regress_rows_that_are_written_twice_are_named_and_lose_nothing(run, kind):
    again = np.repeat(np.arange(4000), 2) if kind == "each" else np.r_[0:2000, 1500:4000]
    count, first = (4000, "sample 1 at 0 s") if kind == "each" else (500, "sample 2000 at 1.5 s")
    result = examine(rows(run, again))
    assert [f.sentence for f in result.findings] == [
        f"run0: {count} rows are written twice, first in {first}; one of each is left out"
    ]
    assert result.usable
    np.testing.assert_array_equal(result.recording["motor_angle"], run["motor_angle"])
    [read] = gather(rows(run, again))
    assert f"{count} rows written twice left out" in read.notes
    np.testing.assert_array_equal(read["t"], run["t"])


def test_exact_rows_that_miss_the_same_numbers_are_written_twice(run):
    run["load_angle"][5:9] = np.nan
    assert "4 rows are written twice" in told(examine(rows(run, np.r_[0:9, 5:4000])), "time", "warning")[0]


def test_regress_both_angles_that_jump_at_once_are_a_fault_of_the_clock(run):
    kept = np.r_[0:1600, 1700:4000]
    found = rows(run, kept) | {"t": run["t"][: kept.size]}
    result = examine(found)
    assert "both angles jump at once in sample 1600 at 1.6 s" in told(result, "time", "reject")[0]
    assert not told(result, "jumps", "reject")


# Angles


@pytest.mark.parametrize("name", TO_MOTOR)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("level", [0.0, 7.0])
def test_regress_dropouts_are_named_and_left_out(clean, name, kind, level):
    found = rows(clean[kind], slice(None))
    true = found[name].copy()
    gone = np.r_[1500:1520, 2100, 3300:3330]
    found[name][gone] = level / TO_MOTOR[name]
    result = examine(found)
    assert [f.sentence for f in result.findings] == [
        f"run0: {name} drops out in 51 samples, 3 times, first in sample 1500 at 1.5 s, where it reads "
        f"{level / TO_MOTOR[name]:.4g} rad; they are left out"
    ]
    assert result.usable
    assert np.isnan(result.recording[name][gone]).all()
    np.testing.assert_array_equal(np.delete(result.recording[name], gone), np.delete(true, gone))


@pytest.mark.parametrize("name", TO_MOTOR)
@pytest.mark.parametrize("kind", KINDS)
def test_regress_spikes_are_named_and_left_out(clean, name, kind):
    found = rows(clean[kind], slice(None))
    places = np.arange(1010, 3000, 250)
    found[name][places] += np.array([1.0, -2.0, 30.0, -1.0, 5.0, -9.0, 1.5, -3.0]) / TO_MOTOR[name]
    result = examine(found)
    [finding] = result.findings
    assert f"{name} has spikes in 8 samples, 8 times, first in sample {places[0]} at" in finding.sentence
    assert finding.severity == "warning"
    assert np.flatnonzero(np.isnan(result.recording[name])).tolist() == places.tolist()


@pytest.mark.parametrize("name", TO_MOTOR)
@pytest.mark.parametrize("kind", KINDS)
def test_regress_a_frozen_angle_is_named_and_left_out(clean, name, kind):
    found = rows(clean[kind], slice(None))
    found[name][1200:1500] = found[name][1200]
    result = examine(found)
    [finding] = result.findings
    assert f"{name} keeps its value in 300 samples while" in finding.sentence
    assert "1 times, first in sample 1200 at 1.2 s; they are left out" in finding.sentence
    assert np.isnan(result.recording[name][1200:1500]).all()


@pytest.mark.parametrize("name", TO_MOTOR)
def test_regress_an_angle_that_misses_what_it_froze_over_rejects(run, name):
    missed = run[name][1500] - run[name][1200]
    run[name][1200:1500] = run[name][1200]
    run[name][1500:] -= missed
    assert f"after it {abs(missed):.3g} rad are missing: split the file there" in examine(run).reason


@pytest.mark.parametrize("name", TO_MOTOR)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [0.3, -TURN])
def test_regress_lost_counts_are_named_and_not_judged_as_motion(clean, name, kind, size):
    found = rows(clean[kind], slice(None))
    found[name][1700:] += size / TO_MOTOR[name]
    result = examine(found)
    assert f"{name} jumps by {size / TO_MOTOR[name]:.1g}"[:-1] in told(result, "jumps", "reject")[0]
    assert "for good in sample 1700 at 1.7 s" in result.reason


def test_exact_a_sample_that_is_missing_at_speed_is_no_jump(run):
    kept = np.delete(np.arange(4000), [1500, 1700, 1750])
    assert examine(rows(run, kept) | {"t": run["t"][:3997]}).findings == []


def test_exact_an_impact_is_no_jump(run):
    """The speed changes from one sample to the next, the angle does not."""
    gone = run["t"] - 1.5
    for name, share in TO_MOTOR.items():
        run[name] = np.where(gone < 0.0, run[name], run[name][1500] - 40.0 * gone / share)
    assert not [f for f in examine(run).findings if f.check in ("jumps", "time", "freezes")]


@pytest.mark.parametrize("name", TO_MOTOR)
@pytest.mark.parametrize("hertz", [100.0, 200.0, 330.0])
def test_exact_what_rings_after_an_impact_is_no_spike_and_no_lost_count(run, name, hertz):
    after = np.maximum(run["t"] - 1.5, 0.0)
    run[name] += 0.3 * np.exp(-60.0 * after) * np.sin(TURN * hertz * after) / TO_MOTOR[name]
    assert not told(examine(run), "jumps", "warning") + told(examine(run), "jumps", "reject")


@pytest.mark.parametrize("kind", KINDS)
def test_regress_exchanged_angles_are_named(clean, kind):
    found = clean[kind] | {"motor_angle": clean[kind]["load_angle"], "load_angle": clean[kind]["motor_angle"]}
    assert "the two angles look exchanged" in examine(found).reason
    with pytest.raises(InputError, match="the two angles look exchanged"):
        refuse_apart(Recording("run0", found), found["motor_angle"], found["load_angle"], RATIO)


PERIODS = [
    (math.pi, 1.0, "3.1416 (half a turn)"),
    (180.0, 360.0 / TURN, "180 (half a turn in degrees)"),
    (4096.0, 4096.0 / TURN, "4096 (4096 counts)"),
    (1.0, 1.0 / TURN, "1 (a turn in turns)"),
    (0.4096 * TURN, 1.0, "2.5736 (0.4096 turns)"),
]


@pytest.mark.parametrize(("period", "scale", "name"), PERIODS)
@pytest.mark.parametrize("kind", KINDS)
def test_regress_an_angle_that_is_wrapped_at_another_period_is_named(clean, kind, period, scale, name):
    found = clean[kind] | {"motor_angle": (scale * clean[kind]["motor_angle"] + 0.3 * period) % period}
    jumps = int(np.sum(np.abs(np.diff(found["motor_angle"])) > 0.5 * period))
    sentence = f"motor_angle jumps by {name} {jumps} times and starts again"
    result = examine(found)
    assert len(result.findings) == 1
    assert sentence in result.reason
    with pytest.raises(InputError, match="starts again"):
        refuse_wrapped(Recording("run0", found), "motor_angle")


@pytest.mark.parametrize("levels", [2, 40])
def test_exact_an_angle_that_moves_in_large_steps_is_not_wrapped(run, levels):
    found = run | {"motor_angle": np.round(levels * (0.5 + 0.5 * np.sin(9.0 * run["t"])))}
    refuse_wrapped(Recording("run0", found), "motor_angle")


# The torque at the output


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("factor", "remedy"),
    [
        (-1.0, "flip the sign of scale in [columns] output_torque"),
        (100.0, "(N cm?): scale = 1e-2 in"),
        (1e3, "(N mm or mN m?): scale = 1e-3 in"),
        (-1e-3, "(kN m?): scale = -1e3 in"),
        (0.0, "a dead channel"),
    ],
)
def test_regress_an_output_torque_of_another_sign_or_unit_or_none_is_not_used(clean, kind, factor, remedy):
    found = clean[kind] | {"output_torque": factor * clean[kind]["output_torque"]}
    result = examine(found)
    [finding] = result.findings
    assert (finding.check, finding.severity) == ("output_torque", "warning")
    assert remedy in finding.sentence
    assert "output_torque" not in result.recording
    assert result.usable


@pytest.mark.parametrize("factor", [0.6, 1.6])
def test_exact_a_gain_of_the_torque_cell_is_no_other_unit(run, factor):
    run["output_torque"] *= factor
    assert examine(run).findings == []


# The motor torque


@pytest.fixture(scope="module")
def stepped():
    """A torque that is commanded up and down in ramps and stays at either end."""
    t = np.linspace(0.0, 4.0, 401)
    torque = 0.1 * np.clip(4.0 * (np.abs((5.0 * t) % 4.0 - 2.0) - 1.0), -1.0, 1.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("simulated_recordings.manoeuvre", lambda kind, rng: Scenario.torque_profile(t, torque))
        return columns(7, "stepped", 1000.0, 1e-3, 17)[0]


@pytest.mark.parametrize("reference", [None, "none", "followed"])
def test_regress_a_torque_that_is_commanded_to_stay_does_not_reject(stepped, reference):
    found = dict(stepped)
    if reference is not None:
        speed = np.gradient(found["motor_angle"], found["t"])
        found["speed_reference"] = speed if reference == "followed" else 0.0 * speed
    result = examine(found)
    assert result.usable
    assert "a limit of the drive or of its controller holds it, or it is asked for" in result.findings[0].sentence


def test_exact_a_torque_that_stays_while_the_speed_misses_its_reference_rejects(stepped):
    speed = np.gradient(stepped["motor_angle"], stepped["t"])
    assert "record with less torque" in examine(stepped | {"speed_reference": 2.0 * speed + 20.0}).reason


def test_exact_a_torque_that_is_switched_off_is_at_no_limit(run):
    on = (run["t"] % 1.0) < 0.6
    noise = 1e-4 * np.random.default_rng(1).standard_normal(4000)
    run["motor_torque"] = np.where(on, 0.1 * np.sin(np.pi * (run["t"] % 1.0) / 0.6), 0.0) + noise
    assert not [f for f in examine(run).findings if f.check == "saturation"]


# Rates


@pytest.mark.parametrize("name", ["motor_angle", "load_angle", "output_torque"])
@pytest.mark.parametrize("every", [3, 3.7, 10, 50])
def test_regress_a_channel_that_lines_have_filled_up_is_named(clean, name, every):
    found = dict(clean["profile"])
    slow = np.arange(0.0, 4.0 + 1e-3 * every, 1e-3 * every)
    found[name] = np.interp(found["t"], slow, np.interp(slow, found["t"], found[name]))
    result = examine(found)
    assert f"{name} has {1000.0 / every:.3g}" in told(result, "interpolated", "note")[0]
    assert result.facts.effective_rate_hz[name] == pytest.approx(1000.0 / every, rel=2e-2)


@pytest.mark.parametrize("kind", ["profile", "multisine"])
def test_exact_a_coarse_angle_is_not_made_of_lines(clean, kind):
    for step in (TURN / 512, TURN / 4096):
        found = clean[kind] | {"motor_angle": step * np.round(clean[kind]["motor_angle"] / step)}
        assert not told(examine(found), "interpolated", "note")


# The reference


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("factor", [-1.0, -30.0 / math.pi])
def test_regress_a_reference_that_runs_against_the_motor_rejects(clean, kind, factor):
    found = dict(clean[kind])
    found["speed_reference"] = factor * np.gradient(found["motor_angle"], found["t"])
    assert "flip the sign of scale in [columns] speed_reference" in examine(found).reason
