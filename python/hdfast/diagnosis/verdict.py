"""The verdict: what `verdict.json` says, by the rules that match first."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.experiment import NOTHING, Contest, Experiment, propose
from hdfast.diagnosis.facts import FACTS
from hdfast.diagnosis.features import features
from hdfast.diagnosis.fit import Bench, Fit
from hdfast.diagnosis.holdout import Proof
from hdfast.diagnosis.limits import Limit, limits, without_windup
from hdfast.diagnosis.locate import Where, locate
from hdfast.diagnosis.masking import Masked, masked, pulled
from hdfast.diagnosis.rivals import ALIKE, CLOSE_ERRORS, INDISTINCT, SURE, Standing, stand
from hdfast.diagnosis.score import CONVINCING, nrmse
from hdfast.diagnosis.select import ALONE, TIMING
from hdfast.diagnosis.session import Session
from hdfast.diagnosis.unknown import Unknown, describe
from hdfast.health import Health

NAMED = ("no_evidence", "found", "undecided", "depends_on", "sensor", "not_reproducible", "data_rejected")
NOWHERE: dict[str, Any] = {
    "place": None,
    "place_candidates": [],
    "windows": [],
    "phase": "all",
    "orders": [],
    "frequencies_hz": [],
    "depends_on": [],
    "memory": "none",
}
PASTS = {"none": "", "rate_independent": " and on its path", "fading": " and on its recent past"}
OF_THE_WINDUP = ("hysteresis", "viscoelastic", "backlash", "soft_windup", "mesh_stiffness_variation", "load_compliance")


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is said, and the evidence it rests on.

    Attributes:
        name: one of `NAMED`.
        sentence: the verdict in one line.
        session: calibration, search and proof.
        standings: accepted effects with probabilities and rivals.
        unknown: best description by a state variable alone, or None.
        where: location of the mismatch.
        masked: parameters that had swallowed an effect.
        limits: what these recordings can show of every effect.
        experiment: the manoeuvre that would decide, or None when nothing is open.
    """

    name: str
    sentence: str
    session: Session = field(repr=False)
    standings: tuple[Standing, ...] = field(repr=False)
    unknown: Unknown | None = field(repr=False)
    where: Where
    masked: tuple[Masked, ...]
    limits: tuple[Limit, ...] = field(repr=False)
    experiment: Experiment | None = field(repr=False)

    @property
    def extended(self) -> Fit | None:
        """The model with what was left out, named or not; None where nothing was added."""
        if self.name == "depends_on" and self.unknown is not None:
            return self.unknown.fit
        return self.session.search.final if self.session.search.accepted else None

    @property
    def proof(self) -> Proof | None:
        """Both models on held-out recordings, or None without any."""
        return self.unknown.proof if self.name == "depends_on" and self.unknown is not None else self.session.proof


def conclude(session: Session, seed: int) -> Verdict:
    """Weigh what the session found."""
    bench, search = session.bench, session.search
    rng = np.random.default_rng([seed, 2])
    standings = stand(bench, search, session.floor, rng)
    unknown = None if standings else _unknown(session, rng)
    where = locate(bench, session.baseline, search.final)
    rigid = session.baseline.structure.model.base == "one_inertia"
    last = search.rounds[-1]
    known = [*limits(last.signatures, last.screen), *(without_windup(OF_THE_WINDUP) if rigid else [])]
    name, reason, contest = _decide(session, standings, unknown)
    experiment = None if contest is None else propose(bench, contest, np.random.default_rng([seed, 3]))
    hidden = masked(session.baseline, search.final, bench.layout) if standings else []
    sentence = _sentence(name, standings, unknown, session, reason)
    return Verdict(name, sentence, session, tuple(standings), unknown, where, tuple(hidden), tuple(known), experiment)


def _unknown(session: Session, rng: np.random.Generator) -> Unknown | None:
    """The best state variable for a mismatch without a name."""
    final = session.search.final
    found = features(session.bench, final.value("ratio"), final.value("J_l"))
    return describe(session.bench, session.held, final, found, rng)


def _decide(
    session: Session, standings: Sequence[Standing], unknown: Unknown | None
) -> tuple[str, str, Contest | None]:
    """The verdict and, for an undecided one, why and between which models."""
    search = session.search
    if not standings:
        if unknown is not None and unknown.accepted:
            return "depends_on", "", None
        first = search.rounds[0]
        near = [
            trial
            for trial in first.trials
            if trial.failed == ("A2 error",)
            and trial.candidate.effect not in TIMING
            and first.screen.p[trial.candidate.label] <= ALONE
            and trial.gain.total >= CONVINCING
        ]
        if near:
            best = max(near, key=lambda trial: trial.gain.total)
            contest = Contest((best.candidate.effect, NOTHING), (best.fit, first.before))
            return "undecided", "something is there, but nothing improves the prediction enough", contest
        return "no_evidence", "", None
    leading = max(standings, key=lambda one: one.alone.total)
    if session.proof is not None and not session.proof.holds:
        contest = Contest((leading.name, NOTHING), (search.final, leading.lesser))
        return "undecided", "the improvement does not show on the held-out recordings", contest
    rivals = leading.rivals
    if leading.probability < SURE:
        reason = f"{leading.name} cannot be told from {rivals[0].effect}"
        return "undecided", reason, Contest((leading.name, rivals[0].effect), (search.final, rivals[0].fit))
    close = [rival for rival in rivals if rival.alike > INDISTINCT and rival.behind < CLOSE_ERRORS]
    if close:
        reason = f"{leading.name} looks like {close[0].effect} on these recordings"
        return "undecided", reason, Contest((leading.name, close[0].effect), (search.final, close[0].fit))
    if all(one.trial.candidate.place == "sensor" for one in standings):
        return "sensor", "", None
    return "found", "", None


