"""When frozen models on held-out recordings leave an effect standing, and what a verdict says of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import small_campaign
from hdfast.diagnosis import accept, beside, choice, diagnose, prove, remarks, shortlist, verdict
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.lesser import Lesser
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.rivals import confidence
from hdfast.diagnosis.score import Gain
from hdfast.diagnosis.trials import Round, Search, Trial
from hdfast.printing import percents

ERRORS = (0.5, 0.5)


def proof(total: float, expected: float, margin: float = 0.0, errors: tuple[float, float] = ERRORS) -> Proof:
    """A gain of that total over twenty blocks that scatter so much that the total is within its error."""
    scatter = np.resize([8.0, -8.0], 20)
    told = Gain(np.full(20, expected / 20.0), errors)
    return Proof(*errors, 0.1, Gain(total / 20.0 + scatter, errors), told, margin, (np.zeros(1), np.zeros(1)))


def test_exact_a_blow_that_neither_model_follows_outweighs_no_other_block() -> None:
    blow = np.full(20, 2.0)
    blow[7] = -1000.0
    shown = np.full(20, 2.0)
    shown[7] = 500.0
    one = Proof(*ERRORS, 0.1, Gain(blow, ERRORS), Gain(shown, ERRORS), 0.0, (np.zeros(1), np.zeros(1)))
    assert one.shows
    assert not one.refutes
    against = Proof(*ERRORS, 0.1, Gain(-blow, ERRORS), Gain(shown, ERRORS), 0.0, (np.zeros(1), np.zeros(1)))
    assert not against.shows


@pytest.mark.parametrize(
    ("total", "expected", "shows"),
    [
        (-1.0, 2.0, False),
        (1.0, 2.0, False),
        (6.0, 2.0, True),
        (6.0, 0.1, False),
        (20.0, 40.0, True),
        (5.0, 40.0, False),
        (-5.0, 40.0, False),
    ],
)
def test_exact_a_gain_shows_by_what_is_expected_of_it(total: float, expected: float, shows: bool) -> None:
    assert proof(total, expected).shows == shows
    assert proof(total, expected).holds == shows


@pytest.mark.parametrize(
    ("total", "margin", "shows"), [(1.0, 4.5, True), (1.0, 3.5, False), (-0.5, 20.0, False), (0.5, 20.0, True)]
)
def test_exact_recordings_that_can_hardly_show_it_count_with_the_others(
    total: float, margin: float, shows: bool
) -> None:
    assert proof(total, 2.0, margin).shows == shows


@pytest.mark.parametrize(
    ("total", "expected", "p", "shows"),
    [
        (1.0, 2.0, 1e-4, True),
        (0.4, 2.0, 1e-4, False),
        (1.0, 0.4, 1e-4, True),
        (1.0, 2.0, 2e-3, False),
        (9.0, 2.0, 2e-3, True),
        (9.0, 2.0, 0.1, False),
        (4.0, 10.0, 1e-4, False),
    ],
)
def test_exact_what_the_screen_shows_is_confirmed_where_chance_would_hardly_make_both(
    total: float, expected: float, p: float, shows: bool
) -> None:
    """Beyond a quarter of what is expected, by Fisher's rule; powered recordings decide as ever."""
    gained = Gain(total / 20.0 + np.resize([1.2, -1.2], 20), ERRORS)
    assert replace(proof(total, expected, -20.0), gain=gained, p=p).shows == shows


@pytest.mark.parametrize(("total", "confirms"), [(0.4, False), (9.0, True), (16.0, True), (24.0, False)])
def test_exact_what_gains_far_more_than_its_size_can_is_not_confirmed(total: float, confirms: bool) -> None:
    """Twice its size gains three times the 2 nats expected, here with an error of 5.5."""
    gained = Gain(total / 20.0 + np.resize([1.2, -1.2], 20), ERRORS)
    assert replace(proof(total, 2.0), gain=gained, p=1e-4).confirms == confirms


