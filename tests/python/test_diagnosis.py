"""Diagnoses of simulated drives: the name is right, or nothing is said; and the same bytes every time."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import diagnosed
import hdfast
import numpy as np
import pytest
import small_campaign
from hdfast.checks import Floats
from hdfast.diagnosis import fit as fits
from hdfast.diagnosis import plant
from hdfast.diagnosis.accept import own_gain
from hdfast.diagnosis.extended import extended_model
from hdfast.diagnosis.fit import fit, placed
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.holdout import replayed, weigh_up
from hdfast.diagnosis.limits import EXACT, UNTOLD, untold_gain
from hdfast.diagnosis.lines import Line
from hdfast.diagnosis.metric import Metric
from hdfast.diagnosis.multistart import multistart
from hdfast.diagnosis.plant import DRIVING
from hdfast.diagnosis.prepare import SHAKES
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import CONVINCING
from hdfast.diagnosis.select import lower_valley
from hdfast.diagnosis.session import candidates, nominal, set_up_usable, stands_still, turned
from hdfast.diagnosis.shaken import calmer, exchanged, quieted
from hdfast.diagnosis.slopes import STEP, linearise
from hdfast.diagnosis.structure import Free, Structure
from hdfast.errors import InputError
from hdfast.recordings import load_campaign

EFFECTS = {
    "coulomb_friction": {"T_c": 0.03},
    "gravity_unbalance": {"T_gravity": 4.0},
    "load_dependent_friction": {"c_drive": 0.2, "c_back": 0.2},
}
#: Largest error of a size by its own account, as a share of it.
KNOWN_TO = {"coulomb_friction": 0.1, "gravity_unbalance": 0.1, "load_dependent_friction": 0.4}
SHARES = (
    Free("load_dependent_friction_c_drive", 0.2, 2.0, True, "1"),
    Free("load_dependent_friction_c_back", 1.0, 0.5, True, "1", times="load_dependent_friction_c_drive"),
)


@pytest.mark.long
def test_regress_nothing_is_found_in_a_complete_model(tmp_path: Path) -> None:
    found = hdfast.diagnose(diagnosed.write(tmp_path))
    assert found.verdict == "no_evidence"
    assert found.effects == []


@pytest.mark.long
@pytest.mark.parametrize("effect", EFFECTS)
def test_regress_a_single_effect_is_named_with_its_size(tmp_path: Path, effect: str) -> None:
    found = hdfast.diagnose(diagnosed.write(tmp_path, [effect], EFFECTS[effect], seed=1))
    assert found.verdict == "found"
    assert [one["effect"] for one in found.effects] == [effect]
    estimated = found.effects[0]["parameters"]
    for name, value in EFFECTS[effect].items():
        sigma = estimated[name]["sigma"]
        assert estimated[name]["value"] == pytest.approx(value, rel=0.1, abs=2.0 * sigma)
        assert abs(estimated[name]["value"] - value) < 3.0 * sigma
        assert sigma < KNOWN_TO[effect] * value
    errors = found.to_dict()["fit"]["heldout"]
    assert errors["extended_nrmse"] < 0.55 * errors["baseline_nrmse"]


@pytest.mark.long
def test_regress_friction_is_named_from_the_motor_side_alone(tmp_path: Path) -> None:
    file = diagnosed.write(tmp_path, ["coulomb_friction"], EFFECTS["coulomb_friction"], seed=2, motor_only=True)
    found = hdfast.diagnose(file)
    assert [one["effect"] for one in found.effects] == ["coulomb_friction"]
    reasons = {one["effect"]: one["reason"] for one in found.to_dict()["not_showable"]}
    assert "load angle" in reasons["backlash"]


def test_exact_the_motors_side_shows_the_resonance_of_a_load_that_is_stated(tmp_path: Path) -> None:
    """A rigid drive would leave it; a base that is stated stands, and nothing is made up of a load that is not."""
    file = small_campaign.write(tmp_path, parameters={"J_l": 2.0})
    text = re.sub("load_angle = .*\n", "", file.read_text()).replace("J_l = 0.5", "J_l = 2.0")
    for run in tmp_path.glob("*.npz"):
        columns = dict(np.load(run))
        del columns["load_angle"]
        np.savez(run, **columns)
    left = {}
    for base in ("two_inertia", "one_inertia"):
        stated = "" if base == "two_inertia" else f'base = "{base}"\n'
        file.write_text(text.replace("[drive]\n", f"[drive]\n{stated}"))
        setup = set_up_usable(load_campaign(file), None)
        assert setup.campaign.base == base
        found = fit(setup.replay, nominal(setup))
        left[base] = float(np.sqrt(np.mean(found.mismatch**2))) / setup.replay.floor[0]
    assert left["two_inertia"] < 1.1
    assert left["one_inertia"] > 2.0
    for unknown in ("k1", "J_l"):
        file.write_text(re.sub(f"{unknown} = .*\n", "", text))
        assert set_up_usable(load_campaign(file), None).campaign.base == "one_inertia"


@pytest.mark.parametrize("term", [one.id for one in hdfast.terms() if one.place != "sensor"])
def test_against_engine_the_delivered_torque_is_the_command_but_for_what_drives(term: str) -> None:
    """Torques and speeds are beyond what any of them holds back."""
    t = np.arange(0.0, 1.0, 1e-3)
    seen = {"t": t, "motor_angle": 400.0 * np.sin(4.0 * t), "motor_torque": 9.0 * np.cos(7.0 * t)}
    model = hdfast.Model(base=hdfast.terms()[term].bases[-1], terms=(term,))
    scenario = hdfast.Scenario.replay(seen, input="motor_motion")
    found = hdfast.simulate({}, model=model, scenario=scenario, t_eval=t, signals=["tau_drive"])
    changed = np.abs(np.asarray(found["tau_drive"]) - seen["motor_torque"]).max()
    assert (changed > 1e-3) == (term in DRIVING)
    assert changed < 1e-12 or term in DRIVING


def test_exact_a_load_that_stands_still_is_not_shaken(tmp_path: Path) -> None:
    """A locked output is a load of which no recording is long enough to see the resonance."""
    file = small_campaign.write(tmp_path)
    text = file.read_text()
    period = 2.0 * math.pi * math.sqrt(0.5 / 31020.0)
    free = load_campaign(file)
    assert (stands_still(free, 0.99 * period), stands_still(free, 1.01 * period)) == (True, False)
    assert turned(free, locked=False) == pytest.approx(3e-4 + 0.5 / 121.0**2, rel=1e-12)
    assert turned(free, locked=True) == 3e-4
    file.write_text(text.replace("J_l = 0.5", "J_l = 1e9"))
    locked = set_up_usable(load_campaign(file), None)
    assert locked.replay.floor[0] < 2.0 * set_up_usable(free, None).replay.floor[0]


@pytest.mark.parametrize(("name", "value"), [("k1", 0.0), ("k1", -5.0), ("J_l", -1.0), ("J_m", 0.0)])
def test_exact_a_drive_that_cannot_be_simulated_as_stated_ends_with_a_sentence(
    tmp_path: Path, name: str, value: float
) -> None:
    file = small_campaign.write(tmp_path)
    file.write_text(file.read_text().replace(f"{name} = {small_campaign.DRIVE[name]}", f"{name} = {value}"))
    setup = set_up_usable(load_campaign(file), None)
    named = rf"cannot be simulated along the recorded motion; {name} = {value:g} .* cannot be simulated \(allowed"
    with pytest.raises(InputError, match=named):
        nominal(setup)


def test_exact_a_drive_that_is_too_stiff_to_be_simulated_is_told_where_to_look(tmp_path: Path) -> None:
    file = small_campaign.write(tmp_path)
    file.write_text(file.read_text().replace("J_l = 0.5", "J_l = 1e-13"))
    setup = set_up_usable(load_campaign(file), None)
    with pytest.raises(InputError, match=r"look for an inertia, stiffness or damping of \[drive\]"):
        nominal(setup)


def test_exact_a_line_at_an_order_of_no_drive_has_to_stand_in_two_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), None)
    found = fit(setup.replay, nominal(setup))
    lines = [Line(37.3, 90.0, 0.01, 1), Line(41.3, 60.0, 0.01, 2), Line(4.0, 40.0, 0.01, 1)]
    monkeypatch.setattr("hdfast.diagnosis.session.order_lines", lambda *_: lines)
    orders = {one.order for one in candidates(setup.replay, found, 121.0) if one.effect == "te_harmonic"}
    assert {4.0, 41.3} < orders
    assert 37.3 not in orders


@pytest.mark.long
def test_exact_a_second_line_of_a_torque_is_found_with_the_first(tmp_path: Path) -> None:
    file = diagnosed.write(tmp_path, seed=3)
    for run in tmp_path.glob("*.npz"):
        columns = dict(np.load(run))
        phase = 3.0 * columns["motor_angle"]
        columns["motor_torque"] += 0.03 * np.sin(phase + 0.3) + 0.015 * np.sin(2.0 * phase + 1.1)
        np.savez(run, **columns)
    found = hdfast.diagnose(file)
    assert [one["effect"] for one in found.effects] == ["cogging"]
    assert found.to_dict()["where"]["orders"][:2] == pytest.approx([3.0, 6.0], rel=0.01)
    estimated = found.effects[0]["parameters"]
    assert [estimated[name]["value"] for name in ("T_cog", "T_cog_2")] == pytest.approx([0.03, 0.015], rel=0.1)
    assert f"value = {estimated['T_cog_2']['value']}" in found.model


@pytest.mark.parametrize("name", ["J_m", "load_dependent_friction_c_drive", "load_dependent_friction_c_back"])
def test_exact_the_slope_of_what_multiplies_an_acceleration_holds_none_of_its_noise(tmp_path: Path, name: str) -> None:
    """Slope and what was taken from it make up the difference; the slope is the smooth part of it."""
    campaign = small_campaign.write(tmp_path, angle_noise=1e-4)
    campaign.write_text(campaign.read_text().replace("J_m = 0.0003", "J_m = { value = 2.4e-4, sigma = 0.3 }"))
    setup = set_up_usable(load_campaign(campaign), None)
    replay, structure = setup.replay, nominal(setup)
    if name != "J_m":
        structure = structure.with_terms(["load_dependent_friction"], [], [], {}, SHARES)
    _, slopes, rough = linearise(replay, structure, structure.start)
    j = structure.names.index(name)
    step = STEP * np.eye(len(structure.names))[j]
    lower, higher = replay.mismatch(structure, structure.start + np.stack([-step, step]))
    whole = (lower - higher) / (2.0 * STEP)
    np.testing.assert_allclose(slopes[:, j] + rough[:, j], whole, rtol=1e-9, atol=1e-12)
    where = next(where for _, channel, where in replay.layout.pieces if channel == "motor_torque")
    bends = [np.median(np.abs(np.diff(column[where, j], 2))) for column in (slopes, rough)]
    assert bends[0] < 0.4 * bends[1]


def silenced(replay: Replay) -> Replay:
    """The same recordings with further noises of the angle that are none."""
    units = [replace(unit, noises=((0.0 * unit.t, 0.0 * unit.t),) * SHAKES) for unit in replay.plant.units]
    return replace(replay, plant=replace(replay.plant, units=units))


def test_exact_noise_of_the_angle_is_not_taken_for_damping(tmp_path: Path) -> None:
    """It shakes the simulated load near its resonance, the more the less damping there is; the real one it does not."""
    campaign = small_campaign.write(tmp_path, angle_noise=2e-4)
    true = small_campaign.DRIVE["B_sp"]
    campaign.write_text(campaign.read_text().replace(f"B_sp = {true}", f"B_sp = {{ value = {true}, sigma = 1.0 }}"))
    setup = set_up_usable(load_campaign(campaign), None)
    replay, structure = setup.replay, nominal(setup)
    aware, unaware = (fit(one, structure) for one in (replay, silenced(replay)))
    assert aware.stir.loud
    assert not unaware.stir.loud
    assert abs(np.log(aware.value("B_sp") / true)) < 0.3
    assert unaware.value("B_sp") > 1.5 * true
    changed = replay.shaken[0].mismatch(structure, aware.coordinates[None])[0] - aware.mismatch
    np.testing.assert_allclose(aware.stir.noise, np.where(replay.load_side, changed, 0.0), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("found", "rounds"), [([900.0] * 11 + [0.01], 12), ([900.0] * 7 + [9.0, 9.0], 8), ([900.0] * 40, 32)]
)
def test_exact_a_fit_goes_on_while_a_round_finds_much(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: list[float], rounds: int
) -> None:
    """Far from where it ends it needs more rounds than a fit that creeps may have."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), 1)
    left = list(found)
    monkeypatch.setattr(fits, "_descended", lambda replay, structure, metric, place, *slopes: (place, left.pop(0)))
    fit(setup.replay, nominal(setup))
    assert len(found) - len(left) == rounds


