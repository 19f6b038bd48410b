"""What `verdict.json` says of a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.facts import facts_of
from hdfast.diagnosis.limits import Limit
from hdfast.diagnosis.masking import pulled
from hdfast.diagnosis.remarks import remarks
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.rivals import ALIKE, FAINT, Standing
from hdfast.diagnosis.score import Gain, nrmse
from hdfast.diagnosis.unknown import Unknown
from hdfast.diagnosis.verdict import Verdict
from hdfast.drive_file import UNKNOWN
from hdfast.files import json_ready
from hdfast.health import Health
from hdfast.model import parse_order
from hdfast.sensors.names import table
from hdfast.terms import terms

MEMORIES = ("none", "rate_independent", "fading")
NOWHERE: dict[str, Any] = {
    "place": None,
    "place_candidates": [],
    "windows": [],
    "phase": "all",
    "phase_shares": {},
    "channel_shares": {},
    "orders": [],
    "frequencies_hz": [],
    "swings": [],
    "depends_on": [],
    "memory": "none",
}


def _findings(health: Health) -> list[dict[str, Any]]:
    """What the health checks said, file by file."""
    listed = [("", finding) for finding in health.findings]
    listed += [(item.name, finding) for item in health for finding in item.findings]
    return [{"file": name, **vars(finding)} for name, finding in listed]


def rejected(health: Health, seed: int, version: str) -> dict[str, Any]:
    """The content of verdict.json when the recordings cannot be used."""
    unknown: dict[str, Any] = {
        "baseline_nrmse": None,
        "extended_nrmse": None,
        "noise_floor_nrmse": None,
        "channels": {},
    }
    return {
        "verdict": "data_rejected",
        "sentence": f"The recordings cannot be used. {health.complaint}",
        "effects": [],
        "candidates": [],
        "where": json_ready(NOWHERE),
        "fit": {"fit": unknown, "heldout": dict(unknown)},
        "masking": [],
        "displaced": [],
        "not_showable": [],
        "detectable": [],
        "next_experiment": None,
        "notes": [],
        "health": json_ready(_findings(health)),
        "seed": seed,
        "version": version,
    }


def _not_showable(limits: Sequence[Limit]) -> list[dict[str, Any]]:
    """Effects of which no shape could have shown, as the one that would show best."""
    return [
        {
            "effect": one.effect,
            "shape": one.shape,
            "reason": one.reason,
            "minimum_detectable": one.minimum_detectable,
            "unit": one.unit,
            "visibility": one.visibility,
        }
        for one, *_ in _by_effect(limits)
        if one.reason is not None
    ]


def _detectable(limits: Sequence[Limit]) -> list[dict[str, Any]]:
    """Every shape of the other effects; None for those that no plausible size of would have shown."""
    return [
        {
            "effect": one.effect,
            "shape": one.shape,
            "minimum_detectable": one.minimum_detectable if one.reason is None else None,
            "unit": one.unit,
        }
        for shapes in _by_effect(limits)
        if shapes[0].reason is None
        for one in shapes
    ]


def _by_effect(limits: Sequence[Limit]) -> list[list[Limit]]:
    """The shapes of each effect, the one that shows best first."""
    return [list(shapes) for _, shapes in groupby(limits, key=lambda one: one.effect)]


def as_dict(verdict: Verdict, health: Health, seed: int, version: str) -> dict[str, Any]:
    """The content of verdict.json."""
    session = verdict.session
    sigma = session.search.final.sigma_of(session.replay.layout)
    effects = [_effect(one, verdict, sigma) for one in verdict.told]
    if verdict.described is not None:
        effects.append(_unknown_effect(verdict.described, verdict.alike))
    content: dict[str, Any] = json_ready(
        {
            "verdict": verdict.name,
            "sentence": verdict.sentence,
            "effects": effects,
            "candidates": [_effect(one, verdict, sigma) for one in verdict.standings if one not in verdict.told],
            "where": _where(verdict),
            "fit": _fit(verdict),
            "masking": [vars(one) for one in verdict.masked],
            "displaced": pulled(session.baseline),
            "not_showable": _not_showable(verdict.limits),
            "detectable": _detectable(verdict.limits),
            "next_experiment": None if verdict.experiment is None else verdict.experiment.to_dict(),
            "notes": remarks(verdict),
            "health": _findings(health),
            "seed": seed,
            "version": version,
        }
    )
    return content


def _effect(one: Standing, verdict: Verdict, sigma: Mapping[str, float]) -> dict[str, Any]:
    final = verdict.session.search.final
    candidate = one.trial.candidate
    seen = verdict.session.search.round_of(one.trial)
    prefixes = [f"{channel}_{effect}_" for effect, channel in candidate.sensors] or [f"{candidate.law}_"]
    values = {**candidate.fixed, **{name: final.value(name) for name in final.structure.names}}
    units = _units(candidate) | {free.name: free.unit for free in final.structure.free}
    parameters: dict[str, Any] = {
        name.removeprefix(prefixes[0]): {
            "value": values[name],
            "sigma": sigma.get(name, 0.0),
            "unit": units[name],
        }
        for name in (*candidate.names, *candidate.fixed)
        if name in values
    }
    return {
        "effect": one.name,
        "place": candidate.place,
        "probability": one.probability,
        "parameters": parameters | order_of(candidate),
        "rivals": list(dict.fromkeys(r.effect for r in one.rivals if r.weight > FAINT or r.alike > ALIKE)),
        "evidence": {
            "screen_p": seen.screen.p.get(candidate.label),
            **_gained(one.trial.gain),
            "rivals": [r.to_dict() for r in one.rivals],
            "fitted_as": candidate.effect,
            "shape": candidate.shape,
        },
    }


def order_of(candidate: Candidate) -> dict[str, Any]:
    """Order per motor revolution of a line of the kinematic error, as a parameter; empty for other effects."""
    if not candidate.orders:
        return {}
    return {"order": {"value": float(parse_order(candidate.orders[0])), "sigma": 0.0, "unit": "1"}}


def _units(candidate: Candidate) -> dict[str, str]:
    """Of the parameters of its laws, by long name; a sensor's effect measures in the unit of its channel."""
    of_laws = {f"{law}_{own.name}": own.unit for law in candidate.terms for own in terms()[law].parameters}
    rows, behind = table(candidate.sensors)
    return of_laws | {"_".join(key): rows[name].unit.replace(" per ", "/") for name, key in behind.items()}


