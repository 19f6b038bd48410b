"""Campaigns with a part missing, and what is written for those who read the verdict by program."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_campaign
from hdfast.diagnosis import content, diagnose, prove, session
from hdfast.diagnosis.accept import sizeable, special
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.extended import extended_model
from hdfast.diagnosis.facts import FACTS
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.lesser import Lesser
from hdfast.diagnosis.library import OF_THE_WINDUP, Sizes, library
from hdfast.diagnosis.limits import NEEDS_TEMPERATURE, RIGID, SILENT, Limit, limits, unseen
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.resolution import unresolved
from hdfast.diagnosis.rivals import stand
from hdfast.diagnosis.score import Gain
from hdfast.diagnosis.screen import Screen, Signature
from hdfast.diagnosis.session import set_up_usable
from hdfast.diagnosis.shapes import in_every_sensor, positive
from hdfast.diagnosis.stages import Stages
from hdfast.diagnosis.stir import Stir
from hdfast.diagnosis.structure import Free, Structure
from hdfast.diagnosis.trials import Round, Search, Trial
from hdfast.errors import InputError
from hdfast.health import check
from hdfast.model import Model
from hdfast.recordings import load_campaign
from simulated_recordings import campaign
from threadpoolctl import threadpool_info, threadpool_limits


def without_column(path, name, column):
    columns = dict(np.load(path.parent / name))
    del columns[column]
    np.savez(path.parent / name, **columns)


def test_exact_held_out_channels_that_nothing_was_fitted_on_are_left_aside(tmp_path):
    path = small_campaign.write(tmp_path)
    for number in range(3):
        without_column(path, f"r{number}.npz", "load_angle")
    setup = set_up_usable(load_campaign(path), None)
    assert setup.held.layout.channels == setup.replay.layout.channels == ("motor_torque",)
    assert {channel for _, channel, _ in setup.held.layout.pieces} == {"motor_torque"}


@pytest.mark.long
def test_exact_held_out_recordings_may_lack_a_channel(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch)
    path = small_campaign.write(tmp_path, ["coulomb_friction"], {"T_c": 0.05})
    without_column(path, "r3.npz", "load_angle")
    assert diagnose(path).verdict == "found"


@pytest.mark.long
def test_exact_a_held_out_standstill_proves_nothing_and_is_told(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch)
    path = small_campaign.write(tmp_path, ["coulomb_friction"], {"T_c": 0.05})
    for number in range(4):
        without_column(path, f"r{number}.npz", "load_angle")
        columns = dict(np.load(tmp_path / f"r{number}.npz"))
        resting = columns["t"] > 2.0
        columns["motor_angle"][resting] = columns["motor_angle"][resting][0]
        np.savez(tmp_path / f"r{number}.npz", **columns)
    text = re.sub('group = "."', 'group = "same"', path.read_text().replace('role = "heldout"', 'role = "fit"'))
    path.write_text(text)
    found = diagnose(path)
    assert found.verdict == "found"
    assert any("no sample of what is held out can be judged" in note for note in found.content["notes"])


def test_exact_an_extended_model_keeps_a_declared_sensor_effect_in_place_of_a_stated_fact(tmp_path):
    path = small_campaign.write(tmp_path)
    stated = "load_angle = { resolution = 6e-6, delay_s = 1e-3 }"
    declared = 'effect = "sensor_delay"\nchannel = "load_angle"\nparameters = { tau_y = 4e-3 }'
    text = path.read_text().replace("load_angle = { resolution = 6e-6 }", stated)
    path.write_text(f"{text}[[terms]]\n{declared}\n")
    campaign = load_campaign(path)
    structure = session.baseline(campaign, 0.05, 0.002)
    written = extended_model(
        campaign, structure, {one.name: one.value for one in structure.free}, dict.fromkeys(structure.names, 0.1)
    )
    (tmp_path / "again.toml").write_text(written)
    again = session.baseline(
        replace(load_campaign(tmp_path / "again.toml"), recordings=campaign.recordings), 0.05, 0.002
    )
    assert structure.fixed["load_angle_sensor_delay_tau_y"] == 4e-3
    assert again.fixed["load_angle_sensor_delay_tau_y"] == 4e-3


def test_exact_a_drift_of_the_torques_zero_grows_with_the_scale_of_its_column(tmp_path):
    path = small_campaign.write(tmp_path)
    drift = "parameters = { offset = 0.01, drift = { value = 5e-3, sigma = 0.5 } }"
    path.write_text(f'{path.read_text()}[[terms]]\neffect = "sensor_offset_drift"\nchannel = "motor_torque"\n{drift}\n')
    campaign = load_campaign(path)
    structure = session.baseline(campaign, 0.05, 0.002)
    values = {one.name: one.value for one in structure.free} | {"torque_scale": 1.1}
    (tmp_path / "again.toml").write_text(
        extended_model(campaign, structure, values, dict.fromkeys(structure.names, 1e-3))
    )
    again = load_campaign(tmp_path / "again.toml")
    [effect] = again.drive.effects
    assert again.columns["motor_torque"].scale == pytest.approx(1.1)
    assert effect.values == pytest.approx({"offset": 0.011, "drift": 5.5e-3})
    assert effect.sigma["drift"] == pytest.approx(1.1e-3)


@pytest.mark.long
def test_exact_an_extended_model_is_read_back_with_its_sensors(tmp_path, monkeypatch):
    """Its nominal model predicts the same recordings as the extended one did."""
    small_campaign.shorten_library(monkeypatch)
    path = small_campaign.write(tmp_path)
    for number in range(4):
        columns = dict(np.load(tmp_path / f"r{number}.npz"))
        columns["load_angle"] = columns["load_angle"] + 6e-5 * np.sin(columns["load_angle"] + 0.3)
        columns["load_angle"] = np.round(columns["load_angle"] / 6e-6) * 6e-6
        np.savez(tmp_path / f"r{number}.npz", **columns)
    found = diagnose(path)
    assert found.verdict == "sensor"
    listed = {one["effect"] for one in found.content["not_showable"] + found.content["detectable"]}
    assert "encoder_eccentricity" not in listed
    (tmp_path / "again.toml").write_text(found.model)
    again = load_campaign(tmp_path / "again.toml")
    kept = found.evidence.session.search.final
    reread = session.baseline(replace(again, recordings=load_campaign(path).recordings), 0.05, 0.002)
    assert reread.sensors == kept.structure.sensors == (("encoder_eccentricity", "load_angle"),)
    name = "load_angle_encoder_eccentricity_eccentricity"
    assert reread.fixed[name] == pytest.approx(kept.value(name), rel=1e-9)


@pytest.mark.long
def test_regress_a_stiff_coupling_is_told_as_detectable(tmp_path, monkeypatch):
    """Of a stiffness, what is seen is every smaller one."""
    small_campaign.shorten_library(monkeypatch, ("load_compliance",))
    found = diagnose(small_campaign.write(tmp_path))
    assert "load_compliance" not in [one["effect"] for one in found.content["not_showable"]]
    seen = found.content["detectable"][0]
    assert seen["effect"] == "load_compliance"
    assert seen["minimum_detectable"] > small_campaign.DRIVE["k1"]


@pytest.mark.parametrize(
    ("holds", "refutes", "together", "kept"),
    [
        ((True, True, True), False, False, 3),
        ((False, True, True), False, False, 3),
        ((False, True, True), True, False, 0),
        ((False, True, True), True, True, 3),
        ((True, False, True), False, False, 1),
        ((False, True, False), False, False, 2),
    ],
)
def test_exact_a_search_is_taken_back_to_what_holds(monkeypatch, holds, refutes, together, kept):
    """Models are numbered by their effects; every pair of neighbours has its own proof, and all of them have one."""
    nothing = Gain(np.zeros(2), (1.0, 1.0))

    class Said(Proof):
        def __new__(cls, first, last):
            return object.__new__(cls)

        def __init__(self, first, last):
            super().__init__(1.0, 1.0, 0.1, nothing, 0.0, 0.0, (np.zeros(1), np.zeros(1)))
            object.__setattr__(self, "span", (first, last))

        @property
        def holds(self):
            return holds[self.span[0]] if self.span[1] == self.span[0] + 1 else True

        @property
        def refutes(self):
            return refutes and self.span == (0, 1)

        @property
        def shows(self):
            return together and self.span == (0, len(holds))

    class Model(int):
        white = mismatch = None

    class Trial:
        gain = nothing

        def __init__(self, number):
            self.candidate = SimpleNamespace(label=f"effect {number}", effect="coulomb_friction")

    class Round:
        def __init__(self, number):
            self.before, self.accepted, self.trials = Model(number), Trial(number), []
            self.screen = SimpleNamespace(p={f"effect {number}": 1.0})

    monkeypatch.setattr(prove, "noise_floor", lambda held: 0.1)
    monkeypatch.setattr(prove, "nrmse", lambda layout, mismatch: 1.0)
    monkeypatch.setattr(prove, "replayed", lambda held, model, reference: model)
    monkeypatch.setattr(prove, "weigh_up", lambda layout, white, before, after, *rest: Said(int(before), int(after)))
    monkeypatch.setattr(prove, "_without", lambda *given: None)
    monkeypatch.setattr(Search, "until", lambda found, number: number)

    class Held:
        layout = None

    rounds = [Round(number) for number in range(3)]
    whole = Search(rounds, Model(3), [one.accepted for one in rounds])
    found, proof, shown = prove.proven(None, Held(), whole)
    assert list(shown) == [f"effect {number}" for number in range(kept)]
    assert (3 if found is whole else found) == kept
    assert proof.span == (0, kept)


@pytest.mark.parametrize(
    ("effect", "failed", "gained", "confirms", "holds", "error", "named"),
    [
        ("coulomb_friction", ("A1 gain", "A2 error"), 9.0, True, True, 0.9, True),
        ("coulomb_friction", ("A2 error",), 9.0, True, True, 0.9, True),
        ("coulomb_friction", ("A2 error",), 9.0, True, True, 1.0, False),
        ("coulomb_friction", ("A2 error",), 9.0, True, False, 0.9, False),
        ("coulomb_friction", ("A1 gain",), 9.0, False, True, 0.9, False),
        ("coulomb_friction", ("A1 gain", "A9 noise"), 9.0, True, True, 0.9, False),
        ("coulomb_friction", ("A1 gain",), -9.0, True, True, 0.9, False),
        ("sensor_delay", ("A1 gain",), 9.0, True, True, 0.9, False),
        ("clock_skew", ("A1 gain",), 9.0, True, True, 0.9, False),
    ],
)
def test_exact_a_faint_effect_stands_where_what_is_held_out_confirms_it(
    monkeypatch, effect, failed, gained, confirms, holds, error, named
):
    """Its chance in the screen goes into that, and the error falls with it; what failed otherwise, or is alike in all
    recordings, is not asked."""
    errors = (1.0, 1.0)
    weighed = []

    def weigh_up(layout, white, before, after, floor, margin=0.0, p=1.0, outset=None):
        weighed.append(p)
        expected = Gain(np.full(9, 0.5 * confirms), errors)
        return Proof(1.0, error, 0.1, Gain(np.full(9, 1.0), errors), expected, 0.0, (), p)

    model = SimpleNamespace(white=None, structure=None, coordinates=None, mismatch=None)
    trial = Trial(SimpleNamespace(effect=effect, label=effect), model, Gain(np.full(9, gained / 9.0), errors), failed)
    first = Round(model, [], [], [], SimpleNamespace(p={effect: 2e-3}), [trial], None)
    for name in ("noise_floor", "replayed", "settled"):
        monkeypatch.setattr(prove, name, lambda *given: model)
    monkeypatch.setattr(prove, "nrmse", lambda layout, mismatch: 1.0)
    monkeypatch.setattr(prove, "weigh_up", weigh_up)
    monkeypatch.setattr(Proof, "confirms", property(lambda proof: confirms))
    monkeypatch.setattr(Proof, "holds", property(lambda proof: holds))
    monkeypatch.setattr(Proof, "speaks_alone", False)
    replay = SimpleNamespace(commanded=lambda fitted: None, layout=None)
    found = prove.proven(replay, replay, Search([first], model, []))[0]
    assert [one.candidate.effect for one in found.accepted] == [effect] * named
    assert all(one.confirmed and not one.failed for one in found.accepted)
    asked = named or not confirms or not holds or error == 1.0
    assert (2e-3 in weighed) == asked


@pytest.mark.parametrize(("stated", "complaint"), [("J_l = 0.0", "cannot be simulated"), ("ratio = 0", "ratio = 0")])
def test_exact_a_drive_that_cannot_be_is_told(tmp_path, stated, complaint):
    path = small_campaign.write(tmp_path)
    key = stated.split(" =", maxsplit=1)[0]
    path.write_text(re.sub(rf"^{key} = .*$", stated, path.read_text(), flags=re.MULTILINE))
    with pytest.raises(InputError, match=complaint):
        diagnose(path)


@pytest.mark.parametrize("seed", [-1, 1.5, 2**63, "0"])
def test_exact_a_seed_that_cannot_be_is_refused_before_the_run(tmp_path, seed):
    with pytest.raises(InputError, match="seed = "):
        diagnose(tmp_path / "there_is_none.toml", seed=seed)


def test_exact_a_detent_is_told_in_newton_metres_whatever_scale_the_torque_is_recorded_in(tmp_path):
    path = small_campaign.write(tmp_path, ["cogging"], {"T_cog": 0.03})
    for number in range(4):
        columns = dict(np.load(tmp_path / f"r{number}.npz"))
        asked = columns["motor_torque"] - 0.03 * np.sin(24.0 * columns["motor_angle"])
        np.savez(tmp_path / f"r{number}.npz", **columns | {"motor_torque": asked / 1.5})
    setup = set_up_usable(load_campaign(path), None)
    detent = Free("cogging_T_cog", 0.03, 1.0, True, "N m")
    structure = session.nominal(setup).with_terms(["cogging"], (), (), {}, [detent])
    at = structure.start
    at[structure.names.index("torque_scale")] = np.log(1.5)
    slow = setup.replay.plant.units[2]
    left = setup.replay.plant.mismatch(structure, at[None])[2]["motor_torque"][0]
    assert np.std(left[slow.judged["motor_torque"]]) < 0.1 * 0.03 / 1.5


def test_exact_effects_of_the_windup_are_those_a_rigid_drive_has_none_of():
    sizes = Sizes(
        motor_torque=0.1, speed=100.0, stiffness=3e4, ratio=121.0, corner=100.0, elastic=True, loaded=True, warm=True,
        orders=(), detents=None, turns=50.0, lines=(), tones=(), channels=("motor_torque", "load_angle"),
    )  # fmt: skip
    effects = [{one.effect for one in library(replace(sizes, elastic=elastic))} for elastic in (True, False)]
    assert effects[0] - effects[1] == set(OF_THE_WINDUP)
    alone = {one.effect for one in library(replace(sizes, channels=("motor_torque",)))}
    assert alone & set(OF_THE_WINDUP) == {"load_side_friction"}


def test_exact_what_is_held_fixed_has_a_unit_too():
    sizes = Sizes(
        motor_torque=0.1, speed=100.0, stiffness=3e4, ratio=121.0, corner=100.0, elastic=True, loaded=True, warm=True,
        orders=(), detents=None, turns=50.0, lines=(), tones=(5.0,), channels=("motor_torque", "load_angle"),
    )  # fmt: skip
    told = {}
    for one in library(sizes):
        units = content._units(one)
        assert {own.name: own.unit for own in one.free if own.name in units} == {
            own.name: units[own.name] for own in one.free if own.name in units
        }
        told |= {name: units[name] for name in one.fixed}
    assert told["mesh_stiffness_variation_eps_2"] == told["nonlinear_viscous_drag_power"] == "1"
    assert told["viscoelastic_tau_short"] == "s"
    assert told["external_periodic_torque_f_external"] == "Hz"
    assert told["motor_torque_sensor_offset_drift_offset"] == "N m"


@pytest.mark.parametrize("base", ["two_inertia", "one_inertia"])
@pytest.mark.parametrize("channels", [("motor_torque",), ("motor_torque", "te"), ("motor_torque", "output_torque")])
@pytest.mark.parametrize("recorded", [True, False])
def test_exact_every_effect_is_a_candidate_or_told_as_not_showable(base, channels, recorded):
    """Where nothing was screened all of them are told, those that are candidates as changing nothing."""
    sizes = Sizes(
        motor_torque=0.1, speed=100.0, stiffness=3e4, ratio=121.0, corner=100.0, elastic=base == "two_inertia",
        loaded=recorded, warm=recorded, orders=(), detents=None, turns=50.0, lines=(), tones=(5.0,),
        channels=tuple("load_angle" if one == "te" else one for one in channels),
    )  # fmt: skip
    plant = SimpleNamespace(load_side=len(channels) > 1, loaded=recorded, warm=recorded, channels=channels)
    friction = ("coulomb_friction",)
    every = library(sizes)
    reasons = {one.effect: one.reason for one in unseen(every, plant, Structure(Model(base=base), {}, ()), ())}
    assert set(reasons) == set(FACTS)
    offered = {one.effect for one in every}
    assert {effect for effect, reason in reasons.items() if reason != SILENT} == (
        set(FACTS) - offered | {"asymmetric_friction", "position_dependent_friction"}
    )
    rubbing = unseen(every, plant, Structure(Model(base=base, terms=friction), {}, ()), friction)
    assert {one.effect for one in rubbing} == set(FACTS) - {"coulomb_friction"}
    assert {one.effect for one in rubbing if one.reason != SILENT} == set(FACTS) - offered


@pytest.mark.long
def test_exact_what_a_rigid_drive_cannot_have_is_told_as_not_showable(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch)
    path = small_campaign.write(tmp_path)
    path.write_text(path.read_text().replace("[drive]\n", '[drive]\nbase = "one_inertia"\n'))
    found = diagnose(path).content
    reasons = {one["effect"]: one["reason"] for one in found["not_showable"]}
    assert {effect for effect, reason in reasons.items() if reason == RIGID} == set(OF_THE_WINDUP)
    assert reasons["thermal_viscous"] == NEEDS_TEMPERATURE
    assert not set(reasons) & {one["effect"] for one in found["detectable"] + found["effects"]}
    drag = [one["minimum_detectable"] for one in found["detectable"] if one["effect"] == "nonlinear_viscous"]
    assert None in drag
    assert drag[0] is not None


@pytest.mark.parametrize(("turns", "resolved"), [(0.45, {5.0, 8.0}), (0.55, {4.0, 5.0, 8.0})])
def test_exact_a_ripple_takes_two_periods_to_be_one(turns, resolved):
    """In less of the motor's motion any slow curve looks the same."""
    unit = SimpleNamespace(angle=np.linspace(0.0, 2.0 * np.pi * turns, 9))
    replay = SimpleNamespace(plant=SimpleNamespace(units=[unit]))
    ripples = [Candidate("torque_ripple", "actuator", (), (), "r_2", order=order) for order in (4.0, 5.0, 8.0)]
    assert {one.order for one in ripples if not unresolved(one, None, replay)} == resolved