def test_exact_a_second_start_in_the_same_valley_ends_at_the_same_fit_sooner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), None)
    replay, structure = setup.replay, nominal(setup)
    first = fit(replay, structure)
    far = first.coordinates - 3.0 * structure.sigma
    taken = []

    def counted(*arguments: Any) -> Any:
        taken.append(1)
        return linearise(*arguments)

    monkeypatch.setattr("hdfast.diagnosis.fit.linearise", counted)
    counts = []
    for ahead in (None, first):
        taken.clear()
        again = fit(replay, structure, far, ahead=ahead)
        counts.append(len(taken))
        away = (again.coordinates - first.coordinates) / np.sqrt(np.diag(first.covariance(replay.layout)))
        assert np.max(np.abs(away)) < 0.3
    assert counts[1] < counts[0]


def test_exact_a_rigid_drive_has_no_resonance_to_start_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its load inertia and load damping are open, and lead a fit from anywhere to the same place."""
    path = diagnosed.write(tmp_path, ["coulomb_friction"], EFFECTS["coulomb_friction"], seed=2, motor_only=True)
    path.write_text(path.read_text().replace("[drive]", '[drive]\nbase = "one_inertia"', 1))
    setup = set_up_usable(load_campaign(path), None)
    structure = nominal(setup)
    assert {"J_l", "B_l"} <= set(structure.names)
    given = []
    monkeypatch.setattr("hdfast.diagnosis.multistart.fit", lambda *of: given.append(of) or fit(*of))
    found = multistart(setup.replay, structure)
    assert len(given) == 1
    away = structure.start + 1.5 * structure.sigma * np.isin(structure.names, ["J_l", "B_l"])
    other = fit(setup.replay, structure, away)
    sigma = np.sqrt(np.diag(found.covariance(setup.replay.layout)))
    assert np.max(np.abs(other.coordinates - found.coordinates) / sigma) < 0.1


def test_exact_a_calibration_that_is_stuck_is_left_for_the_best_of_other_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A first one whose slopes tell it no way, or that is the higher one. In one valley the first stays."""
    path = small_campaign.write(tmp_path)
    wide = {"J_l = 0.5": "J_l = { value = 0.5, sigma = 0.4 }", "B_sp = 20.0": "B_sp = { value = 20.0, sigma = 15.0 }"}
    for stated, unsure in wide.items():
        path.write_text(path.read_text().replace(stated, unsure))
    setup = set_up_usable(load_campaign(path), None)
    replay, structure = setup.replay, nominal(setup)
    good = fit(replay, structure)
    beside = good.coordinates + 0.5 * structure.sigma * np.isin(structure.names, ["J_l", "B_sp"])
    mismatch = replay.mismatch(structure, beside[None])[0]
    stuck = replace(good, coordinates=beside, mismatch=mismatch, slopes=0.0 * good.slopes, rough=0.0 * good.rough)
    firsts = iter([stuck, good])
    monkeypatch.setattr(
        "hdfast.diagnosis.multistart.fit",
        lambda *given, ahead=None: fit(*given, ahead=ahead) if ahead else next(firsts),
    )
    found = multistart(replay, structure)
    away = (found.coordinates - good.coordinates) / np.sqrt(np.diag(good.covariance(replay.layout)))
    assert np.max(np.abs(away)) < 0.3
    assert multistart(replay, structure) is good
    sigma = np.sqrt(np.diag(good.covariance(replay.layout))) * np.isin(structure.names, ["te_cos_2"])
    aside = good.coordinates + 30.0 * sigma
    higher = replace(good, coordinates=aside, mismatch=replay.mismatch(structure, aside[None])[0])
    assert fit(replay, structure, good.coordinates + 15.0 * sigma, ahead=higher) is not higher


