"""The reverse question: which tolerances to tighten and which to relax, at the lowest cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose, shorten
from hdfast.tolerance.designs import sobol_points
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.laws import normal_scores
from hdfast.tolerance.limits import Spec, Verdict, judge_values
from hdfast.tolerance.sample import MAX_ROWS, Plan

TARGETS = ("asked", "present")
FIT_SPREAD = 1.5
ROUNDS = 4


@dataclass(frozen=True)
class Allocation:
    """Spreads that reach the yields at the lowest cost.

    Attributes:
        factors: factor on the spread of each tolerance; below 1 tighten, above 1 relax. All are 1 where the present
            tolerances have the yields aimed at and the search found nothing cheaper that has.
        cost: of the new tolerances relative to the present ones.
        verdicts: yields of a simulation with the new tolerances, one per specification.
        reached: True when that simulation has at least the yields aimed at. Its rows ended the search, so that other
            rows may fall short where the interval of a verdict includes the yield aimed at.
        fit: R squared of the quadratic surface of each metric that led there; a poor one means a poor optimum.
    """

    factors: dict[str, float]
    cost: float
    verdicts: list[Verdict]
    reached: bool
    fit: dict[str, float]


def allocate(
    evaluate: Callable[[dict[str, Floats]], tuple[Mapping[str, Floats], NDArray[np.bool_]]],
    plan: Plan,
    specs: Mapping[str, Spec],
    *,
    target: str = "asked",
    exponent: float = 1.0,
    bounds: tuple[float, float] = (0.25, 2.0),
    rows: int = 2000,
    policy: str = "worst",
    allowed: Mapping[str, tuple[float, float]] | None = None,
) -> Allocation:
    """Minimise the sum of cost / factor^exponent over all tolerances, subject to the yield of every specification.

    A quadratic surface of each metric over the spreads guides the search; a simulation with the result confirms it, and
    when that falls short the search aims higher by as much and runs again.

    Args:
        evaluate: columns (m,) to metrics (m,) and which rows finished.
        plan: the tolerances with their `cost`.
        specs: limits by metric.
        target: "asked" (the min_yield of every specification) or "present" (the yields as they are).
        exponent: halving a spread multiplies its cost by 2^exponent.
        bounds: smallest and largest factor allowed; the largest of a tolerance is less where its `allowed` says so.
        rows: of the fit and of every confirmation.
        policy: under "exclude" rows that lack a metric are left out of its yield, else they count as outside.
        allowed: range of each parameter, which no spread is widened beyond; without end for those left out.

    Raises:
        InputError: naming argument, value and allowed range.
    """
    choose("target", target, TARGETS)
    checks.positive("exponent", exponent, 10.0)
    checks.whole("rows", rows, 1, MAX_ROWS)
    if len(checks.listed("bounds", bounds, "smallest and largest factor")) != 2:
        raise InputError(f"bounds = {shorten(bounds)} are not two numbers (allowed: smallest and largest factor)")
    low, high = (checks.positive("bounds", bound, 10.0) for bound in bounds)
    if not specs or not plan.names or not low < high:
        raise InputError(f"an allocation needs specifications, tolerances and bounds that rise, these are {bounds}")
    scores = _scores(plan, rows)
    widest = np.array(list(plan.widest(allowed or {}).values()))
    surfaces = _fit(evaluate, plan, specs, scores, np.minimum(FIT_SPREAD, widest))
    aims = {metric: spec.min_yield for metric, spec in specs.items()}
    present = _confirm(evaluate, plan, specs, rows, policy)
    if target == "present":
        aims = {verdict.spec.metric: verdict.yield_ for verdict in present}
    highs = np.minimum(high, np.maximum(low, widest))
    costs = np.array([tolerance.cost for tolerance in plan.tolerances])
    raised = dict(aims)
    for _ in range(ROUNDS):
        factors = _search(surfaces, plan, specs, raised, costs, exponent, low, highs)
        named = dict(zip(plan.names, factors.tolist(), strict=True))
        verdicts = _confirm(evaluate, plan.scaled(named), specs, rows, policy)
        short = _short(aims, verdicts)
        if max(short.values()) <= 0.0:
            break
        raised = {m: min(1.0, raised[m] + max(0.0, gap) * 1.2) for m, gap in short.items()}
    cost = float(np.sum(costs * factors**-exponent) / np.sum(costs))
    as_is = low <= 1.0 <= high and max(_short(aims, present).values()) <= 0.0
    if as_is and (cost > 1.0 or max(short.values()) > 0.0):
        named, cost, verdicts, short = dict.fromkeys(plan.names, 1.0), 1.0, present, _short(aims, present)
    return Allocation(named, cost, verdicts, max(short.values()) <= 0.0, {m: s.fit for m, s in surfaces.items()})


def _short(aims: Mapping[str, float], verdicts: Sequence[Verdict]) -> dict[str, float]:
    """How far each yield is below the one aimed at; positive where it is."""
    return {verdict.spec.metric: aims[verdict.spec.metric] - verdict.yield_ for verdict in verdicts}


@dataclass(frozen=True)
class _Surface:
    """Full quadratic polynomial of one metric over the deviates of the tolerances."""

    coefficients: Floats
    fit: float

    def __call__(self, deviates: Floats) -> Floats:
        return np.asarray(_terms(deviates) @ self.coefficients)


def _terms(deviates: Floats) -> Floats:
    first, second = np.triu_indices(deviates.shape[1])
    return np.column_stack([np.ones(len(deviates)), deviates, deviates[:, first] * deviates[:, second]])


def _scores(plan: Plan, rows: int) -> Floats:
    """(rows, d) standard normal scores, dependence included."""
    return plan.dependent_scores(normal_scores(sobol_points(len(plan.names), plan.seed, 0, 0, rows)))


def _deviate(tolerance: Tolerance, values: Floats) -> Floats:
    """Values as distance from the middle: what a change of the spread multiplies."""
    if tolerance.distribution == "lognormal":
        return np.log(values / tolerance.middle) / tolerance.width
    return (values - tolerance.middle) / (tolerance.deviation or 1.0)


def _deviates(plan: Plan, scores: Floats) -> Floats:
    columns = [_deviate(tol, tol.quantile(scipy.special.ndtr(scores[:, j]))) for j, tol in enumerate(plan.tolerances)]
    return np.column_stack(columns)


def _fit(
    evaluate: Callable[[dict[str, Floats]], tuple[Mapping[str, Floats], NDArray[np.bool_]]],
    plan: Plan, specs: Mapping[str, Spec], scores: Floats, spreads: Floats,
) -> dict[str, _Surface]:  # fmt: skip
    """One surface per specification, over spreads (d,) wide enough for tolerances that are relaxed."""
    wide = plan.scaled(dict(zip(plan.names, spreads.tolist(), strict=True)))
    values, finished = evaluate(wide.from_scores(scores))
    deviates = spreads * _deviates(plan, scores)
    surfaces = {}
    for metric in specs:
        good = finished & np.isfinite(values[metric])
        terms, y = _terms(deviates[good]), values[metric][good]
        if len(y) < 2 * terms.shape[1]:
            raise InputError(f"rows: {len(y)} rows have {metric}, its surface needs {2 * terms.shape[1]} or more")
        coefficients = np.asarray(np.linalg.lstsq(terms, y, rcond=None)[0], dtype=np.float64)
        whole = float(np.var(y))
        left = float(np.var(y - terms @ coefficients))
        surfaces[metric] = _Surface(coefficients, 1.0 - left / whole if np.ptp(y) > 0.0 else math.nan)
    return surfaces


def _search(
    surfaces: Mapping[str, _Surface], plan: Plan, specs: Mapping[str, Spec], aims: Mapping[str, float], costs: Floats,
    exponent: float, low: float, highs: Floats,
) -> Floats:  # fmt: skip
    """Factors of lowest cost on the surfaces, from `low` to `highs` (d,); in logarithms, where the cost is convex."""
    deviates = _deviates(plan, _scores(plan, 8192))
    scale = {metric: float(np.std(surface(deviates))) or 1.0 for metric, surface in surfaces.items()}

    def slack(logs: Floats) -> Floats:
        found = []
        for metric, spec in specs.items():
            values = surfaces[metric](deviates * np.exp(logs))
            distance = np.minimum(spec.upper - values, values - spec.lower) / scale[metric]
            found.append(min(float(np.quantile(distance, 1.0 - aims[metric])), 10.0))
        return np.array(found)

    limits = np.log(np.column_stack([np.full(len(highs), low), highs]))
    best = scipy.optimize.minimize(
        lambda logs: float(np.sum(costs * np.exp(-exponent * logs)) / np.sum(costs)),
        np.clip(np.zeros(len(costs)), *limits.T),
        jac=lambda logs: -exponent * costs * np.exp(-exponent * logs) / np.sum(costs),
        bounds=limits,
        constraints={"type": "ineq", "fun": slack},
        method="SLSQP",
        options={"eps": 1e-2, "maxiter": 60},
    )
    found: Floats = np.exp(np.clip(np.asarray(best.x, dtype=np.float64), *limits.T))
    return found


def _confirm(
    evaluate: Callable[[dict[str, Floats]], tuple[Mapping[str, Floats], NDArray[np.bool_]]],
    plan: Plan, specs: Mapping[str, Spec], rows: int, policy: str,
) -> list[Verdict]:  # fmt: skip
    plain = Plan(plan.tolerances, seed=plan.seed, correlation=plan.correlation)
    values, finished = evaluate(plain.draw(0, rows))
    return [judge_values(spec, np.asarray(values[m]), finished, policy=policy) for m, spec in specs.items()]
