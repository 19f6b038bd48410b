"""Derivatives of what sensors read: against closed forms and extrapolated differences of the readings themselves."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from differentiated import AT_TORQUE, OFFSETS, WEIGHTS, assert_close, random_row
from hdfast.errors import InputError
from hdfast.sensors import SensorStage
from hypothesis import given, settings
from hypothesis import strategies as st

RATE = 2.0 * np.pi * 5.0
T = np.arange(2001) * 4e-4
SINE = np.sin(RATE * T)
EFFECTS = {term.id: term for term in hdfast.terms() if term.place == "sensor"}


def slopes(effect, x, *wrt, channel="load_angle", **values):
    """Derivatives (T, W) of the readings of a signal that does not change."""
    return SensorStage([(effect, channel)], values).linearise(T, {channel: x}, wrt=wrt)[1][channel]


@pytest.mark.parametrize("delay", [0.0, 2e-3, 2.13e-3])
def test_exact_delay_differentiates_by_time(delay):
    found = slopes("sensor_delay", SINE, "tau_y", tau_y=delay)[10:-10, 0]
    np.testing.assert_allclose(found, -RATE * np.cos(RATE * (T - delay))[10:-10], atol=1e-6 * RATE)


def test_exact_clock_differentiates_by_its_own_time():
    found = slopes("clock_skew", SINE, "skew", "clock_offset", skew=-1e-3, clock_offset=3e-4)[10:]
    speed = RATE * np.cos(RATE * (0.999 * T[10:] + 3e-4))
    np.testing.assert_allclose(found, np.stack([T[10:] * speed, speed], axis=1), atol=1e-6 * RATE)


@pytest.mark.parametrize("tau", [0.0, 1e-4, 5e-3, 0.5])
def test_exact_lowpass_of_a_sine(tau):
    """The response to a sine that goes on before the start as a straight line, differentiated by hand."""
    found = slopes("sensor_lowpass", SINE, "tau_s", tau_s=tau)[:, 0]
    response = 1.0 / (1.0 + 1j * RATE * tau)
    change = -1j * RATE * response**2
    turning, faded = np.exp(1j * RATE * T), np.exp(-T / tau) if tau else 0.0 * T
    expected = np.imag(change * turning) - (RATE + np.imag(change)) * faded
    expected -= (tau * RATE + np.imag(response)) * faded * T / max(tau, 1e-9) ** 2
    np.testing.assert_allclose(found[1:-10], expected[1:-10], atol=1e-6 * np.max(np.abs(expected)))


@pytest.mark.parametrize("share", [0.0, 0.7, 20.0])
def test_exact_mean_of_a_sine(share):
    half = 0.5 * RATE * 4e-4 * share
    late, gain = RATE * T - half, np.sinc(half / np.pi)
    fall = (np.cos(half) - gain) / half if share else 0.0
    expected = 0.5 * RATE * 4e-4 * (fall * np.sin(late) - gain * np.cos(late))
    found = slopes("sensor_averaging", SINE, "window_share", window_share=share)[:, 0]
    np.testing.assert_allclose(found[30:-10], expected[30:-10], atol=1e-6 * np.max(np.abs(expected)))


def test_exact_eccentricity_is_linearised_where_the_shaft_is():
    angle, along = 30.0 * T, np.stack([SINE, T], axis=1)
    stage = SensorStage([("encoder_eccentricity", "load_angle")], {"eccentricity": 1e-3, "psi": 0.4})
    found = stage.linearise(T, {"load_angle": angle}, {"load_angle": along}, wrt=["psi"])[1]["load_angle"]
    line = 0.04 * np.cos(angle + 0.4)
    np.testing.assert_allclose(found, np.stack([(1.0 + line) * SINE, (1.0 + line) * T, line], axis=1), atol=1e-12)


def test_exact_line_faster_than_samples_behind_a_filter():
    """1024 Hz, read 2500 times per second; the derivative of a settled response by hand."""
    speed, tau, size = np.pi, 5e-3, 2.0 * np.pi / 2048.0
    effects = [("encoder_interpolation_error", "load_angle"), ("sensor_lowpass", "load_angle")]
    stage = SensorStage(effects, {"tau_s": tau, "pitch_share": 1e-2})
    found = stage.linearise(T, {"load_angle": speed * T}, wrt=["pitch_share", "psi", "tau_s", "lines"])[1]["load_angle"]
    rate = 2048.0 * speed
    response = 1.0 / (1.0 + 1j * rate * tau)
    line = size * np.exp(1j * rate * T)
    expected = [
        np.imag(response * line),
        np.real(1e-2 * response * line),
        np.imag(-1j * rate * response**2 * 1e-2 * line) - speed,
        1e-2 * np.imag((1j * speed * T - 1.0 / 2048.0 - 1j * speed * tau * response) * response * line),
    ]
    for column, own in enumerate(expected):
        np.testing.assert_allclose(found[:, column], own, atol=1e-8 * np.max(np.abs(own)))


def test_exact_rounding_is_left_out_and_noise_is_a_factor():
    """Steps may lie anywhere: on average a rounded reading follows the unrounded one and not its steps."""
    effects = [("sensor_delay", "load_angle"), ("sensor_noise", "load_angle"), ("quantisation", "load_angle")]
    signal, along = {"load_angle": SINE}, {"load_angle": np.cos(T)[:, None]}
    wrt = ["tau_y", "noise", "resolution", "step_share"]
    read, found = SensorStage(effects, {"resolution": 0.3}).linearise(T, signal, along, wrt=wrt)
    assert len(np.unique(read["load_angle"])) < 9
    smooth, expected = SensorStage(effects[:2]).linearise(T, signal, along, wrt=wrt[:2])
    np.testing.assert_array_equal(found["load_angle"][:, :3], expected["load_angle"])
    assert np.all(found["load_angle"][:, 3:] == 0.0)
    clean = SensorStage(effects[:1]).apply(T, signal)["load_angle"]
    np.testing.assert_allclose(found["load_angle"][:, 2], (smooth["load_angle"] - clean) / 1e-6, atol=1e-8)


def test_exact_held_readings_stand_still_when_the_clock_before_them_moves():
    stage = SensorStage([("clock_skew", "load_angle"), ("aliasing", "load_angle"), ("sensor_delay", "load_angle")])
    found = stage.linearise(T, {"load_angle": SINE}, wrt=["clock_offset", "f_s"])[1]["load_angle"]
    assert np.all(found[:, 0] == 0.0)
    held = np.floor(T * (1.0 + 5e-5) * 100.0 + 1e-9) / 100.0
    expected = -held / 100.0 * RATE * np.cos(RATE * (held - 1e-3))
    np.testing.assert_allclose(found[30:, 1], expected[30:], atol=1e-6 * np.max(np.abs(expected)))


def random_values(stage, rng, rows=3):
    """Plausible values; amplitudes large enough to be seen beside an angle of many turns."""
    large = {"pitch_share": (0.05, 0.2), "lines": (10.0, 30.0), "eccentricity": (1e-3, 3e-3), "noise": (0.1, 0.2)}
    large |= {"drift": (0.1, 0.3), "offset": (0.1, 0.3), "resolution": (1e-3, 0.1), "skew": (-1e-2, 1e-2)}
    return {p.name: rng.uniform(*large.get(p.name, (p.low, p.high)), rows) for p in stage.parameters}


def assert_derivatives(effects, channel, seed):
    """Within 1e-6 of the largest over time, for the signal's own change and for every parameter of the stage."""
    rng = np.random.default_rng(seed)
    stage = SensorStage([(effect, channel) for effect in effects], seed=seed)
    unrounded = SensorStage([(effect, channel) for effect in effects if effect != "quantisation"], seed=seed)
    values, speed = random_values(stage, rng), rng.uniform(2.0, 10.0, (3, 1))
    t = np.unique(rng.uniform(0.0, 0.3, 300)) if rng.random() < 0.5 else np.arange(300) * 1e-3
    at = np.unique(rng.uniform(0.0, t[-1], 60))

    def signal(shift):
        return speed * t + 0.3 * np.sin(40.0 * t * (1.0 + shift))

    def readings(shift, changed):
        kept = {name: value for name, value in changed.items() if name in unrounded.parameters}
        return unrounded.apply(t, {channel: signal(shift)}, kept, at=at)[channel]

    along = np.broadcast_to(12.0 * t * np.cos(40.0 * t), (3, len(t)))[..., None]
    wrt = [p.name for p in unrounded.parameters]
    read, found = stage.linearise(t, {channel: signal(0.0)}, {channel: along}, values, wrt=wrt, at=at)
    np.testing.assert_array_equal(read[channel], stage.apply(t, {channel: signal(0.0)}, values, at=at)[channel])
    for column, name in enumerate([None, *wrt]):
        if "aliasing" in effects and name in ("skew", "clock_offset"):
            continue  # differences jump from one conversion to the next
        size = np.ones(3) if name is None else np.abs(values[name])
        errors = []
        for step in (1e-3, 1e-4, 1e-5, 1e-6):
            moved = [
                readings(
                    a * step if name is None else 0.0, values | ({name: values[name] + a * step * size} if name else {})
                )
                for a in OFFSETS
            ]
            expected = np.tensordot(WEIGHTS, moved, axes=1) / (step * size[:, None])
            noise = 1e-14 * np.max(np.abs(read[channel])) / (step * size)
            largest = np.max(np.abs(expected), axis=1)
            errors.append((np.max(np.abs(found[channel][..., column] - expected), axis=1) - noise) / largest)
        assert np.all(np.min(errors, axis=0) < 1e-6), (effects, name, errors)