@pytest.mark.parametrize(("side", "away"), [("low", -3.0), ("high", 3.0)])
def test_exact_a_fit_leaves_the_bound_that_it_started_at(tmp_path: Path, side: str, away: float) -> None:
    """Beyond a bound nothing changes, so that a fit that starts or steps there would stay: it ends where others do."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), None)
    structure = nominal(setup)
    at, good = structure.names.index("B_m"), fit(setup.replay, structure)
    free, far = structure.free[at], away * structure.sigma * np.isin(structure.names, ["B_m"])
    bound = {side: float(free.from_coordinate((good.coordinates + far)[at]))}
    bounded = replace(structure, free=tuple(replace(one, **bound) if one is free else one for one in structure.free))
    found = fit(setup.replay, bounded, good.coordinates + 2.0 * far)
    missed = (found.coordinates - good.coordinates) / np.sqrt(np.diag(good.covariance(setup.replay.layout)))
    assert np.max(np.abs(missed)) < 0.3


def test_exact_a_model_in_a_valley_of_its_own_is_fitted_anew_from_where_a_larger_one_left_it(tmp_path: Path) -> None:
    """Whatever is added leads out of the valley, and would be given the credit; in one valley nothing is better."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), None)
    replay, structure = setup.replay, nominal(setup)
    good = fit(replay, structure)
    aside = good.coordinates + 0.3 * np.isin(structure.names, ["J_l", "B_sp"])
    stuck = replace(good, coordinates=aside, mismatch=replay.mismatch(structure, aside[None])[0])
    wider = structure.with_terms(
        [], ["4"], [], {}, [Free(f"te_{wave}_4", 0.0, 1e-5, False, "rad") for wave in ("cos", "sin")]
    )
    larger = fit(replay, wider, np.append(good.coordinates, np.zeros(2)))
    found = lower_valley(replay, stuck, larger)
    assert found is not None
    missed = (found.coordinates - good.coordinates) / np.sqrt(np.diag(good.covariance(replay.layout)))
    assert np.max(np.abs(missed)) < 0.3
    assert lower_valley(replay, good, larger) is None
    assert lower_valley(replay, good, stuck) is None