def _sentence(name: str, standings: Sequence[Standing], unknown: Unknown | None, session: Session, reason: str) -> str:
    sure = [one for one in standings if one.probability >= SURE]
    effects = ", ".join(dict.fromkeys(one.name for one in sure))
    better = ""
    proof = session.proof if standings else unknown.proof if unknown else None
    if proof is not None and math.isfinite(proof.extended):
        better = f"; error on held-out recordings {100 * proof.baseline:.1f} % -> {100 * proof.extended:.1f} %"
    if name in ("found", "sensor"):
        return f"The model leaves out {effects}{better}."
    if name == "depends_on" and unknown is not None:
        feature = unknown.feature
        past = PASTS[feature.memory]
        return (
            f"None of the known effects: a torque at the {feature.place} that depends on {feature.name}{past}{better}."
        )
    if name == "undecided":
        return f"Undecided: {reason}{better}."
    return "No evidence of left-out physics in these recordings."


def _notes(session: Session) -> list[str]:
    """What weakens the proof."""
    notes = [session.weaker] if session.weaker else []
    proof = session.proof
    if session.search.accepted and proof is not None and proof.holds and not proof.shows:
        notes.append("the held-out recordings do not show it: it rests on stretches of the others that were left out")
    return notes


def _findings(health: Health) -> list[dict[str, Any]]:
    """What the health checks said, file by file."""
    listed = [("", finding) for finding in health.findings]
    listed += [(item.name, finding) for item in health for finding in item.findings]
    return [{"file": name, **vars(finding)} for name, finding in listed]


def rejected(health: Health, seed: int, version: str) -> dict[str, Any]:
    """The content of verdict.json when the recordings cannot be used."""
    content: dict[str, Any] = _finite(
        {
            "verdict": "data_rejected",
            "sentence": f"The recordings cannot be used. {health.complaint}",
            "effects": [],
            "where": NOWHERE,
            "fit": {
                "fit": {"baseline_nrmse": None, "extended_nrmse": None},
                "heldout": {"baseline_nrmse": None, "extended_nrmse": None, "noise_floor_nrmse": None},
            },
            "masking": [],
            "not_showable": [],
            "next_experiment": None,
            "health": _findings(health),
            "seed": seed,
            "version": version,
        }
    )
    return content


def as_dict(verdict: Verdict, health: Health, seed: int, version: str) -> dict[str, Any]:
    """The content of verdict.json."""
    session = verdict.session
    final, layout = session.search.final, session.bench.layout
    sigma = final.sigma_of(layout)
    every = [_effect(one, verdict, sigma) for one in verdict.standings]
    effects = [one for one in every if one["probability"] >= SURE or verdict.name == "undecided"]
    unknown = verdict.unknown if verdict.name == "depends_on" else None
    if unknown is not None:
        effects.append(_unknown_effect(unknown, session.bench))
    content: dict[str, Any] = _finite(
        {
            "verdict": verdict.name,
            "sentence": verdict.sentence,
            "effects": effects,
            "candidates": [one for one in every if one not in effects],
            "where": _where(verdict),
            "fit": _fit(verdict),
            "masking": [vars(one) for one in verdict.masked],
            "displaced": pulled(session.baseline),
            "not_showable": [
                {
                    "effect": one.effect,
                    "reason": one.reason,
                    "minimum_detectable": one.minimum_detectable,
                    "unit": one.unit,
                    "visibility": one.visibility,
                }
                for one in verdict.limits
                if one.reason is not None
            ],
            "detectable": [
                {"effect": one.effect, "minimum_detectable": one.minimum_detectable, "unit": one.unit}
                for one in verdict.limits
                if one.reason is None
            ],
            "next_experiment": None if verdict.experiment is None else verdict.experiment.to_dict(),
            "notes": _notes(session),
            "health": _findings(health),
            "seed": seed,
            "version": version,
        }
    )
    return content