@pytest.mark.parametrize(
    ("left_out", "held_out", "gained", "margin", "worse"),
    [
        ((0.51, 0.5), (0.5, 0.51), 9.0, 10.0, True),
        ((0.51, 0.5), (0.5, 0.51), 11.0, 0.0, False),
        ((0.51, 0.5), (0.5, 0.51), 9.0, 12.0, False),
        ((0.51, 0.5), (0.5, 0.51), 5.0, 30.0, True),
        ((0.49, 0.5), (0.5, 0.51), 9.0, 0.0, False),
        ((0.51, 0.5), (0.5, 0.49), 9.0, 0.0, False),
    ],
)
def test_exact_a_name_with_which_all_recordings_are_followed_less_well_is_undecided_unless_those_held_out_convince(
    left_out: tuple[float, float],
    held_out: tuple[float, float],
    gained: float,
    margin: float,
    worse: bool,
) -> None:
    leading = SimpleNamespace(
        name="coulomb_friction", alone=Gain(np.ones(9), ERRORS), lesser=None, rivals=(), probability=0.98,
        trial=SimpleNamespace(candidate=SimpleNamespace(place="motor")),
    )  # fmt: skip
    session = SimpleNamespace(
        search=SimpleNamespace(final=None, accepted=[SimpleNamespace(gain=Gain(np.ones(9), left_out))]),
        proof=SimpleNamespace(
            holds=True,
            baseline=held_out[0],
            extended=held_out[1],
            gain=SimpleNamespace(limited=gained),
            margin=margin,
            confirms=gained > 8.0,
        ),
    )
    assert verdict._decide(session, [leading], None)[0] == ("undecided" if worse else "found")


@pytest.mark.parametrize(
    ("errors", "shown"),
    [
        ((0.174, 0.042), ("17.4 %", "4.2 %")),
        ((0.0474, 0.0471), ("4.74 %", "4.71 %")),
        ((0.03, 0.029999), ("3.0 %", "3.0 %")),
    ],
)
def test_exact_an_improvement_is_told_with_as_many_digits_as_it_takes(
    errors: tuple[float, float], shown: tuple[str, str]
) -> None:
    assert percents(*errors) == shown


def test_exact_what_to_record_next_tells_apart_all_that_look_the_same() -> None:
    """A rival that decides the verdict first, then those that are as likely or alike; three models at most."""
    rivals = [
        SimpleNamespace(effect=effect, weight=weight, alike=alike, fit=effect)
        for effect, weight, alike in (
            ("load_compliance", 0.01, 0.5),
            ("ratio_error", 0.003, 0.999),
            ("clock_skew", 0.002, 0.99),
            ("sensor_lowpass", 0.2, 0.3),
        )
    ]
    leading = SimpleNamespace(name="encoder_eccentricity", rivals=rivals)
    contest = verdict._between(leading, "final", rivals[2])
    assert contest.names == ("encoder_eccentricity", "clock_skew", "ratio_error")
    assert contest.fits == ("final", "clock_skew", "ratio_error")


def test_exact_an_undecided_name_says_what_is_sure_beside_it() -> None:
    rival = SimpleNamespace(effect="sensor_lowpass", weight=0.5, alike=0.0, fit=None)
    delay, hysteresis = (
        SimpleNamespace(
            name=name, alone=Gain(np.full(9, gain), ERRORS), lesser=None, rivals=rivals, probability=probability
        )
        for name, gain, rivals, probability in (
            ("sensor_delay", 2.0, [rival], 0.56),
            ("hysteresis", 1.0, [], 0.98),
        )
    )
    session = SimpleNamespace(replay=SimpleNamespace(layout=None), search=SimpleNamespace(final=None), proof=None)
    told = "sensor_delay cannot be told from sensor_lowpass"
    assert verdict._decide(session, [delay], None)[1] == told
    assert verdict._decide(session, [delay, hysteresis], None)[1] == f"{told}, beside hysteresis"


@pytest.mark.parametrize(("left", "floor", "said"), [(0.29, 0.1, False), (0.31, 0.1, True), (0.31, 0.0, False)])
def test_exact_what_is_left_beyond_the_white_noise_is_noted(monkeypatch, left: float, floor: float, said: bool) -> None:
    search = SimpleNamespace(accepted=[], final=SimpleNamespace(mismatch=None))
    found = SimpleNamespace(
        session=SimpleNamespace(warnings=[], search=search, replay=None),
        proof=SimpleNamespace(extended=left, floor=floor),
        extended=None,
        told=[],
    )
    for astray in ([], ["motor_torque"]):
        monkeypatch.setattr(remarks, "unexplained", lambda replay, mismatch, astray=astray: astray)
        notes = remarks.remarks(found)
        assert any("3.1 times the white noise" in note for note in notes) == said
        assert any("of motor_torque the model explains nothing" in note for note in notes) == bool(astray)