def test_exact_a_damping_that_only_calms_the_noise_of_the_angle_leads_to_no_lower_valley(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A search that began anew for it would find the same fit again, and screen and try everything anew."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=3e-4)), None)
    replay, structure = setup.replay, nominal(setup)
    good = fit(replay, structure)
    calmer = good.coordinates + 0.3 * np.isin(structure.names, ["B_sp"])
    mismatch, metric = replay.mismatch(structure, calmer[None])[0], Metric.about(replay, good)
    here, there = (
        metric.cost(replay.layout, structure, *pair) for pair in ((good.coordinates, good.mismatch), (calmer, mismatch))
    )
    assert here - there > CONVINCING
    monkeypatch.setattr("hdfast.diagnosis.select.fit", lambda *_: pytest.fail("nothing to fit"))
    assert lower_valley(replay, good, replace(good, coordinates=calmer)) is None


def test_exact_a_model_gains_nothing_of_its_own_beside_itself(tmp_path: Path) -> None:
    """Noise of the angle shakes a damped load less: what it adds is that of the place, and not of the fit's."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=3e-4)), None)
    replay, good = setup.replay, fit(setup.replay, nominal(setup))
    assert good.stir.loud
    np.testing.assert_allclose(placed(replay, good, good.coordinates).stir.noise, good.stir.noise, rtol=0, atol=1e-15)
    calmer = placed(replay, good, good.coordinates + 0.3 * np.isin(good.structure.names, ["B_sp"]))
    own = own_gain(replay, calmer, good, replay.layout.block)
    np.testing.assert_allclose(own.by_block, 0.0, atol=1e-9)


def test_exact_a_fit_that_ends_beside_a_known_one_has_its_slopes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only those of what was added are new, and it ends where a fit of its own does."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=1e-4)), None)
    replay, structure = setup.replay, nominal(setup)
    known = fit(replay, structure)
    waves = [Free(f"te_{wave}_4", 1e-7, 1e-5, False, "rad") for wave in ("cos", "sin")]
    wider = structure.with_terms([], ["4"], [], {}, waves)
    start = np.append(known.coordinates, 1e-7 * np.ones(2))
    kept = []

    def counted(*arguments: Any) -> Any:
        kept.append(arguments[3])
        return linearise(*arguments)

    monkeypatch.setattr("hdfast.diagnosis.fit.linearise", counted)
    beside, own = fit(replay, wider, start, known), fit(replay, wider, start)
    first = len(structure.names)
    assert kept[: kept.index(0)] == [first] * kept.index(0)
    np.testing.assert_array_equal(beside.slopes[:, :first], known.slopes)
    away = (beside.coordinates - own.coordinates) / np.sqrt(np.diag(own.covariance(replay.layout)))
    assert np.max(np.abs(away)) < 0.3


def fast_part_taken(replay: Replay, one: Fit, other: Fit) -> Floats:
    """Fast part of what a fit's torque loses, (N,), with the other's inertias."""
    rows = np.stack([one.coordinates, quieted(replay, one, other)])
    return np.asarray(
        np.subtract(*replay.mismatch(one.structure, rows)) - np.subtract(*replay.steady(one.structure, rows))
    )


def noise_taken(replay: Replay, change: Floats, taken: Floats) -> Floats:
    """Mean square of what a change (N,) takes back of a fast part (N,), in the blocks where that is more."""
    whole, counted = replay.layout.sums(taken**2), replay.layout.sums((taken != 0.0).astype(np.float64))
    share = -replay.layout.sums(change * taken) / np.maximum(whole, 1e-300)
    assert np.max(share) <= 1.0 + 1e-12
    np.testing.assert_allclose(change, -share[replay.layout.block] * taken, atol=1e-9 * np.max(np.abs(taken)))
    more = (share < 1.0 - 1e-9) & (counted > 20)
    return np.asarray(share[more] * whole[more] / counted[more])


def test_exact_models_with_other_inertias_are_compared_with_the_same_noise(tmp_path: Path) -> None:
    """Of what another inertia changes in the fast part of the torque is taken back what noise makes of it."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=1e-4)), None)
    replay, structure = setup.replay, nominal(setup)
    one = fit(replay, structure)
    heavier = one.coordinates + 0.2 * (np.array(structure.names) == "J_m")
    other = replace(one, coordinates=heavier, mismatch=replay.mismatch(structure, heavier[None])[0])
    assert np.max(heavier - quieted(replay, other, one)) > 0.02
    taken = fast_part_taken(replay, other, one)
    noise = noise_taken(replay, exchanged(replay, other, one).change, taken)
    assert len(noise) > 10
    assert np.max(noise) < 3.0 * np.min(noise)
    found, own = replayed(replay, other, one), replay.commanded(other)
    change = found.alike - found.mismatch
    np.testing.assert_allclose(noise_taken(own, change, fast_part_taken(own, other, one)), noise, rtol=0.5)
    assert not exchanged(silenced(replay), other, one).change.any()


def test_exact_a_lighter_motor_gains_nothing_by_being_shaken_less(tmp_path: Path) -> None:
    """Beside the best fit a model loses what is expected: what the exchange leaves of the noise is known by size."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=2e-5)), None)
    replay, structure = setup.replay, nominal(setup)
    one = fit(replay, structure)
    lighter = one.coordinates - 0.02 * (np.array(structure.names) == "J_m")
    other = replace(one, coordinates=lighter, mismatch=replay.mismatch(structure, lighter[None])[0])
    before, after = replayed(replay, one, one), replayed(replay, other, one)
    proof = weigh_up(replay.layout, one.white, before, after, 0.0)
    assert proof.expected.total > 50.0
    assert abs(proof.gain.total + proof.expected.total) < 2.0
    unaware = weigh_up(replay.layout, one.white, *(replace(one, noise=0.0 * one.noise) for one in (before, after)), 0.0)
    assert unaware.gain.total + unaware.expected.total > 3.0


def test_exact_a_share_that_is_a_multiple_of_another_is_left_out_with_it_once(tmp_path: Path) -> None:
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=1e-4)), None)
    replay, structure = setup.replay, nominal(setup)
    one = fit(replay, structure)
    law = structure.with_terms(["load_dependent_friction"], [], [], {}, SHARES)
    shared = np.append(one.coordinates, np.log([0.2, 1.0]))
    other = replace(one, structure=law, coordinates=shared, mismatch=replay.mismatch(law, shared[None])[0])
    assert quieted(replay, other, one)[-1] == shared[-1]
    assert np.all(noise_taken(replay, exchanged(replay, other, one).change, fast_part_taken(replay, other, one)) > 0.0)


def test_exact_a_spring_that_answers_noise_of_the_angle_less_is_calmer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten times as stiff, a spring shakes the load less.

    That of a law counts, what a refit does to the drive's own does not; where a gap rattles, since gains know it else.
    """
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=1e-4)), None)
    replay, structure = setup.replay, nominal(setup)
    one = fit(replay, structure)
    j = structure.names.index("k1")
    given = structure.fixed | {"k1": 10.0 * one.value("k1")}
    law = replace(structure, free=(*structure.free[:j], *structure.free[j + 1 :]), fixed=given)
    stiffer = replace(one, structure=law, coordinates=np.delete(one.coordinates, j))
    refitted = replace(one, coordinates=one.coordinates + np.log(10.0) * (np.arange(len(structure.names)) == j))
    assert calmer(replay, stiffer, one) == 0.0
    monkeypatch.setattr(Structure, "rattles", True)
    assert calmer(replay, one, one) == 0.0
    assert calmer(replay, refitted, one) == 0.0
    assert calmer(replay, stiffer, one) > 10.0
    assert calmer(silenced(replay), stiffer, one) == 0.0


