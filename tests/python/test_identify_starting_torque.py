"""Round trip of the starting-torque test: known friction, rigid bench, sensors, identification."""

from __future__ import annotations

import hdfast
import numpy as np
import pytest
from hdfast import config, identify
from hdfast.bench import FrictionLaw, starting_torque
from hdfast.errors import InputError
from hdfast.identify.starts import starts
from hdfast.report import identify_page

LAW = FrictionLaw(T_c=0.03, T_s=0.04, asymmetry=0.1)
STRIBECK = {"effect": "stribeck_friction", "parameters": {"T_c": 0.03, "omega_s": 3.0, "stribeck_shape": 2.0}}


@pytest.fixture(scope="module")
def made():
    return starting_torque(LAW, seed=4)


def test_exact_every_start_is_found_and_moves_between_are_not(made):
    found = starts(made.recordings, [])
    assert found.direction.tolist() == [1.0] * 12 + [-1.0] * 12
    np.testing.assert_allclose(found.torque, made.torques, rtol=0.01)
    np.testing.assert_allclose(found.angle % (np.pi / 6) % (np.pi / 6 - 1e-3), 0.0, atol=1e-3)


def test_exact_counts_of_an_encoder_that_is_not_described_are_no_starts(made):
    """A slow creep steps through single counts before every start."""
    fit = identify.starting_torque([dict(item.columns) for item in made.recordings])
    assert fit.numbers["starts"] == 24
    known = identify.starting_torque(made.recordings)
    for name in ("T_s_forward", "T_s_backward"):
        assert fit.estimates.named(name).value == pytest.approx(known.estimates.named(name).value, rel=1e-6)
    assert "recording 0: resolution of motor_angle is not stated: the smallest step found is taken" in fit.notes


def test_exact_mean_ripple_and_spread_and_their_coverage(long):
    covered, spreads = [], []
    for seed in range(100 if long else 12):
        bench = starting_torque(LAW, rate=5e-3, seed=seed)
        fit = identify.starting_torque(bench.recordings)
        for name, near in (("T_s_forward", 1e-3), ("T_s_backward", 1e-3), ("ripple", 0.02)):
            assert fit.estimates.named(name).value == pytest.approx(bench.truth[name], abs=near), (seed, name)
            covered.append(fit.estimates.named(name).covers(bench.truth[name]))
        spreads.append(fit.estimates.named("spread").value)
    assert 0.82 <= np.mean(covered) <= 0.98
    deviation = 1.0 / np.sqrt(2.0 * (24 - 4))  # of a standard deviation from 24 starts less what is fitted to them
    assert np.max(np.abs(np.array(spreads) / 5e-4 - 1.0)) < 3.5 * deviation
    assert np.mean(spreads) == pytest.approx(5e-4, rel=3.0 * deviation / np.sqrt(len(spreads)))


def test_regress_a_short_ramp_is_read_without_the_rest_before_it(long):
    """The least torque is reached after 1.4 s, within the 2 s over which a long ramp is read."""
    errors, covered = [], []
    for seed in range(60 if long else 10):
        bench = starting_torque(FrictionLaw(T_c=0.0024, T_s=0.0032, B=1e-4), inertia=3e-5, spread=2e-5, seed=seed)
        fit = identify.starting_torque(bench.recordings)
        assert fit.numbers["starts"] >= 23
        for name in ("T_s_forward", "T_s_backward"):
            errors.append(fit.estimates.named(name).value / bench.truth[name] - 1.0)
            covered.append(fit.estimates.named(name).covers(bench.truth[name]))
    assert abs(np.mean(errors)) < 0.006
    assert 0.8 <= np.mean(covered) <= 0.98


def test_regress_starts_that_are_passed_over_are_counted_with_the_reason():
    """A starting torque of 2.7 to 3.3 mN m at 3 mN m/s: the ramps end after 0.9 to 1.1 s."""
    law = FrictionLaw(T_c=0.002, T_s=0.003, B=1e-4)
    fit = identify.starting_torque(starting_torque(law, inertia=3e-5, spread=2e-5, rate=3e-3).recordings)
    passed = 24 - fit.numbers["starts"]
    assert 6 < passed < 18
    note = next(note for note in fit.notes if "passed over" in note)
    assert note.startswith(f"{passed} starts are passed over: less than 0.5 of the torque stood 0.5 s before")
    assert note.endswith("ramps of less than 1 s, which need a slower torque")
    fast = starting_torque(law, inertia=3e-5, spread=2e-5, rate=2e-2).recordings
    with pytest.raises(InputError, match=r"no start found .*; 24 starts are passed over: less than 0\.5 of "):
        identify.starting_torque(fast)