def fitted(base: str, **pulls: float) -> SimpleNamespace:
    """A fit of which nothing counts but how far its parameters are from what is stated."""
    structure = SimpleNamespace(names=list(pulls), model=SimpleNamespace(base=base))
    return SimpleNamespace(structure=structure, pulls=np.array(list(pulls.values())), mismatch=None)


def noted(monkeypatch, before: SimpleNamespace, after: SimpleNamespace, order: float | None, stated: bool) -> str:
    """The notes on a line of the kinematic error, or on an effect without an order, that was added to a fit."""
    monkeypatch.setattr(remarks, "unexplained", lambda replay, mismatch: [])
    priors = {"k1": SimpleNamespace(stated=stated), "J_l": SimpleNamespace(stated=True)}
    campaign = SimpleNamespace(drive=SimpleNamespace(base=None, spring="polynomial"), priors=priors)
    search = SimpleNamespace(accepted=[], final=after)
    session = SimpleNamespace(warnings=[], search=search, replay=None, baseline=before, campaign=campaign)
    named = SimpleNamespace(trial=SimpleNamespace(candidate=SimpleNamespace(order=order)))
    return " ".join(remarks.remarks(SimpleNamespace(session=session, proof=None, extended=after, told=[named])))


def test_exact_what_an_effect_drags_away_from_what_is_stated_is_noted(monkeypatch) -> None:
    before = fitted("two_inertia", torque_scale=0.2, J_m=3.5, J_l=0.1, k1=0.3)
    told = noted(
        monkeypatch,
        before,
        fitted("two_inertia", torque_scale=8.3, J_m=4.4, J_l=4.1, k1=2.9, payload_share=9.0),
        None,
        True,
    )
    assert "drag J_l and the scale of motor_torque more than 3 standard deviations" in told
    assert (
        noted(monkeypatch, before, fitted("two_inertia", torque_scale=1.0, J_m=3.6, J_l=1.0, k1=2.9), None, True) == ""
    )


@pytest.mark.parametrize(
    ("base", "order", "stated", "said"),
    [
        ("one_inertia", 2.0, False, True),
        ("one_inertia", 2.0, True, False),
        ("one_inertia", None, False, False),
        ("two_inertia", 2.0, False, False),
    ],
)
def test_exact_a_line_of_a_drive_that_is_rigid_for_want_of_its_stiffness_is_noted(
    monkeypatch, base: str, order: float | None, stated: bool, said: bool
) -> None:
    one = fitted(base, torque_scale=0.0)
    assert ("[drive] does not state k1" in noted(monkeypatch, one, one, order, stated)) == said


@pytest.mark.parametrize(
    ("total", "expected", "p", "holds"),
    [(-0.8, 0.7, 1e-4, True), (-0.8, 0.7, 2e-3, False), (-3.0, 0.7, 5e-4, False), (-1.2, 3.1, 1e-4, False)],
)
def test_exact_what_the_screen_singles_out_stands_where_the_others_tell_next_to_nothing(
    total: float, expected: float, p: float, holds: bool
) -> None:
    gained = Gain(total / 20.0 + np.resize([0.3, -0.3], 20), ERRORS)
    weighed = replace(proof(total, expected, -20.0), gain=gained, p=p)
    assert not weighed.shows
    assert weighed.holds == holds


@pytest.mark.parametrize(("total", "margin", "shows"), [(6.0, -7.4, False), (8.7, -4.4, True), (20.0, -12.0, True)])
def test_exact_recordings_that_show_it_outweigh_what_the_others_say_against_it(
    total: float, margin: float, shows: bool
) -> None:
    assert proof(total, 10.0, margin).shows == shows


