"""Round trip of the stiffness test: known spring, virtual bench, identification."""

from __future__ import annotations

import numpy as np
import pytest
import round_trips
from hdfast import Scenario, config, identify, simulate, spring
from hdfast.bench import SlipLoop, rig, stiffness
from hdfast.errors import InputError
from hdfast.identify import spring_fit
from hdfast.identify.estimate import Estimate, mean
from hdfast.report import identify_page
from hdfast.sensors import SensorFacts, encoder

SEEDS = 100
WITHIN = {"k1": 0.01, "k3": 0.01, "k5": 0.01, "K1": 0.01, "K2": 0.01, "K3": 0.01, "loop_energy": 0.004}


CASES = [(spring, *sensor) for spring in ("polynomial", "piecewise") for sensor in round_trips.SENSORS]
SLOW = [case for case in CASES if case[1:] != (20, 100.0)]


@pytest.mark.parametrize(
    ("spring", "bits", "rate"), [pytest.param(*case, marks=[pytest.mark.long] * (case in SLOW)) for case in CASES]
)
def test_exact_round_trip_and_coverage(spring, bits, rate, long):
    seeds = SEEDS if long else 25
    tallies = round_trips.springs(spring, bits, rate, seeds)
    for name in WITHIN.keys() & tallies.keys():
        assert tallies[name].worst < WITHIN[name], name
    slack = 0.0 if seeds == SEEDS else 0.04
    assert 0.85 - slack <= np.mean([tally.coverage for tally in tallies.values()]) <= 0.95 + slack
    chance = 3.0 * np.sqrt(0.9 * 0.1 / seeds)
    for name, tally in tallies.items():
        assert abs(tally.coverage - 0.9) <= chance, name


def test_exact_spring_without_loop_needs_no_cut():
    made = stiffness(loop=SlipLoop(torque=0.0), seed=3)
    fit = identify.stiffness(made.recording, ratio=121.0)
    assert fit.numbers["cut"] == 0.0
    assert fit.estimates.named("k5").value == pytest.approx(made.truth["k5"], rel=0.01)
    assert abs(fit.estimates.named("hysteresis_loss").value) < 2e-6


def test_exact_loss_and_lost_motion_follow_from_the_loop():
    made = stiffness(loop=SlipLoop(torque=3.0), seed=1)
    fit = identify.stiffness(made.recording, ratio=121.0)
    k1, k3 = made.truth["k1"], made.truth["k3"]
    half = 3.0 / (k1 + k3 * (3.0 / k1) ** 2)
    assert fit.estimates.named("hysteresis_loss").value == pytest.approx(2.0 * half, rel=0.01)
    torque = 0.04 * 67.0

    def windup(held):
        return next(float(r.real) for r in np.roots([k3, 0.0, k1, -held]) if abs(r.imag) < 1e-12)

    middle = 0.5 * (windup(torque - 3.0) + windup(torque + 3.0))
    assert fit.estimates.named("lost_motion").value == pytest.approx(2.0 * middle, rel=0.01)


def test_exact_residual_of_a_polynomial_on_both_branches_tells_the_loop():
    made = stiffness(seed=2)
    fit = identify.stiffness(made.recording, ratio=121.0)
    assert any("cannot hold the loop" in note for note in fit.notes)
    assert fit.numbers["laws"]["full"]["k2"] * 1.4e-3**2 == pytest.approx(0.0, abs=0.05)


def test_exact_model_file_is_read_by_every_command():
    made = stiffness(seed=2)
    for law in ("odd", "full", "piecewise"):
        fit = identify.stiffness(made.recording, ratio=121.0, law=law)
        settings = config.parse(fit.model_text())
        assert settings.model.spring == ("piecewise" if law == "piecewise" else "polynomial")
        assert settings.drive[{"piecewise": "K1"}.get(law, "k1")] > 3e4


def test_exact_a_declared_hysteresis_goes_with_a_loop_that_has_none():
    base = {"terms": [{"effect": "hysteresis"}, {"effect": "cogging"}]}
    fit = identify.stiffness(stiffness(loop=SlipLoop(torque=0.0), seed=3).recording, ratio=121.0, base=base)
    assert [item["effect"] for item in fit.model["terms"]] == ["cogging"]
    assert "the model file no longer declares hysteresis" in fit.notes