def _gained(gain: Gain) -> dict[str, Any]:
    """What is gained on left-out stretches, where no block counts for more than it needs to convince."""
    return {
        "gain": gain.limited,
        "gain_error": gain.counted_error,
        "gain_in_errors": gain.ratio,
        "left_out_nrmse": list(gain.nrmse),
    }


def _unknown_effect(unknown: Unknown, alike: Sequence[str]) -> dict[str, Any]:
    curve, feature, told = unknown.curve, unknown.feature, {}
    if curve is not None:
        told = {feature.name: curve[0].tolist(), "torque_N_m": curve[1].tolist(), "torque_at": feature.place}
    return {
        "effect": UNKNOWN,
        "place": unknown.place,
        "probability": unknown.probability,
        "parameters": {},
        "rivals": list(alike),
        "evidence": {
            "ranking": [list(entry) for entry in unknown.ranking],
            **_gained(unknown.gain),
            **told,
        },
    }


def _where(verdict: Verdict) -> dict[str, Any]:
    swings = [
        {"frequency_hz": round(one.frequency, 3), "channel": one.channel, "p": one.p} for one in verdict.where.swings
    ]
    if verdict.name == "no_evidence":
        return NOWHERE | {"frequencies_hz": [one["frequency_hz"] for one in swings], "swings": swings}
    places = list(dict.fromkeys(one.trial.candidate.place for one in verdict.told))
    ratio = verdict.session.search.final.value("ratio")
    facts = [facts_of(one.name, one.trial.candidate.order, ratio) for one in verdict.told]
    depends = list(dict.fromkeys(name for own in facts for name in own.depends_on))
    memory = max((own.memory for own in facts), key=MEMORIES.index, default=MEMORIES[0])
    if verdict.described is not None:
        feature = verdict.described.feature
        places = [feature.place] if verdict.described.place else ["motor", "load"]
        depends, memory = [feature.name], feature.memory
    return {
        "place": places[0] if len(places) == 1 else None,
        "place_candidates": places,
        "windows": [list(window) for window in verdict.where.windows],
        "phase": verdict.where.phase,
        "phase_shares": verdict.where.shares,
        "channel_shares": verdict.where.channels,
        "orders": list(verdict.where.orders),
        "frequencies_hz": list(verdict.where.frequencies),
        "swings": swings,
        "depends_on": depends,
        "memory": memory,
    }


def _fit(verdict: Verdict) -> dict[str, Any]:
    session, proof = verdict.session, verdict.proof
    layout = session.replay.layout
    extended = verdict.extended or session.search.final
    return {
        "fit": {
            "baseline_nrmse": nrmse(layout, session.baseline.mismatch),
            "extended_nrmse": nrmse(layout, extended.mismatch),
            "noise_floor_nrmse": session.floor,
            "channels": by_channel(session.replay, session.baseline.mismatch, extended.mismatch),
        },
        "heldout": {
            "baseline_nrmse": proof.baseline if proof else None,
            "extended_nrmse": proof.extended if proof else None,
            "noise_floor_nrmse": proof.floor if proof else None,
            "channels": by_channel(session.held, *proof.mismatch) if proof and session.held else {},
        },
    }


def by_channel(replay: Replay, before: Floats, after: Floats) -> dict[str, dict[str, float]]:
    """Errors by channel, the corner of the low-pass through which they are seen, and what an error of 1 stands for."""
    return {
        channel: {
            "band_hz": replay.plant.band.of(channel),
            "measured_std": 1.0 / nrmse(replay.layout, np.ones(replay.layout.size), channel),
            "baseline_nrmse": nrmse(replay.layout, before, channel),
            "extended_nrmse": nrmse(replay.layout, after, channel),
        }
        for channel in replay.layout.channels
    }