@pytest.mark.parametrize("ratio", [100.0, -100.0])
@pytest.mark.parametrize(
    ("half_gap", "step", "resolved"),
    [(1e-6, 0.0, False), (2e-6, 0.0, True), (1e-4, 0.0, True), (4e-6, 5e-4, False), (6e-6, 5e-4, True)],
    ids=["fraction of an arc second", "narrow", "wide", "within a step of the motor's angle", "wider than a step"],
)
def test_exact_a_gap_that_is_not_resolved_is_none(half_gap, step, resolved, ratio):
    fitted = SimpleNamespace(value={"backlash_half_gap": half_gap}.get)
    units = [SimpleNamespace(angle=np.zeros(9), step=own, ratio=ratio) for own in (step, 0.0)]
    replay = SimpleNamespace(plant=SimpleNamespace(units=units))
    candidate = Candidate("backlash", "mesh", ("backlash",), (), "backlash_half_gap")
    assert unresolved(candidate, fitted, replay) != resolved


@pytest.mark.long
def test_against_simulation_a_gap_is_found_in_which_an_unseen_weight_holds_the_load(tmp_path, monkeypatch):
    """The weight alone leaves nothing that is seen."""
    small_campaign.shorten_library(monkeypatch, ("backlash", "gravity_unbalance"))
    weight = {"T_gravity": 0.1, "gravity_unbalance_psi": -1.0}
    (tmp_path / "weight").mkdir()
    alone = diagnose(small_campaign.write(tmp_path / "weight", ["gravity_unbalance"], weight))
    assert alone.verdict == "no_evidence"
    both = small_campaign.write(tmp_path, ["backlash", "gravity_unbalance"], weight | {"half_gap": 4e-6})
    [found] = diagnose(both).effects
    told = {name: entry["value"] for name, entry in found["parameters"].items()}
    assert found["effect"] == "backlash"
    assert told["half_gap"] == pytest.approx(4e-6, rel=0.05)
    assert told["gravity_unbalance_T_gravity"] == pytest.approx(0.1, rel=0.1)