def test_exact_tolerances_and_correlations_of_the_other_spring_go():
    varied = {"distribution": "truncated_normal", "relative": True, "sigma": 0.05, "lower": 0.85, "upper": 1.15}
    pairs = [["k1", "J_l", 0.3], ["J_m", "J_l", 0.1]]
    base = {"tolerance": dict.fromkeys(("k1", "J_l", "J_m"), varied), "correlation": {"pairs": pairs}}
    fit = identify.stiffness(stiffness(seed=2).recording, ratio=121.0, law="piecewise", base=base)
    settings = config.parse(fit.model_text())
    assert set(settings.tolerances) == {"J_l", "J_m"}
    assert settings.correlation.names == ("J_l", "J_m")


@pytest.mark.parametrize("k2", [-4.9e6, 0.0, 4.9e6])
def test_exact_a_bench_winds_a_spring_of_two_signs_to_its_torque(k2):
    """The tangents at 3 mrad are 60 and 1.6 kN m/rad."""
    drive = {"k1": 31020.0, "k2": k2, "k3": 0.0, "k4": 0.0, "k5": 0.0, "phi_max": 3e-3}
    perfect = rig(load_angle=SensorFacts(), load_torque=SensorFacts())
    found = stiffness(drive, loop=SlipLoop(torque=0.0), sensors=perfect).recording
    held = spring.torque("polynomial", drive, -found["load_angle"])
    np.testing.assert_allclose(held, found["load_torque"], atol=1e-3)


@pytest.mark.parametrize("step", [0.2, 1.0, 2.0, 5.0])
def test_exact_sparse_samples_are_covered_too(step):
    """N m from one reading to the next, of 67 N m."""
    held = {name: [] for name in ("k1", "k3", "k5", "hysteresis_torque", "loop_energy")}
    for seed in range(20):
        made = stiffness(rate=10.0 * step, sensors=rig(10.0), seed=seed)
        fit = identify.stiffness(made.recording, ratio=121.0)
        assert any("sparse samples" in note for note in fit.notes)
        assert fit.estimates.named("loop_energy").sigma < 0.015 * made.truth["loop_energy"]
        for name, found in held.items():
            found.append(fit.estimates.named(name).covers(made.truth[name]))
    assert min(np.mean(found) for found in held.values()) >= 0.75


def test_exact_samples_too_sparse_for_the_branches_are_refused():
    made = stiffness(rate=200.0, sensors=rig(10.0), seed=1)
    with pytest.raises(InputError, match=r"the branches share . levels .* more torque or a slower one"):
        identify.stiffness(made.recording, ratio=121.0)


def test_exact_missing_and_wrong_are_named():
    made = stiffness(seed=2)
    short = {name: values[:20_000] for name, values in made.recording.items()}
    with pytest.raises(InputError, match="whole passes"):
        identify.stiffness(short, ratio=121.0)
    with pytest.raises(InputError, match="'piecwise' is not known"):
        identify.stiffness(made.recording, law="piecwise")
    turned = dict(made.recording.columns) | {"motor_angle": made.recording["t"]}
    with pytest.raises(InputError, match="give ratio"):
        identify.stiffness(turned)
    wrapped = dict(made.recording.columns) | {"load_angle": made.recording["load_angle"] % 6.283185}
    with pytest.raises(InputError, match=r"load_angle jumps by a whole turn \d+ times"):
        identify.stiffness(wrapped, ratio=121.0)


def test_against_engine_the_written_hysteresis_costs_what_the_loop_cost():
    made = stiffness(seed=5)
    fit = identify.stiffness(made.recording, ratio=121.0)
    settings = config.parse(fit.model_text())
    assert settings.model.terms == ("hysteresis",)
    assert settings.drive["T_h"] == pytest.approx(2.0, rel=0.01)
    moments, torque, held = np.array([0.0, 4.0, 12.0, 20.0]), np.array([0.0, 67.0, -67.0, 67.0]), np.linspace(0, 20, 9)
    t = np.linspace(4.0, 20.0, 6001)
    run = simulate(
        settings.drive | {"te_scale": 0.0},
        model=settings.model,
        scenario=Scenario.motion(held, 0.0 * held, load=(moments, torque)),
        t_eval=t,
        signals=["te"],
        metrics=[],
    )
    energy = abs(np.trapezoid(np.interp(t, moments, torque), run["te"]))
    assert energy == pytest.approx(made.truth["loop_energy"], rel=0.01)


