from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import small_campaign
from conftest import leave_figures_out
from hdfast.cli import main
from hdfast.diagnosis import diagnose
from hdfast.diagnosis.experiment import NOTHING, Contest, propose
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.library import Sizes, library
from hdfast.diagnosis.rivals import Rival
from hdfast.diagnosis.score import Gain
from hdfast.diagnosis.session import set_up_usable
from hdfast.diagnosis.steady import SPEED
from hdfast.diagnosis.swings import Swing
from hdfast.diagnosis.verdict import NAMED
from hdfast.recordings import load_campaign
from hdfast.report import diagnosis_details, diagnosis_page, diagnosis_plots, diagnosis_screen
from hdfast.report.diagnosis_details import pulls, time_strips
from hdfast.report.diagnosis_screen import TAGS, cards
from hdfast.report.diagnosis_swings import missing_tones, swings_section
from hdfast.report.diagnosis_tables import amplitude, plus_minus, spoken, trial_table, words
from hdfast.report.diagnosis_views import spectrum, telling, traces, traces_of
from hdfast.report.plots import svg


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("found")
    with pytest.MonkeyPatch.context() as patch:
        small_campaign.shorten_library(patch)
        return diagnose(small_campaign.write(folder, ["coulomb_friction"], {"T_c": 0.05}))


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quiet")
    with pytest.MonkeyPatch.context() as patch:
        small_campaign.shorten_library(patch)
        return diagnose(small_campaign.write(folder), threads=2)


@pytest.fixture(scope="module")
def unnamed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("unnamed")
    with pytest.MonkeyPatch.context() as patch:
        small_campaign.shorten_library(patch, ())
        return diagnose(small_campaign.write(folder, ["coulomb_friction"], {"T_c": 0.05}))