@pytest.mark.parametrize(
    ("total", "expected", "margin", "holds"),
    [
        (-0.3, 0.4, 67.0, True),
        (-0.3, 0.4, 5.0, False),
        (-5.5, 4.6, 20.0, True),
        (-5.5, 4.6, 12.0, True),
        (-5.5, 4.6, 10.0, False),
        (5.0, 46.0, 16.0, True),
        (5.0, 46.0, 9.0, False),
        (-5.0, 46.0, 60.0, True),
        (-5.0, 46.0, 14.0, False),
        (-30.0, 46.0, 60.0, False),
    ],
)
def test_exact_what_convinces_elsewhere_stands_unless_refuted(
    total: float, expected: float, margin: float, holds: bool
) -> None:
    """At least a quarter of its size is seen, and what speaks against the rest leaves the others convincing."""
    weighed = replace(proof(total, expected, margin), p=1e-3)
    assert not weighed.shows
    assert weighed.holds == holds
    assert weighed.refutes == (expected > 8.0 and total < 0.0 and not holds)


@pytest.mark.parametrize(
    ("total", "margin", "p", "holds"),
    [(-1.0, 11.5, 6e-3, False), (-1.0, 11.5, 1e-3, True), (1.0, 11.5, 6e-3, True), (-1.0, 21.5, 6e-3, True)],
)
def test_exact_what_is_spoken_against_and_not_singled_out_has_to_be_certain(total, margin, p, holds) -> None:
    weighed = replace(proof(total, 5.0, margin), p=p)
    assert weighed.holds == holds


@pytest.mark.parametrize(
    ("total", "expected", "refuted"),
    [(-30.0, 400.0, False), (-190.0, 400.0, False), (-210.0, 400.0, True), (-5.0, 46.0, True), (-390.0, 400.0, True)],
)
def test_exact_an_effect_of_less_than_half_its_size_is_not_refuted(total, expected, refuted) -> None:
    """A share s of it gains 2 s - 1 of what is expected: 46, 26, 24, 45 and 1 %, known to 4 to 80 %."""
    assert proof(total, expected).refutes == refuted
    assert not proof(total, expected).holds
    assert proof(total, expected, margin=400.0).holds == (total >= -0.5 * expected)


@pytest.mark.parametrize(
    ("weights", "evidence", "probability"),
    [
        ((), 1e3, 0.98),
        ((), 10.0, 0.98 * (1.0 - np.exp(-1.0))),
        ((), -3.0, 0.0),
        ((0.5,), 1e3, 0.49),
        ((0.5, 0.5), 1e3, 0.98 / 3.0),
    ],
)
def test_exact_a_name_is_as_probable_as_its_evidence(
    weights: tuple[float, ...], evidence: float, probability: float
) -> None:
    assert confidence(weights, evidence) == pytest.approx(probability)


def test_exact_a_model_that_predicts_worse_never_holds() -> None:
    worse = proof(30.0, 30.0, 100.0, errors=(0.5, 0.52))
    assert worse.refutes
    assert not worse.holds
    assert not proof(100.0, 100.0, 100.0, (9.0, 8.0)).holds


@pytest.mark.parametrize(
    ("rise", "outset", "gain", "holds"),
    [
        (0.04, 0.9, 30.0, True), (0.06, 0.9, 30.0, False), (0.04, 0.5, 30.0, False), (0.04, None, 30.0, False),
        (0.04, 0.9, 19.0, False), (0.02, 0.9, 19.0, True),
    ],
)  # fmt: skip
def test_exact_what_is_certain_may_raise_an_error_that_the_search_has_lowered(rise, outset, gain, holds) -> None:
    """By 5 % at most, and never beyond what it was before the search."""
    even = Gain(np.full(20, gain / 20.0), ERRORS)
    risen = replace(proof(gain, 30.0, 100.0), gain=even, extended=0.5 * (1.0 + rise) - 1e-9, outset=outset)
    assert risen.holds == holds


def test_exact_a_candidate_that_cannot_be_simulated_is_no_crash(tmp_path, monkeypatch):
    """Rows of a candidate that fail at every amplitude end its trial, not the diagnosis."""
    small_campaign.shorten_library(monkeypatch)
    whole = Replay.mismatch

    def failing(replay, structure, coordinates):
        found = whole(replay, structure, coordinates)
        broken = "coulomb_friction" in structure.model.terms and len(coordinates) > 1
        return np.full_like(found, np.nan) if broken else found

    monkeypatch.setattr(Replay, "mismatch", failing)
    found = diagnose(small_campaign.write(tmp_path, ["coulomb_friction"], {"T_c": 0.05}))
    trials = found.evidence.session.search.rounds[0].trials
    assert next(one.failed for one in trials if one.candidate.effect == "coulomb_friction") == ("A0 simulation",)