def test_exact_drifts_need_a_second_recording():
    skew = Free("skew", 1e-4, 1.0, False, "1")
    candidate = Candidate("clock_skew", "sensor", (), (skew,), "skew", sensors=(("clock_skew", "load_angle"),))
    seen = Screen({"clock_skew": 1.0}, {"clock_skew": 1.0}, {"clock_skew": 1.0}, {"clock_skew": 1.0})
    signature = Signature(
        candidate, np.ones((9, 1)), np.zeros((0, 1)), np.ones(1), 1.0, 1.0, 1.0, np.zeros(1), np.zeros(1)
    )
    reasons = [limits([signature], seen, recordings)[0].reason for recordings in (1, 2)]
    assert "second recording" in reasons[0]
    assert reasons[1] is None


def drifting(channel: str, unit: str, rate: float) -> Signature:
    """A zero that drifts, of which 1.8 times a typical rate would be seen."""
    free = Free(f"{channel}_sensor_offset_drift_drift", rate, 1.0, False, unit)
    pair = ("sensor_offset_drift", channel)
    candidate = Candidate(
        "sensor_offset_drift", "sensor", (), (free,), free.name, shape=f"on {channel}", sensors=(pair,)
    )
    return Signature(candidate, np.ones((1, 1)), np.zeros((0, 1)), np.ones(1), 1.0, 1.0, 1.0, np.zeros(1), np.zeros(1))


