"""Round trip of the transmission-error test: known series, engine, sensors, identification."""

from __future__ import annotations

import functools

import drives
import numpy as np
import pytest
from hdfast import Model, Scenario, config, identify
from hdfast.bench import record, rig, startstop
from hdfast.bench.kinematic_error import motion
from hdfast.errors import InputError
from hdfast.sensors import encoder

GAIN = {name: {**drives.DRIVE, **drives.POLYNOMIAL}[name] for name in ("J_l", "k1", "B_sp", "B_l")}
ANGLES = ("motor_angle", "load_angle")
# load encoder [bit], rate [Hz], revolutions in each direction, speed [r/min]; the speed is no simple ratio of the rate,
# or every output revolution would repeat the rounding errors of the one before
SHORT = [(20, 100.0, 242, 14.93), (20, 1000.0, 121, 14.93)]
LONG = [(20, 100.0, 363, 14.93), (20, 1000.0, 121, 14.93), (17, 1000.0, 242, 14.93), (17, 100.0, 484, 2.987)]


@functools.lru_cache(maxsize=2)
def signals(rate, revolutions, speed):
    duration = 60.0 / speed * (revolutions + 0.02)
    return [motion(None, Model(), sign * speed, duration, rate) for sign in (1.0, -1.0)]


def runs(bits, rate, revolutions, speed, seed):
    sensors = rig(rate, load_angle=encoder(bits, noise=1e-6))
    return [
        record(sensors, f"run {j}", found["t"], {name: found[name] for name in ANGLES}, [seed, j])
        for j, found in enumerate(signals(rate, revolutions, speed))
    ]


def check(case, seeds):
    covered = []
    for seed in range(seeds):
        fit = identify.kinematic_error(runs(*case, seed), ratio=121.0, gain=GAIN)
        assert fit.numbers["suggested"] == fit.numbers["knee"] == 15, seed
        for n, amplitude in enumerate(drives.AMPLITUDES, 1):
            assert fit.estimates.named(f"te_{n}").value == pytest.approx(amplitude, rel=0.02), (seed, n)
        truth = drives.kinematic_error()
        covered += [fit.estimates.named(name).covers(value) for name, value in truth.items()]
    assert 0.85 <= np.mean(covered) <= 0.95


@pytest.mark.parametrize("case", SHORT)
def test_exact_round_trip_orders_and_coverage(case):
    check(case, 10)


@pytest.mark.long
@pytest.mark.parametrize("case", LONG)
def test_exact_round_trip_over_a_hundred_seeds(case):
    check(case, 100)


def smooth(orders, amplitudes, phases, noise, turns=24, seed=0):
    """Runs of a rigid gear, written here: both directions, `noise` rad on the load angle."""
    rng = np.random.default_rng(seed)
    found = []
    for sign in (1.0, -1.0):
        t = np.arange(0.0, 4.0 * turns + 0.08, 0.05)
        motor = sign * 2 * np.pi / 4.0 * t
        error = sum(a * np.sin(n * motor + p) for n, a, p in zip(orders, amplitudes, phases, strict=True))
        load = motor / 121.0 - error + noise * rng.standard_normal(len(t))
        found.append({"t": t, "motor_angle": motor, "load_angle": load})
    return found


@pytest.mark.parametrize("count", [2, 4, 6, 10, 15])
def test_exact_knee_stands_at_the_true_order(count):
    """Content that does not fall off by itself; the knee is where it ends."""
    recordings = smooth(range(1, count + 1), [8e-6] * count, drives.PHASES[:count], 1e-6)
    fit = identify.kinematic_error(recordings, ratio=121.0)
    assert (fit.numbers["knee"], fit.numbers["suggested"]) == (count, count)
    assert np.all(np.diff(fit.numbers["rmse"]) <= 0.0)


def test_against_design_table_rmse_curve():
    """66, 17.4, 6.5, 3.0, 2.2, 1.54, 1.36, 1.36 µrad at 1, 2, 4, 6, 10, 14, 15, 20 orders with 1.36 µrad noise."""
    recordings = smooth(range(1, 16), drives.AMPLITUDES, drives.PHASES, 1.36e-6, turns=121)
    rmse = 1e6 * np.array(identify.kinematic_error(recordings, ratio=121.0).numbers["rmse"])
    expected = {1: 66.0, 2: 17.4, 4: 6.5, 6: 3.0, 10: 2.2, 14: 1.54, 15: 1.36, 20: 1.36}
    for n, value in expected.items():
        assert rmse[n - 1] == pytest.approx(value, rel=0.03), n


def test_exact_any_order_list_and_the_beat_of_the_output():
    orders, amplitudes, phases = [2.0, 240 / 121, 1 / 121], [90e-6, 12e-6, 30e-6], [0.4, 1.0, 2.0]
    recordings = smooth(orders, amplitudes, phases, 1e-6, turns=122)
    fit = identify.kinematic_error(recordings, ratio=121.0, orders=[2])
    assert fit.numbers["orders"] == ["2", "1/121", "2/121", "240/121"]
    for order, amplitude in zip(("2", "240/121", "1/121"), amplitudes, strict=True):
        assert fit.estimates.named(f"te_{order}").value == pytest.approx(amplitude, rel=0.02)
    listed = identify.kinematic_error(recordings, ratio=121.0, orders=["240/121", 2, "1/121"])
    assert config.parse(listed.model_text()).model.order_labels == ["240/121", "2", "1/121"]


def test_exact_scale_error_and_skew_are_nuisances():
    recordings = smooth([2], [90e-6], [0.4], 0.0)
    for found in recordings:
        found["load_angle"] = found["load_angle"] + 1e-6 * found["t"] - 2e-6 * found["motor_angle"]
    fit = identify.kinematic_error(recordings, ratio=121.0, orders=[2])
    assert fit.estimates.named("te_2").value == pytest.approx(90e-6, rel=1e-6)
    assert any("2e-06 rad per motor radian" in note for note in fit.notes)


def test_exact_wrong_recordings_are_named():
    [forward, _] = smooth([2], [90e-6], [0.4], 0.0)
    with pytest.raises(InputError, match="motor revolutions"):
        identify.kinematic_error({name: values[:60] for name, values in forward.items()}, ratio=121.0)
    turning = forward | {"motor_angle": 0.5 * forward["t"] + 20.0 * np.sin(0.1 * forward["t"])}
    with pytest.raises(InputError, match="turns back"):
        identify.kinematic_error(turning, ratio=121.0)


def test_exact_a_bench_that_ends_early_is_refused():
    with pytest.raises(InputError, match="cannot be simulated"):
        startstop({"J_m": 1e-30}, scenario=Scenario.start_stop(t_end=1.0))
