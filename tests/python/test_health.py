"""Health checks: each fires on a made fault, names the correction, and is silent on clean recordings."""

from __future__ import annotations

import math
from itertools import combinations, pairwise

import numpy as np
import pytest
from collisions import collided
from hdfast import health
from hdfast.diagnosis.session import usable, with_heldout
from hdfast.errors import InputError
from hdfast.health import alignment, leakage, nameplate, order, result, steps, timing
from hdfast.health.subject import Subject
from hdfast.recordings import Recording, load_campaign
from hypothesis import given, settings
from hypothesis import strategies as st
from simulated_recordings import J_L, J_M, RATIO, TEXT, campaign, columns

RNG = np.random.default_rng(5)


def examine(found, text=TEXT, **facts):
    return health.check(campaign([(found, facts)], text)).recordings[0]


def sentences(result, check, severity=None):
    return [f.sentence for f in result.findings if f.check == check and severity in (None, f.severity)]


@pytest.fixture(scope="module")
def clean():
    """One clean recording per manoeuvre, at 1 kHz, with encoders of 17 and 21 bit."""
    return {
        kind: columns(7, kind, 1000.0, 1e-3, 17)[0] for kind in ("profile", "sine", "start_stop", "ladder", "multisine")
    }


@pytest.fixture
def run(clean):
    return {name: values.copy() for name, values in clean["profile"].items()}


@pytest.mark.parametrize("block", range(5))
def test_exact_fifty_clean_recordings_give_no_finding(block):
    for seed in range(10 * block, 10 * block + 10):
        found, facts = columns(seed)
        result = examine(found, TEXT + facts)
        assert result.findings == [], seed
        assert result.usable
        assert result.mask.all()
        assert result.recording is not None


def test_exact_facts_of_a_clean_recording(run):
    facts = examine(run).facts
    assert facts.rate_hz == pytest.approx(1000.0)
    assert facts.effective_rate_hz["load_angle"] == pytest.approx(1000.0)
    assert facts.resolution["motor_angle"] == pytest.approx(2.0 * math.pi / 2**17, rel=1e-6)
    assert facts.ratio == pytest.approx(RATIO, rel=1e-3)
    assert facts.lag_s == pytest.approx(0.0, abs=2e-4)
    assert facts.gaps == facts.events == []


def test_exact_a_drive_without_gear_gives_no_hint_of_units(run):
    del run["load_angle"]
    run["speed_reference"] = np.gradient(run["motor_angle"], run["t"])
    drive = f"[drive]\nratio = 1\nJ_m = {J_M + J_L / RATIO**2}\nJ_l = 0.0\n"
    assert examine(run, drive).findings == []


def test_exact_a_missing_column_rejects_and_is_named(run):
    del run["motor_torque"]
    result = examine(run)
    assert not result.usable
    assert "no column for motor_torque (the file has: t, motor_angle, load_angle, output_torque)" in result.reason


def test_exact_a_missing_column_that_has_a_unit_in_its_name_is_proposed(run):
    named = {"t": "t [ms]", "motor_angle": "motor_angle_deg", "load_angle": "load_angle [deg]"}
    result = examine({"motor_torque": run["motor_torque"]}, file_columns=(*named.values(), "motor_torque"))
    assert result.reason.endswith(
        't = { name = "t [ms]", scale = 0.001 }  motor_angle = { name = "motor_angle_deg", scale = 0.0174532925 }'
    )


def test_regress_a_recording_without_samples_has_a_reason(run):
    result = examine({name: values[:0] for name, values in run.items()})
    assert not result.usable
    assert "0 samples with increasing time" in result.reason