def _effect(one: Standing, verdict: Verdict, sigma: Mapping[str, float]) -> dict[str, Any]:
    final = verdict.session.search.final
    candidate = one.trial.candidate
    seen = next(r for r in verdict.session.search.rounds if r.accepted is one.trial)
    prefixes = [f"{channel}_{effect}_" for effect, channel in candidate.sensors] or [f"{candidate.effect}_"]
    parameters: dict[str, Any] = {
        free.name.removeprefix(prefixes[0]): {
            "value": final.value(free.name),
            "sigma": sigma[free.name],
            "unit": free.unit,
        }
        for free in candidate.free
        if free.name in sigma
    }
    parameters |= {
        name.removeprefix(prefixes[0]): {"value": value, "sigma": 0.0, "unit": ""}
        for name, value in candidate.fixed.items()
    }
    if candidate.orders:
        parameters["order"] = {"value": _number(candidate.orders[0]), "sigma": 0.0, "unit": "1"}
    return {
        "effect": one.name,
        "place": candidate.place,
        "probability": one.probability,
        "parameters": parameters,
        "rivals": list(dict.fromkeys(r.effect for r in one.rivals if r.weight > 0.05 or r.alike > ALIKE)),
        "evidence": {
            "screen_p": seen.screen.p.get(candidate.label),
            "gain": one.trial.gain.total,
            "gain_error": one.trial.gain.error,
            "gain_in_errors": one.trial.gain.ratio,
            "left_out_nrmse": list(one.trial.gain.nrmse),
            "rivals": [r.to_dict() for r in one.rivals],
            "fitted_as": candidate.effect,
            "shape": candidate.shape,
        },
    }


def _number(order: str) -> float:
    top, _, bottom = order.partition("/")
    return float(top) / float(bottom or 1.0)


def _unknown_effect(unknown: Unknown, bench: Bench) -> dict[str, Any]:
    evidence: dict[str, Any] = {
        "ranking": [list(entry) for entry in unknown.ranking],
        "gain": unknown.gain.total,
        "torque_N_m": None,
    }
    curve = unknown.curve(bench)
    if curve is not None:
        evidence[unknown.feature.name], evidence["torque_N_m"] = (values.tolist() for values in curve)
    return {
        "effect": "unknown",
        "place": unknown.feature.place,
        "probability": 1.0 - 1.0 / (1.0 + max(unknown.gain.ratio, 0.0) ** 2),
        "parameters": {},
        "rivals": [],
        "evidence": evidence,
    }


def _where(verdict: Verdict) -> dict[str, Any]:
    places = list(dict.fromkeys(one.trial.candidate.place for one in verdict.standings))
    if verdict.name == "no_evidence":
        return NOWHERE
    depends: list[str] = []
    memory = "none"
    orders = list(verdict.where.orders)
    for one in verdict.standings:
        order = one.trial.candidate.order
        if order is not None and all(abs(order - known) > 0.01 * known for known in orders):
            orders.append(order)
        facts = FACTS[one.name]
        depends += [name for name in facts.depends_on if name not in depends]
        memory = facts.memory if facts.memory != "none" else memory
    if not verdict.standings and verdict.unknown is not None:
        feature = verdict.unknown.feature
        places, depends, memory = [feature.place], [feature.name], feature.memory
    return {
        "place": places[0] if len(places) == 1 else None,
        "place_candidates": places,
        "windows": [list(window) for window in verdict.where.windows],
        "phase": verdict.where.phase,
        "phase_shares": verdict.where.shares,
        "channel_shares": verdict.where.channels,
        "orders": orders,
        "frequencies_hz": list(verdict.where.frequencies),
        "depends_on": depends,
        "memory": memory,
    }


def _fit(verdict: Verdict) -> dict[str, Any]:
    session, proof = verdict.session, verdict.proof
    layout = session.bench.layout
    extended = verdict.extended or session.search.final
    return {
        "fit": {
            "baseline_nrmse": nrmse(layout, session.baseline.mismatch),
            "extended_nrmse": nrmse(layout, extended.mismatch),
            "noise_floor_nrmse": session.floor,
            "channels": _channels(session.bench, session.baseline.mismatch, extended.mismatch),
        },
        "heldout": {
            "baseline_nrmse": proof.baseline if proof else None,
            "extended_nrmse": proof.extended if proof else None,
            "noise_floor_nrmse": proof.floor if proof else None,
            "channels": _channels(session.held, *proof.mismatch) if proof and session.held else {},
        },
    }


def _channels(bench: Bench, before: Floats, after: Floats) -> dict[str, dict[str, float]]:
    """Errors by channel, and the corner of the low-pass through which they are seen."""
    return {
        channel: {
            "band_hz": bench.plant.band.of(channel),
            "baseline_nrmse": nrmse(bench.layout, before, channel),
            "extended_nrmse": nrmse(bench.layout, after, channel),
        }
        for channel in bench.layout.channels
    }


def _finite(value: Any) -> Any:
    """The same with plain numbers, None for those that are not finite."""
    if isinstance(value, Mapping):
        return {key: _finite(own) for key, own in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(own) for own in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
