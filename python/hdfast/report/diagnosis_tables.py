"""Tables and wordings of the page of a diagnosis."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.structure import Free
from hdfast.diagnosis.trials import Round
from hdfast.printing import enumerated, html_table
from hdfast.report.plots import scaled
from hdfast.report.tables import number
from hdfast.terms import terms

PARAMETER_HEADER = ["parameter", "unit", "prior", "nominal model, calibrated", "pull [σ]"]
PAIR_HEADER = ["hardly told apart", "correlation"]
CORRELATED = 0.95
EXTENDED_HEADER = ["extended model", "pull [σ]", ""]
TRIAL_HEADER = [
    "candidate", "place", "screen p", "visible", "limited gain (log density)", "in errors", "left-out error", "outcome",
]  # fmt: skip
WORDS = {
    "coulomb_friction": "Coulomb friction",
    "stribeck_friction": "Stribeck friction",
    "te_harmonic": "kinematic error line",
    "te_load_dependence": "load-dependent kinematic error",
    "load_dependent_friction": "load-dependent friction",
    "load_side_friction": "load-side friction",
    "position_dependent_friction": "position-dependent friction",
    "unknown": "unnamed torque",
    "abs_transmitted_torque": "size of the torque through the gear",
    "transmitted_torque": "torque through the gear",
    "time_since_start": "time since the start",
}
VARIABLES = ("motor_speed", "motor_acceleration", "motor_phase", "load_phase", "lobe_phase")
FAILURES = {
    "A0": "cannot be simulated",
    "A1": "gain within chance",
    "A2": "error hardly falls",
    "A3": "amplitude within 2 σ of 0",
    "A5": "beyond what is resolved",
    "A6": "its special case is all that is left",
    "A7": "does not show on what was held out",
    "A8": "predicts worse than no model",
    "A9": "owes its gain to noise that it calms",
    "A10": "owes its gain to parameters that were refitted with it",
}


def words(effect: str) -> str:
    """The id of an effect or of a state variable as words."""
    return WORDS.get(effect, effect.replace("_", " "))


def spoken(sentence: str, names: Collection[str] = ()) -> str:
    """A sentence with the ids of effects and of state variables as words; the names of recordings stay as they are."""
    ids = [one for one in (*terms().ids, *WORDS, *VARIABLES) if "_" in one]
    kept = sorted({*names, *ids}, key=len, reverse=True)
    known = "|".join(re.escape(one) for one in kept)
    told = re.sub(rf"(?<!\w)({known})(?!\w)", lambda one: one[0] if one[0] in names else words(one[0]), sentence)
    return told.replace(" -> ", " → ")


def plus_minus(value: float | None, sigma: float | None, unit: str) -> str:
    """Value ± standard deviation, two digits of the deviation, with a prefix of the unit."""
    if value is None or not math.isfinite(value):
        return "-"
    factor, short = scaled(np.array([value]), unit)
    tail = "" if short in ("1", "") else f" {short}"
    value *= factor
    if not sigma or not math.isfinite(sigma):
        return f"{value:.4g}{tail}"
    sigma *= factor
    digits = max(0, 1 - math.floor(math.log10(sigma)))
    if digits > 7 or abs(value) >= 1e5:
        return f"{value:.4g} ± {sigma:.2g}{tail}"
    return f"{value:z.{digits}f} ± {sigma:.{digits}f}{tail}"


def amplitude(effect: Mapping[str, Any]) -> tuple[str, dict[str, Any]] | None:
    """The fitted parameter of an effect that says how large it is, with its entry."""
    fitted = {name: entry for name, entry in effect["parameters"].items() if entry["sigma"] != 0.0}
    usual = terms()[effect["effect"]].amplitude if effect["effect"] in terms().ids else ""
    name = usual if usual in fitted else next(iter(fitted), "")
    return (name, fitted[name]) if name else None


def parameter_table(layout: Layout, before: Fit, after: Fit | None, masked: Sequence[str] = ()) -> str:
    """Every fitted parameter: prior, calibrated, in the extended model if any, and its pulls in sigma of the prior."""
    sigmas = before.sigma_of(layout), after.sigma_of(layout) if after else {}
    rows = []
    for name in dict.fromkeys([*before.structure.names, *(after.structure.names if after else ())]):
        known = name in before.structure.names
        free = next(one for fit in (before, after) if fit for one in fit.structure.free if one.name == name)
        factor, unit = scaled(np.array([abs(free.value), prior_sigma(free)]), free.unit)

        def stated(fit: Fit, sigma: Mapping[str, float], name: str = name, factor: float = factor) -> list[str]:
            if name not in sigma:
                return ["", ""]
            return [plus_minus(fit.value(name) * factor, sigma[name] * factor, ""), f"{pull(fit, name):+z.1f}"]

        prior = plus_minus(free.value * factor, prior_sigma(free) * factor, "")
        row = [name, unit, prior if free.times is None else f"{prior} of {free.times}", *stated(before, sigmas[0])]
        if after:
            row += [*stated(after, sigmas[1]), _role(name, known, masked)]
        rows.append(row)
    header = PARAMETER_HEADER + (EXTENDED_HEADER if after else [])
    return html_table(header, rows, right=range(2, 7))


def _role(name: str, known: bool, masked: Sequence[str]) -> str:
    if name in masked:
        return "had swallowed an effect"
    return "" if known else "added"


def prior_sigma(free: Free) -> float:
    """Prior standard deviation in the parameter's own unit."""
    return float(free.sigma * (abs(free.value) if free.positive else 1.0))


