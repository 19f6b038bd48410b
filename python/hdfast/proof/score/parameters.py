"""Sizes: parameters of the effect and of the baseline it had displaced, and the held-out fit."""

from __future__ import annotations

import math
from itertools import chain
from typing import Any

import numpy as np

from hdfast.proof.score.identification import GROUPS, SINGLE
from hdfast.proof.score.judge import RIGHT, Case
from hdfast.proof.score.value import Score, share, statistic

NINETY = 1.6448536269514722
WORSE = 1.02
NO_SIZES = ("order", "pole_pairs", "omega_s", "phi_0", "tau_short", "f_external")  # counts and shapes
ABSENT_AT = {"breakaway_ratio": 1.0}  # where not 0
WAVE = ("te_cos_", "te_sin_")
DECLARED = "coulomb_friction_"  # law before the parameters of the friction that a campaign declares
TRUTH, NOISE = "oracle_heldout", "noise_heldout"


def scores(cases: list[Case]) -> list[Score]:
    """Scores of the cases whose effect was named rightly; the fit counts for every claim."""
    right = [c for c in cases if c.stratum in SINGLE and c.outcome == RIGHT and c.answer.named]
    sized = [(c.ids[0], error) for c in right if (error := _effect_error(c)) is not None]
    errors = [error for _, error in sized]
    covered = [hit for c in right if (hit := _covered(c)) is not None]
    displaced = [e for c in right if (e := _displaced_errors(c))]
    claims = [c for c in cases if c.claimed and c.ids]
    fits = [fit for c in claims if (fit := _heldout(c, TRUTH)) is not None]
    own = "the tool's own figures; the floor is the error of the true structure, refitted, in the tool's band"
    noise = [fit for c in claims if NOISE in c.label and (fit := _heldout(c, NOISE)) is not None]
    return [
        statistic("effect parameter", errors, _median, "<= 10 %", lambda v: v <= 0.1, "median abs log ratio"),
        *(statistic(f"effect parameter, {group}", [e for effect, e in sized if effect in ids], _median)
          for group, ids in GROUPS.items()),
        share("effect parameter: 90 % interval", covered, "85-95 %", lambda v: 0.85 <= v <= 0.95),
        statistic("displaced parameters", displaced, _median_of_all, "<= 10 %", lambda v: v <= 0.1,
                  "median abs log ratio over the parameters of all cases; interval over cases"),
        statistic("held-out gap closed", _closed(fits), _median, ">= 80 %", lambda v: v >= 0.8, own),
        statistic("held-out gap closed, to the noise", _closed(noise), _median,
                  note="the same with the noise alone as floor, as before version 9 of the cases"),
        share("held-out fit made worse", [f["extended_nrmse"] > WORSE * f["baseline_nrmse"] for f in fits], "never",
              lambda v: v == 0.0, own),
    ]  # fmt: skip


def _median(values: list[float]) -> float:
    return float(np.median(values))


def _median_of_all(cases: list[list[float]]) -> float:
    return _median(list(chain(*cases)))


def _pair(case: Case) -> tuple[float, float, float] | None:
    """Estimate, its sigma and the truth of the first parameter that both sides state and that is a size.

    Of a line of the kinematic error, whose order alone is the same on both sides, it is the amplitude.
    """
    stated, effect = case.answer.listed[0].get("parameters") or {}, case.label["effects"][0]
    known = {name: entry for name, entry in stated.items() if _is_known(entry)}
    for name, true in effect["true_parameters"].items():
        if name in known and name not in NO_SIZES:
            absent = ABSENT_AT.get(name, 0.0)
            return float(known[name]["value"]) - absent, float(known[name].get("sigma") or 0.0), float(true) - absent
    waves = [entry for name, entry in known.items() if name.startswith(WAVE)]
    if len(waves) != 2 or "amplitude" not in effect:
        return None
    values, sigmas = (np.array([float(one.get(key) or 0.0) for one in waves]) for key in ("value", "sigma"))
    size = float(np.linalg.norm(values))
    return size, float(np.linalg.norm(values * sigmas)) / max(size, 1e-300), float(effect["amplitude"])


def _is_known(entry: Any) -> bool:
    """Whether a size is stated; exactly zero is a parameter that was not asked."""
    stated = isinstance(entry, dict) and isinstance(entry.get("value"), int | float)
    return stated and (entry["value"] != 0.0 or bool(entry.get("sigma")))


def _effect_error(case: Case) -> float | None:
    pair = _pair(case)
    if pair is None or pair[0] == 0.0 or pair[2] == 0.0:
        return None
    return abs(math.log(abs(pair[0])) - math.log(abs(pair[2])))


def _covered(case: Case) -> bool | None:
    pair = _pair(case)
    return None if pair is None else abs(abs(pair[0]) - abs(pair[2])) <= NINETY * pair[1]


def _displaced_errors(case: Case) -> list[float]:
    true: dict[str, float] = case.label.get("baseline_true", {})
    stated = {row["parameter"].removeprefix(DECLARED): row.get("extended") for row in case.answer.verdict["masking"]}
    return [
        abs(math.log(value) - math.log(true[name]))
        for name, value in stated.items()
        if name in true and isinstance(value, int | float) and value > 0.0
    ]


def _heldout(case: Case, floor: str) -> dict[str, float] | None:
    found: dict[str, Any] = (case.answer.verdict.get("fit") or {}).get("heldout") or {}
    if not all(isinstance(found.get(k), int | float) for k in ("baseline_nrmse", "extended_nrmse")):
        return None
    errors = {k: float(found[k]) for k in ("baseline_nrmse", "extended_nrmse")}
    return {**errors, "floor": _floor(case.label, found, floor)}


def _floor(label: dict[str, Any], found: dict[str, Any], floor: str = TRUTH) -> float:
    """A floor of the label in the band and scale of the answer; without them, the smaller of two floors."""
    spectra: dict[str, list[list[float]]] = label.get(floor) or {}
    channels = found.get("channels") or {}
    stated = {name: (own.get("band_hz"), own.get("measured_std")) for name, own in channels.items()}
    if spectra and set(spectra) == set(stated) and all(map(_positive, chain(*stated.values()))):
        shares = [_noise(pairs, stated[name][0]) / stated[name][1] for name, pairs in spectra.items()]
        return float(np.sqrt(np.mean(np.square(shares))))
    floors = [v for v in (found.get("noise_floor_nrmse"), label.get("oracle_heldout_nrmse")) if v is not None]
    return min(floors, default=0.0)


def _positive(value: Any) -> bool:
    return isinstance(value, int | float) and value > 0.0


def _noise(pairs: list[list[float]], corner: float) -> float:
    """Noise at a corner [Hz] between those of pairs of corner and noise."""
    corners, noise = np.array(pairs).T
    return float(np.interp(math.log(corner), np.log(corners), noise))


def _closed(fits: list[dict[str, float]]) -> list[float]:
    """Share of each gap that is closed, where there is one."""
    return [
        (fit["baseline_nrmse"] - fit["extended_nrmse"]) / (fit["baseline_nrmse"] - fit["floor"])
        for fit in fits
        if fit["baseline_nrmse"] > WORSE * fit["floor"]
    ]