@pytest.mark.parametrize("effect", EFFECTS)
def test_against_differences_of_every_effect(effect):
    for seed, channel in enumerate({"load_angle", "motor_torque"} & set(EFFECTS[effect].channels)):
        assert_derivatives([effect], channel, seed)


def test_against_differences_of_a_line_apart_from_the_curve():
    effects = ["encoder_interpolation_error", "ratio_error", "sensor_lowpass", "sampling_jitter", "sensor_averaging"]
    assert_derivatives(effects, "load_angle", 3)


@given(st.lists(st.sampled_from(list(EFFECTS)), unique=True, min_size=2, max_size=6), st.integers(0, 1000))
@settings(max_examples=10)
def test_against_differences_of_any_effects_together(effects, seed):
    assert_derivatives(effects, "load_angle", seed)


RIG = SensorStage(
    [
        ("encoder_eccentricity", "load_angle"),
        ("encoder_interpolation_error", "load_angle"),
        ("sensor_lowpass", "load_angle"),
        ("clock_skew", "motor_angle"),
        ("ratio_error", "motor_angle"),
        ("sensor_averaging", "output_torque"),
        ("sensor_offset_drift", "output_torque"),
        ("sensor_delay", "output_torque"),
    ],
    {"lines": 20.0, "eccentricity": 1e-3, "pitch_share": 0.1, "encoder_eccentricity_psi": 0.3, "clock_offset": 0.01},
)