@pytest.mark.long
def test_exact_what_convinces_where_it_was_fitted_and_is_refused_elsewhere_is_undecided(tmp_path, monkeypatch):
    """The drive has dry friction in the fitted recordings and none in the one that is held out."""
    small_campaign.shorten_library(monkeypatch)
    told = diagnose(small_campaign.write_without_in_held_out(tmp_path, ["coulomb_friction"], {"T_c": 0.05})).to_dict()
    assert told["verdict"] == "undecided"
    assert "coulomb_friction is beyond doubt where it was fitted" in told["sentence"]
    assert told["effects"] == []
    assert told["next_experiment"] is not None


@pytest.mark.long
@pytest.mark.parametrize(("height", "first"), [(3e-5, "coulomb_friction"), (1e-4, "te_harmonic")])
def test_exact_what_is_refused_goes_and_what_holds_without_it_stays(tmp_path, monkeypatch, height, first):
    """The fourth harmonic is in the fitted recordings alone and draws their fit, dry friction is in all of them."""
    small_campaign.shorten_library(monkeypatch, ("coulomb_friction", "te_harmonic"))
    terms, level = ["coulomb_friction"], {"T_c": 0.05}
    spoiled = level | {"te_cos_4": height, "te_sin_4": 0.0}
    always = (terms, level)
    found = diagnose(small_campaign.write_without_in_held_out(tmp_path, terms, spoiled, (2, 4), always))
    rounds = found.evidence.session.search.rounds
    refused = [one.candidate.effect for each in rounds for one in each.trials if one.failed == ("A7 held out",)]
    assert refused == ["te_harmonic"]
    assert (rounds[0].accepted is None) == (first == "te_harmonic")
    assert [one["effect"] for one in found.effects] == ["coulomb_friction"]
    session = found.evidence.session
    assert list(session.shown.values()) == [session.proof.gain.limited]
    told = found.to_dict()["fit"]["heldout"]["channels"]["motor_torque"]
    assert told["extended_nrmse"] < 0.12 * told["baseline_nrmse"]


@pytest.mark.parametrize(
    ("least", "told"),
    [
        (15.0, {"abc": {"a": -9.0, "b": 5.0, "c": -4.0}, "bc": {"b": 5.0, "c": 6.0}}),
        (14.0, {"abc": {"a": 4.0, "b": 5.0, "c": 6.0}, "bc": {"b": 5.0, "c": 6.0}}),
    ],
)
def test_exact_effects_that_do_not_hold_or_gain_little_beside_the_others_go_one_by_one(monkeypatch, least, told):
    """The weakest first: without it another one holds, or does not."""
    kinds = [SimpleNamespace(effect=name, label=name, refines=False) for name in "abc"]
    trials = [Trial(one, None, Gain(np.zeros(2), ERRORS), ()) for one in kinds]
    rounds = [Round(None, [], [], [], None, [one], one) for one in trials]

    def steps(held, found, lessers, outset):
        assert outset == 0.5
        every = told["".join(one.candidate.effect for one in found.accepted)]
        gains = {one: SimpleNamespace(limited=every[one.candidate.effect]) for one in lessers}
        return {one: SimpleNamespace(gain=own, holds=own.limited > 0.0) for one, own in gains.items()}

    def lessers_of(replay, found, parts, floor):
        gains = {"a": least, "b": 15.0, "c": 15.0}
        of = [one.candidate.effect for one in parts]
        return [Lesser(f"less {one}", Gain(np.full(5, gains[one] / 5.0), ERRORS)) for one in of]

    monkeypatch.setattr(beside, "_lessers", lessers_of)
    monkeypatch.setattr(beside, "_steps", steps)
    monkeypatch.setattr(beside, "whole_proof", lambda held, found: SimpleNamespace(baseline=0.5, model=found.final))
    sequence = Search(rounds, "all", trials), SimpleNamespace(baseline=0.5), {"a": 1.0, "b": 2.0, "c": 3.0}
    (found, proof, shown), lessers = beside.beside(None, None, sequence, 0.1)
    assert [one.candidate.label for one in found.accepted] == ["b", "c"]
    assert (found.final, proof.model) == ("less a", "less a")
    assert shown == {"b": 5.0, "c": 6.0}
    assert {label: lesser.fit for label, lesser in lessers.items()} == {"b": "less b", "c": "less c"}