def test_exact_a_torque_that_no_drive_has_is_no_simulation(tmp_path: Path) -> None:
    """A filter of it would overflow."""
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), None)
    structure = nominal(setup)
    absurd = np.where(np.array(structure.names) == "B_m", np.log(1e200), structure.start)
    found = setup.replay.mismatch(structure, np.stack([absurd, structure.start]))
    assert np.isnan(found[0]).all()
    assert np.isfinite(found[1]).all()


@pytest.mark.parametrize("load_side", [True, False])
def test_exact_a_common_factor_of_torque_and_drive_is_told_by_priors_alone(tmp_path: Path, *, load_side: bool) -> None:
    """It changes no signal; slopes that are off by a thousandth would tell it from strong recordings all the same."""
    path = small_campaign.write(tmp_path, ["coulomb_friction"], {"T_c": 0.03})
    path.write_text(f'{path.read_text()}[[terms]]\neffect = "coulomb_friction"\nparameters = {{ T_c = 0.03 }}\n')
    if not load_side:
        for file in tmp_path.glob("r*.npz"):
            columns = dict(np.load(file))
            np.savez(file, **{name: columns[name] for name in columns if name != "load_angle"})
    done = hdfast.calibrate(path)
    layout, known, names = done.setup.replay.layout, done.fit, done.fit.structure.names
    assert known.structure.model.base == "two_inertia"
    scaled = ("torque_scale", "J_m", "J_l", "B_m", "B_l", "B_ml", "B_sp", "k1", "coulomb_friction_T_c")
    way = np.array([float(name in scaled) for name in names])
    prior = np.sum((way / known.structure.sigma) ** 2)
    assert np.sum(known.white(layout, known.slopes @ way) ** 2) < 1e-3 * prior
    assert np.sum((known.stir.whitened(layout, known.white).slopes @ way) ** 2) < 1e-6 * prior
    assert 0.95 < prior * known.covariance(layout)[0, 0] < 1.3
    [told] = untold_gain(known, layout)
    assert told.effect == "torque_gain"
    assert told.reason == UNTOLD