@pytest.mark.parametrize("terms", [[], ["coulomb_friction", "backlash"]], ids=["nominal", "friction and clearance"])
def test_against_differences_through_drive_and_sensors(terms):
    values = {"coulomb_friction_T_c": 0.04, "half_gap": 5e-5} if terms else {}
    own = {name: RIG.value(name) for name in RIG.parameters.names if "interpolation" not in name}
    wrt = [*own, *values, "J_m", "tau_load", "k1"]
    options = AT_TORQUE | {"model": hdfast.Model(terms=terms), "sensors": RIG}
    assert_close(random_row(5, **values, **own), wrt, 1e-6, steps=(1e-3, 1e-4, 1e-5), **options)


ROWS = {"J_l": np.array([0.5, -1.0, 0.4]), "tau_y": np.array([1e-3, 2e-3, 3e-3])}
SIMPLE = SensorStage([("sensor_delay", "load_angle"), ("quantisation", "motor_angle")])
BRIEF = {"t_eval": np.linspace(0.0, 1.0, 11), "metrics": ["te_pp"], "sensors": SIMPLE}


def test_exact_columns_are_in_the_order_asked_for_and_motion_does_not_see_sensors():
    wrt = ["tau_y", "J_l", "initial_omega_m", "resolution"]
    found = hdfast.sweep(ROWS, sensitivities=wrt, **BRIEF)
    plain = hdfast.sweep(ROWS, **BRIEF)
    drive = hdfast.sweep({"J_l": ROWS["J_l"]}, sensitivities=wrt[1:3], **(BRIEF | {"sensors": None}))
    assert found.sensitivities == tuple(wrt)
    for name, values in plain.recorded.items():
        np.testing.assert_array_equal(found.recorded[name], values)
    for mine, own in (
        (found.metric_sensitivities["te_pp"], drive.metric_sensitivities["te_pp"]),
        (found.sample_sensitivities["te"], drive.sample_sensitivities["te"]),
        (found.final_state_sensitivities, drive.final_state_sensitivities),
    ):
        np.testing.assert_array_equal(mine[..., 1:3], own)
        np.testing.assert_array_equal(mine[[0, 2]][..., [0, 3]], 0.0)
    late = found.recorded_sensitivities["load_angle"]
    assert np.isnan(late[1]).all()
    assert np.all(late[[0, 2], -1, 0] < 0.0)
    np.testing.assert_array_equal(found.recorded_sensitivities["motor_torque"][[0, 2]][..., [0, 3]], 0.0)
    assert plain.recorded_sensitivities["load_angle"].shape == (3, 11, 0)