def test_against_engine_the_written_drive_starts_at_the_identified_torque(made):
    """Torque just below and just above the identified level, at the angle where the ripple vanishes."""
    fit = identify.starting_torque(made.recordings, base={"terms": [STRIBECK]})
    settings = config.parse(fit.model_text())
    assert settings.model.terms == ("stribeck_friction", "asymmetric_friction", "position_dependent_friction")
    assert settings.drive["breakaway_ratio"] == pytest.approx(4.0 / 3.0, rel=0.01)
    assert settings.drive["friction_ripple"] == pytest.approx(0.1, rel=0.05)
    for name, sign in (("forward", 1.0), ("backward", -1.0)):
        held = sign * fit.estimates.named(f"T_s_{name}").value * 1.1
        for factor, moves in ((0.97, False), (1.03, True)):
            run = hdfast.simulate(
                settings.drive | {"te_scale": 0.0},
                model=settings.model,
                scenario=hdfast.Scenario.start_stop(torque=held * factor, stop=None, t_end=0.5),
                metrics=[],
                signals=["theta_m"],
                t_eval=np.array([0.0, 0.5]),
            )
            assert (abs(run["theta_m"][-1]) > 0.05) == moves


def test_exact_without_sliding_friction_the_level_stands_as_coulomb_torque(made):
    fit = identify.starting_torque(made.recordings[:1])
    settings = config.parse(fit.model_text())
    assert settings.drive["T_c"] == pytest.approx(0.044, rel=0.01)
    text = " ".join(fit.notes)
    assert "one direction only" in text
    assert "stands as Coulomb torque" in text
    assert "<svg" in identify_page.page(fit)


def test_exact_one_start_in_each_direction_tells_neither_scatter_nor_asymmetry():
    fit = identify.starting_torque(starting_torque(LAW, rate=2e-2, angles=1, seed=4).recordings)
    assert fit.numbers["starts"] == 2
    assert {item.sigma for item in fit.estimates} == {np.inf}
    assert [term["effect"] for term in fit.model["terms"]] == ["coulomb_friction"]


def test_exact_declared_effects_of_a_test_that_does_not_find_them_go():
    even = starting_torque(FrictionLaw(T_c=0.03, T_s=0.04), ripple=0.0, rate=5e-3, seed=4)
    ripple = {"effect": "position_dependent_friction"}
    for order, kept in ((2.0, []), (1.0, ["position_dependent_friction"])):
        declared = [{"effect": "asymmetric_friction"}, ripple | {"parameters": {"order": order}}]
        fit = identify.starting_torque(even.recordings, base={"terms": declared})
        assert [item["effect"] for item in fit.model["terms"]] == [*kept, "coulomb_friction"]


def test_exact_a_declared_law_may_state_a_deviation_or_no_friction(made):
    for level, ratio in (({"value": 0.03, "sigma": 0.1}, 4.0 / 3.0), (0.0, None)):
        declared = STRIBECK | {"parameters": STRIBECK["parameters"] | {"T_c": level}}
        law = identify.starting_torque(made.recordings, base={"terms": [declared]}).model["terms"][0]
        assert law["effect"] == ("stribeck_friction" if ratio else "coulomb_friction")
        assert law["parameters"].get("breakaway_ratio") == (pytest.approx(ratio, rel=0.01) if ratio else None)


def test_exact_recordings_without_a_slow_start_are_refused():
    t = np.linspace(0.0, 4.0, 4001)
    moving = {"t": t, "motor_angle": 10.0 * np.maximum(t - 2.0, 0.0) ** 2, "motor_torque": np.where(t < 2.0, 0.0, 0.1)}
    with pytest.raises(InputError, match="no start found"):
        identify.starting_torque(moving)
    with pytest.raises(InputError, match="motor_angle jumps by a whole turn 6 times"):
        identify.starting_torque(moving | {"motor_angle": moving["motor_angle"] % (2.0 * np.pi)})
    with pytest.raises(InputError, match="motor_torque"):
        identify.starting_torque({"t": t, "motor_angle": t})


def test_exact_a_drive_without_friction_has_no_start():
    with pytest.raises(InputError, match="T_s = 0 must be greater than zero"):
        starting_torque(FrictionLaw(T_c=0.0, T_s=0.0))
