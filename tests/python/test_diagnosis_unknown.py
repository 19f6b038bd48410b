"""A mismatch without a name: which state variable it follows, with which memory, and where it acts."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import diagnosed
import numpy as np
import pytest
import small_campaign
from hdfast.diagnosis import content, diagnose, verdict
from hdfast.diagnosis.features import Feature, features, slowed
from hdfast.diagnosis.fit import fit
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.regressors import DAMPING, aged, bumps, positions, ramps, resonances
from hdfast.diagnosis.score import Gain
from hdfast.diagnosis.session import nominal, set_up_usable
from hdfast.diagnosis.unknown import Unknown, describe
from hdfast.model import Model
from hdfast.recordings import load_campaign
from scipy import integrate

RATE = 500.0
LAWS = {
    "gravity_unbalance": ({"T_gravity": 4.0, "psi": 0.4}, "load_phase", "none", "load"),
    "coulomb_friction": ({"T_c": 0.03}, "direction", "none", "motor"),
}
TRUE = {
    "gravity_unbalance": lambda angle: 4.0 * np.sin(angle + 0.4),
    "coulomb_friction": lambda direction: 0.03 * direction,
}


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """Replay and fit of a complete drive."""
    campaign = load_campaign(small_campaign.write(tmp_path_factory.mktemp("complete")))
    setup = set_up_usable(campaign, None)
    return setup.replay, fit(setup.replay, nominal(setup))


@pytest.mark.parametrize("law", ["coulomb_friction", pytest.param("gravity_unbalance", marks=pytest.mark.long)])
def test_regress_a_law_that_the_library_lacks_is_described_without_a_name(tmp_path, monkeypatch, law):
    values, variable, memory, place = LAWS[law]
    small_campaign.shorten_library(monkeypatch, ())
    found = diagnose(diagnosed.write(tmp_path, [law], {f"{law}_{name}": own for name, own in values.items()}))
    assert found.verdict == "depends_on"
    where = found.content["where"]
    assert (where["depends_on"], where["memory"], where["place"]) == ([variable], memory, place)
    errors = found.content["fit"]["heldout"]
    assert errors["extended_nrmse"] < 0.7 * errors["baseline_nrmse"]
    evidence = found.effects[0]["evidence"]
    true = TRUE[law](np.array(evidence[variable]))
    np.testing.assert_allclose(
        evidence["torque_N_m"], true - np.mean(true) + np.mean(evidence["torque_N_m"]), atol=0.15 * np.ptp(true)
    )


@pytest.mark.long
def test_regress_a_complete_drive_without_names_is_quiet(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch, ())
    assert diagnose(small_campaign.write(tmp_path)).verdict == "no_evidence"


@pytest.mark.long
def test_exact_a_drag_that_a_drive_loses_as_it_warms_up_is_described(tmp_path):
    """No temperature is recorded; every recording begins cold."""
    path = small_campaign.write(tmp_path)
    for number in range(4):
        columns = dict(np.load(tmp_path / f"r{number}.npz"))
        speed = np.gradient(columns["motor_angle"], columns["t"])
        smooth = np.convolve(speed, np.ones(25) / 25.0, "same")
        columns["motor_torque"] += 1.2e-3 * smooth * np.exp(-columns["t"] / 1.0)
        np.savez(tmp_path / f"r{number}.npz", **columns)
    found = diagnose(path)
    assert found.verdict == "depends_on"
    where = found.content["where"]
    assert (where["depends_on"], where["memory"], where["place"]) == (["time_since_start"], "fading", "motor")
    assert "as in a drive that warms up" in found.content["sentence"]
    errors = found.content["fit"]["heldout"]
    assert errors["extended_nrmse"] < 0.6 * errors["baseline_nrmse"]


@pytest.mark.long
def test_exact_a_law_that_is_refused_elsewhere_is_undecided(tmp_path, monkeypatch):
    """The drive has dry friction in the fitted recordings and none in the one that is held out; it has no name."""
    small_campaign.shorten_library(monkeypatch, ())
    told = diagnose(small_campaign.write_without_in_held_out(tmp_path, ["coulomb_friction"], {"T_c": 0.05})).to_dict()
    assert told["verdict"] == "undecided"
    assert "something depends on direction is beyond doubt where it was fitted" in told["sentence"]
    assert told["effects"] == []


@pytest.mark.long
def test_exact_recordings_that_stay_away_from_an_end_cannot_refuse_what_is_there(tmp_path, monkeypatch):
    """A spring of 5 N m/rad that two fitted recordings reach; what is held out goes the other way."""
    small_campaign.shorten_library(monkeypatch, ())
    path = small_campaign.write(tmp_path)
    for number in range(4):
        columns = dict(np.load(tmp_path / f"r{number}.npz"))
        torque = 5.0 * np.maximum(columns["load_angle"] - 0.12, 0.0)
        assert torque.any() == (number < 2)
        columns["motor_torque"] += torque / 121.0
        columns["load_angle"] -= torque / small_campaign.DRIVE["k1"]
        np.savez(tmp_path / f"r{number}.npz", **columns)
    found = diagnose(path)
    assert (found.content["where"]["depends_on"], found.content["where"]["memory"]) == (["load_phase"], "none")
    unknown = found.evidence.unknown
    assert unknown.proof.expected.total == 0.0
    against = replace(unknown.proof.gain, by_block=np.full(20, -0.5))
    assert replace(unknown, proof=replace(unknown.proof, gain=against)).accepted


@pytest.mark.parametrize(
    ("after", "gained", "accepted", "refused"),
    [(0.503, 8.0, True, False), (0.52, 8.0, False, True), (0.503, -8.0, False, True), (0.45, 8.0, True, False)],
)
def test_exact_a_description_that_shows_may_miss_by_two_percent_more(after, gained, accepted, refused):
    """Its whitened gain of 160 nats tells more than an error that something else makes."""
    errors = (after, 0.5)
    told, nothing = Gain(np.full(20, gained), errors), np.zeros(1)
    proof = Proof(0.5, after, 0.1, told, Gain(np.full(20, 8.0), errors), 60.0, (nothing, nothing))
    fitted = Gain(np.full(20, 5.0), (0.4, 0.5))
    found = Unknown(None, 2.0, None, fitted, 0.9, (), None, proof)
    assert (found.accepted, found.refused) == (accepted, refused)


@pytest.mark.parametrize(("after", "fall", "told"), [(0.49, 0.02, False), (0.47, 0.02, True), (0.49, 0.06, True)])
def test_exact_what_hardly_lowers_the_error_is_not_described(after, fall, told):
    """However sure: a command held between two samples, or a clock, follows the motion as well."""
    sure = Gain(np.full(20, 5.0), (after, 0.5), fall)
    assert Unknown(None, 3.0, None, sure, 0.9, (), None, None).accepted == told


@pytest.mark.parametrize("base", ["one_inertia", "two_inertia"])
@pytest.mark.parametrize("place", ["motor", "load"])
def test_exact_a_curve_says_on_which_side_of_the_gear_it_counts(base, place):
    """Where motor and load are one inertia it has no place, and would be open by a factor of the ratio."""
    feature = Feature("load_phase", "none", place, None, np.sin, np.ones(1))
    fitted = SimpleNamespace(structure=SimpleNamespace(model=Model(base=base)))
    curve = np.array([0.1, 0.2]), np.array([3.0, -3.0])
    one = Unknown(feature, 2.0, fitted, Gain(np.full(20, 5.0), (0.4, 0.5)), 0.9, (), curve, None)
    assert one.noted["torque_at"] == place
    assert one.noted.get("place") == (place if base == "two_inertia" else None)
    assert content._unknown_effect(one, ())["evidence"]["torque_at"] == place
    remembering = replace(one, curve=None)
    assert "torque_at" not in remembering.noted
    assert "torque_at" not in content._unknown_effect(remembering, ())["evidence"]


def test_exact_a_slow_torque_behind_the_gear_is_felt_everywhere_at_once(complete):
    """Simulated through the drive, a torque over the position arrives at the motor, in the windup and in between."""
    replay, fitted = complete
    slow = slowed(replay)
    one = next(one for one in features(replay, slow, fitted) if one.name == "load_phase" and one.place == "load")
    whole, quick = (of(replay, slow, fitted) for of in (one.columns, one.sketch))
    for unit, channel, where in replay.layout.pieces:
        if unit == 2:
            far = np.abs(whole[where] - quick[where])
            assert np.median(far) < 0.1 * np.ptp(whole[where]), channel


def test_exact_of_white_noise_nothing_is_described(complete):
    replay, fitted = complete
    noise = fitted.weights.scale[replay.layout.channel] * np.random.default_rng(2).standard_normal(replay.layout.size)
    assert describe(replay, None, replace(fitted, mismatch=noise), np.random.default_rng(1)) is None


@pytest.mark.long
def test_exact_a_torque_at_one_place_is_described_as_one(complete):
    """A doublet 0.02 rad wide that the output passes, twelve noise deviations of the windup high."""
    replay, fitted = complete
    slow = slowed(replay)
    whole = np.concatenate([unit.turned for unit in slow])
    place = float(np.quantile(whole, 0.6))

    def doublet(unit):
        x = (unit.turned - place) / 0.02
        return (x * np.exp(0.5 - 0.5 * x * x))[:, None]

    one = Feature("load_phase", "none", "load", None, doublet, np.ones(1))
    added = one.columns(replay, slow, fitted)[:, 0]
    seen = np.max(np.abs(fitted.white(replay.layout, added)))
    shown = replace(fitted, mismatch=fitted.mismatch + 12.0 / seen * added)
    found = describe(replay, None, shown, np.random.default_rng(1))
    assert found.accepted
    assert (found.feature.name, found.feature.memory, found.feature.place) == ("load_phase", "none", "load")
    angle, torque = found.curve
    far = np.abs(angle - place) > 0.15
    assert np.ptp(torque[far]) < 0.2 * np.ptp(torque)


def test_exact_shapes_at_one_place(complete):
    replay, _ = complete
    units = replay.plant.units
    near = bumps(units, 24)
    low, high = (pick(pick(unit.turned) for unit in units) for pick in (min, max))
    width = (high - low) / 24
    for unit in units:
        told = near[12](unit)
        away = np.abs(unit.turned - (low + high) / 2.0)
        np.testing.assert_allclose(told[away < 0.5e-3 * width].sum(axis=1), 1.0, atol=1e-3)
        assert np.all(told[away > 3.0 * width] == 0.0)
    above, below = ramps(units)[:2]
    edge = low + width
    np.testing.assert_allclose((above(units[0]) - below(units[0]))[:, 0], units[0].turned - edge, atol=1e-12)


def test_exact_what_is_built_up_at_rest_wears_off_in_motion(complete):
    replay, _ = complete
    unit = replay.plant.units[0]
    t = np.arange(2000) / RATE
    moving = replace(unit, t=t, speed=np.where(t < 1.0, 0.0, -3.0))
    found = aged(0.2, RATE)(moving)[:, 0]
    assert np.all(found[t < 1.0] == 0.0)
    np.testing.assert_allclose(found[t >= 1.0], -np.exp(-(t[t >= 1.0] - 1.0 + 1.0 / RATE) / 0.2), rtol=1e-9)


def test_against_lsoda_a_mass_on_a_spring_answers_a_shake(complete):
    replay, _ = complete
    t = np.arange(1000) / RATE
    shaken = replace(replay.plant.units[0], t=t, acceleration=np.sin(9.0 * t))
    w = 2.0 * np.pi * 2.0

    def swing(time, y):
        return [y[1], np.sin(9.0 * time) - 2.0 * DAMPING * w * y[1] - w**2 * y[0]]

    exact = integrate.solve_ivp(swing, (0.0, t[-1]), [0.0, 0.0], method="LSODA", t_eval=t, rtol=1e-9, atol=1e-12).y
    found = resonances(2.0, RATE)(shaken)
    np.testing.assert_allclose(found[:, 0], w**2 * exact[0], atol=0.01 * np.max(np.abs(found[:, 0])))
    np.testing.assert_allclose(found[:, 1], w * exact[1], atol=0.01 * np.max(np.abs(found[:, 1])))


def test_exact_positions_share_out_one_everywhere(complete):
    replay, _ = complete
    units = replay.plant.units
    over = positions(units, 6)
    for unit in units:
        np.testing.assert_allclose(over(unit).sum(axis=1), 1.0, rtol=1e-12)
    turning = [replace(unit, angle=8.0 * np.pi * unit.ratio * unit.t / unit.t[-1]) for unit in units]
    again = [replace(unit, angle=unit.angle - 2.0 * np.pi * unit.ratio) for unit in turning]
    np.testing.assert_allclose(positions(turning, 6)(turning[0]), positions(turning, 6)(again[0]), atol=1e-6)


@pytest.mark.parametrize(
    ("effect", "place", "failed", "p", "told"),
    [
        ("gravity_unbalance", "load", ("A1 gain",), 0.001, ["gravity_unbalance"]),
        ("gravity_unbalance", "load", ("A1 gain",), 0.02, []),
        ("gravity_unbalance", "load", ("A1 gain", "A2 error"), 0.001, []),
        ("encoder_eccentricity", "sensor", ("A1 gain",), 0.001, []),
        ("load_side_friction", "load", ("A1 gain",), 0.001, []),
    ],
)
def test_exact_a_known_effect_that_acts_so_may_be_it(effect, place, failed, p, told):
    trial = SimpleNamespace(failed=failed, candidate=SimpleNamespace(effect=effect, place=place, label=effect))
    last = SimpleNamespace(trials=[trial], screen=SimpleNamespace(p={effect: p}))
    session = SimpleNamespace(search=SimpleNamespace(rounds=[last]))
    unknown = SimpleNamespace(
        feature=SimpleNamespace(name="load_phase", memory="none"), place="load", fit=None, proof=None
    )
    claim = verdict.Claim("depends_on", "", session, [], unknown)
    assert claim.alike == told
    assert claim.sentence.startswith(
        "Could be gravity_unbalance, but not for sure: a torque at the load"
        if told
        else "None of the known effects: a torque at the load"
    )
