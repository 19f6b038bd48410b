"""Round trip of the transmission-error test: known series, engine, sensors, identification."""

from __future__ import annotations

import drives
import numpy as np
import pytest
import round_trips
from hdfast import Scenario, config, identify
from hdfast.bench import startstop
from hdfast.errors import InputError
from hdfast.identify import estimate, orders

CHANCE = 3.0 * np.sqrt(0.9 * 0.1)


def check(bits, rate, seeds, revolutions=None):
    tallies, counts = round_trips.orders(bits, rate, seeds, revolutions)
    assert counts == {(15, 15)}
    amplitudes = [tallies[f"te_{n}"] for n in range(1, 16)]
    assert max(tally.worst for tally in amplitudes) < 0.02
    for group in (amplitudes, list(tallies.values())):
        assert 0.85 <= np.mean([tally.coverage for tally in group]) <= 0.95
    return tallies


def test_exact_round_trip_orders_and_coverage():
    check(20, 100.0, 10, 242)


@pytest.mark.long
@pytest.mark.parametrize(("bits", "rate"), round_trips.RUNS)
def test_exact_round_trip_over_a_hundred_seeds(bits, rate):
    for name, tally in check(bits, rate, 100).items():
        assert abs(tally.coverage - 0.9) <= CHANCE / np.sqrt(100), name


def smooth(orders, amplitudes, phases, noise, turns=24, seed=0, step=0.05):
    """Runs of a rigid gear, written here: both directions, `noise` rad on the load angle, a sample every `step` s."""
    rng = np.random.default_rng(seed)
    found = []
    for sign in (1.0, -1.0):
        t = np.arange(0.0, 4.0 * turns + 0.08, step)
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


def test_exact_orders_of_runs_whose_speed_changes():
    """Speeds from 0 to twice the mean: means of samples take more from an order where the motor is fast."""
    t = np.arange(0.0, 80.0, 5e-3)
    for speed in (4.0 * (1.0 - np.abs(t / 40.0 - 1.0)), np.pi * np.sin(np.pi * t / 80.0)):
        motor = np.cumsum(speed) * 5e-3
        error = sum(30e-6 / n * np.sin(n * motor) for n in range(1, 21))
        run = {"t": t, "motor_angle": motor, "load_angle": motor / 121.0 - error}
        fit = identify.kinematic_error(run, ratio=121.0, orders=list(range(1, 21)))
        for n in range(1, 21):
            assert fit.estimates.named(f"te_{n}").value == pytest.approx(30e-6 / n, rel=1e-3), n


@pytest.mark.parametrize("step", [1e-3, 1.1e-3, 1.7e-3, 0.02])
@pytest.mark.parametrize("turns", [1, 2, 3])
def test_exact_blocks_cut_no_revolution(turns, step):
    motor = np.arange(0.0, 2.0 * np.pi * turns + 0.05, step)
    assert orders.blocks(motor, motor, 0.0 * motor, 20.0).whole == turns


@pytest.mark.parametrize("turns", [(24, 24), (24, 5), (24, 2), (24, 1), (2, 1), (1, 1)])
def test_exact_a_short_run_beside_a_long_one_hides_no_orders(turns):
    """20 µrad of backlash between the directions, which nothing else tells where a run is left out as a whole."""
    runs = [smooth(range(1, 7), [8e-6] * 6, drives.PHASES[:6], 1e-7, turns=n)[k] for k, n in enumerate(turns)]
    runs[1]["load_angle"] = runs[1]["load_angle"] + 20e-6
    fit = identify.kinematic_error(runs, ratio=121.0, most=12)
    assert fit.numbers["suggested"] == 6
    judge = "cross-validation" if max(turns) > 1 else "BIC, as no run has two revolutions"
    assert fit.notes[1].startswith(f"orders 1 ... 6 suggested by {judge}")


@pytest.mark.parametrize(("turns", "both"), [(1, True), (1, False), (2, False), (4, True)])
def test_exact_intervals_of_short_runs_hold_the_truth(turns, both):
    """Twenty orders are fitted, ten are there: of one turn they leave no residual where they are."""
    amplitudes = [30e-6 / n for n in range(1, 11)]
    phases = [0.3 * n for n in range(1, 11)]
    held = []
    for seed in range(60):
        runs = smooth(range(1, 11), amplitudes, phases, 1e-6, turns=turns, seed=seed, step=0.01)
        fit = identify.kinematic_error(runs if both else runs[0], ratio=121.0, orders=list(range(1, 21)))
        for n, (a, p) in enumerate(zip(amplitudes, phases, strict=True), start=1):
            held.append(fit.estimates.named(f"te_cos_{n}").covers(a * np.sin(p)))
    assert 0.84 <= np.mean(held) <= 0.96