@pytest.mark.parametrize(("drive", "columns", "reason"), [("", ", sigma = 0.0", EXACT), ("sigma = 0.0", "", None)])
def test_exact_the_scale_of_a_torque_is_told_by_what_is_stated_as_exact(tmp_path, drive, columns, reason):
    """By itself, or by the drive: no inertia, damping or stiffness may then make up for it."""
    file = small_campaign.write(tmp_path)
    text = file.read_text().replace(
        "[sensors]", f'[columns]\nmotor_torque = {{ name = "motor_torque"{columns} }}\n[sensors]'
    )
    if drive:
        for name, value in small_campaign.DRIVE.items():
            text = text.replace(f"{name} = {value}\n", f"{name} = {{ value = {value}, {drive} }}\n")
    file.write_text(text)
    done = hdfast.calibrate(file)
    assert [one.reason for one in untold_gain(done.fit, done.setup.replay.layout)] == ([reason] if reason else [])


def test_exact_wide_slopes_are_differences_to_both_sides(tmp_path: Path) -> None:
    setup = set_up_usable(load_campaign(small_campaign.write(tmp_path)), None)
    replay, structure = setup.replay, nominal(setup)
    wide = 0.05 * structure.sigma
    _, slopes, rough = linearise(replay, structure, structure.start, kept=1, wide=wide)
    higher, lower = (replay.mismatch(structure, structure.start + side * np.diag(wide)) for side in (1.0, -1.0))
    expected = -((higher - lower) / (2.0 * wide[:, None])).T
    np.testing.assert_allclose((slopes + rough)[:, 1:], expected[:, 1:], rtol=1e-9, atol=1e-12)
    assert not slopes[:, 0].any()