def test_exact_too_few_numbers_reject_and_a_few_missing_are_masked(run):
    run["motor_torque"][:100] = np.nan
    run["motor_angle"][200] = np.inf
    few = examine(run)
    assert few.usable
    assert few.mask.sum() == run["t"].size - 101
    run["motor_torque"][: run["t"].size // 2 + 1] = np.nan
    assert "of motor_torque are numbers" in examine(run).reason


def test_exact_a_column_with_too_few_numbers_is_not_handed_on(run):
    run["load_angle"][: run["t"].size // 2 + 1] = np.nan
    run["load_torque"] = np.full(run["t"].size, np.nan)
    result = examine(run)
    assert [sentence.split("; ")[1] for sentence in sentences(result, "columns", "warning")] == [
        "the column is not used"
    ] * 2
    assert result.usable
    assert set(result.recording) == {"t", "motor_angle", "motor_torque", "output_torque"}


def test_exact_backward_time_is_left_out_or_rejects(run):
    run["t"][500] = 0.1
    result = examine(run)
    assert result.usable
    assert "time runs backward 1 times" in sentences(result, "time", "warning")[0]
    assert not result.mask[500]
    assert result.recording["t"].size == run["t"].size - 1
    run["t"] = np.tile(run["t"][: run["t"].size // 2], 2)
    assert "split the file" in examine(run).reason


@pytest.mark.parametrize(("scale", "reach"), [(1e3, "1.7e+12"), (1e9, "1.7e+18")])
def test_exact_a_time_stamp_in_parts_of_a_second_is_named(run, scale, reach):
    run["t"] = scale * (1.7e9 + run["t"])
    assert f"t reaches {reach} s: a time stamp in ms, us or ns? scale it in [columns] t" in examine(run).reason


def test_exact_repeated_and_constant_times(run):
    run["t"][700] = run["t"][699]
    assert "1 samples repeat the time" in sentences(examine(run), "time", "warning")[0]
    run["t"] = np.round(run["t"], 2)
    assert "write the time with more digits" in examine(run).reason
    run["t"][:] = 1.0
    assert "1 samples with increasing time" in examine(run).reason


def test_exact_gaps_split_or_reject(run):
    kept = np.ones(run["t"].size, dtype=bool)
    kept[1000:1100] = False
    small = examine({name: values[kept] for name, values in run.items()})
    assert small.usable
    assert small.facts.gaps == [(pytest.approx(0.999), pytest.approx(1.1))]
    kept[1000:2000] = False
    assert "record again without them" in examine({name: values[kept] for name, values in run.items()}).reason


def test_exact_a_gap_is_found_on_a_clock_that_counts_from_1970(run):
    kept = np.ones(run["t"].size, dtype=bool)
    kept[1000:1100] = False
    late = {name: values[kept] for name, values in run.items()}
    late["t"] = late["t"] + 1.7e9
    assert "a gap of 0.101 s after 1700000000.999 s" in sentences(examine(late), "time", "warning")[0]


def test_exact_jitter_is_a_note_and_no_gap(run):
    run["t"] = run["t"] + 2e-4 * RNG.uniform(-1.0, 1.0, run["t"].size)
    result = examine(run)
    assert [f.severity for f in result.findings if f.check == "time"] == ["note"]
    assert result.facts.gaps == []


@pytest.mark.parametrize("name", ["motor_angle", "load_angle", "motor_torque", "output_torque"])
def test_exact_held_values_give_the_effective_rate(run, name):
    run[name] = run[name][np.arange(run["t"].size) // 15 * 15]
    result = examine(run)
    assert f"{name} holds its values for 15 ms" in sentences(result, "held_values")[0]
    assert result.facts.effective_rate_hz[name] == pytest.approx(1000.0 / 15.0, rel=0.02)


def test_exact_a_coarse_encoder_is_not_a_held_value(clean):
    found = dict(clean["sine"])
    step = 2.0 * math.pi / 512
    found["motor_angle"] = step * np.round(found["motor_angle"] / step)
    assert sentences(examine(found), "held_values") == []


def test_exact_a_few_jerks_of_a_noisy_coarse_encoder_are_no_held_values(run):
    step, n = 4.8e-5, run["t"].size
    jerks = np.isin(np.arange(n), RNG.choice(n, 40, replace=False))
    moved = step * (0.3 * RNG.standard_normal(n) + 4.0 * np.cumsum(jerks))
    assert steps.hold(run["t"], step * np.round(moved / step), step) is None


def test_exact_resolution_is_the_larger_of_stated_and_seen(run):
    step = 2.0 * math.pi / 2**17
    coarse = examine(run, TEXT + f"[sensors]\nmotor_angle = {{ resolution = {step / 8.0!r} }}\n")
    assert "the larger one is used" in sentences(coarse, "resolution", "warning")[0]
    assert coarse.facts.resolution["motor_angle"] == pytest.approx(step, rel=1e-6)
    fine = examine(run, TEXT + f"[sensors]\nmotor_angle = {{ resolution = {step * 8.0!r} }}\n")
    assert "finer than" in sentences(fine, "resolution", "note")[0]
    assert fine.facts.resolution["motor_angle"] == pytest.approx(8.0 * step)


def test_exact_a_cut_off_torque_is_told_from_a_constant_one(clean):
    found = dict(clean["multisine"])
    torque = found["motor_torque"]
    found["motor_torque"] = np.clip(torque, -np.quantile(np.abs(torque), 0.9), np.quantile(np.abs(torque), 0.9))
    cut = examine(found)
    assert "a limit of the drive or of its controller holds it" in sentences(cut, "saturation", "warning")[0]
    assert cut.facts.saturation[1] == pytest.approx(0.1, abs=0.05)
    found["motor_torque"] = np.clip(torque, -np.quantile(np.abs(torque), 0.5), np.quantile(np.abs(torque), 0.5))
    assert "record with less torque" in examine(found).reason


@pytest.mark.parametrize(
    ("turn", "scale"), [(2.0 * math.pi, 1.0), (360.0, 180.0 / math.pi), (RATIO * 2.0 * math.pi, 60.0)]
)
@pytest.mark.parametrize("kind", ["profile", "sine", "ladder", "multisine"])
def test_exact_a_wrapped_angle_is_named_and_nothing_else(clean, kind, turn, scale):
    found = dict(clean[kind])
    found["motor_angle"] = scale * found["motor_angle"]
    jumps = int(np.sum(np.diff(np.floor(found["motor_angle"] / turn + 0.5)) != 0))
    found["motor_angle"] = (found["motor_angle"] + turn / 2.0) % turn - turn / 2.0
    result = examine(found)
    assert jumps > 0
    assert sentences(result, "wrapping") == [
        f"run0: motor_angle jumps by a whole turn {jumps} times: unwrap it (numpy.unwrap) before saving"
    ]
    assert len(result.findings) == 1
    assert not result.usable


def test_exact_a_jump_that_is_no_turn_is_not_called_one(clean):
    found = dict(clean["sine"])
    found["motor_angle"] = 0.2 * np.sin(found["t"])
    found["motor_angle"][2000:] += 5.0
    assert sentences(examine(found), "wrapping") == []


def test_exact_a_torque_beyond_the_limit_of_the_controller_is_a_wrong_scale(run):
    text = TEXT + '[controller]\nkind = "pi"\nkp = 0.05\nlimit = 2.0\n'
    assert sentences(examine(run, text), "saturation") == []
    largest = 1e3 * float(np.max(np.abs(run["motor_torque"])))
    run["motor_torque"] = 1e3 * run["motor_torque"]
    result = examine(run, text)
    assert sentences(result, "saturation", "reject") == [
        f"run0: motor_torque reaches {largest:.4g} N m, {largest / 2.0:.3g} times the limit of [controller]: "
        "scale it in [columns] motor_torque, or correct limit"
    ]
    run["motor_torque"] = 1e-3 * run["motor_torque"]
    run["motor_torque"][1000] = 5.0
    assert "2.5 times the limit" in sentences(examine(run, text), "saturation", "warning")[0]


def test_exact_the_limit_of_the_controller_is_a_saturation(run):
    limit = float(np.quantile(np.abs(run["motor_torque"]), 0.95))
    text = TEXT + f'[controller]\nkind = "pi"\nkp = 0.05\nlimit = {limit}\n'
    run["motor_torque"] = np.clip(run["motor_torque"], -limit, limit)
    assert examine(run, text).facts.saturation == (pytest.approx(limit), pytest.approx(0.05, abs=0.02))


RATIO_FAULTS = [
    (-1.0, "flip the sign of scale"),
    (180.0 / math.pi, "load_angle looks like degrees"),
    (math.pi / 180.0, "motor_angle looks like degrees"),
    (RATIO, "both angles look like the same side"),
    (1.05, "check ratio and the scales"),
]


@pytest.mark.parametrize(("factor", "text"), RATIO_FAULTS)
def test_exact_ratio_and_sign(run, factor, text):
    run["load_angle"] = factor * run["load_angle"]
    result = examine(run)
    assert not result.usable
    assert text in sentences(result, "ratio", "reject")[0]


@pytest.mark.parametrize(("ratio", "usable"), [(RATIO, True), (100.0, False)])
def test_exact_a_ratio_that_is_not_stated_is_no_guess(run, ratio, usable):
    """The default drive has 121."""
    run["load_angle"] = run["load_angle"] * RATIO / ratio
    result = examine(run, "\n".join(line for line in TEXT.splitlines() if not line.startswith("ratio")))
    assert result.usable == usable
    [told] = sentences(result, "ratio")
    assert f"the angles give a ratio of {'120.97' if usable else '99.97'}" in told
    assert ("state ratio in [drive]" in told) != usable


def test_exact_windup_on_a_short_stroke_is_no_wrong_ratio(clean):
    found = dict(clean["sine"])
    shorter = 0.04 * RATIO / np.ptp(found["motor_angle"])
    for name in ("motor_angle", "motor_torque", "load_angle"):
        found[name] = shorter * found[name]
    found["load_angle"] = 1.05 * found["load_angle"]
    assert examine(found).usable
    found["load_angle"] = 1.3 * found["load_angle"]
    assert "check ratio and the scales" in examine(found).reason


def test_exact_a_locked_output_is_no_ratio_error(run):
    run["load_angle"][:] = 0.25
    result = examine(run)
    assert result.usable
    assert "a locked output or a dead channel" in sentences(result, "ratio", "warning")[0]


def test_exact_a_small_ratio_error_is_a_candidate(run):
    run["load_angle"] = run["load_angle"] * RATIO / 120.0
    [sentence] = sentences(examine(run), "ratio", "warning")
    assert "a gear of 120 : 1 with another member fixed?" in sentence
    run["load_angle"] = run["load_angle"] * 120.0 / RATIO * 1.003
    assert "ratio_error is a candidate" in sentences(examine(run), "ratio", "warning")[0]


@pytest.mark.parametrize("kind", ["profile", "sine", "multisine"])
@pytest.mark.parametrize("lag", [3e-3, -3e-3, 2e-2])
def test_exact_lag_of_the_load_angle(clean, kind, lag):
    found = dict(clean[kind])
    found["load_angle"] = np.interp(found["t"] - lag, found["t"], found["load_angle"])
    result = examine(found)
    assert result.facts.lag_s == pytest.approx(lag, abs=3e-4)
    assert "delay and sensor_delay are candidates" in sentences(result, "clock", "warning")[0]
    stated = examine(found, TEXT + f"[sensors]\nload_angle = {{ delay_s = {max(lag, 0.0)} }}\n")
    assert bool(sentences(stated, "clock")) is (lag < 0.0)


@pytest.mark.parametrize("noise", [0.0, 3e-5])
@pytest.mark.parametrize("start", [0.1, 0.3])
def test_exact_a_shaft_that_turns_steadily_has_no_lag(start, noise):
    t = np.arange(0.0, 4.3, 1e-3)
    speed = 11.0 * np.clip(t / start, 0.0, 1.0)
    angle = np.cumsum(speed) * 1e-3
    swinging = 2e-5 * np.sin(9.0 * t) + noise * np.random.default_rng(3).standard_normal(len(t))
    load = angle / RATIO + 3e-5 * np.cos(2.0 * angle + 1.0) + swinging
    torque = 0.02 + 1e-3 * speed + (J_M + J_L / RATIO**2) * np.gradient(speed, t)
    result = examine({"t": t, "motor_angle": angle, "motor_torque": torque, "load_angle": load})
    assert result.usable
    assert result.facts.lag_s == pytest.approx(0.0, abs=2e-2)
    assert not sentences(result, "clock")


@pytest.mark.parametrize("kind", ["profile", "sine", "ladder", "multisine"])
@pytest.mark.parametrize("known", [False, True])
def test_exact_what_winds_up_the_gear_is_no_lag_and_no_other_ratio(clean, kind, known):
    found = dict(clean[kind])
    if known:
        load = 20.0 * np.sin(3.0 * math.pi * found["t"] / found["t"][-1])
        found["load_torque"] = load
    else:
        load = 20.0 * np.sign(np.gradient(found["motor_angle"], found["t"]))
    found["load_angle"] = found["load_angle"] - load / 4e4
    assert not [f.sentence for f in examine(found).findings if f.check in ("ratio", "clock")]


def test_exact_windup_of_a_spring_that_stiffens_is_no_other_ratio_on_short_ways(clean):
    found = dict(clean["sine"])
    t, share = found["t"], 0.15 / np.ptp(found["load_angle"])
    found |= {name: share * found[name] for name in ("motor_angle", "load_angle")}
    pulled = np.gradient(np.gradient(found["load_angle"], t), t)
    found["load_angle"] = found["load_angle"] - 1e-3 * np.tanh(2.0 * pulled / np.abs(pulled).max())
    assert sentences(examine(found), "ratio") == []


@pytest.mark.parametrize("resolution", [0.0, 2.0 * math.pi / 2**17])
@pytest.mark.parametrize("frequency", [0.2, 1.0, 3.0])
def test_exact_windup_of_a_swing_of_one_tone_is_no_other_ratio(frequency, resolution):
    """Its acceleration is in proportion to its angle, whatever the spring."""
    t, turned = np.arange(0.0, 6.0, 1e-3), 2.0 * math.pi * frequency
    swing = np.sin(turned * t)
    windup = -J_L * turned**2 * swing / RATIO / 31020.0
    motor = resolution * np.round(60.0 * swing / resolution) if resolution else 60.0 * swing
    torque = 0.03 * np.tanh(np.cos(turned * t)) - 60.0 * (J_M + J_L / RATIO**2) * turned**2 * swing
    found = {"t": t, "motor_angle": motor, "motor_torque": torque, "load_angle": 60.0 * (swing / RATIO - windup)}
    assert sentences(examine(found), "ratio") == []


def test_exact_a_late_load_angle_rejects(run):
    run["load_angle"] = np.interp(run["t"] - 0.08, run["t"], run["load_angle"])
    assert "load_angle lags motor_angle by 80" in examine(run).reason


def test_exact_clock_skew(clean):
    found = dict(clean["sine"])
    found["load_angle"] = np.interp(found["t"] * (1.0 - 2e-3), found["t"], found["load_angle"])
    late, skew = sentences(examine(found), "clock", "warning")
    assert "lags motor_angle by 4" in late
    assert "clock_skew is a candidate" in skew


@pytest.mark.parametrize("kind", ["profile", "sine", "multisine", "ladder", "start_stop"])
def test_exact_torque_with_the_wrong_sign(clean, kind):
    found = dict(clean[kind])
    found["motor_torque"] = -found["motor_torque"]
    result = examine(found)
    assert not result.usable
    assert "flip the sign of scale in [columns] motor_torque" in sentences(result, "torque_sign", "reject")[0]


UNITS = [
    ("motor_angle", 57.29578, "the motor reaches"),
    ("motor_torque", RATIO, "motor_torque may be the torque at the output"),
    ("motor_torque", 1000.0, "motor_torque may be in mN m"),
    ("motor_torque", 9.09, "look for a scale of motor_torque"),
    ("motor_torque", 0.1, "look for a scale of motor_torque"),
    ("t", 1000.0, "t may not be in seconds"),
]


@pytest.mark.parametrize(("name", "factor", "text"), UNITS)
def test_exact_units_are_suggested_and_nothing_is_rescaled(run, name, factor, text):
    before = {key: values.copy() for key, values in run.items()}
    run[name] = run[name] * factor
    result = examine(run)
    assert any(text in sentence for sentence in sentences(result, "units", "warning"))
    np.testing.assert_array_equal(result.source[name], before[name] * factor)


@pytest.mark.parametrize("unit", ["K", "°F"])
def test_exact_a_temperature_that_no_scale_converts_has_to_be_converted(run, unit):
    run["temperature"] = np.full(run["t"].size, 293.15)
    said = (
        f"run0: the file gives temperature in {unit}, not in degC: convert it to degC in the file, which no scale does"
    )
    assert sentences(examine(run, units={"temperature": unit}), "units", "warning") == [said]
    with pytest.raises(InputError) as told:
        Recording("run0", run, units={"temperature": unit}).need("friction", "temperature")
    assert str(told.value) == said
    assert sentences(examine(run, units={"temperature": "°C"}), "units", "warning") == []


@pytest.mark.parametrize(("value", "told"), [(293.15, True), (85.0, False)])
def test_exact_a_temperature_that_no_gear_has_may_be_in_kelvin(run, value, told):
    run["temperature"] = np.full(run["t"].size, value)
    assert any("kelvin" in sentence for sentence in sentences(examine(run), "units", "warning")) is told


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("deg", "scale = 0.0174532925 in [columns]"),
        ("Degrees", "scale = 0.0174532925 in [columns]"),
        ("DEG", "scale = 0.0174532925 in [columns]"),
        ("arcsec", "scale = 4.84813681e-06 in [columns]"),
        ("inc", "a scale from inc to rad"),
        ("rpm", "gives load_angle in rpm, not in rad: name another column in [columns] load_angle, or"),
        ("N·m", "name another column in [columns] load_angle, or correct its unit in the file"),
        ("Rad", ""),
        ("-", ""),
        ("rad", ""),
        ("ÅU", ""),
    ],
)
def test_exact_units_that_the_file_states(run, unit, text):
    found = sentences(examine(run, units={"load_angle": unit}), "units", "reject")
    assert bool(found) is bool(text)
    assert all(text in sentence for sentence in found)


@pytest.mark.parametrize(("factor", "severity"), [(1e-2, "warning"), (1e-6, "reject")])
def test_exact_a_scale_with_which_no_fit_means_anything_is_rejected(run, factor, severity):
    """Time in milliseconds, which would be simulated for hours."""
    run["motor_torque"] = run["motor_torque"] / factor
    assert "times the stated inertia" in sentences(examine(run), "units", severity)[0]


@pytest.mark.parametrize(
    ("factor", "text"), [(9.549297, "r/min"), (57.29578, "deg/s"), (1.0 / RATIO, "speed of the output")]
)
def test_exact_units_of_the_reference(run, factor, text):
    run["speed_reference"] = factor * np.gradient(run["motor_angle"], run["t"])
    assert text in sentences(examine(run), "units", "warning")[0]


def test_exact_a_collision_is_an_event():
    found, begin = collided()
    result = examine(found)
    [event] = result.facts.events
    assert event[0] < begin < event[1] < begin + 1.0
    assert "come from outside" in sentences(result, "events", "warning")[0]
    inside = (found["t"] > event[0]) & (found["t"] < event[1])
    assert not result.mask[inside].any()
    assert result.mask[~inside].sum() > 0.7 * found["t"].size


def test_regress_samples_further_apart_than_an_onset_are_no_event():
    """As where a column in milliseconds is read in seconds: nothing is left of the time before the onset."""
    t = np.arange(0.0, 1000.0, 0.5)
    torque = 0.1 * np.sin(2.0 * np.pi * t / 200.0)
    acceleration = torque / 3.0
    acceleration[800] -= 0.2 / 3.0
    angle = 0.25 * np.cumsum(np.cumsum(acceleration))
    assert examine({"t": t, "motor_angle": angle, "motor_torque": torque}).facts.events == []


def test_exact_leakage_rejects_the_heldout_recording(run, clean):
    part = {name: values[1000:3000] for name, values in run.items()}
    thinned = {name: values[::2] for name, values in run.items()}
    for copy in (run, part, thinned):
        result = health.check(campaign([run, clean["sine"], (copy, {"role": "heldout"})]))
        assert list(result.rejected) == ["run2"]
        assert "are also in run0" in result.rejected["run2"]
        assert result.usable
    result = health.check(campaign([run, run, (clean["sine"], {"role": "heldout"})]))
    assert result.rejected == {}
    assert "counts twice" in sentences(result.recordings[1], "leakage", "warning")[0]


@pytest.mark.parametrize(("groups", "held"), [("ABCD", "run2"), ("ABCC", "run2"), ("ABBC", "run3")])
def test_exact_what_is_set_aside_is_no_copy_of_what_is_fitted(clean, groups, held):
    """Where the copy is of another group than the last one, it is fitted twice, and that is said."""
    twice = groups == "ABBC"
    order = ["profile", "sine", *(("profile", "ladder") if twice else ("ladder", "profile"))]
    found = health.check(campaign([(clean[kind], {"group": own}) for kind, own in zip(order, groups, strict=True)]))
    assert list(found.rejected) == ([] if twice else ["run3"])
    assert [one.name for one in with_heldout(usable(found))[0] if one.role == "heldout"] == [held]
    assert bool(sentences(found.recordings[2], "leakage", "warning")) is twice


@pytest.mark.parametrize(("begin", "rejected"), [(0, []), (1600, ["run1"])])
def test_exact_the_last_part_of_a_recording_is_not_the_first_one_of_another(run, begin, rejected):
    """A whole copy is cut at the same sample; the later half is fitted where the whole recording is set aside."""
    later = {name: values[begin:] for name, values in run.items()}
    for held in ([], [(run | {"motor_angle": 0.0 * run["motor_angle"]}, {"role": "heldout"})]):
        found = health.check(campaign([run, later, *held]))
        assert list(found.rejected) == [*rejected, *(["run2"] if held else [])]
        assert bool(rejected) or "counts twice" in sentences(found.recordings[1], "leakage", "warning")[0]


def test_exact_different_motions_under_one_torque_that_begin_alike_are_no_leak(clean):
    fitted, held = ({name: values.copy() for name, values in clean[kind].items()} for kind in ("profile", "sine"))
    for found in (fitted, held):
        found["motor_angle"] -= found["motor_angle"][0]
        found["motor_torque"][:] = 0.1
    result = health.check(campaign([fitted, fitted | {"t": fitted["t"]}, (held, {"role": "heldout"})]))
    assert sentences(result.recordings[1], "leakage") == [
        "run1: 100 % of its samples are also in run0; the same evidence counts twice"
    ]
    assert not sentences(result.recordings[2], "leakage")


def test_exact_a_held_out_recording_may_repeat_a_rejected_one(run, clean):
    reversed_load = run | {"load_angle": -run["load_angle"]}
    result = health.check(campaign([clean["sine"], reversed_load, (run, {"role": "heldout"})]))
    assert list(result.rejected) == ["run1"]


def test_exact_leakage_reads_every_recording_once(clean, monkeypatch):
    """Blocks and samples, whatever the number of pairs."""
    read = []
    whole = leakage.Evidence._marks
    monkeypatch.setattr(leakage.Evidence, "_marks", lambda *given: read.append(given[2]) or whole(*given))
    *fitted, held = clean.values()
    health.check(campaign([*fitted, (held, {"role": "heldout"})]))
    assert sorted(read) == [1] * 5 + [leakage.BLOCK] * 5


def test_exact_missing_numbers_are_no_leak(clean):
    """Both loggers miss as many samples, of the angle and the torque."""
    fitted, held = ({name: values.copy() for name, values in clean[kind].items()} for kind in ("profile", "sine"))
    for found in (fitted, held):
        for name in ("motor_angle", "motor_torque"):
            found[name][1000:1500] = np.nan
    result = health.check(campaign([fitted, (held, {"role": "heldout"})]))
    assert not any(sentences(item, "leakage") for item in result.recordings)


def test_exact_no_motion_rejects(run):
    run["motor_angle"][:] = 1.0
    assert "the motor does not move" in examine(run).reason


def test_exact_speeds_whose_squares_are_no_numbers_are_examined(clean):
    found = {**clean["sine"], "speed_reference": np.gradient(clean["sine"]["motor_angle"], clean["sine"]["t"])}
    tiny = {name: values if name == "t" else 1e-200 * values for name, values in found.items()}
    assert examine(tiny).usable


def test_exact_a_motor_at_rest_is_not_told_to_flip_its_torque(run):
    step = 2.0 * math.pi / 2**17
    run["motor_angle"] = step * (np.sin(run["t"]) < 0.0)
    run["motor_torque"] = np.cos(run["t"])
    result = examine(run, TEXT + f"[sensors]\nmotor_angle = {{ resolution = {step!r} }}\n")
    assert not sentences(result, "torque_sign")
    assert "the motor does not move" in result.reason


@pytest.mark.parametrize("name", ["noise", "resolution"])
def test_exact_a_stated_sensor_that_hides_the_motion_is_named(run, name):
    travel = np.ptp(run["motor_angle"])
    stated = TEXT + f"[sensors]\nmotor_angle = {{ {name} = {travel} }}\n"
    assert sentences(examine(run, stated), "coverage") == [
        f"run0: the motor does not move: motor_angle changes by {travel:.3g} rad, at most 5 times its {name} of "
        f"{travel:.3g} rad; correct [sensors], or leave the recording out"
    ]


def test_exact_warnings_are_those_to_mend_and_those_not_used(run, clean):
    still = {name: 0.0 * values if name == "motor_angle" else values for name, values in run.items()}
    run["load_torque"] = np.full(run["t"].size, np.nan)
    found = health.check(campaign([clean["sine"], run, still]))
    assert found.warnings[0] == "run1: 0 % of load_torque are numbers; the column is not used"
    assert "not used: run2: the motor does not move" in " ".join(found.warnings)


def test_exact_coverage_counts_groups(clean):
    result = health.check(
        campaign([clean["profile"], (clean["start_stop"], {"group": "B"}), (clean["profile"], {"group": "B"})])
    )
    one, two = result.coverage
    assert (one.group, one.recordings, one.directions, one.reversals) == ("A", 1, ("forward", "backward"), 1)
    assert (two.recordings, two.starts) == (2, 2)
    assert two.seconds == pytest.approx(8.0, abs=0.01)
    assert one.speed[0] < -10.0 < 20.0 < one.speed[1]
    assert one.load[0] < one.load[1]
    assert one.temperature is None


def test_exact_repeats_are_found_and_their_variance_is_the_noise(clean):
    noisy = []
    for seed in (1, 2):
        found = dict(clean["multisine"])
        found["output_torque"] = found["output_torque"] + 0.5 * np.random.default_rng(seed).standard_normal(4000)
        noisy.append(found)
    [pair] = health.check(campaign([*noisy, clean["sine"]])).repeats
    assert (pair.recordings, pair.input) == ((0, 1), "motor_torque")
    assert pair.variance["output_torque"] == pytest.approx(0.25, rel=0.1)
    broken = {name: values[:3] for name, values in clean["sine"].items()}
    [pair] = health.check(campaign([broken, *noisy])).repeats
    assert pair.recordings == (1, 2)


def test_exact_repeats_are_looked_for_when_they_are_asked_for(clean, monkeypatch):
    asked = []
    monkeypatch.setattr(result, "repeats", lambda subjects: asked.append(len(subjects)) or [])
    found = health.check(campaign([clean["sine"], clean["multisine"]]))
    assert asked == []
    assert found.repeats is found.repeats
    assert asked == [2]


def test_exact_what_was_noted_while_loading_is_a_finding(run):
    noted = examine(run, notes=("read as Windows-1252 text",))
    assert sentences(noted, "columns", "note") == ["run0: read as Windows-1252 text"]
    assert len(noted.findings) == 1


def test_exact_a_column_that_other_recordings_have_is_missed(clean):
    bare = {name: values for name, values in clean["sine"].items() if name != "load_angle"}
    first, second = health.check(campaign([clean["multisine"], bare])).recordings
    assert first.findings == []
    assert sentences(second, "columns", "warning") == [
        "run1: no column 'load_angle' for load_angle, which other recordings have"
    ]


@pytest.mark.parametrize(("every", "share"), [(2, 0.5), (100, 1.0)])
def test_exact_samples_that_are_left_out_throughout_set_the_effective_rate(run, every, share):
    run["load_angle"][::every] = np.nan
    facts = examine(run).facts
    assert facts.effective_rate_hz["load_angle"] == pytest.approx(1000.0 * share, rel=1e-3)
    assert facts.resolution["load_angle"] == pytest.approx(2.0 * math.pi / 2**21, rel=1e-6)
    assert facts.effective_rate_hz["motor_angle"] == facts.rate_hz


def test_exact_a_slow_raster_of_an_mdf_has_its_own_rate(run, tmp_path):
    """A load angle of 50 Hz on the times of a motor at 1 kHz says nothing of what is faster."""
    from asammdf import MDF, Signal

    slow = {"load_angle": 20}
    with MDF() as file:
        for name in ("motor_angle", "motor_torque", "load_angle"):
            every = slow.get(name, 1)
            file.append([Signal(run[name][::every], run["t"][::every], name=name)])
        file.save(tmp_path / "run.mf4")
    (tmp_path / "campaign.toml").write_text(TEXT + '[[recording]]\nfile = "run.mf4"\n')
    found = health.check(load_campaign(tmp_path / "campaign.toml"))
    [item] = found.recordings
    assert item.facts.effective_rate_hz["load_angle"] == pytest.approx(50.0, rel=1e-3)
    assert item.facts.effective_rate_hz["motor_angle"] == item.facts.rate_hz
    assert "load_angle has 50 samples per second of its own" in sentences(item, "interpolated", "note")[0]
    [source] = usable(found)
    assert source.rate == pytest.approx(50.0, rel=1e-3)


def test_exact_what_the_drive_leaves_open_is_named(run):
    result = health.check(campaign([run], "[drive]\nratio = 120\nteeth_flexspline = 240\nteeth_circular = 242\n"))
    note, warning = result.findings
    assert "[drive] does not state J_m, J_l" in note.sentence
    assert "ratio = 120, the teeth give 121" in warning.sentence
    assert "of 1 recordings usable" in repr(result)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 20), max_size=12))