def signature(effect: str, gain: float = 9.0, lies: str = "") -> SimpleNamespace:
    candidate = SimpleNamespace(
        effect=effect, label=effect + lies, law=effect, variety=(effect, bool(lies)), contains=(), free=effect + lies,
        unseen=("weight",) if lies else (),
    )  # fmt: skip
    return SimpleNamespace(candidate=candidate, gain=gain, bulk=gain)


def test_exact_a_first_effect_is_tried_where_the_screen_suspects_it_or_cannot_show_it() -> None:
    p = {"hysteresis": 0.04, "cogging": 0.2, "backlash": 0.5, "load_side_friction": 0.9}
    found, seen = [signature(effect) for effect in p], SimpleNamespace(p=p)

    def tried(*, first: bool) -> list[str]:
        return [alike[0].candidate.effect for alike in shortlist.shortlist(found, seen, first=first)]

    assert tried(first=True) == ["hysteresis", "cogging", "load_side_friction"]
    assert tried(first=False) == ["hysteresis"]


def test_exact_wherever_a_weight_may_hold_the_load_in_its_gap_one_trial_begins() -> None:
    found = [
        signature("backlash"),
        *(signature("backlash", gain, lies) for gain, lies in ((20.0, "left"), (1.0, "right"))),
    ]
    seen = SimpleNamespace(p={"backlash": 0.02, "backlashleft": 0.01, "backlashright": 0.9})
    listed = shortlist.shortlist(found, seen, first=True)
    assert [[one.candidate.label for one in alike] for alike in listed] == [["backlashleft", "backlashright"]]


@pytest.mark.parametrize(("p", "both"), [((0.02, 4e-3), True), ((4e-3, 4e-3), False), ((0.03, 0.02), False)])
def test_exact_a_likelier_shape_of_a_law_is_tried_with_the_one_that_gains_more(p, both) -> None:
    """A line of 8 detectable amplitudes stood behind a slow one, which gains more and lies where noise does as well."""
    slow, fast = signature("te_harmonic", 20.0), signature("te_harmonic")
    fast.candidate.label = fast.candidate.variety = fast.candidate.free = "order 6"
    seen = SimpleNamespace(p=dict(zip(("te_harmonic", "order 6"), p, strict=True)))
    tried = [alike[0].candidate.label for alike in shortlist.shortlist([slow, fast], seen, first=True)]
    assert sorted(tried) == (["order 6", "te_harmonic"] if both else ["te_harmonic"])


def test_exact_what_others_keep_off_the_shortlist_is_tried_where_the_screen_singles_it_out() -> None:
    gains = {"hysteresis": 50.0, "backlash": 40.0, "viscoelastic": 30.0, "soft_windup": 20.0, "delay": 10.0}
    found = [signature(*one) for one in [*gains.items(), ("cogging", 8.0), ("te_harmonic", 9.0)]]
    p = dict.fromkeys(gains, 1e-4) | {"cogging": 1e-3, "te_harmonic": 2e-3}
    seen = SimpleNamespace(p=p)
    listed = [alike[0] for alike in shortlist.shortlist(found, seen, first=True)]
    assert [one.candidate.effect for one in listed] == list(gains)
    others = shortlist.overlooked(found, seen, listed)
    assert [[one.candidate.effect for one in alike] for alike in others] == [["cogging"]]


@pytest.mark.parametrize(
    ("effect", "failed", "p", "ahead", "carried"),
    [
        ("load_side_friction", (accept.SHORT,), 5e-3, 1.0, True),
        ("load_side_friction", (accept.SHORT,), 5e-3, -1.0, False),
        ("load_side_friction", (accept.SHORT,), 0.02, 1.0, False),
        ("load_side_friction", (accept.SHORT, accept.STILL), 5e-3, 1.0, False),
        ("sensor_delay", (accept.SHORT,), 5e-3, 1.0, False),
        ("clock_skew", (accept.SHORT,), 5e-3, 1.0, False),
    ],
)
def test_exact_what_gains_too_little_by_chance_alone_goes_where_it_beats_the_best(
    monkeypatch, effect, failed, p, ahead, carried
) -> None:
    """One of 12 +- 7 nats beside one of 9 that breaks no rule."""
    uneven = Gain(0.6 + np.resize([1.6, -1.6], 20), ERRORS)
    kinds = [SimpleNamespace(effect=name, label=name, contains=()) for name in ("coulomb_friction", effect)]
    trials = [Trial(kinds[0], "best", Gain(np.full(20, 0.45), ERRORS), ()), Trial(kinds[1], "other", uneven, failed)]
    monkeypatch.setattr(
        choice, "gain", lambda replay, one, other, folds: SimpleNamespace(limited=ahead if one == "other" else -ahead)
    )
    seen, rules = SimpleNamespace(p={"coulomb_friction": 1e-4, effect: p}), SimpleNamespace(folds=None)
    found = choice.carried(None, trials, seen, rules)
    assert [one.failed for one in found] == [(), () if carried else failed]
    assert choice.best(None, found, [], seen, rules) is found[carried]


