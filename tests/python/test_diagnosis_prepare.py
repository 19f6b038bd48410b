"""Recordings brought to one clock and one band, and what of them is judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hdfast.diagnosis.angle_noise import another
from hdfast.diagnosis.band import Band, choose_band, low_pass, noise_density
from hdfast.diagnosis.evidence import lay_out
from hdfast.diagnosis.noise import as_coarse, floors
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.prepare import joined, prepare
from hdfast.diagnosis.reading import reading
from hdfast.diagnosis.session import far_slower, warmed, with_heldout
from hdfast.diagnosis.source import Source
from hdfast.diagnosis.structure import Free, Structure
from hdfast.errors import InputError
from hdfast.model import Model
from hdfast.recordings.clock import period
from hdfast.sensors import SensorFacts, SensorStage
from hypothesis import given
from hypothesis import strategies as st
from scipy import fft, signal

RATIO = 100.0


def source(rate: float, seconds: float = 4.0, start: float = 0.0, role: str = "fit", **columns: np.ndarray) -> Source:
    """A drive that swings to and fro at 1 Hz."""
    t = start + np.arange(round(seconds * rate)) / rate
    angle = 20.0 * np.sin(2.0 * np.pi * (t - start))
    noise = np.random.default_rng(1).normal(0.0, 1e-3, len(t))
    recording = {"t": t, "motor_angle": angle, "motor_torque": 0.1 * np.sign(np.gradient(angle)) + noise, **columns}
    return Source("swing", recording, role, "A", np.ones(len(t), dtype=bool))


@pytest.mark.parametrize("seconds", [3.0, 4.0, 5.0, 12.0])
@pytest.mark.parametrize("start", [0.0, 10.0])
def test_exact_a_clock_that_rounds_gives_the_same_band(seconds, start):
    assert choose_band([source(1000.0, seconds, start)], 1e-4, {}).rate == pytest.approx(500.0, rel=1e-9)


def test_exact_the_slowest_clock_sets_the_rate_of_all():
    sources = [source(1000.0), source(100.0, role="heldout")]
    band = choose_band(sources, 1e-4, {})
    assert band.rate == pytest.approx(100.0, rel=1e-9)
    for one in sources:
        assert 1.0 / np.diff(prepare(one, band, RATIO).t) == pytest.approx(100.0, rel=1e-9)


def test_exact_time_since_the_start_counts_from_the_first_sample_of_the_whole_recording():
    """Also on a clock that counts from 1970, and in the part of a recording that was set aside."""
    whole = replace(source(1000.0, start=1.7e9), start=1.7e9)
    part = {name: values[3000:] for name, values in whole.recording.items()}
    cut = replace(whole, recording=part, good=whole.good[3000:])
    band = choose_band([whole], 1e-4, {})
    units = [prepare(one, band, RATIO) for one in (whole, cut)]
    assert [unit.before for unit in units] == pytest.approx([0.0, 3.0])
    assert [unit.offset for unit in units] == pytest.approx([1.7e9, 1.7e9 + 3.0])


def test_exact_held_values_set_the_rate():
    held = replace(source(1000.0), news={"motor_angle": 66.7})
    assert choose_band([held], 1e-4, {}).rate == pytest.approx(66.7)


def test_exact_what_is_held_out_without_a_temperature_has_that_of_what_was_fitted():
    warm, cold = (source(1000.0, temperature=np.full(4000, degrees)) for degrees in (34.0, 36.0))
    own, without = (source(1000.0, role="heldout", **given) for given in ({"temperature": np.full(4000, 20.0)}, {}))
    band = choose_band([warm, cold], 1e-4, {})
    units = warmed([prepare(one, band, RATIO) for one in (warm, cold, own, without)])
    assert [np.mean(unit.temperature) for unit in units] == pytest.approx([34.0, 36.0, 20.0, 35.0])
    assert warmed([prepare(one, band, RATIO) for one in (source(1000.0), without)])[1].temperature is None
    mixed = warmed([prepare(one, band, RATIO) for one in (source(1000.0), warm, own)])
    assert [unit.temperature for unit in mixed] == [None, None, None]


@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize("samples", [60, 2250])
def test_exact_noise_of_an_angle_that_never_slows_is_not_its_travel(noise, samples):
    t, step = np.arange(samples) / 500.0, 4.8e-5
    angle = 36.0 * t + 0.02 * np.sin(30.0 * t) + noise * np.random.default_rng(0).standard_normal(samples)
    found = noise_density(t, np.round(angle / step) * step)
    off = found / ((step**2 / 12.0 + noise**2) * 2.0 / 500.0)
    assert abs(np.log(off)) < np.log(4.0 if samples < 100 else 1.2)


def test_exact_the_coarser_of_the_stated_and_the_shown_step_counts():
    stated = {"load_angle": SensorFacts(resolution=6e-6, noise=1e-6), "motor_angle": SensorFacts(resolution=5e-5)}
    shown = [replace(source(1000.0), steps={"load_angle": 4e-4, "motor_angle": 4e-5, "motor_torque": 1e-3})]
    found = as_coarse(stated, shown)
    assert {name: facts.resolution for name, facts in found.items()} == {"load_angle": 4e-4, "motor_angle": 5e-5}
    assert found["load_angle"].noise == 1e-6


def test_exact_what_a_bridged_gap_of_the_motor_sets_swinging_is_not_judged_on_the_load():
    whole = source(1000.0)
    gap = whole.recording["motor_angle"].copy()
    gap[1500:1700] = np.nan
    load = whole.recording["motor_angle"] / RATIO + 1e-4 * np.sin(whole.recording["t"])
    torn = source(1000.0, motor_angle=gap, load_angle=load)
    band = choose_band([torn], 1e-4, {})
    unit = prepare(torn, band, RATIO)
    late = (unit.t > 1.7) & (unit.t < 1.95)
    assert not unit.judged["te"][late].any()
    assert unit.judged["te"][(unit.t > 1.96) & (unit.t < 3.0)].all()
    assert unit.judged["motor_torque"][late].any()


def test_exact_where_the_load_torque_is_not_known_nothing_is_judged():
    load = np.where(np.arange(4000) < 2400, 5.0, np.nan)
    parts, _ = with_heldout([source(1000.0, load_torque=load)])
    band = choose_band(parts, 1e-4, {})
    judged = {one.role: prepare(one, band, RATIO).judged["motor_torque"].any() for one in parts}
    assert judged == {"fit": True, "heldout": False}


def test_exact_clocks_of_no_common_multiple_share_the_working_rate():
    sources = [source(1000.0), source(700.0)]
    band = choose_band(sources, 1e-4, {})
    for one in sources:
        unit = prepare(one, band, RATIO)
        assert 1.0 / np.diff(unit.t) == pytest.approx(band.rate, rel=1e-9)
        inner = slice(50, -50)
        assert unit.angle[inner] == pytest.approx(20.0 * np.sin(2.0 * np.pi * unit.t[inner]), abs=2e-2)


def test_exact_missing_samples_of_the_load_side_are_not_judged():
    one = source(500.0)
    t = one.recording["t"]
    missing = (t > 1.0) & (t < 3.0)
    angle = one.recording["motor_angle"]
    load = np.where(missing, np.nan, (angle - 1e-4 * np.sin(2.0 * angle)) / RATIO)
    unit = prepare(source(500.0, load_angle=load), Band(500.0, 50.0, 200.0), RATIO)
    assert not unit.judged["te"][(unit.t > 1.0) & (unit.t < 3.0)].any()
    assert unit.judged["te"][(unit.t > 0.5) & (unit.t < 0.9)].all()
    assert unit.judged["motor_torque"][(unit.t > 1.0) & (unit.t < 3.0)].any()


@pytest.mark.parametrize("column", ["motor_torque", "motor_angle", "load_angle", "output_torque", "load_torque"])
@pytest.mark.parametrize("missing", [slice(1, None, 2), slice(0, None, 100)])
def test_exact_samples_without_a_number_cost_no_others(column, missing):
    """Scattered ones, and those of a column that is logged at half of the rate."""
    angle = source(1000.0).recording["motor_angle"]
    torque = np.random.default_rng(4).normal(0.0, 1.0, len(angle))
    whole = source(1000.0, load_angle=angle / RATIO - 1e-4 * np.sin(angle), output_torque=torque, load_torque=torque)
    values = whole.recording[column].copy()
    values[missing] = np.nan
    band = Band(500.0, 50.0, 200.0)
    wanted, found = (
        prepare(one, band, RATIO).judged
        for one in (whole, replace(whole, recording={**whole.recording, column: values}))
    )
    for channel in ("te", "output_torque"):
        assert wanted[channel].mean() > 0.8
        np.testing.assert_array_equal(found[channel], wanted[channel])
    assert wanted["motor_torque"].mean() > 0.3
    assert found["motor_torque"].sum() == pytest.approx(wanted["motor_torque"].sum(), rel=0.02)


def test_exact_a_torque_that_ends_early_is_judged_as_far_as_it_goes():
    torque = source(1000.0).recording["motor_torque"]
    torque[3000:] = np.nan
    unit = prepare(source(1000.0, motor_torque=torque), Band(500.0, 50.0, 200.0), RATIO)
    assert not unit.judged["motor_torque"][unit.t > 3.0 - 3.0 / 50.0].any()
    assert unit.judged["motor_torque"][unit.t < 2.9].mean() > 0.3


def test_against_every_gap_and_every_flagged_sample_alone():
    one = source(500.0, output_torque=np.random.default_rng(5).normal(0.0, 1.0, 2000))
    kept = np.ones(2000, dtype=bool)
    kept[400:420] = kept[800:803] = kept[1200] = False
    recording = {name: values[kept] for name, values in one.recording.items()}
    good = np.ones(kept.sum(), dtype=bool)
    good[1000] = good[1500:1520] = False
    unit = prepare(replace(one, recording=recording, good=good), Band(500.0, 50.0, 200.0), RATIO)
    t, clock, margin = unit.t, recording["t"], 3.0 / 50.0
    wanted = (t >= 0.25) & (t <= t[-1] - margin)
    gaps = [(clock[k], clock[k + 1]) for k in range(len(clock) - 1) if clock[k + 1] - clock[k] > 0.0051]
    assert len(gaps) == 2
    for begin, end in [*gaps, *((moment, moment) for moment in clock[~good])]:
        wanted &= (t < begin - margin) | (t > end + margin)
    np.testing.assert_array_equal(unit.judged["output_torque"], wanted)


def test_exact_noise_of_the_torque_widens_the_band_and_that_of_the_angle_narrows_it():
    t = np.arange(4000) / 1000.0
    rng = np.random.default_rng(2)
    angle, torque = rng.normal(0.0, 1.0, (2, len(t)))

    def corner(of_angle: float, of_torque: float) -> float:
        swing, drive = np.sin(2.0 * np.pi * t), np.cos(2.0 * np.pi * t)
        columns = {"motor_angle": 20.0 * swing + of_angle * angle, "motor_torque": 0.1 * drive + of_torque * torque}
        return choose_band([source(1000.0, **columns)], 1e-4, {}).motion

    corners = [corner(1e-4, of_torque) for of_torque in (1e-4, 1e-3, 1e-2, 1e-1)]
    assert corners == sorted(corners)
    assert corners[0] < 0.7 * corners[-1]
    assert corner(2e-4, 2e-4) == pytest.approx(corner(1e-4, 2e-4) / np.sqrt(2.0), rel=0.05)


@pytest.mark.parametrize("noise", [None, 1e-5])
def test_exact_what_moves_with_a_slow_clock_is_no_more_noise_than_is_stated(noise):
    """At 100 Hz a swept ripple stands where nothing moves in a faster recording."""
    t = np.arange(400) / 100.0
    rng = np.random.default_rng(4)
    ripple = 1e-3 * signal.chirp(t, 30.0, t[-1], 49.0)
    angle = 20.0 * np.sin(2.0 * np.pi * t) + ripple + rng.normal(0.0, 1e-5, len(t))
    sensors = {"motor_angle": SensorFacts(resolution=1e-6, noise=noise)}
    deviation = np.sqrt(choose_band([source(100.0, motor_angle=angle)], 1e-4, sensors).angle_noise * 50.0)
    assert deviation > 1e-4 if noise is None else 0.5e-5 < deviation < 1.1e-5


def test_exact_a_sparse_columns_noise_is_that_of_its_own_rate():
    """Of white noise at 100 readings a second a low-pass of 20 Hz leaves sqrt(2 20 / 100), whatever the clock."""
    noise = np.random.default_rng(3).normal(0.0, 0.1, 4000)
    sparse = np.where(np.arange(4000) % 10 == 0, noise, np.nan)
    for torque, rate in ((noise, 1000.0), (sparse, 100.0)):
        band = Band(500.0, 20.0, 200.0)
        found = floors([source(1000.0, motor_torque=torque)], ["motor_torque"], band, {}, RATIO, 0.0)
        assert found[0] == pytest.approx(0.1 * np.sqrt(2.0 * band.motion / rate), rel=0.1)


def test_exact_held_values_are_as_noisy_as_they_are_without_being_held():
    """Repeated values differ by nothing: of a column held ten times most third differences are zero."""
    rng = np.random.default_rng(3)
    torque, angle = rng.normal(0.0, 0.1, 400), source(100.0).recording["motor_angle"] + rng.normal(0.0, 1e-3, 400)
    plain = source(100.0, motor_torque=torque, motor_angle=angle)
    held = source(1000.0, motor_torque=np.repeat(torque, 10), motor_angle=np.repeat(angle, 10))
    held = replace(held, news={"motor_torque": 100.0, "motor_angle": 100.0})
    bands = [choose_band([one], 1e-4, {}) for one in (plain, held)]
    assert bands[1].angle_noise == pytest.approx(bands[0].angle_noise, rel=1e-6)
    found = [floors([one], ["motor_torque"], bands[0], {}, RATIO, 0.0) for one in (plain, held)]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6)


def test_exact_a_column_that_is_mostly_at_rest_between_its_steps_is_as_noisy_as_they_are():
    """Third differences that are mostly 0 show nothing, and nothing is stated: noise of 0 would have no share."""
    step = 0.005
    coarse = np.round(0.1 * np.sin(2.0 * np.pi * np.arange(4000) / 2000.0) / step) * step
    assert np.median(np.abs(np.diff(coarse, 3))) == 0.0
    one = replace(source(1000.0, motor_torque=coarse), steps={"motor_torque": step})
    band = Band(500.0, 20.0, 200.0)
    found = floors([one], ["motor_torque"], band, {}, RATIO, 0.0)
    assert found[0] == pytest.approx(step / np.sqrt(12.0) * np.sqrt(2.0 * band.motion / 1000.0))


def test_exact_a_dead_channel_is_not_judged():
    unit = prepare(source(500.0, output_torque=np.full(2000, 3.0)), Band(500.0, 50.0, 200.0), RATIO)
    assert not unit.judged["output_torque"].any()
    assert unit.judged["motor_torque"].any()


@pytest.mark.parametrize("level", [0.0, 3.0])
@pytest.mark.parametrize("rate", [500.0, 1000.0])
def test_exact_a_channel_that_varies_where_nothing_is_judged_is_dead(rate, level):
    """What its low-pass carries over is no spread to hold an error against."""
    torque = np.full(round(4.0 * rate), level)
    torque[: round(0.1 * rate)] += np.random.default_rng(6).normal(0.0, 1.0, round(0.1 * rate))
    unit = prepare(source(rate, output_torque=torque), Band(500.0, 50.0, 200.0), RATIO)
    assert not unit.judged["output_torque"].any()
    assert unit.judged["motor_torque"].any()


def test_exact_a_load_angle_that_stays_is_not_judged():
    """It has no noise: what a simulated output moves, held by a finite inertia, would be a drift beyond any doubt."""
    unit = prepare(source(500.0, load_angle=np.zeros(2000)), Band(500.0, 50.0, 200.0), RATIO)
    assert np.ptp(unit.measured["te"]) > 0.0
    assert not unit.judged["te"].any()
    assert unit.judged["motor_torque"].any()


def test_exact_near_standstill_a_torque_is_judged_where_the_load_is_locked():
    """Its windup, which the motor angle tells, is known at any speed; of a load that moves, te is judged instead."""
    noise = 1e-4 * np.random.default_rng(2).standard_normal(2000)
    slow = source(500.0, motor_angle=0.3 + noise, load_angle=np.full(2000, 0.002))
    locked, free = (prepare(slow, Band(500.0, 50.0, 200.0), RATIO, locked=own) for own in (True, False))
    assert (locked.judged["motor_torque"].any(), free.judged["motor_torque"].any()) == (True, False)
    assert not any(unit.judged["te"].any() for unit in (locked, free))
    assert (locked.locked, free.locked) == (pytest.approx(0.002, rel=1e-12), None)


def test_exact_a_recording_shorter_than_its_margins_has_nothing_to_judge():
    unit = prepare(source(100.0, 0.3), Band(100.0, 5.0, 40.0), RATIO)
    assert not any(mask.any() for mask in unit.judged.values())


def test_exact_a_recording_with_too_few_samples_at_the_working_rate_is_named():
    with pytest.raises(InputError, match=r"swing: 2 samples are left of its 0.999 s at 2 Hz.*leave it out"):
        prepare(source(1000.0, 1.0), Band(2.0, 0.8, 0.8), RATIO)


def test_exact_a_channel_that_ends_early_is_not_held_out():
    load = source(500.0).recording["motor_angle"] / RATIO
    load[1300:] = np.nan
    kept, _ = with_heldout([source(500.0, load_angle=load)])
    assert ["load_angle" in one.recording for one in kept] == [True, False]
    torque = source(500.0).recording["motor_torque"]
    torque[1300:] = np.nan
    kept, said = with_heldout([source(500.0, motor_torque=torque)])
    assert said.endswith("the last 30 % of each have no motor angle or torque: nothing is proven on other recordings")
    assert [one.role for one in kept] == ["fit"]


@pytest.mark.parametrize(
    ("rates", "slow"),
    [((500.0, 20.0), [1]), ((20.0, 20.0, 500.0), []), ((500.0, 260.0), []), ((5000.0, 260.0, 5000.0, 200.0), [3])],
)
def test_exact_recordings_that_cost_the_others_half_of_their_rate(rates, slow):
    """Up to the highest working rate, 500 Hz, which faster ones do not have anyway."""
    told = far_slower([replace(source(rate, 2.0), name=str(number)) for number, rate in enumerate(rates)])
    assert [int(sentence.split(":")[0]) for sentence in told] == slow


def test_exact_angles_that_share_no_sample_give_no_transmission_error():
    one = source(500.0)
    turns = np.arange(2000) % 2 == 0
    motor = np.where(turns, one.recording["motor_angle"], np.nan)
    load = np.where(turns, np.nan, one.recording["motor_angle"] / RATIO)
    unit = prepare(source(500.0, motor_angle=motor, load_angle=load), Band(500.0, 50.0, 200.0), RATIO)
    assert list(unit.measured) == ["motor_torque"]


def shaken(rng, count, rate, jitter=0.05):
    """A clock whose samples are late or early by a share of its period."""
    return np.sort(np.arange(count) + jitter * np.clip(rng.standard_normal(count), -3.0, 3.0)) / rate


@given(st.integers(0, 10**6), st.floats(0.0, 0.1), st.sampled_from([100.0, 1000.0, 66.7]))
def test_exact_a_clock_that_shakes_and_loses_samples_has_its_period(seed, jitter, rate):
    """Over the whole recording it is off by less than its first and last sample are."""
    rng = np.random.default_rng(seed)
    t = shaken(rng, 700, rate, jitter)
    kept = t[np.concatenate([[True], rng.random(698) > 0.02, [True]])]
    assert abs(period(kept) * rate - 1.0) * 699 <= 6.0 * jitter + 1e-9


@pytest.mark.parametrize("rate", [500.0, 1000.0])
def test_exact_one_more_noise_of_the_angle_is_as_large_and_as_wide_as_the_recorded_one(rate):
    """A recorder at the working rate shows it whole where the band is the widest, a faster one below the corner."""
    t = np.arange(round(4.0 * rate)) / rate
    still = 20.0 * np.sin(2.0 * np.pi * t)
    size = 1e-4 * np.sqrt(rate)
    loud = still + size * np.random.default_rng(2).standard_normal(len(t))
    band = Band(500.0, 200.0, 200.0, 2.0 * size**2 / rate)
    exact, unit = (prepare(source(rate, motor_angle=angle), band, RATIO) for angle in (still, loud))
    more = unit.shaken[0]
    shown = [fft.rfft(one.angle - other.angle) for one, other in ((unit, exact), (more, unit))]
    frequency = fft.rfftfreq(len(unit.t), 1.0 / 500.0)
    for low, high in ((0.0, 100.0), (100.0, 180.0), (210.0, 250.0)):
        recorded, drawn = (np.sum(np.abs(one[(frequency > low) & (frequency < high)]) ** 2) for one in shown)
        assert drawn == pytest.approx(recorded, rel=0.4)


def encoded(turns, step, averaged=1):
    """Six seconds at so many steps per sample, with a ripple, and what an encoder makes of it: rounded, or a mean."""
    fine = np.arange(6000 * averaged) / averaged
    motion = step * (turns * fine + 0.5 * np.sin(2.0 * np.pi * 3e-3 * fine))
    return motion[::averaged], (step * np.rint(motion / step)).reshape(-1, averaged).mean(axis=1)


@pytest.mark.parametrize("turns", [24.03, 0.03])
def test_exact_one_more_noise_of_an_encoder_at_a_steady_speed_has_its_lines(turns):
    """At 1 kHz its steps come round 30 times a second: a line, where white noise of its size is even."""
    step = 2.0 * np.pi / 2**14
    motion, rounded = encoded(turns, step)
    band = Band(500.0, 45.0, 200.0, step**2 / 12.0 * 2.0 / 1000.0)
    one = replace(source(1000.0, 6.0, motor_angle=rounded), steps={"motor_angle": step})
    exact, unit, white = (
        prepare(found, band, RATIO) for found in (source(1000.0, 6.0, motor_angle=motion), one, replace(one, steps={}))
    )
    frequency = fft.rfftfreq(len(unit.t), 1.0 / 500.0)
    line = (frequency > 25.0) & (frequency < 35.0)
    recorded, drawn, even = (
        np.sum(np.abs(fft.rfft(noise))[line] ** 2)
        for noise in (unit.angle - exact.angle, unit.noises[0][0], white.noises[0][0])
    )
    assert drawn == pytest.approx(recorded, rel=0.4)
    assert even < 0.3 * recorded


def test_exact_steps_of_an_encoder_that_averages_are_as_large_as_it_shows():
    step = 2.0 * np.pi / 2**14
    motion, mean = encoded(24.03, step, averaged=8)
    found = another(mean, motion, step, 0.0, np.random.default_rng(1))
    assert np.std(np.diff(found, 3)) == pytest.approx(np.std(np.diff(mean, 3)), rel=1e-3)
    assert np.std(found) < 0.5 * step


def test_exact_a_torque_on_the_load_strikes_as_fast_as_it_was_recorded():
    """A resonance above the band of the motor torque answers to what the low-pass of that would take from a blow."""
    blow = np.where(np.arange(2000) < 1000, 0.0, 10.0)
    unit = prepare(source(500.0, load_torque=blow), Band(500.0, 40.0, 200.0), RATIO)
    np.testing.assert_allclose(unit.load_torque, blow, atol=1e-9)


@pytest.mark.parametrize(("frequency", "lost", "left"), [(45.0, 0.025, 0.002), (90.0, 0.1, 0.025)])
def test_exact_a_torque_on_the_load_is_joined_by_lines_that_do_not_cut_its_corners(frequency, lost, left):
    """What answers a blow at its resonance would take the difference for another inertia, or for a coupling."""
    t, dense = np.arange(500) / 500.0, np.arange(20000) / 20000.0
    wave = np.sin(2.0 * np.pi * frequency * t)
    found = [
        2.0 * np.mean(np.interp(dense, t, values) * np.sin(2.0 * np.pi * frequency * dense))
        for values in (wave, joined(wave))
    ]
    assert 1.0 - found[0] > lost
    assert found[1] == pytest.approx(1.0, abs=left)


def test_exact_torques_are_simulated_as_densely_as_their_band_needs():
    slow, fast = Band(500.0, 40.0, 200.0), Band(500.0, 200.0, 200.0)
    assert (slow.density, fast.density) == (1, 4)
    t = np.arange(400) / 500.0
    unit = prepare(source(500.0), slow, RATIO)
    assert len(unit.fine) == len(unit.t)
    torque = np.sin(2.0 * np.pi * 5.0 * t)
    dense = np.sin(2.0 * np.pi * 5.0 * np.linspace(t[0], t[-1], 4 * 399 + 1))
    inner = slice(60, -60)
    np.testing.assert_allclose(slow.simulated(torque, 1)[inner], slow.simulated(dense, 4)[inner], atol=1e-4)


def test_exact_a_torque_passes_its_low_pass_where_the_band_is_the_widest_too():
    """Between the samples of a motion nobody knows what it took: what would be mirrored into the band is left out."""
    band = Band(100.0, 40.0, 40.0)
    t = np.arange(400) / 100.0
    dense = np.linspace(t[0], t[-1], 4 * 399 + 1)
    slow, fast = (np.sin(2.0 * np.pi * frequency * dense) for frequency in (20.0, 72.0))
    inner = slice(60, -60)
    assert np.max(np.abs(band.simulated(fast, 4)[inner])) < 0.02
    for own in (slow, 0.0 * slow):
        torque = own[::4] + 0.1 * np.cos(2.0 * np.pi * t)
        unit = prepare(source(100.0, motor_torque=torque), band, RATIO)
        simulated = band.simulated(own + 0.1 * np.cos(2.0 * np.pi * dense), 4)
        np.testing.assert_allclose(unit.measured["motor_torque"][inner], simulated[inner], atol=1e-3)


@pytest.mark.parametrize(("rest", "zero", "known"), [(1.5, 0.0, True), (1.5, 0.05, False), (0.0, 0.0, False)])
def test_exact_a_rest_tells_how_far_the_zero_of_the_torque_may_be_off(rest, zero, known):
    """Of a mean of n samples counts 1 / hypot(1, zero sqrt(n) / noise)."""
    t = np.arange(4000) / 1000.0
    angle = np.where(t < 4.0 - rest, 20.0 * np.sin(np.pi * t / (4.0 - rest)) ** 2, 0.0)
    torque = 0.1 * np.sign(np.gradient(angle)) + zero
    band = Band(500.0, 20.0, 200.0)
    unit = prepare(source(1000.0, motor_angle=angle, motor_torque=torque), band, RATIO)
    layout = lay_out(Plant([unit], ["motor_torque"], band), np.array([1e-3]))
    n, judged = layout.size, unit.judged["motor_torque"]
    off = 0.02 * np.std(unit.measured["motor_torque"]) if known else np.std(unit.measured["motor_torque"][judged])
    assert layout.certain[0] == pytest.approx(1.0 / np.hypot(1.0, off * np.sqrt(n) / 1e-3), rel=0.05)


@pytest.mark.parametrize("frequency", [13.0, 61.0, 93.0])
def test_exact_what_a_recorder_cannot_follow_is_simulated_as_it_was_taken(frequency):
    """Up to its rate; between the dense times of a simulation lies a cubic."""
    t = shaken(np.random.default_rng(3), 400, 100.0)
    angle = 20.0 * np.sin(2.0 * np.pi * t)
    load = angle / RATIO - 1e-4 * np.sin(2.0 * np.pi * frequency * t)
    one = Source("swing", {"t": t, "motor_angle": angle, "motor_torque": np.cos(t), "load_angle": load}, "fit", "A",
                 np.ones(len(t), dtype=bool))  # fmt: skip
    rate = 1.0 / period(t)
    band = Band(rate, 20.0, 0.4 * rate)
    unit = prepare(one, band, RATIO)
    simulated = unit.read(1e-4 * np.sin(2.0 * np.pi * frequency * (unit.fine + t[0]))[None], band)[0]
    inner = slice(20, -20)
    left = np.std((unit.measured["te"] - simulated)[inner])
    assert left < 0.06 * np.std(unit.measured["te"][inner])


@pytest.mark.parametrize("frequency", [7.0, 40.0, 70.0, 130.0])
def test_exact_means_of_a_line_are_those_of_a_recorder_that_averages(frequency):
    """Beyond the rate they turn round: a line of one size is not of one size at two speeds."""
    rate = 100.0
    t = np.arange(400) / rate
    fine = np.linspace(0.0, t[-1], 16 * 399 + 1)
    read = reading(fine, t, t, 1.0 / rate) @ np.sin(2.0 * np.pi * frequency * fine)
    means = np.sinc(frequency / rate) * np.sin(2.0 * np.pi * frequency * t)
    np.testing.assert_allclose(read[4:-4], means[4:-4], atol=1e-2)


@pytest.mark.parametrize("averaged", [True, False])
def test_exact_a_recorder_with_an_even_clock_is_simulated_with_its_means(averaged):
    one = source(100.0, load_angle=np.sin(np.arange(400.0)))
    band = choose_band([one], 1e-4, {})
    assert (prepare(one, band, RATIO, means=averaged).reading is not None) == averaged


@pytest.mark.parametrize("frequency", [13.0, 130.0, 190.0])
def test_exact_what_a_fast_recorder_shows_is_simulated_through_the_same_low_pass(frequency):
    t = np.arange(4000) / 1000.0
    error = 1e-4 * np.sin(2.0 * np.pi * frequency * t)
    one = source(1000.0, load_angle=20.0 * np.sin(2.0 * np.pi * t) / RATIO - error)
    band = Band(500.0, 20.0, 200.0)
    unit = prepare(one, band, RATIO)
    simulated = unit.read(np.interp(unit.fine, t, error)[None], band)[0]
    np.testing.assert_allclose(simulated[50:-50], unit.measured["te"][50:-50], atol=1e-7)


def test_exact_a_low_pass_is_the_same_at_any_rate() -> None:
    corner, fast = 21.0, 400.0
    t = np.arange(0.0, 4.0, 1.0 / fast)
    inside = (t > 1.0) & (t < 3.0)
    for frequency in (5.0, 21.0, 34.0):
        wave = np.sin(2.0 * np.pi * frequency * t)
        passed = low_pass(wave, corner, fast)
        thinned = low_pass(wave[::4], corner, fast / 4.0)
        np.testing.assert_allclose(passed[::4][inside[::4]], thinned[inside[::4]], atol=2e-4)
        share = 1.0 / (1.0 + (frequency / corner) ** 8)
        np.testing.assert_allclose(passed[inside], share * wave[inside], atol=2e-4)
    np.testing.assert_allclose(low_pass(3.0 * t - 1.0, corner, fast), 3.0 * t - 1.0, atol=1e-12)


@pytest.mark.parametrize(("n", "corner", "atol"), [(33, 0.02, 1e-13), (1413, 0.05, 1e-10), (3919, 0.12, 1e-9)])
@pytest.mark.parametrize("stride", [1, 2, 3, 4])
def test_against_the_sine_transform_of_the_whole_series_reflected_without_end(n, corner, atol, stride) -> None:
    """Of lengths that are quickly transformed and not, thinned and whole."""
    long = stride * (n - 1) + 1
    values = np.random.default_rng(n).normal(size=(3, long)).cumsum(axis=1)
    line = np.linspace(values[:, 0], values[:, -1], long, axis=1)
    share = 1.0 / (1.0 + (0.5 / corner * stride * np.arange(1, long - 1) / (long - 1)) ** 8)
    wanted = line.copy()
    wanted[:, 1:-1] += fft.idst(share * fft.dst((values - line)[:, 1:-1], type=1), type=1)
    passed = low_pass(values, corner, float(stride), stride)
    np.testing.assert_allclose(passed, wanted[:, ::stride], atol=atol * np.max(np.abs(values)))


def test_exact_a_weight_that_hangs_at_the_start_sets_nothing_swinging():
    """The gear carries it: te of a drive at rest is the kinematic error and the windup under load and weight."""
    t = np.arange(500) / 500.0
    rest = Source(
        "rest", {"t": t, "motor_angle": np.full(500, 40.0), "motor_torque": np.full(500, 0.05),
                 "load_angle": np.full(500, 40.0 / RATIO), "load_torque": np.full(500, 6.0)},
        "fit", "A", np.ones(500, dtype=bool),
    )  # fmt: skip
    unit = prepare(rest, Band(500.0, 20.0, 200.0), RATIO)
    drive = {"ratio": RATIO, "J_m": 3e-4, "J_l": 2.0, "B_sp": 1.0, "k1": 2e4, "k3": 0.0, "k5": 0.0, "phi_max": 0.01,
             "te_cos_1": 1e-4, "te_sin_1": 0.0}  # fmt: skip
    model = Model(orders=[1], terms=["gravity_unbalance"])
    weight = {"gravity_unbalance_T_gravity": 7.0, "gravity_unbalance_psi": 1.1}
    plant = Plant([unit], ("motor_torque", "te"), Band(500.0, 20.0, 200.0))
    values = {name: np.array([own]) for name, own in weight.items()}
    found = plant._simulate(model, drive, values, np.zeros(1), ["te"]).samples["te"][0]
    wound = (6.0 + 7.0 * np.sin(40.0 / RATIO + 1.1)) / 2e4
    np.testing.assert_allclose(found, 1e-4 * np.cos(40.0) + wound, atol=1e-7)


def test_exact_a_locked_load_starts_where_it_is_locked():
    """A start that takes it along with the motor would leave the gear wound up by the first angle for ever."""
    t = np.arange(500) / 500.0
    held = {"t": t, "motor_angle": 0.5 + 0.1 * t, "motor_torque": 0.1 * t, "load_angle": np.full(500, 0.003)}
    band = Band(500.0, 20.0, 200.0)
    unit = prepare(Source("held", held, "fit", "A", np.ones(500, dtype=bool)), band, RATIO, locked=True)
    drive = {"ratio": RATIO, "J_m": 3e-4, "J_l": 1e9, "B_sp": 1.0, "k1": 2e4, "k3": 0.0, "k5": 0.0, "phi_max": 0.01}
    plant = Plant([unit], ("motor_torque", "te"), band)
    found = plant._simulate(Model(orders=[]), drive, {}, np.zeros(1), ["te"]).samples["te"][0]
    np.testing.assert_allclose(found, unit.angle / RATIO - 0.003, atol=1e-7)


def test_exact_a_given_filter_of_the_torque_passes_all_of_it():
    """A given one changes the fast part as well; a fitted one must not win by quieting noise."""
    one = source(1000.0)
    band = Band(500.0, 40.0, 200.0)
    unit = prepare(one, band, RATIO)
    plant = Plant([unit], ("motor_torque",), band)
    model = Model(base="one_inertia", orders=[])
    drive = {"ratio": RATIO, "J_m": 3e-4, "J_l": 0.0, "B_m": 1e-3, "B_ml": 0.0, "B_l": 0.0}
    name, lag = "motor_torque_sensor_lowpass_tau_s", 2e-3
    pair = (("sensor_lowpass", "motor_torque"),)
    scale = Free("torque_scale", 1.0, 0.05, True, "1", 0.1, 10.0)
    free = Free(name, lag, 0.5, True, "s", 0.0, 1.0)
    plain, given, fitted = (
        plant.mismatch(structure, structure.start[None])[0]["motor_torque"][0]
        for structure in (
            Structure(model, drive, (scale,)),
            Structure(model, {**drive, name: lag}, (scale,), pair),
            Structure(model, drive, (scale, free), pair),
        )
    )
    whole = SensorStage(pair, {name: lag}, band.rate).apply(
        unit.t, {"motor_torque": unit.measured["motor_torque"] - plain}
    )
    np.testing.assert_allclose(given, unit.measured["motor_torque"] - whole["motor_torque"], atol=1e-9)
    assert np.std(fitted - given) > 1e-7