def test_against_brute_force_longest_increasing(values):
    found = order.longest_increasing(np.array(values, dtype=float))
    chosen = [values[k] for k in found]
    assert all(a < b for a, b in pairwise(chosen))
    assert not any(all(a < b for a, b in pairwise(other)) for other in combinations(values, len(chosen) + 1))


@settings(max_examples=60, deadline=None)
@given(st.floats(1e-7, 10.0), st.integers(0, 2**32 - 1))
def test_exact_lattice_of_rounded_noise(step, seed):
    values = step * np.round(np.random.default_rng(seed).normal(0.0, 5.0, 400))
    assert steps.lattice(np.diff(values)) == pytest.approx(step, rel=1e-6)
    assert steps.lattice(np.diff(np.random.default_rng(seed).normal(0.0, 5.0, 400))) == 0.0


def test_exact_steady_speeds_that_are_multiples_are_no_lattice():
    speed = np.repeat([10.0, 20.0, 30.0, -10.0, -20.0, -30.0], 500)
    angle = np.cumsum(speed) * 1e-3 + np.random.default_rng(2).normal(0.0, 1e-4, 3000)
    assert steps.lattice(np.diff(angle)) == 0.0


@pytest.mark.parametrize(("sigma", "told"), [(0.1, False), (1.0, False), (2e-5, True), (1600.0, True), (0.0, False)])
def test_exact_a_sigma_that_is_no_share_is_told(sigma, told):
    text = TEXT.replace("B_ml = 6e-4", f"B_ml = {{ value = 6e-4, sigma = {sigma} }}")
    found = [one.sentence for one in nameplate.check(campaign([], text)) if one.severity == "warning"]
    assert any(sentence.startswith(f"sigma of B_ml ({sigma:.4g})") for sentence in found) == told