def pull(fit: Fit, name: str) -> float:
    """Distance of an estimate from the centre of its prior in the prior's standard deviations."""
    j = fit.structure.names.index(name)
    return float((fit.coordinates[j] - fit.structure.start[j]) / fit.structure.sigma[j])


def correlations(fit: Fit, layout: Layout) -> list[list[str]]:
    """Groups of parameters that these recordings hardly tell apart, each of the pairs closest to each other first."""
    covariance = fit.covariance(layout)
    size = np.sqrt(np.diag(covariance))
    shares = covariance / np.outer(size, size)
    close, names = np.abs(shares) > CORRELATED, fit.structure.names
    pairs = [(abs(shares[i, j]), j, i) for i in range(len(names)) for j in range(i) if close[i, j]]
    rows, told = [], np.zeros_like(close)
    for _, first, second in sorted(pairs, reverse=True):
        if told[first, second]:
            continue
        group = [first, second]
        for other in range(len(names)):
            if other not in group and close[other, group].all():
                group.append(other)
        told[np.ix_(group, group)] = True
        least = min((shares[i, j] for i in group for j in group if i != j), key=abs)
        figure = f"{least:+.3f}" if len(group) == 2 else f"{abs(least):.3f} or more"
        rows.append([enumerated([names[j] for j in sorted(group)]), figure])
    return rows


def trial_table(one: Round) -> str:
    """Candidates of a round: what the screen saw of each and what the joint refit gave."""
    visible = {signature.candidate.label: signature.visibility for signature in one.signatures}
    rows = []
    for trial in sorted(one.trials, key=lambda trial: -trial.gain.limited):
        candidate = trial.candidate
        outcome = (
            "accepted" if one.accepted is trial else ("passes, but another goes first" if not trial.failed else "")
        )
        rows.append(
            [
                spoken(candidate.label),
                candidate.place,
                _p(one.screen.p.get(candidate.label)),
                f"{100 * visible.get(candidate.label, math.nan):.0f} %",
                f"{trial.gain.limited:.1f} ± {trial.gain.counted_error:.1f}",
                f"{trial.gain.ratio:.1f}",
                f"{100 * trial.gain.nrmse[1]:.2f} → {100 * trial.gain.nrmse[0]:.2f} %",
                outcome or ", ".join(_failure(rule) for rule in trial.failed),
            ]
        )
    return html_table(TRIAL_HEADER, rows, right=(2, 3, 4, 5, 6))


def _failure(rule: str) -> str:
    code, _, rest = rule.partition(" ")
    if code == "A4":
        return f"drags {rest} off its prior"
    return FAILURES.get(code, rule)


def _p(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def screened(one: Round) -> str:
    """Strongest candidates of the screen that were not refitted, in one sentence."""
    tried = {trial.candidate.effect for trial in one.trials}
    rest = sorted(
        ((label, statistic) for label, statistic in one.screen.statistic.items() if label.split(" ")[0] not in tried),
        key=lambda item: -item[1],
    )
    shown = ", ".join(f"{spoken(label)} {statistic:.1f} (p {one.screen.p[label]:.3f})" for label, statistic in rest[:5])
    return f"Next in the screen, not refitted: {shown}." if shown else ""


def experiment_rows(proposal: Mapping[str, Any]) -> list[list[str]]:
    """A proposed experiment as rows of label and text."""
    motion, limits = proposal["manoeuvre"], proposal["limits"]
    steps = "; ".join(
        f"to {number(one['speed_rad_s'])} rad/s in {one['ramp_s']:.2g} s, held for {one['hold_s']:.2g} s"
        for one in motion["segments"]
    )
    first, *others = proposal["separates"]
    beyond = enumerated(proposal["beyond"])
    return [
        ["tells apart", f"{spoken(first)} from {spoken(enumerated(others))}"],
        ["motor speed", f"{motion['kind']}, {proposal['duration_s']:.1f} s from standstill: {steps}"],
        [
            "keeps to",
            f"{number(limits['speed_rad_s'])} rad/s, {number(limits['acceleration_rad_s2'])} rad/s\u00b2, motor angle "
            f"{number(limits['low_angle_rad'])} to {number(limits['high_angle_rad'])} rad, starting at "
            f"{number(motion['start_angle_rad'])} rad"
            + (f"; beyond the recordings in {beyond}: nothing within them decides" if beyond else ""),
        ],
        [
            "expected evidence",
            f"log Bayes factor {proposal['expected_log_bayes_factor']:.1f}; a motion at random gives "
            f"{proposal['random_motion_log_bayes_factor']:.1f}"
            + (
                ""
                if proposal["decides"]
                else "; that does not decide, nor would more time, travel and speed: a further sensor would be needed"
            ),
        ],
        ["look for", spoken(proposal["difference"])],
    ]