def test_exact_what_is_plausible_of_a_drift_is_that_of_its_channel():
    for channel, unit, rate, plausible in (
        ("motor_torque", "N m/s", 1e-4, True),
        ("motor_torque", "N m/s", 1e-2, False),
        ("load_angle", "rad/s", 5e-9, True),
        ("load_angle", "rad/s", 1e-6, False),
    ):
        one = drifting(channel, unit, rate)
        [found] = limits([one], Screen(*({one.candidate.label: 1.0} for _ in range(4))), 2)
        assert found.minimum_detectable == pytest.approx(1.84 * rate)
        assert (found.reason is None) == plausible


def test_exact_amplitudes_of_different_units_are_compared_in_typical_ones():
    angle, torque = drifting("load_angle", "rad/s", 5e-9), drifting("motor_torque", "N m/s", 1e-4)
    labels = [one.candidate.label for one in (angle, torque)]
    for needed, shape in (((1.0, 3.0), "on load_angle"), ((3.0, 1.0), "on motor_torque")):
        ones = dict.fromkeys(labels, 1.0)
        found = limits([angle, torque], Screen(ones, ones, dict(zip(labels, needed, strict=True)), ones), 2)
        assert [one.shape for one in found] == [shape, *({"on load_angle", "on motor_torque"} - {shape})]