def test_exact_loops_of_several_sizes_and_rates_share_one_spring():
    """Largest last; the rates differ, so do the sensors' noises; one loop is too small to show parallel branches."""
    made = [
        stiffness(torque=torque, rate=rate, sensors=rig(hz), seed=seed)
        for seed, (torque, rate, hz) in enumerate([(8, 1, 1000.0), (20, 0.5, 100.0), (40, 2, 1000.0), (67, 8, 1000.0)])
    ]
    together = identify.stiffness([item.recording for item in made], ratio=121.0)
    alone = identify.stiffness(made[-1].recording, ratio=121.0)
    truth = made[-1].truth
    for name in ("k1", "k3", "k5", "hysteresis_torque", "loop_energy"):
        found = together.estimates.named(name)
        assert found.value == pytest.approx(truth[name], rel=2e-3), name
        assert found.sigma <= alone.estimates.named(name).sigma
    assert together.estimates.named("k1").sigma < 0.7 * alone.estimates.named("k1").sigma
    for item, loop in zip(reversed(made), together.numbers["loops"], strict=True):
        assert loop["loop_energy"] == pytest.approx(item.truth["loop_energy"], rel=5e-3)
    assert sum("losses only" in note for note in together.notes) == 1
    assert "<svg" in identify_page.page(together)


def test_exact_repeated_loops_are_averaged_and_their_scatter_counts():
    made = [stiffness(sensors=rig(100.0), seed=seed) for seed in range(4)]
    fit = identify.stiffness([item.recording for item in made], ratio=121.0)
    single = [loop["loop_energy"] for loop in fit.numbers["loops"]]
    energy = fit.estimates.named("loop_energy")
    assert min(single) < energy.value < max(single)
    assert energy.value == pytest.approx(made[0].truth["loop_energy"], rel=1e-3)
    apart = [Estimate("E", value, "J", 1.0, 0.0, 0.0) for value in (0.0, 10.0)]
    assert mean(apart).value == 5.0
    assert mean(apart).sigma == pytest.approx(5.0)


def test_against_engine_the_bench_holds_the_motor_against_the_load():
    t = np.linspace(0.0, 2.0, 9)
    held = simulate(
        {"te_scale": 0.0}, scenario=Scenario.motion(t, 0.0 * t, load=20.0), t_eval=t, signals=["tau_m"], metrics=[]
    )
    sensors = rig(50.0, motor_torque=SensorFacts(), load_torque=SensorFacts())
    made = stiffness(rate=20.0, sensors=sensors).recording
    np.testing.assert_allclose(made["motor_torque"], held["tau_m"][-1] / 20.0 * made["load_torque"], atol=1e-5)


@pytest.mark.parametrize("bits", [8, 11, 12, 13, 15])
def test_exact_a_coarse_encoder_gives_numbers_or_a_sentence(bits):
    """The loop is 3 mrad wide: 4 steps of 13 bit, 15 of 15 bit."""
    for seed in range(4):
        made = stiffness(rate=8.0, sensors=rig(100.0, load_angle=encoder(bits, noise=1e-6)), seed=seed)
        if bits == 15:
            fit = identify.stiffness(made.recording, ratio=121.0)
            assert fit.estimates.named("k1").value == pytest.approx(made.truth["k1"], rel=0.05)
            continue
        with pytest.raises(InputError, match=r"allowed: at least 8|does not grow with the torque"):
            identify.stiffness(made.recording, ratio=121.0)


@pytest.mark.parametrize(
    ("change", "options", "text"),
    [
        ({"load_angle": 0.0}, {}, "moves by 0 rad, does not grow with the torque"),
        ({"load_angle": -1.0}, {}, "does not grow with the torque"),
        ({"load_torque": 0.0}, {}, "0 whole passes"),
        ({"load_torque": np.nan}, {}, "finds 0 samples"),
        ({}, {"ratio": 0.0}, "ratio = 0 must be greater than zero"),
        ({}, {"ratio": -121.0}, "ratio = -121 is out of range"),
    ],
)
def test_exact_columns_and_ratios_that_cannot_be_are_named(change, options, text):
    columns = dict(stiffness(rate=20.0, sensors=rig(100.0)).recording.columns)
    columns |= {name: factor * columns[name] for name, factor in change.items()}
    with pytest.raises(InputError, match=text):
        identify.stiffness(columns, **{"ratio": 121.0} | options)