@pytest.mark.long
@pytest.mark.parametrize("shape", [0.6, 2.0])
def test_exact_sizes_of_a_stribeck_friction_hold_whatever_the_shape_of_its_fall(tmp_path, monkeypatch, shape):
    """It is found with a shape of 1, which would give one of 2 a breakaway 28 % too high, at four errors."""
    small_campaign.shorten_library(monkeypatch, ("coulomb_friction", "stribeck_friction"))
    true = {"T_c": 0.05, "breakaway_ratio": 2.5, "omega_s": 2.0, "stribeck_shape": shape}
    own = {f"stribeck_friction_{name}": value for name, value in true.items()}
    [found] = hdfast.diagnose(small_campaign.write(tmp_path, ["stribeck_friction"], own)).effects
    assert found["effect"] == "stribeck_friction"
    for name, value in true.items():
        told = found["parameters"][name]
        assert abs(told["value"] - value) < 3.0 * told["sigma"]


@pytest.mark.long
def test_exact_same_bytes_on_any_number_of_threads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small_campaign.shorten_library(monkeypatch)
    file = small_campaign.write(tmp_path, ["coulomb_friction"], EFFECTS["coulomb_friction"])
    one, two = (hdfast.diagnose(file, threads=threads) for threads in (1, 2))
    assert json.dumps(one.to_dict()) == json.dumps(two.to_dict())
    assert one.model == two.model