def test_exact_a_torque_that_does_not_change_is_told(tmp_path):
    path = small_campaign.write(tmp_path)
    for one in tmp_path.glob("r*.npz"):
        columns = dict(np.load(one))
        np.savez(one, **columns | {"motor_torque": np.zeros_like(columns["motor_torque"])})
    with pytest.raises(InputError, match="motor_torque is constant"):
        diagnose(path)


def gaps(varied: str | None, *, fixed: bool) -> list[Limit]:
    """Limits of two gaps that differ in a free parameter or in a fixed one; the second shows ten times as well."""
    seen = []
    for value, length in ((1.0, 1.0), (2.0, 10.0)):
        free = tuple(Free(name, value if name == varied else 1.0, 1.0, True, "rad") for name in ("half_gap", "width"))
        made = {"order": value} if fixed else {}
        one = Candidate("backlash", "mesh", ("backlash",), free, "half_gap", fixed=made, shape=f"gap {value}")
        nothing = np.zeros(1)
        seen.append(
            Signature(one, np.full((1, 1), length), np.zeros((1, 1)), np.ones(1), 1.0, 1.0, 0.5, nothing, nothing)
        )
    labels = [one.candidate.label for one in seen]
    return limits(seen, Screen(*(dict.fromkeys(labels, 1.0) for _ in range(4))), 2)