@pytest.mark.parametrize(("sigma", "told"), [(0.5, True), (0, False)])
def test_exact_a_relative_sigma_of_zero_is_told_unless_it_is_meant(sigma, told):
    text = TEXT.replace("B_ml = 6e-4", f"B_ml = {{ value = 0, sigma = {sigma} }}")
    found = [one.sentence for one in nameplate.check(campaign([], text))]
    assert any(sentence.startswith("B_ml = 0 has a relative sigma") for sentence in found) == told


def test_against_lstsq_block_regression():
    basis = RNG.normal(size=(500, 4))
    values = basis @ [1.0, -2.0, 0.5, 0.0] + 0.1 * RNG.normal(size=500)
    found, errors = alignment.block_regression(basis, values)
    np.testing.assert_allclose(found, np.linalg.lstsq(basis, values, rcond=None)[0], rtol=1e-10)
    assert np.all(errors < 0.02)


def test_exact_inertia_of_the_rigid_fit(clean):
    made = campaign([clean["multisine"]])
    subject = Subject(made, made.recordings[0])
    timing.check(subject)
    assert subject.rigid.inertia == pytest.approx(J_M + J_L / RATIO**2, rel=0.1)


def test_exact_a_known_load_torque_is_no_inertia(run):
    t, speed = run["t"], np.gradient(run["motor_angle"], run["t"])
    run["load_torque"] = np.where((t > 1.0) & (t < 3.0), 60.0, 0.0) + np.sin(3.0 * t) * np.abs(speed)
    run["motor_torque"] = run["motor_torque"] + run["load_torque"] / RATIO
    health_of_it = health.check(campaign([run]))
    assert health_of_it.subjects[0].rigid.inertia == pytest.approx(J_M + J_L / RATIO**2, rel=0.1)
    assert health_of_it.recordings[0].findings == []


@pytest.mark.parametrize(
    ("B_m", "B_ml", "told"), [("0", "0", True), ("0", "6e-4", False), ("6e-4", "0", False), ("0", None, False)]
)
def test_exact_a_drive_that_is_stated_without_drag_is_told_what_becomes_of_it(B_m, B_ml, told):
    """One of the two dampings takes what there is of drag; where neither can, another law does."""
    text = TEXT.replace("B_m = 6e-4", f"B_m = {B_m}").replace("B_ml = 6e-4", f"B_ml = {B_ml}" if B_ml else "")
    found = nameplate.check(campaign([], text))
    assert any(one.sentence.startswith("B_m and B_ml = 0") for one in found if one.severity == "warning") == told