@pytest.mark.parametrize("freedom", [np.inf, 10.0])
@pytest.mark.parametrize("truth", [0.0, 1.0, 2.0, 3.0, 10.0, 40.0])
def test_exact_intervals_of_an_amplitude_hold_the_truth(truth, freedom):
    rng = np.random.default_rng(7)
    sizes = np.hypot(truth + rng.standard_normal(2000), rng.standard_normal(2000))
    sigmas = np.ones(2000) if np.isinf(freedom) else np.sqrt(rng.chisquare(freedom, 2000) / freedom)
    found = [estimate.amplitude("te", size, "rad", sigma, freedom) for size, sigma in zip(sizes, sigmas, strict=True)]
    assert 0.88 <= np.mean([item.covers(truth) for item in found]) <= 0.96
    assert min(item.low for item in found) >= 0.0
    assert all(item.low <= item.value <= item.high for item in found)
    assert np.median([item.high - item.low for item in found]) < 3.7


def test_exact_amplitudes_of_orders_that_are_not_there_reach_zero():
    held = []
    for seed in range(20):
        fit = identify.kinematic_error(
            smooth([2], [90e-6], [0.4], 1e-6, seed=seed), ratio=121.0, orders=[*range(1, 11)]
        )
        held += [fit.estimates.named(f"te_{n}").low == 0.0 for n in range(1, 11) if n != 2]
        assert fit.estimates.named("te_2").low == pytest.approx(90e-6, rel=0.02)
    assert 0.88 <= np.mean(held) <= 0.99


def test_exact_intervals_are_not_known_where_the_fit_leaves_no_residual():
    run = smooth([2], [90e-6], [0.4], 1e-6, turns=1)[0]
    fit = identify.kinematic_error(run, ratio=121.0, orders=list(range(1, 35)))
    assert np.isinf(fit.estimates.named("te_2").sigma)
    assert "not known" in repr(fit)


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


def test_exact_friction_windup_is_the_mean_over_the_runs_of_each_direction():
    """Forward, backward, forward: 5 µrad of windup against the motion, and 3 µrad more in the last run."""
    forward, backward = smooth([2], [90e-6], [0.4], 0.0)
    again = dict(forward)
    for run, windup in ((forward, 5e-6), (backward, -5e-6), (again, 8e-6)):
        run["load_angle"] = run["load_angle"] - windup
    for runs, half in (([forward, backward, again], "5.75"), ([backward, forward, forward], "5")):
        notes = identify.kinematic_error(runs, ratio=121.0, orders=[2]).notes
        assert any(f"forward and backward: {half} µrad" in note for note in notes)


def test_exact_a_wrong_ratio_is_no_friction_windup():
    """5 µrad of windup against the motion beside 2e-6 rad per motor radian, which make 300 µrad over a run."""
    runs = smooth([2], [90e-6], [0.4], 0.0)
    for run, windup in zip(runs, (5e-6, -5e-6), strict=True):
        run["load_angle"] = run["load_angle"] - windup - 2e-6 * run["motor_angle"]
    notes = identify.kinematic_error(runs, ratio=121.0, orders=[2]).notes
    assert any("forward and backward: 5 µrad" in note for note in notes)


@pytest.mark.parametrize(
    ("orders", "text"), [([], "orders is empty"), ([2, "2"], "2 twice"), ("1,2", "not a list"), ([0], "order 0")]
)
def test_exact_orders_that_cannot_be_are_named(orders, text):
    with pytest.raises(InputError, match=text):
        identify.kinematic_error(smooth([2], [90e-6], [0.4], 0.0), ratio=121.0, orders=orders)