class Reader(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.references, self.words = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.references += [value for name, value in attrs if name in ("src", "href", "xlink:href", "srcset")]

    def handle_data(self, data):
        self.words.append(data)


def words_of(text):
    return " ".join(Reader(text).words)


@pytest.fixture(scope="module")
def page(found):
    return diagnosis_page.page(found)


@pytest.fixture(scope="module")
def quiet_page(quiet):
    with pytest.MonkeyPatch.context() as patch:
        leave_figures_out(patch)
        return diagnosis_page.page(quiet)


def test_exact_page_needs_nothing_else(page):
    reader = Reader(page)
    assert all(reference.startswith(("#", "data:image/png;base64,")) for reference in reader.references)
    assert {"script", "link", "img"}.isdisjoint(reader.tags)
    assert reader.tags.count("h1") == 1
    assert "A &lt;small&gt; campaign" in page


def test_regress_first_screen_names_effect_place_size_and_errors(found, page):
    assert found.verdict == "found"
    text = words_of(page).replace("\u00a0", " ")
    assert "The model leaves out Coulomb friction (50.4 ± 2.9 mN m) at the motor." in text
    assert "Error on recordings kept for the proof: 16.4 % → 2 %; white sensor noise alone makes 1.9 %." in text
    told = "Diagnosis(found: The model leaves out coulomb_friction; error on held-out recordings 16.4 % -> 2.0 %.)"
    assert repr(found) == told


def test_exact_a_quiet_campaign_says_what_would_have_been_seen(quiet, quiet_page):
    assert quiet.verdict == "no_evidence"
    text = words_of(quiet_page)
    assert "No evidence of left-out physics" in text
    assert "What would have been seen" in text
    assert "extended" not in text


def test_exact_what_was_not_screened_has_no_share_that_a_refit_leaves(quiet_page):
    assert re.search(r"thermal viscous\s+-\s+-\s+needs the temperature", words_of(quiet_page))


def test_exact_what_passes_beside_a_special_case_that_goes_first_does_not_gain_less(found):
    """Its gain may be the larger one: it has to be so clearly."""
    taken = found.evidence.session.search.rounds[0]
    own = taken.accepted
    law = replace(own, gain=replace(own.gain, by_block=own.gain.by_block + 1.0))
    text = words_of(trial_table(replace(taken, trials=[own, law])))
    assert text.index("passes, but another goes first") < text.index("accepted")


@pytest.mark.long
def test_exact_a_mismatch_without_a_name_shows_its_variables(unnamed, undrawn):
    assert unnamed.verdict == "depends_on"
    shown = cards(unnamed.content, unnamed.evidence, traces(unnamed.evidence))
    assert [card.title for card in shown][:3] == ["Where", "What it depends on best", "How much better"]
    assert words(unnamed.evidence.unknown.feature.name) in shown[4].figures[0].caption
    text = words_of(diagnosis_page.page(unnamed))
    held = unnamed.content["fit"]["heldout"]
    assert f"{100 * held['baseline_nrmse']:.1f} % → {100 * held['extended_nrmse']:.1f} %" in text


def test_exact_what_rests_on_fitted_recordings_says_so_beside_the_errors(found, undrawn):
    """Held-out recordings that do not reach an effect: a gain of theirs would read as a refusal."""
    nothing = Gain(np.zeros(20), (0.5, 0.5))
    silent = Proof(0.5, 0.5, 0.1, nothing, nothing, 50.0, found.evidence.proof.mismatch)
    assert silent.holds
    assert not silent.shows
    evidence = replace(found.evidence, session=replace(found.evidence.session, proof=silent))
    content = {**found.content, "notes": ["it rests on the others"]}
    better = cards(content, evidence, traces(evidence))[2]
    assert better.texts == ["it rests on the others"]


def test_exact_bars_have_the_names_of_the_verdict(found, undrawn, monkeypatch):
    """A law of which its special case is left has that one's; what is too unlikely for one has none."""
    [standing] = found.evidence.standings
    law = replace(standing.trial, candidate=replace(standing.trial.candidate, effect="stribeck_friction"))
    left, unlikely = replace(standing, trial=law), replace(standing, name="hysteresis", probability=0.6)
    bars, drawn = {}, diagnosis_plots.probabilities

    def noted(rows, sure):
        bars.update({name: named for name, _, named in rows})
        return drawn(rows, sure)

    monkeypatch.setattr(diagnosis_plots, "probabilities", noted)
    evidence = replace(found.evidence, standings=[left, unlikely])
    cards(found.content, evidence, traces(evidence))
    assert bars["Coulomb friction"]
    assert not bars["hysteresis"]
    assert "Stribeck friction" not in bars


def test_exact_shapes_of_one_rival_share_its_bar(found, undrawn, monkeypatch):
    """Lines of two orders in the place of one effect: the fainter one does not stand for both."""
    [standing] = found.evidence.standings
    rivals = [
        Rival("te_harmonic", f"te_harmonic order {order}", weight, 0.9, 1.0, (), standing.lesser)
        for order, weight in ((1, 0.3), (2, 0.1))
    ]
    bars = {}
    monkeypatch.setattr(
        diagnosis_plots, "probabilities", lambda rows, _: bars.update({name: share for name, share, _ in rows})
    )
    monkeypatch.setattr(diagnosis_screen, "picture", lambda *_: None)
    diagnosis_screen._what(
        found.content,
        replace(found.evidence, standings=[replace(standing, probability=0.6, rivals=tuple(rivals))]),
    )
    assert bars["or kinematic error line"] == pytest.approx(0.6 * (0.3 / 0.7 + 0.1 / 0.9))
    assert sum(bars.values()) == pytest.approx(1.0)


def test_exact_gains_are_told_as_they_are_judged(found, page, undrawn):
    """No block counts for more than it needs to convince: one in which both models are shaken says nothing."""
    [standing] = found.evidence.standings
    gained, told = standing.trial.gain, found.effects[0]["evidence"]
    assert gained.total > 1.5 * gained.limited
    assert told["gain"] == pytest.approx(told["gain_in_errors"] * told["gain_error"])
    assert f"{gained.limited:.1f} ± {gained.counted_error:.1f}" in words_of(page)
    shaken = replace(found.evidence.proof, gain=Gain(np.array([-1e3, *np.full(19, 8.0)]), (0.1, 0.5)))
    evidence = replace(found.evidence, session=replace(found.evidence.session, proof=shaken))
    better = cards(found.content, evidence, traces(evidence))[2]
    assert better.texts[0] == f"Proof: a gain of {142.0 / 18.0:.1f} standard errors."


def test_exact_an_undecided_page_begins_with_what_to_record_next(found, undrawn):
    session = found.evidence.session
    contest = Contest(("coulomb_friction", NOTHING), (session.search.final, session.baseline))
    experiment = propose(session.replay, contest, np.random.default_rng(0)).to_dict()
    finding = {"file": "r0.npz", "check": "torque_sign", "severity": "warning", "sentence": "s", "t0": 0.5, "t1": None}
    changed = {"verdict": "undecided", "next_experiment": experiment, "health": [finding], "notes": ["a weaker proof"]}
    text = diagnosis_page.page(replace(found, content={**found.content, **changed}))
    titles = re.findall(r"<h2>([^<]*)</h2>", text)
    assert titles.index("What to record next") < titles.index("When")
    for part in ("rad/s in", "Coulomb friction from nothing left out", "torque_sign", "a weaker proof"):
        assert part in text


def test_exact_files_keep_their_names(found, undrawn):
    """Also one that is the id of an effect; its clock, from 1970, is told to the millisecond."""
    names = ("motor_speed_ladder.csv", "coulomb_friction")
    recordings = [replace(one, name=name) for one, name in zip(found.campaign.recordings, names, strict=False)]
    sentence = "motor_speed is not the rate of motor_angle, as in coulomb_friction"
    finding = {"file": names[0], "check": "clock", "severity": "note", "sentence": sentence}
    note = f"{names[0]}: hides load_side_friction"
    content = {**found.content, "health": [finding | {"t0": 1.7e9 + 0.999, "t1": 1.7e9 + 1.1}], "notes": [note]}
    changed = replace(found, content=content, campaign=replace(found.campaign, recordings=recordings))
    text = words_of(diagnosis_page.page(changed))
    assert "motor speed is not the rate of motor_angle, as in coulomb_friction" in text
    assert "motor_speed_ladder.csv: hides load-side friction" in text
    assert "1700000000.999" in text
    assert "1700000001.100" in text


def test_regress_only_whole_words_are_spoken():
    assert spoken("motor_speed_01: backlash -> torque_ripple") == "motor_speed_01: backlash → torque ripple"
    assert (
        spoken("day.motor_speed depends on motor_speed", ["day.motor_speed"])
        == "day.motor_speed depends on motor speed"
    )


def test_exact_numbers_are_written_where_the_page_fails(quiet, tmp_path, monkeypatch):
    monkeypatch.setattr(diagnosis_page, "page", lambda _: pytest.fail("no page"))
    with pytest.raises(pytest.fail.Exception, match="no page"):
        quiet.report(tmp_path)
    assert json.loads((tmp_path / "verdict.json").read_text()) == quiet.to_dict()


def test_exact_a_drive_that_is_known_exactly_has_no_distances():
    axes = pulls([], np.empty(0), None, []).axes[0]
    assert axes.get_xlim() == pytest.approx((-2.2, 2.2))


def test_exact_a_parameter_that_the_extended_model_lacks_has_no_dot(found, monkeypatch):
    """A declared law that another one has replaced."""
    session = found.evidence.session
    swapped = replace(session, baseline=session.search.final, search=replace(session.search, final=session.baseline))
    moved, drawn = {}, diagnosis_details.pulls

    def noted(names, before, after, marked):
        moved.update(zip(names, after, strict=True))
        return drawn(names, before, after, marked)

    monkeypatch.setattr(diagnosis_details, "pulls", noted)
    diagnosis_page._parameters(found.content, replace(found.evidence, session=swapped))
    assert [name for name, distance in moved.items() if np.isnan(distance)] == ["coulomb_friction_T_c"]


def test_exact_windows_stand_over_the_fitted_part_of_a_recording_alone(found):
    """Both parts of a recording whose last part was set aside have its name."""
    fitted = next(one for one in traces(found.evidence) if one.unit.role == "fit")
    held = replace(fitted, unit=replace(fitted.unit, role="heldout"))
    axes = time_strips([held, fitted], [(0.5, 1.0, fitted.unit.name)]).axes[0]
    assert [float(line.get_ydata()[0]) for line in axes.lines] == pytest.approx([1.0 - 0.42])


def test_exact_recordings_hours_apart_are_drawn_from_their_own_starts(found):
    """On one clock for all of them each would be a line of no width; what was cut off one stays where it was."""
    fitted = next(one for one in traces(found.evidence) if one.unit.role == "fit")
    starts = {"r0.npz": 1.7e9, "r1.npz": 1.7e9 + 7200.0}
    units = [replace(fitted.unit, name=name, offset=start) for name, start in starts.items()]
    last = replace(units[1], role="heldout", offset=starts["r1.npz"] + 2.1, before=2.1)
    windows = [(start + 0.5, start + 1.0, name) for name, start in starts.items()]
    axes = time_strips([replace(fitted, unit=unit) for unit in (*units, last)], windows).axes[0]
    long = float(fitted.unit.t[-1])
    assert axes.get_xlim() == pytest.approx((0.0, 2.1 + long))
    np.testing.assert_allclose([line.get_xdata() for line in axes.lines], [(0.5, 1.0)] * 2, atol=1e-6)
    drawn = [image.get_extent()[:2] for image in axes.images]
    np.testing.assert_allclose(drawn, [(0.0, long), (0.0, long), (2.1, 2.1 + long)], atol=1e-6)


def test_exact_the_size_of_an_effect_is_that_of_the_parameter_that_was_fitted():
    """The catalogue's amplitude may be held at 0 beside it, as one of two ripples."""
    sizes = Sizes(
        motor_torque=0.1, speed=100.0, stiffness=3e4, ratio=121.0, corner=100.0, elastic=True, loaded=True, warm=True,
        orders=(), detents=None, turns=50.0, lines=(), tones=(5.0,), channels=("motor_torque", "load_angle"),
    )  # fmt: skip
    for one in library(sizes):
        parameters = {name: {"value": 1.0, "sigma": 0.1} for name in one.names}
        parameters |= {name: {"value": 0.0, "sigma": 0.0} for name in one.fixed}
        own = f"{one.sensors[0][1]}_{one.effect}_" if one.sensors else f"{one.law}_"
        told = {name.removeprefix(own): entry for name, entry in parameters.items()}
        name, entry = amplitude({"effect": one.effect, "parameters": told})
        assert name == one.amplitude.removeprefix(own)
        assert entry["sigma"] > 0.0
    assert amplitude({"effect": "unknown", "parameters": {}}) is None


def test_regress_the_name_of_a_recording_is_no_formula(found):
    """Between dollar signs Matplotlib reads mathematics, and fails at what is none."""
    name = "run$_$1"
    every = [replace(one, unit=replace(one.unit, name=name)) for one in traces(found.evidence)]
    channel, whole = every[0].channel, (every[0].t[0], every[0].t[-1])
    columns = {"t": np.arange(10.0), "motor_angle": np.arange(10.0), "motor_torque": np.arange(10.0)}
    for figure in (
        time_strips(every, []), diagnosis_details.phase_planes(every, channel),
        diagnosis_details.recordings(every, channel), diagnosis_details.raw([(name, columns)]),
        diagnosis_plots.overlay(every[0], whole),
    ):  # fmt: skip
        assert svg(figure).startswith("<svg")


def test_exact_every_verdict_has_a_tag():
    assert set(TAGS) == set(NAMED)


def test_exact_rejected_recordings_are_shown_with_the_reason(tmp_path):
    path = small_campaign.write(tmp_path)
    for name in ("r0", "r1", "r2", "r3"):
        table = dict(np.load(tmp_path / f"{name}.npz"))
        del table["motor_torque"]
        np.savez(tmp_path / f"{name}.npz", **table)
    rejected = diagnose(load_campaign(path))
    assert rejected.verdict == "data_rejected"
    text = words_of(diagnosis_page.page(rejected))
    assert "Recordings rejected" in text
    assert "motor_torque" in text
    assert "The recordings as they were read" in text


@pytest.mark.long
def test_exact_command_writes_the_same_page_from_another_run(tmp_path, monkeypatch, undrawn, capsys, quiet_page):
    """On one thread instead of two."""
    small_campaign.shorten_library(monkeypatch)
    out = tmp_path / "out"
    assert main(["diagnose", str(small_campaign.write(tmp_path)), "--out", str(out), "--threads", "1"]) == 0
    assert str(out / "report.html") in capsys.readouterr().out
    names = {"report.html", "verdict.json", "extended_model.toml", "campaign.toml"}
    assert {path.name for path in out.iterdir()} == names
    assert json.loads((out / "verdict.json").read_text())["verdict"] == "no_evidence"
    assert (out / "report.html").read_text() == quiet_page


def test_exact_without_report_the_other_files_are_the_same(tmp_path, monkeypatch, quiet, capsys, undrawn):
    monkeypatch.setattr("hdfast.diagnosis.command.diagnose", lambda _campaign, **_: quiet)
    campaign = small_campaign.write(tmp_path)
    whole, short = tmp_path / "whole", tmp_path / "short"
    for out, flags in ((whole, []), (short, ["--no-report"])):
        assert main(["diagnose", str(campaign), "--out", str(out), *flags]) == 0
    assert str(short) in capsys.readouterr().out
    assert {path.name for path in short.iterdir()} == {path.name for path in whole.iterdir()} - {"report.html"}
    for path in short.iterdir():
        assert path.read_bytes() == (whole / path.name).read_bytes()


def test_exact_telling_window_is_of_a_recording_kept_for_the_proof(found):
    trace, (begin, end) = telling(traces(found.evidence))
    assert trace.unit.role == "heldout"
    assert trace.channel == "motor_torque"
    assert trace.t[0] <= begin < end <= trace.t[-1]


def test_exact_prediction_is_measured_minus_mismatch(found):
    session = found.evidence.session
    trace = next(one for one in traces(found.evidence) if one.unit.name == session.replay.plant.units[0].name)
    where = session.replay.layout.pieces[0][2]
    known = np.isfinite(trace.missing)
    np.testing.assert_allclose(trace.missing[known], session.baseline.mismatch[where], atol=1e-12)
    np.testing.assert_allclose(trace.left[known], session.search.final.mismatch[where], atol=1e-12)


def test_exact_spectrum_of_two_known_lines_at_a_speed_that_changes():
    t = np.linspace(0.0, 6.0, 6001)
    turns = 5.0 * t + 0.3 * np.sin(t)
    signal = 2e-3 * np.cos(2.0 * np.pi * 2.0 * turns) + 5e-4 * np.sin(2.0 * np.pi * 5.0 * turns)
    place, size = spectrum([turns], [signal], 10.0)
    near = [np.nanmax(size[np.abs(place - line) < 0.05]) for line in (2.0, 5.0, 3.5)]
    assert near[0] == pytest.approx(2e-3, rel=0.1)
    assert near[1] == pytest.approx(5e-4, rel=0.1)
    assert near[2] < 1e-4


def test_exact_a_line_has_no_mirror_in_its_spectrum():
    """Samples every 2 ms beside cells of other widths: shares of them, not whole ones, go into the sums."""
    t = np.arange(0.0, 8.0, 0.002)
    place, size = spectrum([t], [np.sin(2.0 * np.pi * 40.0 * t)], 200.0)
    assert np.nanmax(size) == pytest.approx(1.0, rel=0.02)
    assert np.nanmax(size[np.abs(place - 40.0) > 15.0]) < 0.01


@pytest.mark.parametrize(
    ("value", "sigma", "unit", "text"),
    [
        (0.0374, 0.00069, "N m", "37.40 ± 0.69 mN m"),
        (121.0, None, "1", "121"),
        (-3.1e15, 3e14, "kg m^2", "-3.1e+15 ± 3e+14 kg m^2"),
        (-0.0003, 0.05, "1", "0.000 ± 0.050"),
        (None, None, "rad", "-"),
    ],
)
def test_exact_sizes_are_written_with_two_digits_of_their_deviation(value, sigma, unit, text):
    assert plus_minus(value, sigma, unit) == text


def test_exact_samples_that_follow_each_other_are_neighbours_in_pictures(tmp_path):
    """Where the band leaves every other sample out, lines through the rest are drawn all the same."""
    replay = set_up_usable(load_campaign(small_campaign.write(tmp_path, angle_noise=1e-4)), None).replay
    assert replay.plant.band.stride("motor_torque") > 1
    nothing = np.zeros(replay.layout.size)
    for trace in traces_of(replay, (nothing, nothing), ("nominal", "")):
        known = np.isfinite(trace.measured)
        assert np.mean(known[1:] & known[:-1]) > 0.5
        assert len(trace.t) == len(trace.unit.speed) == len(trace.measured)


def test_exact_a_swing_is_shown_as_no_claim(quiet):
    assert not swings_section(quiet.evidence).texts
    swinging = replace(quiet.evidence.where, swings=(Swing(5.5, 1.0, SPEED, 1e-4),))
    section = swings_section(replace(quiet.evidence, where=swinging))
    assert len(section.texts) == len(section.figures) == 1
    assert "motor speed swings at 5.5 Hz" in section.texts[0]
    assert "no claim of an effect" in section.texts[0]


def test_exact_what_swings_in_the_recordings_is_no_line_of_the_mismatch():
    where = {"frequencies_hz": [12.0, 5.5], "swings": [{"frequency_hz": 5.5, "channel": SPEED, "p": 1e-4}]}
    assert missing_tones(where) == [12.0]