def test_exact_rejected_recordings_give_the_reason(tmp_path: Path) -> None:
    file = diagnosed.write(tmp_path)
    for run in tmp_path.glob("*.npz"):
        columns = dict(np.load(run))
        columns["motor_angle"] = np.zeros_like(columns["t"])
        np.savez(run, **columns)
    found = hdfast.diagnose(file)
    assert found.verdict == "data_rejected"
    assert "run0.npz" in found.to_dict()["sentence"]
    json.dumps(found.to_dict(), allow_nan=False)


def test_exact_a_campaign_that_holds_everything_out_is_told_what_is_missing(tmp_path: Path) -> None:
    path = small_campaign.write(tmp_path)
    entries = path.read_text().replace('role = "fit"\n', "").replace('role = "heldout"\n', "")
    path.write_text(entries.replace("[[recording]]\n", '[[recording]]\nrole = "heldout"\n'))
    found = hdfast.diagnose(path)
    assert found.verdict == "data_rejected"
    assert 'No recording has the role "fit"' in found.to_dict()["sentence"]


@pytest.mark.parametrize("torque", [0.5, 0.1])
def test_exact_a_torque_that_stays_is_refused_whatever_its_mean_is_rounded_to(tmp_path: Path, torque: float) -> None:
    path = small_campaign.write(tmp_path)
    for run in tmp_path.glob("*.npz"):
        columns = dict(np.load(run))
        np.savez(run, **columns | {"motor_torque": np.full_like(columns["t"], torque)})
    with pytest.raises(InputError, match="motor_torque is constant"):
        hdfast.diagnose(path)


@pytest.mark.long
def test_exact_steps_are_allowed_by_how_long_a_recording_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And what is held out proves nothing where the drive cannot be simulated along it."""
    small_campaign.shorten_library(monkeypatch)
    path = small_campaign.write(tmp_path)
    for number in range(3):
        columns = dict(np.load(tmp_path / f"r{number}.npz"))
        np.savez(tmp_path / f"r{number}.npz", **{name: values[:750] for name, values in columns.items()})
    monkeypatch.setattr(plant, "MOST_STEPS", 1)
    assert hdfast.diagnose(path).evidence.session.held is not None  # type: ignore[union-attr]
    monkeypatch.setattr(plant, "MOST_STEPS", 2200)
    monkeypatch.setattr(plant, "STEPS_PER_SECOND", 0)
    found = hdfast.diagnose(path)
    assert found.evidence is not None
    assert found.evidence.session.held is None
    assert any("cannot be simulated along what is held out" in note for note in found.content["notes"])


def test_exact_what_is_known_exactly_stays_so_in_the_model(tmp_path: Path) -> None:
    path = small_campaign.write(tmp_path)
    path.write_text(path.read_text().replace("J_l = 0.5", "J_l = { value = 0.5, sigma = 0 }"))
    setup = set_up_usable(load_campaign(path), None)
    start = fit(setup.replay, nominal(setup))
    pool = [one.added_to(start.structure) for one in candidates(setup.replay, start, 121.0)]
    structure = next(one for one in pool if "viscoelastic_tau_long" in one.fixed or "tau_long" in one.fixed)
    values = {free.name: free.value for free in structure.free}
    (tmp_path / "model.toml").write_text(extended_model(setup.campaign, structure, values, dict.fromkeys(values, 0.01)))
    known = load_campaign(tmp_path / "model.toml").priors
    assert known["J_l"].sigma == known["tau_long"].sigma == 0.0
    assert known["J_m"].sigma == pytest.approx(0.01)
    assert known["te_cos_2"].sigma == 0.01


def test_exact_motion_that_nothing_can_be_judged_on_is_refused(tmp_path: Path) -> None:
    path = small_campaign.write(tmp_path)
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 3.0, 0.01)
    for number in range(4):
        shaken = 0.5 * np.sin(2.0 * np.pi * 8.0 * t) + 0.02 * rng.standard_normal(len(t))
        np.savez(tmp_path / f"r{number}.npz", t=t, motor_angle=shaken, motor_torque=rng.standard_normal(len(t)))
    with pytest.raises(hdfast.InputError, match=r"r0\.npz, r1\.npz, r2\.npz: no sample can be judged"):
        hdfast.diagnose(path)