def test_exact_wrong_recordings_are_named():
    [forward, _] = smooth([2], [90e-6], [0.4], 0.0)
    with pytest.raises(InputError, match="motor revolutions"):
        identify.kinematic_error({name: values[:60] for name, values in forward.items()}, ratio=121.0)
    turning = forward | {"motor_angle": 0.5 * forward["t"] + 20.0 * np.sin(0.1 * forward["t"])}
    with pytest.raises(InputError, match="turns back"):
        identify.kinematic_error(turning, ratio=121.0)
    out_and_back = forward | {"motor_angle": 20.0 * np.sin(np.linspace(0.0, np.pi, len(forward["t"])))}
    with pytest.raises(InputError, match="turns back"):
        identify.kinematic_error(out_and_back, ratio=121.0)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (np.negative, "load_angle turns against motor_angle; flip the sign of scale"),
        (np.degrees, "load_angle moves 57.29[0-9] times as far as motor_angle / ratio; load_angle looks like degrees"),
        (np.zeros_like, "load_angle stays while the motor turns by"),
        (
            lambda load: (load + 1.0) % 2.0,
            r"load_angle jumps by 2 \(0.3183 turns\) 3 times and starts again: unwrap it",
        ),
        (lambda load: (load + 6.0) % (2.0 * np.pi), "load_angle jumps by a whole turn 1 times: unwrap it"),
    ],
)
def test_exact_a_load_that_does_not_follow_the_motor_is_refused(change, text):
    runs = smooth([2], [90e-6], [0.4], 1e-6, turns=121)
    for run in runs:
        run["load_angle"] = change(run["load_angle"])
    with pytest.raises(InputError, match=f"recording 0: {text}"):
        identify.kinematic_error(runs, ratio=121.0)


@pytest.mark.parametrize("turns", [1, 24])
def test_exact_windup_and_the_ratio_of_another_fixed_member_are_no_other_motion(turns):
    for ratio in (120.0, 121.0):
        assert identify.kinematic_error(smooth([2], [90e-6], [0.4], 1e-6, turns=turns)[0], ratio=ratio).estimates


def test_exact_an_angle_that_its_file_gives_in_degrees_is_not_taken_for_radians(tmp_path):
    """A motor torque in ampere, which the test does not read, is nobody's concern."""
    paths = []
    for number, found in enumerate(smooth([2], [90e-6], [0.4], 1e-7)):
        table = np.column_stack([found["t"], found["motor_angle"], np.degrees(found["load_angle"]), 0.0 * found["t"]])
        paths.append(tmp_path / f"run{number}.csv")
        header = "t,motor_angle,load_angle,motor_torque\ns,rad,deg,A"
        np.savetxt(paths[-1], table, delimiter=",", header=header, comments="", fmt="%.17g")
    with pytest.raises(InputError, match=r"the file gives load_angle in deg, not in rad: state scale = 0\.0174"):
        identify.kinematic_error(paths, ratio=121.0, orders=[2])
    scaled = {"load_angle": {"scale": np.pi / 180.0}}
    fit = identify.kinematic_error(paths, ratio=121.0, orders=[2], columns=scaled)
    assert fit.estimates.named("te_2").value == pytest.approx(90e-6, rel=1e-3)


def test_exact_tolerances_of_orders_that_are_not_there_go():
    varied = {"distribution": "normal", "sigma": 1e-6}
    base = {"tolerance": {"te_cos_2": varied, "te_cos_9": varied}}
    fit = identify.kinematic_error(smooth([2], [90e-6], [0.4], 1e-7), ratio=121.0, orders=[2], base=base)
    assert set(config.parse(fit.model_text()).tolerances) == {"te_cos_2"}
    assert "the model file has no tolerance of te_cos_9: the drive has no te_cos_9" in fit.notes


def test_exact_a_bench_that_ends_early_is_refused():
    with pytest.raises(InputError, match="cannot be simulated"):
        startstop({"J_m": 1e-30}, scenario=Scenario.start_stop(t_end=1.0))


@pytest.mark.parametrize(
    ("orders", "per_turn", "turns", "lost"),
    [([1, 9], 10, 40, "1, 9"), ([1, 11], 10, 40, "1, 11"), (["1/121", 1], 100, 1, "1/121")],
)
def test_regress_orders_that_a_run_cannot_tell_are_refused(orders, per_turn, turns, lost):
    """Ten readings a turn show orders 9 and 11 as 1; one turn of 121 shows the output's as offset and slope."""
    motor = 2.0 * np.pi * np.arange(per_turn * turns + 1) / per_turn
    noise = 1e-6 * np.random.default_rng(2).standard_normal(len(motor))
    run = {"t": 0.01 * np.arange(len(motor)), "motor_angle": motor, "load_angle": motor / 121.0 + noise}
    with pytest.raises(InputError, match=f"orders {lost} cannot be told"):
        identify.kinematic_error(run, ratio=121.0, orders=orders)
