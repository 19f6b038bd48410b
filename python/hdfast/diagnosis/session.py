"""One diagnosis from checked recordings to a searched model, stage by stage."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import median_high

import numpy as np

from hdfast.diagnosis.band import HIGHEST_RATE, MOST_SAMPLES, choose_band
from hdfast.diagnosis.baseline import baseline, with_resonance
from hdfast.diagnosis.beside import beside
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.evidence import lay_out
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.lateness import LOAD, means, neglected, on_time
from hdfast.diagnosis.lesser import Lesser
from hdfast.diagnosis.library import HIGHEST_INTEGER, Sizes, library
from hdfast.diagnosis.lines import order_lines, several, snapped, tone_lines
from hdfast.diagnosis.multistart import multistart
from hdfast.diagnosis.noise import COLUMNS, as_coarse, floors, stated
from hdfast.diagnosis.plant import Plant
from hdfast.diagnosis.prepare import CONSTANT, Unit, prepare
from hdfast.diagnosis.prove import proven
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import noise_floor
from hdfast.diagnosis.select import search
from hdfast.diagnosis.source import Source, fitted
from hdfast.diagnosis.stages import Stages
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.trials import Search
from hdfast.errors import InputError
from hdfast.health import Health, check
from hdfast.health.result import RecordingHealth
from hdfast.health.subject import REQUIRED
from hdfast.recordings import Campaign
from hdfast.recordings.aside import LAST_SHARE, parts, set_aside
from hdfast.recordings.clock import period
from hdfast.spring import COEFFICIENTS

HELD = 0.7
STIFF = 1e4
FAR_SLOWER = 0.5
MOST_LINES = 6
LESS = "for the proof, which proves less than recordings of another day"
NOTHING_HELD = "no recording is held out"
NOTHING_LEFT = "none of the recordings that are held out can be used"
UNPROVEN = "nothing is proven on other recordings: no sample of what is held out can be judged"
WHERE_TO_LOOK = "look for an inertia, stiffness or damping of [drive] that is zero, negative or far off"
LOST = "nothing is proven on other recordings: the drive as stated cannot be simulated along what is held out"


@dataclass(frozen=True, eq=False)
class Session:
    """Everything a verdict is read from.

    Attributes:
        campaign: the checked campaign.
        replay: the recordings that are fitted.
        held: the recordings kept for the proof, or None.
        baseline: the calibrated nominal model.
        search: rounds and result of the search.
        proof: baseline and extended model on held-out recordings, or None.
        shown: gain of each accepted effect there, by its label.
        lessers: of several accepted effects, the final model without one and what that one gains, by its label.
        floor: nrmse of the sensor noise on the fitted recordings.
        warnings: what is said of the recordings as they were set up.
    """

    campaign: Campaign
    replay: Replay = field(repr=False)
    held: Replay | None = field(repr=False)
    baseline: Fit = field(repr=False)
    search: Search = field(repr=False)
    proof: Proof | None
    shown: Mapping[str, float]
    lessers: Mapping[str, Lesser] = field(repr=False)
    floor: float
    warnings: Sequence[str]


@dataclass(frozen=True, eq=False)
class Setup:
    """Recordings at the working rate, ready for fits and for the proof.

    Attributes:
        campaign: the checked campaign.
        replay: the recordings that are fitted.
        held: the recordings kept for the proof, or None.
        period: between the samples of the slowest recording [s].
        warnings: what the health checks want to be mended or kept in mind, how held-out data were made when the
            campaign names none, recordings that are far slower than the others, and what of a sensor is not used.
        notes: what else the health checks found.
    """

    campaign: Campaign
    replay: Replay = field(repr=False)
    held: Replay | None = field(repr=False)
    period: float
    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()


def usable(health: Health) -> list[Source]:
    """The recordings that the health checks leave, with the samples that may be judged."""
    return [
        Source(
            name=item.name,
            recording=item.recording,
            role=item.source.role,
            group=item.source.group,
            good=item.mask[item.timed],
            start=float(item.recording["t"][0]),
            news=_news(item),
            steps=item.facts.resolution,
        )
        for item in health
        if item.usable and item.recording is not None
    ]


def _news(item: RecordingHealth) -> dict[str, float]:
    """New values per second of the columns that hold theirs."""
    rates = item.facts.effective_rate_hz
    return {name: rates[name] for name in COLUMNS if rates.get(name, math.inf) < HELD * item.facts.rate_hz}


def set_up(campaign: Campaign, sources: Sequence[Source], threads: int | None) -> Setup:
    """Bring the recordings of a campaign to one band.

    Args:
        campaign: the checked campaign.
        sources: its usable recordings.
        threads: threads of the engine.

    Raises:
        InputError: no sample of what is fitted can be judged, or the motor torque is constant.
    """
    ratio = campaign.priors["ratio"].value
    locked = stands_still(campaign, max(float(np.ptp(source.recording["t"])) for source in sources))
    inertia = turned(campaign, locked)
    named = any(one.role == "heldout" for one in campaign.recordings)
    slowest = max(period(source.recording["t"]) for source in sources)
    sources = on_time(campaign, sources)
    slow = far_slower(sources)
    sources, weaker = with_heldout(sources, NOTHING_LEFT if named else NOTHING_HELD)
    sensors = as_coarse(campaign.sensors, fitted(sources))
    band = choose_band(sources, inertia, sensors)
    campaign = with_resonance(campaign, band.motion)
    averaged = means(campaign)
    units = warmed(
        [prepare(one, band, ratio, number=n, means=averaged, locked=locked) for n, one in enumerate(sources)]
    )
    channels = list(dict.fromkeys(channel for unit in units if unit.role == "fit" for channel in unit.measured))
    floor = floors(fitted(sources), channels, band, sensors, ratio, inertia)
    noise = stated(channels, sensors, ratio, floor)

    def replay(role: str) -> Replay:
        plant = Plant([unit.seen_on(channels) for unit in units if unit.role == role], channels, band, threads)
        return Replay(plant, lay_out(plant, noise), floor, noise)

    judged = replay("fit")
    if not judged.layout.size:
        remedy = ". ".join(slow) or "record longer strokes, or with a faster clock"
        raise InputError(
            f"{', '.join(unit.name for unit in judged.plant.units)}: no sample can be judged: near standstill and near "
            f"reversals nothing is, and with the band of {band.motion:.3g} Hz that clock and noise of the angle leave, "
            f"that is all of the motion; {remedy}"
        )
    if judged.plant.torque_spread <= CONSTANT * judged.plant.torque_level:
        raise InputError(
            "motor_torque is constant in half of the recordings or more, so that nothing can be told from it: record "
            "what moves the drive; for the kinematic error alone there is hdfast identify kinematic-error"
        )
    held = replay("heldout") if any(unit.role == "heldout" for unit in units) else None
    if held is not None and not held.layout.size:
        held, weaker = None, UNPROVEN
    return Setup(campaign, judged, held, slowest, [*([weaker] if weaker else []), *slow, *neglected(campaign)])


def far_slower(sources: Sequence[Source]) -> list[str]:
    """A sentence on every recording that costs the others more than half of the rate they would be compared at.

    That is their own, up to where a working rate ends.
    """
    total = sum(float(np.ptp(source.recording["t"])) for source in fitted(sources))
    usual = min(median_high(source.rate for source in sources), HIGHEST_RATE, MOST_SAMPLES / total)
    return [
        f"{source.name}: it has {source.rate:.3g} new samples per second, and all recordings are compared at the rate "
        f"of the slowest, others at {usual:.3g} Hz without it; leave it out, or record it with a faster clock"
        for source in sources
        if source.rate < FAR_SLOWER * usual
    ]


def warmed(units: Sequence[Unit]) -> list[Unit]:
    """The recordings, of those held out also the ones without a temperature at the mean of those fitted.

    Where one of those fitted has none, no temperature counts.
    """
    known = [float(np.mean(unit.temperature)) for unit in units if unit.role == "fit" and unit.temperature is not None]
    if len(known) < sum(unit.role == "fit" for unit in units):
        return [replace(unit, temperature=None) for unit in units]
    usual = float(np.mean(known))
    return [
        replace(unit, temperature=np.full_like(unit.t, usual))
        if unit.role == "heldout" and unit.temperature is None
        else unit
        for unit in units
    ]


def stands_still(campaign: Campaign, longest: float) -> bool:
    """Whether the load's torsional resonance takes longer than the longest recording [s], as that of a locked output.

    It stands still in all of them, then.
    """
    inertia, stiffness = (campaign.priors[name].value for name in ("J_l", COEFFICIENTS[campaign.drive.spring][0]))
    return campaign.base == "two_inertia" and inertia > stiffness * (longest / (2.0 * math.pi)) ** 2


def turned(campaign: Campaign, locked: bool) -> float:
    """Inertia at the motor that the noise of its angle makes a torque of [kg m^2]; it does not reach a locked load."""
    priors = campaign.priors
    return priors["J_m"].value + (0.0 if locked else priors["J_l"].value / priors["ratio"].value ** 2)


def set_up_usable(campaign: Campaign, threads: int | None) -> Setup:
    """As `set_up`, with what the health checks leave of a campaign.

    Raises:
        InputError: they leave nothing that can be fitted.
    """
    health = check(campaign)
    if not health.usable:
        raise InputError(health.complaint)
    setup = set_up(campaign, usable(health), threads)
    return replace(setup, warnings=[*health.warnings, *setup.warnings], notes=health.notes)


def nominal(setup: Setup) -> Structure:
    """The model of the campaign with what its priors leave open.

    Raises:
        InputError: it cannot be simulated as it is stated.
    """
    structure = baseline(setup.campaign, setup.replay.plant.torque_spread, setup.period)
    if not np.isfinite(setup.replay.mismatch(structure, structure.start[None])).all():
        raise InputError(
            f"{setup.campaign.title}: the drive as stated cannot be simulated along the recorded motion; "
            f"{setup.replay.plant.refused(structure) or WHERE_TO_LOOK}"
        )
    return structure


def run(campaign: Campaign, sources: Sequence[Source], seed: int, threads: int | None, stages: Stages) -> Session:
    """Calibrate, search, prove.

    Args:
        campaign: the checked campaign.
        sources: its usable recordings.
        seed: of the draws of the screen.
        threads: threads of the engine.
        stages: is told what happens.
    """
    setup = set_up(campaign, sources, threads)
    replay, held, warnings, stated = setup.replay, setup.held, setup.warnings, nominal(setup)
    stages.expect(2)
    band = replay.plant.band
    stages.done(f"{len(replay.plant.units)} recordings at {band.rate:.0f} Hz, band {band.motion:.0f} Hz")
    if held is not None and not np.isfinite(held.mismatch(stated, stated.start[None])).all():
        held, warnings = None, [*warnings, LOST]
    calibrated = multistart(replay, stated)
    stages.done("calibrated the nominal model")
    floor = noise_floor(replay)
    rng = np.random.default_rng([seed, 1])
    ratio = calibrated.value("ratio")
    found = search(replay, calibrated, lambda current: candidates(replay, current, ratio), floor, rng, stages)
    proof: Proof | None = None
    shown: dict[str, float] = {}
    lessers: dict[str, Lesser] = {}
    if held is not None:
        (found, proof, shown), lessers = beside(replay, held, proven(replay, held, found), floor)
    baseline = found.rounds[0].before
    return Session(setup.campaign, replay, held, baseline, found, proof, shown, lessers, floor, warnings)


def candidates(replay: Replay, current: Fit, ratio: float) -> list[Candidate]:
    """The library for the present mismatch: its lines and tones become hypotheses.

    At a steady speed the steps of an encoder make a line anywhere, so that one at an order that no drive is known for
    has to stand in several recordings, as tones have.
    """
    units = replay.plant.units
    model = current.structure.model
    whole = range(1, HIGHEST_INTEGER + 1)
    load = 1.0 / abs(ratio)
    expected = [load, 2.0 * load, *(order * turn for order in whole for turn in (1.0, 1.0 - 1.0 / ratio))]
    least = several(replay)
    found = [(line, snapped(line, expected)) for line in order_lines(replay, current.mismatch)]
    lines = [order for line, order in found if order in expected or line.recordings >= least]
    tones = [line.position for line in tone_lines(replay, current.mismatch) if line.recordings >= least]
    sizes = Sizes(
        motor_torque=replay.plant.torque_spread,
        speed=max(float(np.abs(unit.speed).max()) for unit in units),
        stiffness=current.stiffness if model.base == "two_inertia" else STIFF,
        ratio=ratio,
        corner=replay.plant.band.motion,
        elastic=model.base == "two_inertia",
        loaded=replay.plant.loaded,
        warm=replay.plant.warm,
        orders=tuple(model.order_values),
        detents=current.structure.fixed.get("cogging_order"),
        turns=max(float(np.ptp(unit.angle)) for unit in units) / (2.0 * np.pi),
        lines=tuple(lines[:MOST_LINES]),
        tones=tuple(tones[: MOST_LINES // 2]),
        channels=tuple("load_angle" if channel == "te" else channel for channel in replay.plant.channels),
    )
    return library(sizes)


def with_heldout(sources: Sequence[Source], reason: str = NOTHING_HELD) -> tuple[list[Source], str | None]:
    """The sources with something held out, and a sentence that begins with a reason where none is named or left."""
    if any(source.role == "heldout" for source in sources):
        return list(sources), None
    group = set_aside(source.group for source in sources)
    if group is not None:
        kept = [replace(one, role="heldout") if one.group == group else one for one in sources]
        return kept, f"{reason}: group {group} was set aside {LESS}"
    cut = []
    for source in sources:
        first, last = parts(source.recording["t"])
        cut += [_part(source, first, "fit"), _part(source, last, "heldout")]
    cut = [one for one in cut if set(REQUIRED) <= set(one.recording)]
    share = f"the last {100 * LAST_SHARE:.0f} % of each"
    if all(one.role == "fit" for one in cut):
        return cut, f"{reason}, and {share} have no motor angle or torque: nothing is proven on other recordings"
    return cut, f"{reason}: {share} were set aside {LESS}"


def _part(source: Source, rows: np.ndarray, role: str) -> Source:
    own = {name: values[rows] for name, values in source.recording.items()}
    columns = {name: values for name, values in own.items() if name == LOAD or np.isfinite(values).any()}
    return replace(source, recording=columns, role=role, good=source.good[rows])
