"""Every sensor effect against a closed form, and what holds for all of them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import hdfast
import numpy as np
import pytest
import scipy
from hdfast.errors import InputError
from hdfast.sensors import CHANNELS, SensorStage, encoder
from hdfast.sensors.catalogue import EFFECTS
from hdfast.sensors.contract import Filter, Geometry
from hypothesis import given, settings
from hypothesis import strategies as st

TURN = 2.0 * np.pi
T = np.arange(2001) * 1e-3
LINE = "encoder_interpolation_error"
RNG = np.random.default_rng(5)
ORACLES = {}


def oracle(effect):
    """Marks the test that holds the truth of an effect."""

    def mark(test):
        ORACLES[effect] = test
        return test

    return mark


def read(effect, x, t=T, at=None, channel="load_angle", seed=0, **values):
    return SensorStage([(effect, channel)], values, seed=seed).apply(t, {channel: x}, at=at)[channel]


def line(x, angle, order):
    """Complex amplitude of sin at an order over whole turns."""
    weights = np.gradient(angle)
    return 2.0 * np.sum(weights * x * np.exp(-1j * (order * angle - np.pi / 2))) / np.sum(weights)


def test_exact_every_sensor_effect_is_complete():
    pages = Path(__file__).parents[2] / "docs" / "terms"
    effects = [term for term in hdfast.terms() if term.place == "sensor"]
    assert {term.id for term in effects} == set(ORACLES)
    for term in effects:
        assert (pages / f"{term.id}.md").exists()
        assert term.equation
        assert term.source
        assert term.channels
        assert set(term.channels) <= set(CHANNELS)
        assert term.amplitude == term.parameters[0].name
        for parameter in term.parameters:
            assert parameter.unit
            assert parameter.meaning
            for default, low, high in filter(None, [dataclasses.astuple(parameter)[3:6], parameter.on_torque]):
                assert parameter.allowed[0] <= low <= default <= high <= parameter.allowed[1]


@oracle("encoder_eccentricity")
def test_exact_eccentricity_is_one_line_of_its_shaft():
    angle = np.linspace(0.0, 3.0 * TURN, 3001)[:-1]
    off = read("encoder_eccentricity", angle, np.arange(3000.0), eccentricity=5e-6, disc_diameter=0.05, psi=0.7) - angle
    assert abs(line(off, angle, 1)) == pytest.approx(412.5 * 5.0 / 50.0 * TURN / 1296000.0, rel=1e-4)  # makers' rule
    assert line(off, angle, 1) == pytest.approx(2e-4 * np.exp(0.7j), rel=1e-9)
    assert np.max(np.abs(off - np.imag(2e-4 * np.exp(1j * (angle + 0.7))))) < 1e-14


@oracle("encoder_interpolation_error")
def test_exact_interpolation_error_is_a_share_of_a_line_pitch():
    angle = np.linspace(0.0, TURN, 64001)[:-1]
    off = read("encoder_interpolation_error", angle, np.arange(64000.0), pitch_share=0.02, lines=1000.0) - angle
    assert abs(line(off, angle, 1000)) == pytest.approx(0.02 * TURN / 1000.0, rel=1e-5)
    assert np.sqrt(2.0) * np.std(off) == pytest.approx(0.02 * TURN / 1000.0, rel=1e-5)


def fast_line(effects, x, t, **values):
    """What an interpolation error of half a line pitch adds to the reading of a motor angle."""
    found = []
    for names in (effects, [LINE, *effects]):
        stage = SensorStage([(name, "motor_angle") for name in names])
        known = {name: value for name, value in values.items() if name in stage.parameters}
        found.append(stage.apply(t, {"motor_angle": x}, known)["motor_angle"])
    return found[1] - found[0]


@pytest.mark.parametrize("rpm", [0.0, 0.3, 15.0, 30.0, 600.0])
@pytest.mark.parametrize(
    "effects",
    [
        ["sensor_delay"],
        ["sensor_lowpass"],
        ["sensor_averaging"],
        ["ratio_error", "sensor_lowpass", "sensor_delay", "sensor_averaging"],
    ],
    ids="+".join,
)
@pytest.mark.parametrize("delay", [3e-4, 0.3], ids=["", "before the start"])
def test_exact_line_faster_than_samples_is_filtered_and_averaged_before_it_folds(rpm, effects, delay):
    """2048 lines: 512 Hz at 15 r/min, 20 kHz at 600 r/min, read 1000 times per second."""
    speed, tau, interval, t = rpm * TURN / 60.0, 5e-3, 1e-3, T[:201]
    rate = 2048.0 * speed
    values = {"pitch_share": 0.5, "psi": 0.4, "tau_y": delay, "tau_s": tau, "ratio_error": 0.1}
    gains = {
        "ratio_error": 1.1,
        "sensor_lowpass": 1.0 / (1.0 + 1j * rate * tau),
        "sensor_delay": np.exp(-1j * rate * delay),
        "sensor_averaging": np.exp(-0.5j * rate * interval) * np.sinc(rate * interval / TURN),
    }
    expected = np.pi / 2048.0 * np.prod([gains[name] for name in effects]) * np.exp(1j * (rate * t + 0.4))
    np.testing.assert_allclose(fast_line(effects, speed * t, t, **values), np.imag(expected), atol=1e-11)


def test_exact_lines_of_an_encoder_pass_one_filter_and_then_factors():
    behind = list(EFFECTS.values())[list(EFFECTS).index(LINE) + 1 :]
    assert sum(isinstance(effect, Filter) for effect in behind) == 1
    for effect in behind:
        if isinstance(effect, Geometry):
            p = {item.name: np.array([[item.high]]) for item in effect.info.parameters}
            assert effect.reading(3.0 * T, p) == pytest.approx(3.0 * effect.reading(T, p))


def test_against_fine_steps_line_of_a_shaft_that_starts_and_stops():
    """10 rad/s reached with 100 rad/s^2: between samples the phase is off by up to 0.026 rad."""
    fine = np.arange(0.0, 0.6, 1e-5)
    angle = np.cumsum(np.interp(fine, [0.1, 0.2, 0.4, 0.5], [0.0, 10.0, 10.0, 0.0])) * 1e-5
    line = np.pi / 2048.0 * np.sin(2048.0 * angle + 0.4)
    decay = np.exp(-1e-5 / 2e-3)
    halves = 0.5 * (1.0 - decay) * (line + np.roll(line, 1))
    halves[0] = (1.0 - decay) * line[0]
    filtered = scipy.signal.lfilter([1.0], [1.0, -decay], halves, zi=[decay * line[0]])[0]
    mean = scipy.ndimage.uniform_filter1d(filtered, 100, origin=49)
    for effects, expected in ((["sensor_lowpass"], filtered), (["sensor_lowpass", "sensor_averaging"], mean)):
        found = fast_line(effects, angle[::100], fine[::100], tau_s=2e-3, pitch_share=0.5, psi=0.4)
        assert np.max(np.abs(found - expected[::100])[2:]) < 0.02 * np.pi / 2048.0


@oracle("ratio_error")
def test_exact_ratio_error_grows_with_the_angle_and_returns():
    angle = 40.0 * np.sin(T * np.pi / 2.0)
    off = read("ratio_error", angle, ratio_error=1e-3) - angle
    np.testing.assert_allclose(np.polyfit(angle, off, 1), [1e-3, 0.0], atol=1e-12)
    assert off[-1] == pytest.approx(0.0, abs=1e-12)


@oracle("sensor_lowpass")
@pytest.mark.parametrize("frequency", [3.0, 30.0, 300.0])
@pytest.mark.parametrize("irregular", [False, True])
def test_exact_lowpass_gain_and_phase(frequency, irregular):
    tau, steps = 1.0 / (TURN * 30.0), 500
    t = np.arange(12 * steps) / (steps * frequency)
    if irregular:
        t = t + 0.2 / (steps * frequency) * np.sin(np.arange(len(t)))
    x = np.sin(TURN * frequency * t)
    y = read("sensor_lowpass", x, t, tau_s=tau)
    response = 1.0 / (1.0 + 1j * TURN * frequency * tau)
    start = y[0] - np.imag(response)
    if not irregular:
        settled = np.imag(response * np.exp(1j * TURN * frequency * t)) + start * np.exp(-t / tau)
        assert np.max(np.abs(y - settled)) < 1e-9
    basis = np.stack([np.sin(TURN * frequency * t), np.cos(TURN * frequency * t), np.exp(-t / tau)])
    found = np.linalg.lstsq(basis.T, y, rcond=None)[0]
    assert abs(found[0] + 1j * found[1] - response) < (1e-8 if irregular else 1e-9)


def test_exact_lowpass_follows_a_ramp_late_and_a_torque_from_its_first_value():
    np.testing.assert_allclose(read("sensor_lowpass", 3.0 * T, tau_s=0.02), 3.0 * (T - 0.02), atol=1e-12)
    held = read("sensor_lowpass", 3.0 * T, tau_s=0.02, channel="motor_torque")
    np.testing.assert_allclose(held, 3.0 * (T - 0.02 * -np.expm1(-T / 0.02)), atol=1e-12)
    slow = read("sensor_lowpass", 3.0 * T, tau_s=50.0)
    np.testing.assert_allclose(slow, 3.0 * (T - 50.0), rtol=1e-10)


@oracle("sensor_delay")
@pytest.mark.parametrize("delay", [1.7e-3, 0.0123, -4e-4])
def test_exact_delay_of_a_sine_and_of_a_ramp(delay):
    x = np.sin(TURN * 5.0 * T)
    inside = (T > 0.1) & (T < 1.9)
    late = read("sensor_delay", x, tau_y=delay)
    assert np.max(np.abs(late - np.sin(TURN * 5.0 * (T - delay)))[inside]) < 5e-9
    np.testing.assert_allclose(read("sensor_delay", 10.0 * T, tau_y=delay), 10.0 * (T - delay), atol=1e-12)


def test_against_central_difference_delay_has_the_slope_of_the_signal():
    x = np.sin(TURN * 5.0 * T)
    late, early = (read("sensor_delay", x, tau_y=delay) for delay in (1e-3 + 1e-6, 1e-3 - 1e-6))
    slope = -TURN * 5.0 * np.cos(TURN * 5.0 * (T - 1e-3))
    assert np.max(np.abs((late - early) / 2e-6 - slope)[100:-100]) < 1e-4


def test_exact_step_of_a_torque_is_read_late_without_overshoot():
    step = np.where(T >= 0.01, 0.1, 0.0)
    expected = np.where(T > 0.0105, 0.1, np.where(T > 0.0095, 0.05, 0.0))
    stage = SensorStage([("sensor_delay", "motor_torque")], {"tau_y": 5e-4})
    late, change = stage.linearise(T, {"motor_torque": step}, {"motor_torque": step[:, None]})
    np.testing.assert_allclose(late["motor_torque"], expected, atol=1e-15)
    np.testing.assert_allclose(change["motor_torque"][:, 0], expected, atol=1e-15)
    ring = 0.02 * np.sin(TURN * 20.0 * T)
    found = read("sensor_delay", step + ring, channel="motor_torque", tau_y=5e-4)
    assert np.max(np.abs(found - expected - 0.02 * np.sin(TURN * 20.0 * (T - 5e-4)))[1:]) < 1e-5
    slow = read("sensor_lowpass", step, channel="motor_torque", tau_s=5e-3)
    assert np.all(np.diff(slow) >= 0.0)
    assert slow[9] == 0.0


@pytest.mark.parametrize("frequency", [1.0, 40.0, 100.0, 170.0, 250.0, 330.0])
def test_against_scipy_torque_that_does_not_jump_is_one_spline(frequency):
    x = np.sin(TURN * frequency * T + 0.3) + 0.5 * np.sin(TURN * 7.0 * T)
    found = read("sensor_delay", x, channel="output_torque", tau_y=3e-4)[1:]
    np.testing.assert_allclose(found, scipy.interpolate.CubicSpline(T, x)(T[1:] - 3e-4), atol=1e-12)


@oracle("clock_skew")
def test_exact_skew_is_a_ramp_in_time_at_constant_speed():
    speed = 100.0 * TURN / 60.0
    off = read("clock_skew", speed * T, skew=5e-5, clock_offset=2e-3) - speed * T
    np.testing.assert_allclose(np.polyfit(T, off, 1), [5e-5 * speed, 2e-3 * speed], rtol=1e-9)


@oracle("aliasing")
@pytest.mark.parametrize(("frequency", "seen"), [(40.0, 20.0), (63.0, 3.0), (130.0, 10.0)])
def test_exact_alias_frequency(frequency, seen):
    t = np.arange(60_000) / 6000.0
    held = read("aliasing", np.sin(TURN * frequency * t + 0.3), t, f_s=60.0)
    assert len(np.unique(np.flatnonzero(np.diff(held)) % 100)) == 1
    spectrum = np.abs(np.fft.rfft(held[::100]))
    assert np.argmax(spectrum) / 10.0 == pytest.approx(seen)


@oracle("sampling_jitter")
def test_exact_jitter_is_noise_that_grows_with_speed():
    for speed in (3.0, 60.0):
        off = read("sampling_jitter", speed * T, jitter=1e-4) - speed * T
        assert np.std(off) == pytest.approx(speed * 1e-4, rel=0.05)
    assert np.all(read("sampling_jitter", 0.0 * T + 2.0, jitter=1e-4) == 2.0)


@oracle("sensor_averaging")
@pytest.mark.parametrize("share", [0.5, 1.0, 3.0])
def test_exact_mean_has_the_gain_of_a_window_and_half_its_delay(share):
    at = np.arange(1.0, 2.0, 0.01)
    found = read("sensor_averaging", np.sin(TURN * 7.0 * T), at=at, window_share=share)
    half = np.pi * 7.0 * 0.01 * share
    expected = np.sin(half) / half * np.sin(TURN * 7.0 * at - half)
    assert np.max(np.abs(found - expected)[:95]) < 1e-8


def test_exact_mean_over_the_usual_interval_where_readings_are_lost():
    at = np.concatenate([np.arange(0.0, 0.5, 0.01), np.arange(0.6, 1.0, 0.01)])
    found = read("sensor_averaging", 10.0 * T, at=at)
    np.testing.assert_allclose(found, 10.0 * (at - 0.005), atol=1e-12)


@oracle("sensor_offset_drift")
def test_exact_drift_is_a_line_in_time():
    off = read("sensor_offset_drift", np.cos(T), channel="output_torque", offset=0.3, drift=-0.02) - np.cos(T)
    np.testing.assert_allclose(off, 0.3 - 0.02 * T, atol=1e-14)


@oracle("sensor_noise")
def test_exact_noise_is_normal_white_and_keyed_by_seed_channel_and_row():
    t = np.arange(200_000) * 1e-3
    zero = np.zeros((2, len(t)))
    stage = SensorStage([("sensor_noise", "load_angle"), ("sensor_noise", "motor_angle")], seed=3)
    found = stage.apply(t, {"load_angle": zero, "motor_angle": zero[0]})
    first, second = found["load_angle"] / 1e-6
    assert np.std(first) == pytest.approx(1.0, rel=0.01)
    assert np.mean(first**4) == pytest.approx(3.0, rel=0.05)
    for other in (second, found["motor_angle"] / 1e-6, np.roll(first, 1)):
        assert abs(np.corrcoef(first, other)[0, 1]) < 0.01


@oracle("quantisation")
def test_exact_rounding_error_bound_and_floor():
    q = encoder(17).resolution
    x = np.cumsum(RNG.uniform(0.0, 1e-2, len(T)))
    off = read("quantisation", x, resolution=q) - x
    assert np.max(np.abs(off)) <= 0.5 * q * (1.0 + 1e-9)
    assert np.std(off) == pytest.approx(q / np.sqrt(12.0), rel=0.03)
    np.testing.assert_allclose(np.round((x + off) / q) * q, x + off, atol=1e-15)


signals = st.integers(4, 40).flatmap(
    lambda n: st.lists(st.floats(-100.0, 100.0, allow_subnormal=False), min_size=n, max_size=n)
)


@given(signals)
@settings(max_examples=50, deadline=None)
def test_exact_stage_without_effects_changes_no_bit(values):
    x = np.array(values)
    t = np.arange(len(x)) * 0.1
    stage = SensorStage([("sensor_delay", "motor_angle")])
    assert np.array_equal(stage.apply(t, {"load_angle": x})["load_angle"], x)
    assert np.array_equal(SensorStage().apply(t, {"load_angle": x}, at=t[1:3])["load_angle"], x[1:3])


@given(signals, st.floats(1e-6, 10.0), st.floats(0.0, 1.0))
@settings(max_examples=50, deadline=None)
def test_exact_rounding_twice_is_rounding_once(values, q, share):
    x = np.array(values)
    t = np.arange(len(x)) * 0.1
    once = read("quantisation", x, t, resolution=q, step_share=share)
    assert np.array_equal(read("quantisation", once, t, resolution=q, step_share=share), once)


@given(st.integers(0, 50), st.integers(0, 50))
@settings(max_examples=25, deadline=None)
def test_exact_delays_add_up(a, b):
    x = np.cumsum(RNG.normal(size=400))
    t = np.arange(400) * 1e-3
    twice = read("sensor_delay", read("sensor_delay", x, t, tau_y=a * 1e-3), t, tau_y=b * 1e-3)
    once = read("sensor_delay", x, t, tau_y=(a + b) * 1e-3)
    np.testing.assert_allclose(twice[a + b :], once[a + b :], atol=1e-9)


@given(st.lists(st.sampled_from([term.id for term in hdfast.terms() if term.channels]), unique=True, min_size=1))
@settings(max_examples=25, deadline=None)
def test_exact_rows_have_the_same_bits_in_any_company_and_order_of_effects(names):
    x = np.cumsum(RNG.normal(size=(3, 200)), axis=1)
    t = np.arange(200) * 1e-3
    pairs = [(name, "motor_angle") for name in names]
    together = SensorStage(pairs, seed=4).apply(t, {"motor_angle": x})["motor_angle"]
    alone = SensorStage(pairs[::-1], seed=4).apply(t, {"motor_angle": x[1:2]}, rows=[1])["motor_angle"]
    assert np.array_equal(together[1:2], alone)


def test_exact_held_reading_keeps_its_noise():
    stage = SensorStage([("aliasing", "load_angle"), ("sensor_noise", "load_angle")], {"f_s": 50.0})
    held = stage.apply(T, {"load_angle": T})["load_angle"]
    assert len(np.unique(held)) == 101


@pytest.mark.parametrize("scale", [[], [LINE]], ids=["", "line"])
def test_exact_row_that_ends_early_ends_early_in_the_record(scale):
    x = np.stack([T, T])
    x[1, 1000:] = np.nan
    effects = [*scale, "sensor_lowpass", "sensor_delay"]
    stage = SensorStage([(effect, "load_angle") for effect in effects], {"tau_y": 0.1})
    found = stage.apply(T, {"load_angle": x})["load_angle"]
    assert np.isfinite(found[0]).all()
    assert np.isfinite(found[1, :1099]).all()
    assert np.isnan(found[1, 1100:]).all()
    np.testing.assert_array_equal(found[1, 200:1000], found[0, 200:1000])


def test_exact_names_are_as_short_as_they_can_be_told_apart():
    stage = SensorStage([("quantisation", "motor_angle"), ("quantisation", "load_angle"), ("clock_skew", "load_angle")])
    assert "skew" in stage.parameters.names
    assert "load_angle_quantisation_resolution" in stage.parameters.names
    assert stage.value("load_angle_clock_skew_skew") == 5e-5
    both = SensorStage([("encoder_eccentricity", "load_angle"), ("encoder_interpolation_error", "load_angle")])
    assert "encoder_eccentricity_psi" in both.parameters.names


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: SensorStage([("eccentricity", "load_angle")]), "encoder_eccentricity"),
        (lambda: SensorStage([("ratio_error", "motor_torque")]), "motor_angle, load_angle"),
        (lambda: SensorStage([("aliasing", "load_angle")] * 2), "twice"),
        (lambda: SensorStage(["aliasing"]), "pairs of effect id and channel"),
        (lambda: SensorStage([("aliasing", "load_angle")], {"f_s": -1.0}), "0.001 to 1e\\+09 Hz"),
        (lambda: SensorStage([("aliasing", "load_angle")], {"fs": 1.0}), "did you mean 'f_s'"),
        (lambda: SensorStage(seed=-1), "seed = -1"),
        (lambda: SensorStage().apply(T, {"load_angle": T[:5]}), r"shape \(5,\)"),
        (lambda: read("sensor_delay", T[:3], T[:3]), "at least 4"),
    ],
)
def test_exact_wrong_stages_are_named(make, named):
    with pytest.raises(InputError, match=named):
        make()


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: SensorStage(5), "effects = 5 is not a list"),
        (lambda: SensorStage("sensor_noise"), "effects = 'sensor_noise' is not a list"),
        (lambda: SensorStage().times(np.inf), "end = inf must be finite"),
        (lambda: SensorStage().times(-1.0), "end = -1 s is out of range"),
        (lambda: SensorStage().apply([0.0, 2.0, 1.0], {"load_angle": np.zeros(3)}), "t must strictly increase"),
        (lambda: SensorStage().apply(T[:3], {"load_angle": np.zeros((1, 3))}, rows=[1.7]), "rows has .* float64"),
    ],
)
def test_exact_wrong_arguments_of_a_stage(make, text):
    with pytest.raises(InputError, match=text):
        make()