@pytest.mark.parametrize(("left", "first"), [(0.2, True), (0.4, False)])
def test_exact_what_leaves_far_less_of_the_error_goes_first(monkeypatch, left, first) -> None:
    """A loop in few blocks beside friction that gains a little in all of them, from an error of .58 to .56."""
    kinds = [SimpleNamespace(effect=name, label=name, contains=()) for name in ("stribeck_friction", "hysteresis")]
    friction = Trial(kinds[0], "friction", Gain(np.full(20, 5.0), (0.56, 0.58)), ())
    loop = Trial(kinds[1], "loop", Gain(np.resize([300.0, -4.0], 20), (left, 0.58)), ())
    ahead = {"friction": 1.0, "loop": -1.0}
    monkeypatch.setattr(choice, "gain", lambda replay, one, other, folds: SimpleNamespace(limited=ahead[one]))
    rules = SimpleNamespace(folds=None)
    assert choice.best(None, [friction, loop], [], None, rules) is (loop if first else friction)


def confirmed_on_others(monkeypatch, p, gained, *, beside=(), **shown) -> bool:
    """Whether a faint friction is confirmed, with this p value, gain and proof, beside these other effects."""
    candidate = SimpleNamespace(effect="load_side_friction", label="load_side_friction", contains=("cogging",))
    fitted = SimpleNamespace(white=None, structure=None, coordinates=None)
    trial = Trial(candidate, fitted, gained, (accept.STILL,))
    last = Round(fitted, [], [], [], SimpleNamespace(p={"load_side_friction": p}), [trial], None)
    for name in ("noise_floor", "replayed", "settled"):
        monkeypatch.setattr(prove, name, lambda *given: fitted)
    proof = SimpleNamespace(confirms=True, holds=True, baseline=1.0, **shown)
    monkeypatch.setattr(prove, "weigh_up", lambda *given: proof)
    monkeypatch.setattr(prove, "_holding", lambda replay, held, found: found.accepted)
    held = SimpleNamespace(layout=None, commanded=lambda one: None)
    others = [SimpleNamespace(candidate=SimpleNamespace(effect=effect)) for effect in beside]
    accepted = prove._confirmed(held, held, Search([last], fitted, others), trial)
    if accepted is None:
        return False
    assert [one.candidate.effect for one in accepted[:-1]] == [effect for effect in beside if effect != "cogging"]
    return bool(accepted[-1].candidate is candidate and accepted[-1].confirmed and not accepted[-1].failed)


@pytest.mark.parametrize(
    ("p", "spread", "beside", "named"),
    [
        (0.02, 0.0, (), True), (0.02, 2.6, (), False), (0.01, 2.6, (), True), (0.01, 9.0, (), False),
        (0.01, 0.0, ("cogging", "backlash"), False),
    ],
)  # fmt: skip
@pytest.mark.parametrize("alone", [False, True])
def test_exact_what_opens_no_search_is_confirmed_by_others_where_these_speak_alone(
    monkeypatch, p, spread, beside, named, alone
) -> None:
    gained = Gain(1.0 + spread * np.resize([1.0, -1.0], 20), (0.1, 0.2))
    shown = {"extended": 0.9, "speaks_alone": alone}
    assert confirmed_on_others(monkeypatch, p, gained, beside=beside, **shown) == (named or alone)


