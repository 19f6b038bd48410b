"""What a rival says of a case, in the schema of `verdict.json`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.content import by_channel, order_of
from hdfast.diagnosis.facts import FACTS
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.holdout import Proof, replayed, weigh_up
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.score import noise_floor, nrmse
from hdfast.diagnosis.session import Setup


@dataclass(frozen=True)
class Named:
    """An effect that a rival names, and its probability by the rival's own criterion."""

    candidate: Candidate
    probability: float


@dataclass(frozen=True, eq=False)
class Said:
    """A rival's answer.

    Attributes:
        verdict: "no_evidence", "undecided", "found" or "sensor".
        final: the model it ends with.
        named: the effects in it.
    """

    verdict: str
    final: Fit = field(repr=False)
    named: tuple[Named, ...] = ()


def finding(final: Fit, named: list[Named]) -> Said:
    """The answer that names what was accepted; no evidence where nothing was."""
    if not named:
        return Said("no_evidence", final)
    sensed = all(one.candidate.place == "sensor" for one in named)
    return Said("sensor" if sensed else "found", final, tuple(named))


def as_dict(said: Said, setup: Setup, calibrated: Fit) -> dict[str, Any]:
    """The content of verdict.json; held-out recordings are simulated once, with the frozen models."""
    layout = setup.replay.layout
    proof = None if setup.held is None else _proven(setup.held, calibrated, said.final)
    sigma = said.final.sigma_of(layout)
    effects = [_effect(one, said.final, sigma) for one in said.named]
    return {
        "verdict": said.verdict,
        "effects": effects,
        "where": _where(said),
        "fit": {
            "fit": {
                "baseline_nrmse": _finite(nrmse(layout, calibrated.mismatch)),
                "extended_nrmse": _finite(nrmse(layout, said.final.mismatch)),
            },
            "heldout": {
                "baseline_nrmse": _finite(proof.baseline) if proof else None,
                "extended_nrmse": _finite(proof.extended) if proof else None,
                "noise_floor_nrmse": proof.floor if proof else None,
                "channels": _by_channel(setup.held, proof) if proof and setup.held else {},
            },
        },
        "masking": [],
        "not_showable": [],
        "next_experiment": None,
        "seed": 0,
        "version": version("hdfast"),
    }


def _by_channel(held: Replay, proof: Proof) -> dict[str, dict[str, float | None]]:
    return {
        channel: {key: _finite(value) for key, value in own.items()}
        for channel, own in by_channel(held, *proof.mismatch).items()
    }


def _proven(held: Replay, calibrated: Fit, final: Fit) -> Proof:
    before, after = (replayed(held, one, calibrated) for one in (calibrated, final))
    return weigh_up(held.layout, final.white, before, after, noise_floor(held))


def _effect(one: Named, final: Fit, sigma: dict[str, float]) -> dict[str, Any]:
    candidate = one.candidate
    prefix = next((f"{channel}_{effect}_" for effect, channel in candidate.sensors), f"{candidate.law}_")
    parameters = {
        free.name.removeprefix(prefix): {
            "value": _finite(final.value(free.name)),
            "sigma": _finite(sigma[free.name]),
            "unit": free.unit,
        }
        for free in candidate.free
        if free.name in sigma
    }
    return {
        "effect": candidate.effect,
        "place": candidate.place,
        "probability": min(max(one.probability, 0.0), 1.0),
        "parameters": parameters | order_of(candidate),
        "rivals": [],
    }


def _where(said: Said) -> dict[str, Any]:
    places = list(dict.fromkeys(one.candidate.place for one in said.named))
    facts = [FACTS[one.candidate.effect] for one in said.named]
    return {
        "place": places[0] if len(places) == 1 else None,
        "windows": [],
        "phase": "all",
        "orders": [],
        "frequencies_hz": [],
        "depends_on": list(dict.fromkeys(variable for one in facts for variable in one.depends_on)),
        "memory": next((one.memory for one in facts if one.memory != "none"), "none"),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