def test_exact_an_empty_torque_leaves_the_test_to_the_other_one():
    made = stiffness(rate=20.0, sensors=rig(100.0)).recording
    empty = np.full(made.samples, np.nan)
    fit = identify.stiffness({**made, "output_torque": empty, "motor_angle": empty}, ratio=121.0)
    assert fit.numbers["laws"]["odd"]["k1"] == pytest.approx(3.102e4, rel=0.02)
    text = " ".join(fit.notes)
    assert "torque is the column load_torque" in text
    assert "less than 50 % of motor_angle are numbers" in text


def test_exact_a_loop_without_noise_or_hysteresis():
    perfect = rig(100.0, motor_angle=SensorFacts(), load_angle=SensorFacts(), load_torque=SensorFacts())
    made = stiffness(rate=8.0, loop=SlipLoop(torque=0.0), sensors=perfect)
    fit = identify.stiffness([made.recording, made.recording], ratio=121.0)
    assert fit.estimates.named("k1").value == pytest.approx(made.truth["k1"], rel=1e-3)


@pytest.mark.parametrize(
    ("drive", "text"), [({"K9": 1.0}, "'K9' is not known"), ({"k1": -1.0}, "k1 = -1 .* cannot be simulated")]
)
def test_exact_a_bench_refuses_a_drive_that_cannot_be(drive, text):
    with pytest.raises(InputError, match=text):
        stiffness(drive)


@pytest.mark.parametrize(
    ("torque", "corners", "text"),
    [
        (49.0, (14.0, 48.0), "and 0 above them .allowed: at least 8 each"),
        (67.0, (14.0, 66.9), "and 0 above them .allowed: at least 8 each"),
        (67.0, (30.0, 30.01), "below, 0 between"),
        (67.0, (14.0, 14.0), r"corners\[1\] = 14 N m must be greater than corners\[0\] = 14 N m"),
    ],
)
def test_regress_slopes_that_the_torque_on_the_spring_does_not_reach_are_refused(torque, corners, text):
    made = stiffness(torque=torque, rate=8.0, sensors=rig(100.0))
    with pytest.raises(InputError, match=text):
        identify.stiffness(made.recording, ratio=121.0, law="piecewise", corners=corners)
    if corners[0] < corners[1]:
        fit = identify.stiffness(made.recording, ratio=121.0, corners=corners)
        assert set(fit.numbers["laws"]) == {"odd", "full"}
        assert any(note.startswith("no K1, K2, K3: corners = ") for note in fit.notes)


def test_regress_a_slope_that_noise_hides_is_refused():
    points = spring_fit.Points(*wavy_points())
    start = spring_fit.odd(points, np.zeros(1))
    with pytest.raises(InputError, match="K3 may be 0 or less at 90 %"):
        spring_fit.piecewise(points, start, (14.0, 64.0))


def wavy_points():
    """A straight spring whose windup scatters by more than the stretch beyond 64 N m takes."""
    torque = np.tile(np.linspace(-66.0, 66.0, 265), 2)
    direction = np.repeat([1.0, -1.0], 265)
    windup = (torque - direction) / 4e4 + 2e-4 * np.random.default_rng(1).standard_normal(530)
    return windup, torque, direction, np.zeros(530, dtype=np.int64), np.ones(530)


def test_regress_lost_motion_beyond_the_loop_is_not_known():
    made = stiffness(rate=8.0, sensors=rig(100.0))
    for rated in (1700.0, 1e5):
        fit = identify.stiffness(made.recording, ratio=121.0, rated_torque=rated)
        assert np.isnan(fit.estimates.named("lost_motion").value)
        assert np.isfinite(fit.estimates.named("hysteresis_loss").value)
        assert sum("lost_motion" in note and "is not known" in note for note in fit.notes) == 1
        assert "<svg" in identify_page.page(fit)


def test_exact_a_torque_that_lags_has_no_hysteresis():
    """Two seconds at 2 N m/s: the branches change places, 4 N m each."""
    made = stiffness(loop=SlipLoop(torque=0.0), sensors=rig(100.0)).recording
    late = np.concatenate([np.zeros(200), made["load_torque"][:-200]])
    base = {"terms": [{"effect": "hysteresis"}]}
    fit = identify.stiffness({**made, "load_torque": late}, ratio=121.0, base=base)
    assert fit.estimates.named("hysteresis_torque").value == pytest.approx(-4.0, rel=0.01)
    assert any("hysteresis_torque is negative (90 %:" in note for note in fit.notes)
    assert [item["effect"] for item in fit.model["terms"]] == ["hysteresis"]