def test_exact_jacobian_is_of_the_readings_where_there_are_sensors():
    t, wrt = BRIEF["t_eval"], ["J_l", "load_angle_sensor_delay_tau_y"]
    channels = hdfast.jacobian({"J_l": 0.4, "tau_y": 0.0}, wrt=wrt, t_eval=t, sensors=SIMPLE, rtol=1e-10)
    assert channels.shape == (11, 4, 2)
    signals = ["theta_l", "load_angle", "omega_l"]
    J = hdfast.jacobian({"J_l": 0.4, "tau_y": 0.0}, wrt=wrt, t_eval=t, signals=signals, sensors=SIMPLE, rtol=1e-10)
    np.testing.assert_array_equal(J[:, 1], channels[:, 1])
    np.testing.assert_allclose(J[:, 1, 0], J[:, 0, 0], atol=1e-12)
    run = hdfast.simulate({"J_l": 0.4}, t_eval=t, signals=["omega_l"], rtol=1e-10)
    np.testing.assert_allclose(J[1:, 1, 1], -run["omega_l"][1:], rtol=1e-6)


def test_exact_derivatives_by_sensors_alone_need_no_method_that_carries_them():
    found = hdfast.sweep({}, sensitivities=["tau_y"], method="bs3", **BRIEF)
    assert np.isfinite(found.recorded_sensitivities["load_angle"]).all()
    with pytest.raises(InputError, match="bs3"):
        hdfast.sweep({}, sensitivities=["tau_y", "J_l"], method="bs3", **BRIEF)


def test_exact_rows_have_the_same_bits_in_any_company_and_end_early():
    rng = np.random.default_rng(2)
    t = np.arange(400) * 1e-3
    x, along = (np.cumsum(rng.normal(size=shape), axis=1) for shape in ((3, 400), (3, 400, 2)))
    x[1, 250:] = along[1, 250:] = np.nan
    stage = SensorStage([("sensor_lowpass", "load_angle"), ("sensor_delay", "load_angle")], {"tau_y": 0.05})
    wrt = ["tau_s", "tau_y"]
    together = stage.linearise(t, {"load_angle": x}, {"load_angle": along}, wrt=wrt)[1]["load_angle"]
    alone = stage.linearise(t, {"load_angle": x[1]}, {"load_angle": along[1]}, wrt=wrt)[1]["load_angle"]
    np.testing.assert_array_equal(together[1], alone)
    assert np.isfinite(alone[:299]).all()
    assert np.isnan(alone[300:]).all()
    assert np.isfinite(together[[0, 2]]).all()


def test_exact_dataset_holds_readings_and_their_derivatives():
    result = hdfast.sweep({"J_l": [0.5, 0.4]}, sensitivities=["J_l", "tau_y"], **BRIEF)
    data = result.to_xarray()
    np.testing.assert_array_equal(data["load_angle"], result.recorded["load_angle"])
    assert data["load_angle"].attrs["units"] == "rad"
    expected = result.recorded_sensitivities["load_angle"][..., 1]
    np.testing.assert_array_equal(data["d_load_angle"].sel(wrt="tau_y"), expected)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: SIMPLE.linearise(T, {"load_angle": SINE}, wrt=["tau"]), "tau_y"),
        (lambda: SIMPLE.linearise(T, {"load_angle": SINE}, wrt="tau_y"), "not a list"),
        (lambda: SIMPLE.linearise(T, {"load_angle": SINE}, wrt=["tau_y", "sensor_delay_tau_y"]), "twice"),
        (lambda: SIMPLE.linearise(T, {"load_angle": SINE}, {"load_angle": SINE}), r"slopes\['load_angle'\]"),
        (lambda: hdfast.sweep({}, sensitivities=["tau_yy"], **BRIEF), "tau_y"),
        (lambda: hdfast.sweep({}, sensitivities=["tau_y"]), "tau_y"),
        (lambda: hdfast.sweep({}, sensitivities=["tau_y", "sensor_delay_tau_y"], **BRIEF), "twice"),
        (lambda: hdfast.jacobian({}, wrt=["J_l"], t_eval=[1.0], signals=["load_angle"]), "load_angle"),
        (lambda: hdfast.jacobian({}, wrt=["J_l"], t_eval=[1.0], signals="load_angle", sensors=SIMPLE), "not a list"),
    ],
)
def test_exact_wrong_calls(call, named):
    with pytest.raises(InputError, match=named):
        call()