@pytest.mark.parametrize(
    ("p", "margin", "error", "alone", "named"),
    [
        (1e-3, 0.25, 1.01, False, True), (2e-3, 0.25, 1.01, False, False), (1e-3, 0.24, 1.01, False, False),
        (2e-3, 0.1, 0.99, False, True), (2e-3, 0.25, 1.01, True, True), (2e-3, 0.24, 1.01, True, False),
    ],
)  # fmt: skip
def test_exact_what_is_singled_out_is_confirmed_where_the_loudest_channel_hides_it(
    monkeypatch, p, margin, error, alone, named
) -> None:
    gained = Gain(np.full(20, margin), (0.1, 0.2))
    assert confirmed_on_others(monkeypatch, p, gained, extended=error, speaks_alone=alone) == named


@pytest.mark.parametrize(("gained", "alone"), [(3.6, False), (3.9, True)])
def test_exact_others_speak_alone_where_chance_makes_their_gain_once_in_ten_thousand(gained, alone) -> None:
    """Nothing left out loses what is expected of it, give or take the root of twice that."""
    expected, deviation = 8.0, 4.0
    blocks = Gain(np.full(8, (gained * deviation - expected) / 8.0), (1.0, 1.0))
    proof = Proof(1.0, 1.0, 0.1, blocks, Gain(np.full(8, expected / 8.0), (1.0, 1.0)), 0.0, ())
    assert proof.speaks_alone == alone


@pytest.mark.parametrize(("error", "beyond_doubt", "broken"), [
    (0.208, False, [accept.STILL]), (0.208, True, []), (0.212, True, [accept.STILL]),
])  # fmt: skip
def test_exact_what_is_certain_may_stand_in_less_than_the_error_does(monkeypatch, error, beyond_doubt, broken) -> None:
    found = broken_rules(monkeypatch, 0.01, Gain(np.full(20, 2.0), (error, 0.2)), certain=beyond_doubt)
    assert found == broken


@pytest.mark.parametrize(("p", "broken"), [(0.05, []), (0.06, [accept.SHORT])])
def test_exact_what_the_screen_does_not_notice_is_left_to_the_held_out_recordings(monkeypatch, p, broken) -> None:
    assert broken_rules(monkeypatch, p, Gain(np.full(20, 2.0), (0.1, 0.2)), certain=True) == broken


@pytest.mark.parametrize(
    ("effect", "whole", "own", "broken"),
    [
        ("cogging", 2.0, 0.9, ["A10 own gain"]),
        ("cogging", 2.0, 1.1, []),
        ("cogging", 4.0, 0.9, ["A10 own gain"]),
        ("cogging", 4.0, 1.1, []),
        ("delay", 2.0, 0.1, ["A10 own gain"]),
        ("delay", 2.0, 0.9, []),
    ],
)
def test_exact_what_a_refit_moves_is_not_an_effects_own_gain(monkeypatch, effect, whole, own, broken) -> None:
    """Of 20 blocks half has to be its own, or 20 nats; a delay's own has to convince, here by 4 nats in all."""
    gains = [Gain(size + 0.1 * np.resize([1.0, -1.0], 20), (0.1, 0.2)) for size in (whole, own)]
    found = broken_rules(monkeypatch, 0.01, gains[0], certain=True, effect=effect, own=gains[1])
    assert found == broken


def broken_rules(
    monkeypatch, p: float, gained: Gain, *, certain: bool, effect: str = "cogging", own: Gain | None = None
) -> list[str]:
    """Those that an effect of this p value and gain breaks which breaks no other."""
    monkeypatch.setattr(accept, "certain", lambda *_: certain)
    monkeypatch.setattr(accept, "sizeable", lambda *_: True)
    monkeypatch.setattr(accept, "own_gain", lambda *_: own or gained)
    for rule in ("unresolved", "special"):
        monkeypatch.setattr(accept, rule, lambda *_: False)
    monkeypatch.setattr(accept, "strained", lambda *_: [])
    monkeypatch.setattr(accept, "_at_bounds", lambda *_: [])
    monkeypatch.setattr(accept, "calmer", lambda *_: 0.0)
    candidate = SimpleNamespace(effect=effect, label=effect)
    joint, replay = SimpleNamespace(mismatch=np.zeros(3)), SimpleNamespace()
    rules, seen = accept.Rules(0.1, np.zeros(3, dtype=int)), SimpleNamespace(p={effect: p})
    return list(accept.failed_rules(replay, joint, joint, candidate, gained, rules, seen))