def test_exact_every_shape_has_a_limit_and_amplitudes_are_no_shapes():
    assert [one.shape for one in gaps("half_gap", fixed=False)] == [""]
    assert [one.shape for one in gaps("width", fixed=False)] == ["gap 2.0", "gap 1.0"]
    assert [one.shape for one in gaps(None, fixed=True)] == ["gap 2.0", "gap 1.0"]


def test_exact_the_limit_of_a_shape_is_that_of_the_size_that_hides_best():
    [found] = gaps("half_gap", fixed=False)
    assert found.minimum_detectable == pytest.approx(1.84)


def test_exact_gains_by_recording_leave_out_recordings_without_blocks():
    gained = Gain(np.array([1.0, 2.0, 3.0, 4.0]), (1.0, 1.0)).over(np.array([0, 0, 2, 2]))
    assert gained.by_block.tolist() == [3.0, 7.0]


def test_exact_shares_stay_where_the_parameters_can_follow():
    signed = Candidate("clock_skew", "sensor", (), (Free("rate", 1e-4, 1.0, False, "1"),), "rate")
    friction = Candidate("coulomb_friction", "motor", (), (Free("T_c", 0.1, 1.0, True, "N m"),), "T_c")
    for candidate, value in ((signed, -2e-4), (friction, 0.01)):
        shares = candidate.possible(np.array([-2.0]))
        assert candidate.started(shares).free[0].value == pytest.approx(value)
        assert shares[0] * candidate.free[0].value == pytest.approx(value)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A search that has found friction."""
    campaign = load_campaign(
        small_campaign.write(tmp_path_factory.mktemp("friction"), ["coulomb_friction"], {"T_c": 0.05})
    )
    with pytest.MonkeyPatch.context() as patch:
        small_campaign.shorten_library(patch)
        return session.run(campaign, session.usable(check(campaign)), 0, None, Stages())


def test_exact_a_rival_that_cannot_be_simulated_in_the_place_of_a_name_is_none(done, monkeypatch):
    before = next(one for one in done.search.rounds if one.accepted is not None)
    own = before.accepted
    twin = replace(own.candidate, effect="stribeck_friction", contains=())
    far = own.fit.coordinates.copy()
    far[own.fit.structure.names.index(own.candidate.amplitude)] = 1e3
    other = replace(own, candidate=twin, fit=replace(own.fit, coordinates=far))
    signature = next(one for one in before.signatures if one.candidate.label == own.candidate.label)
    signatures = [*before.signatures, replace(signature, candidate=twin)]
    seen = replace(before, trials=[*before.trials, other], signatures=signatures)
    search = replace(done.search, rounds=[seen if one is before else one for one in done.search.rounds])
    simulated = Plant.mismatch

    def failing(plant, structure, coordinates):
        lost = np.any(coordinates == far.max(), axis=1)[:, None]
        found = simulated(plant, structure, np.minimum(coordinates, 900.0))
        return [{channel: np.where(lost, np.nan, own) for channel, own in unit.items()} for unit in found]

    monkeypatch.setattr(Plant, "mismatch", failing)
    standing = stand(done.replay, search, done.floor, {}, {}, np.random.default_rng(1))[0]
    assert standing.trial is own
    assert "stribeck_friction" not in [one.effect for one in standing.rivals]


def test_exact_where_no_drive_without_the_effect_can_be_simulated_the_one_before_it_stands(done, monkeypatch):
    simulated = Plant.mismatch

    def failing(plant, structure, coordinates):
        found = simulated(plant, structure, coordinates)
        lost = not structure.model.terms
        return [{channel: np.where(lost, np.nan, own) for channel, own in unit.items()} for unit in found]

    monkeypatch.setattr(Plant, "mismatch", failing)
    standing = stand(done.replay, done.search, done.floor, {}, {}, np.random.default_rng(1))[0]
    assert standing.lesser is next(one for one in done.search.rounds if one.accepted is not None).before


def test_exact_what_an_effect_gains_beside_the_others_is_computed_once(done):
    [taken] = done.search.accepted
    known = {taken.candidate.label: Lesser(done.baseline, taken.gain)}
    [standing] = stand(done.replay, done.search, done.floor, {}, known, np.random.default_rng(1))
    assert standing.lesser is done.baseline
    assert standing.alone is taken.gain


def test_exact_a_parameter_that_is_a_multiple_of_another_has_the_errors_of_both(monkeypatch):
    free = (Free("c_drive", 0.1, 2.0, True, "1"), Free("c_back", 1.0, 0.5, True, "1", times="c_drive"))
    structure = Structure(Model(), {}, free)
    rows = np.log([[0.2, 1.5], [0.4, 0.5]])
    assert structure.values(rows)["c_back"] == pytest.approx([0.3, 0.2])
    covariance = np.array([[0.04, -0.03], [-0.03, 0.09]])
    monkeypatch.setattr(Fit, "covariance", lambda *_: covariance)
    nothing = np.zeros(0)
    sigma = Fit(structure, rows[0], nothing, nothing, nothing, None, None, Stir.none(nothing)).sigma_of(None)
    assert sigma["c_back"] / sigma["c_drive"] == pytest.approx(0.3 * np.sqrt(0.04 + 0.09 - 0.06) / (0.2 * 0.2))


@pytest.mark.parametrize(("shared", "enough"), [(0.0, False), (0.99, True), (1.01, False)])
def test_exact_an_amplitude_is_as_sure_as_it_is_at_the_effects_own_shape(monkeypatch, shared, enough):
    """Recordings at few speeds hardly tell how fast friction falls, and its height with that, but whether it falls."""
    scale = Free("torque_scale", 1.0, 0.01, True, "1")
    law = (Free("T_s", 0.1, 2.0, True, "N m"), Free("omega_s", 3.0, 1.0, True, "rad/s"))
    structure = Structure(Model(), {}, (scale, *law))
    covariance = np.diag([1e-4, 1.0, 1.0]) + shared * np.array([[0, 0, 0], [0, 0, 1], [0, 1, 0]])
    monkeypatch.setattr(Fit, "covariance", lambda *_: covariance)
    nothing = np.zeros(0)
    joint = Fit(structure, structure.start, nothing, nothing, nothing, None, None, Stir.none(nothing))
    candidate = Candidate("stribeck_friction", "motor", ("stribeck_friction",), law, "T_s")
    assert sizeable(SimpleNamespace(layout=None), joint, candidate) == enough


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "size"),
    [
        ("gravity_unbalance", {"T_gravity": 4.0}),
        ("load_side_friction", {"T_cl": 4.0}),
    ],
)
def test_exact_a_load_that_turns_the_other_way_gets_the_same_answer(tmp_path, monkeypatch, effect, size):
    small_campaign.shorten_library(monkeypatch, ("load_side_friction", "gravity_unbalance", "hysteresis", "backlash"))
    path = small_campaign.write(tmp_path, [effect], size)
    forwards = diagnose(path)
    text = path.read_text().replace("ratio = 121", "ratio = -121").replace("[7e-5]", "[-7e-5]")
    path.write_text(text.replace("[5e-5]", "[-5e-5]") + '[columns]\nload_angle = { name = "load_angle", scale = -1 }\n')
    backwards = diagnose(path)
    for found in (forwards, backwards):
        assert [one["effect"] for one in found.effects] == [effect]
        assert found.content["where"]["place"] == forwards.content["where"]["place"]
    for name in size:
        value, mirrored = (found.effects[0]["parameters"][name]["value"] for found in (forwards, backwards))
        assert mirrored == pytest.approx(value, rel=1e-4)


def test_exact_a_candidate_without_room_is_none():
    free = (Free("delay_tau_d", 1e-3, 1.0, True, "s"),)
    late = Candidate("delay", "actuator", ("delay",), free, "delay_tau_d")
    full = ["viscoelastic", "base_compliance", "load_compliance", "input_compliance"]
    assert late.fits_into(Structure(Model(), {}, ()))
    assert not late.fits_into(Structure(Model(terms=full), {}, ()))


@pytest.mark.long
def test_exact_a_declared_special_case_comes_back_where_its_law_is_taken_out(tmp_path, monkeypatch):
    """Stribeck friction beside a declared Coulomb friction is weighed against Coulomb friction, not against none."""
    small_campaign.shorten_library(monkeypatch, ("coulomb_friction", "stribeck_friction"))
    parameters = {"T_c": 0.05, "breakaway_ratio": 2.5, "omega_s": 10.0}
    path = small_campaign.write(tmp_path, ["stribeck_friction"], parameters)
    path.write_text(path.read_text() + '\n[[terms]]\neffect = "coulomb_friction"\nparameters = { T_c = 0.05 }\n')
    found = diagnose(path).evidence
    [law] = found.standings
    assert law.trial.candidate.effect == "stribeck_friction"
    assert law.lesser.structure.model.terms == ("coulomb_friction",)


@pytest.mark.long
def test_exact_rejected_recordings_are_told_with_the_same_keys(tmp_path, monkeypatch):
    small_campaign.shorten_library(monkeypatch)
    path = small_campaign.write(tmp_path)
    accepted = diagnose(path).content
    for file in tmp_path.glob("*.npz"):
        columns = dict(np.load(file))
        columns["t"][:] = 0.0
        np.savez(file, **columns)
    rejected = diagnose(path).content
    assert rejected["verdict"] == "data_rejected"
    assert rejected.keys() == accepted.keys()
    assert rejected["where"].keys() == accepted["where"].keys()
    assert rejected["fit"]["heldout"].keys() == accepted["fit"]["heldout"].keys()


def test_exact_health_is_checked_on_one_thread_of_linear_algebra(monkeypatch):
    threads = []

    def checked(_):
        threads.extend(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        raise InputError("seen")

    monkeypatch.setattr(sys.modules["hdfast.diagnosis.diagnose"], "check", checked)
    with threadpool_limits(2), pytest.raises(InputError, match="seen"):
        diagnose(campaign([{"t": np.arange(100) * 1e-3}]))
    assert set(threads) == {1}


@pytest.mark.long
def test_exact_ripple_faster_than_half_the_recorders_rate_is_named(tmp_path, monkeypatch):
    """A recorder of 100 Hz whose samples are late or early by 4 % of its period; the error passes at up to 64 Hz."""

    def clock(rng):
        return np.sort(np.arange(300) + 0.04 * np.clip(rng.standard_normal(300), -3.0, 3.0)).clip(0.0) / 100.0

    small_campaign.shorten_library(monkeypatch, ("te_harmonic", "encoder_eccentricity"))
    path = small_campaign.write(tmp_path, parameters={"te_cos_8": 1.5e-5, "te_sin_8": 0.0}, orders=(2, 8), clock=clock)
    found = diagnose(path)
    assert [one["effect"] for one in found.effects] == ["te_harmonic"]
    parameters = found.effects[0]["parameters"]
    assert parameters["order"]["value"] == 8.0
    assert parameters["te_cos_8"]["value"] == pytest.approx(1.5e-5, rel=0.1)


@pytest.mark.long
def test_regress_a_stiff_coupling_is_named_though_a_refit_follows_the_resonance_it_moves(tmp_path, monkeypatch):
    """To first order its stiffness over the square of the share beyond it counts, and 0.8 of the inertia is as good."""
    small_campaign.shorten_library(monkeypatch, ("load_compliance", "viscoelastic"))
    coupling = {"K_c": 6.0 * small_campaign.DRIVE["k1"], "c_c": 15.0, "payload_share": 0.95}
    found = diagnose(small_campaign.write(tmp_path, ["load_compliance"], coupling))
    assert [one["effect"] for one in found.effects] == ["load_compliance"]
    assert 0.6 < found.effects[0]["parameters"]["K_c"]["value"] / coupling["K_c"] < 1.2


@pytest.mark.parametrize(("factor", "at_its_bound"), [(1.1, False), (30.0, True)])
def test_exact_a_filter_that_is_unlike_the_others_is_at_its_bound(factor, at_its_bound):
    """Its bound is of how many times as long it is as the first one, which is a millisecond."""
    own = replace(
        in_every_sensor("sensor_lowpass", ("motor_torque", "load_angle"), positive("tau_s", 1e-3, "s", high=1.0)),
        contains=("actuator_lag",),
    )
    assert {free.unit for free in own.free} == {"s"}
    fitted = SimpleNamespace(structure=SimpleNamespace(names=list(own.names)), coordinates=np.log([1e-3, factor]))
    assert special(own, fitted) == at_its_bound
