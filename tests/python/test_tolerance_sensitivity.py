from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hdfast.tolerance import indices, sensitivity
from hdfast.tolerance.allocation import allocate
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.effects import effects
from hdfast.tolerance.intervals import Groups, clopper_pearson
from hdfast.tolerance.limits import Spec
from hdfast.tolerance.sample import Plan
from scipy import stats
from toleranced import (
    LinearGaussian,
    additive,
    additive_indices,
    g_function,
    g_indices,
    ishigami,
    ishigami_indices,
    normal,
    uniform,
)

PROBLEM = LinearGaussian()
SEEDS = 200
ENOUGH = int(stats.binom(SEEDS, 0.95).ppf(0.001))
NAMES = list("abcdef")
BOTH_TAILS = 2 * stats.norm.ppf(0.975)


def independent(function, dimensions, count):
    """Widths of first and total indices, (2, d), from so many independent base points, to first order."""
    first, second = np.random.default_rng(1).random((2, 50_000, dimensions))
    a, b = function(first), function(second)
    mixed = np.array([function(np.where(np.arange(dimensions) == j, second, first)) for j in range(dimensions)])
    spread = [np.std((b - np.mean(b)) * (mixed - a), axis=1), np.std(0.5 * (mixed - a) ** 2, axis=1)]
    return BOTH_TAILS * np.array(spread) / np.var(a) / math.sqrt(count)


def squared_correlation(share, count):
    """Width of the interval of the square of a correlation of normal values, to first order in 1 / sqrt(count)."""
    return BOTH_TAILS * 2.0 * math.sqrt(share) * (1.0 - share) / math.sqrt(count)


@pytest.mark.parametrize(
    ("function", "truth"),
    [(ishigami, ishigami_indices()), (g_function, g_indices()), (additive, additive_indices())],
    ids=["ishigami", "g_function", "additive_drive"],
)
def test_exact_sobol_indices_hold_in_95_percent_of_seeds(function, truth):
    first, total = truth
    dimensions = len(first)
    hits, widths = np.zeros((2, 2, dimensions))
    for seed in range(SEEDS):
        values = function(indices.saltelli_points(dimensions, 512, seed))
        found = indices.sobol_indices(values, NAMES[:dimensions], seed=seed, resamples=60)
        hits[0] += [e.covers(v) for e, v in zip(found.first.values(), first, strict=True)]
        hits[1] += [e.covers(v) for e, v in zip(found.total.values(), total, strict=True)]
        widths += [[e.high - e.low for e in kind.values()] for kind in (found.first, found.total)]
    assert hits.min() >= ENOUGH, hits
    wide = widths / SEEDS / independent(function, dimensions, 512)
    assert wide.max() < 1.5, wide


@pytest.mark.parametrize("base", [2, 5, 16, 40])
def test_against_student_intervals_of_few_base_points(base):
    """A bootstrap of as many parts as there are: 2 base points leave one degree of freedom."""
    values = ishigami(indices.saltelli_points(3, base, 1))
    wide, narrow = (indices.sobol_indices(values, NAMES[:3], confidence=share).total["a"] for share in (0.95, 0.5))
    student = stats.t(min(base, indices.SCRAMBLINGS) - 1)
    ratio = (wide.high - wide.low) / (narrow.high - narrow.low)
    assert ratio == pytest.approx(student.ppf(0.975) / student.ppf(0.75), rel=1e-9)


def test_exact_more_base_points_continue_the_first():
    whole = indices.saltelli_points(4, 64, 7)
    parts = [indices.saltelli_points(4, 40, 7), indices.saltelli_points(4, 24, 7, start=40)]
    assert np.array_equal(np.concatenate(parts), whole)
    assert np.array_equal(indices.morris_points(4, 20, 7)[:50], indices.morris_points(4, 10, 7))


def test_against_salib_on_the_same_samples():
    from SALib.analyze import morris, sobol

    problem = {"num_vars": 6, "names": NAMES, "bounds": [[0, 1]] * 6}
    points = indices.saltelli_points(6, 256, 3)
    values = g_function(points)
    theirs = sobol.analyze(problem, values, calc_second_order=False, num_resamples=10)
    mine = indices.sobol_indices(values, NAMES)
    assert [e.value for e in mine.first.values()] == pytest.approx(theirs["S1"], abs=1e-9)
    assert [e.value for e in mine.total.values()] == pytest.approx(theirs["ST"], abs=1e-9)
    walks = indices.morris_points(6, 30, 3)
    effects_found = indices.morris_effects(walks, g_function(walks), NAMES)
    theirs = morris.analyze(problem, walks, g_function(walks), num_resamples=10)
    assert list(effects_found.mean.values()) == pytest.approx(theirs["mu"], rel=1e-9)
    assert [e.value for e in effects_found.mean_size.values()] == pytest.approx(theirs["mu_star"], rel=1e-9)
    assert list(effects_found.deviation.values()) == pytest.approx(theirs["sigma"], rel=1e-9)


def test_against_openturns_on_the_same_samples():
    import openturns as ot

    points = indices.saltelli_points(3, 512, 3).reshape(512, 5, 3)
    order = [0, 4, 1, 2, 3]  # OpenTURNS wants A, B, then A with one column of B after the other
    design = np.concatenate([points[:, k] for k in order])
    algorithm = ot.SaltelliSensitivityAlgorithm(ot.Sample(design), ot.Sample(ishigami(design).reshape(-1, 1)), 512)
    mine = indices.sobol_indices(ishigami(points.reshape(-1, 3)), NAMES[:3])
    assert [e.value for e in mine.first.values()] == pytest.approx(list(algorithm.getFirstOrderIndices()), abs=0.06)
    jansen = ot.JansenSensitivityAlgorithm(ot.Sample(design), ot.Sample(ishigami(design).reshape(-1, 1)), 512)
    assert [e.value for e in mine.total.values()] == pytest.approx(list(jansen.getTotalOrderIndices()), abs=0.02)
    drawn = Plan(PROBLEM.tolerances, seed=5).draw(0, 800)
    y = PROBLEM(drawn)
    table = ot.CorrelationAnalysis(ot.Sample(np.column_stack(list(drawn.values()))), ot.Sample(y.reshape(-1, 1)))
    ranks = [sensitivity.rank_correlation(drawn[name], y).value for name in drawn]
    assert ranks == pytest.approx(list(table.computeSpearmanCorrelation()), abs=1e-9)


def test_exact_shares_of_variance_from_rows_at_hand():
    hits = dict.fromkeys(PROBLEM.shares, 0)
    wide = dict.fromkeys(PROBLEM.shares, 0.0)
    for seed in range(SEEDS):
        drawn = Plan(PROBLEM.tolerances, seed=seed).draw(0, 1000)
        for name, share in PROBLEM.shares.items():
            found = sensitivity.variance_share(drawn[name], PROBLEM(drawn))
            hits[name] += found.covers(share)
            wide[name] += (found.high - found.low) / squared_correlation(share, 1000) / SEEDS
    assert min(hits.values()) >= ENOUGH, hits
    assert max(wide.values()) < 1.3, wide


@pytest.mark.parametrize("batches", [40, 100])
def test_exact_shares_of_variance_from_rows_that_are_equal_in_a_batch(batches):
    """Twenty rows of a batch tell what one does: counted as twenty, what chance puts into a class is a share."""
    same = tuple(replace(tolerance, batch_share=1.0) for tolerance in PROBLEM.tolerances)
    found = {name: [] for name in PROBLEM.shares}
    for seed in range(SEEDS):
        plan = Plan(same, seed=seed, batch_size=20)
        drawn = plan.draw(0, 20 * batches)
        groups = plan.groups(0, 20 * batches)
        for name, shares in found.items():
            shares.append(sensitivity.variance_share(drawn[name], PROBLEM(drawn), groups))
    for name, shares in found.items():
        truth = PROBLEM.shares[name]
        assert np.mean([share.value for share in shares]) == pytest.approx(truth, abs=0.05)
        assert sum(share.covers(truth) for share in shares) >= 0.85 * SEEDS
        wide = np.mean([share.high - share.low for share in shares]) / squared_correlation(truth, batches)
        assert wide < 2.5, (name, wide)  # what chance puts into the lines comes on top


def test_exact_no_share_of_variance_from_no_more_batches_than_the_lines_leave_free():
    drawn = Plan(PROBLEM.tolerances).draw(0, 200)
    few = Groups(np.arange(200) % 2, alike=True)
    assert math.isnan(sensitivity.variance_share(drawn["a"], PROBLEM(drawn), few).value)


def test_exact_rank_correlation_of_normal_values():
    hits, width = 0, 0.0
    truth = 6 / math.pi * math.asin(2.0 / PROBLEM.sigma / 2)
    for seed in range(SEEDS):
        drawn = Plan(PROBLEM.tolerances, seed=seed).draw(0, 400)
        found = sensitivity.rank_correlation(drawn["a"], PROBLEM(drawn))
        hits += found.covers(truth)
        width += (found.high - found.low) / SEEDS
    assert hits >= ENOUGH
    bonett_and_wright = BOTH_TAILS * math.sqrt((1.0 + truth**2 / 2.0) / 397) * (1.0 - truth**2)
    assert width == pytest.approx(bonett_and_wright, rel=0.05)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_regress_ranks_that_all_agree_are_not_certain(sign):
    found = {n: sensitivity.rank_correlation(sign * np.arange(n), np.arange(n) ** 3.0) for n in (4, 5, 50, 100_000)}
    assert all(e.value == sign and e.covers(sign) and -1.0 <= e.low < e.high <= 1.0 for e in found.values())
    widths = [e.high - e.low for e in found.values()]
    assert widths == sorted(widths, reverse=True)
    assert found[4].covers(0.0)  # one order in 24
    assert widths[2] < 0.01
    y = np.repeat(np.arange(5.0), 40)
    assert sensitivity.rank_correlation(sign * y, y, Groups(y.astype(int), alike=True)) == found[5]
    assert math.isnan(sensitivity.rank_correlation(sign * y, y, Groups(np.zeros(200, dtype=int), alike=True)).low)


def test_exact_ranks_seldom_all_agree_at_the_lower_limit():
    """At the lower limit all ranks of n rows agree in fewer than one sample of forty."""
    for n in (5, 8):
        spearman = sensitivity.rank_correlation(np.arange(n), np.arange(n)).low
        score = 2.0 * math.sin(math.pi * spearman / 6.0)
        x, z = np.random.default_rng(1).normal(size=(2, 4000, n))
        y = score * x + math.sqrt(1.0 - score**2) * z
        assert np.mean(np.all(np.argsort(x) == np.argsort(y), axis=1)) < 0.025


def test_exact_nan_is_refused_everywhere():
    x, y = np.arange(200.0), np.arange(200.0)
    y[7] = np.nan
    for call in (
        lambda: sensitivity.rank_correlation(x, y),
        lambda: sensitivity.variance_share(x, y),
        lambda: indices.sobol_indices(y, ["a", "b", "c"][:2]),
        lambda: indices.morris_effects(np.tile([[0.0], [1.0]], (100, 1)), y, ["a"]),
    ):
        with pytest.raises(ValueError, match="finite"):
            call()


def test_exact_constant_output_has_no_sensitivity():
    drawn = Plan(PROBLEM.tolerances).draw(0, 200)
    assert math.isnan(sensitivity.variance_share(drawn["a"], np.ones(200)).value)
    assert math.isnan(indices.sobol_indices(np.ones(50), NAMES[:3]).first["a"].value)


@pytest.mark.parametrize("ask", [sensitivity.variance_share, sensitivity.rank_correlation])
def test_exact_rows_that_repeat_in_batches_tell_as_much_as_one_of_each(ask):
    drawn = Plan(PROBLEM.tolerances, seed=3).draw(0, 400)
    x, y = drawn["a"], PROBLEM(drawn)
    batches = Groups(np.repeat(np.arange(400), 10), alike=True)
    once, repeated = ask(x, y), ask(np.repeat(x, 10), np.repeat(y, 10), batches)
    assert repeated.value == pytest.approx(once.value, abs=0.05)
    assert repeated.high - repeated.low == pytest.approx(once.high - once.low, rel=0.4)
    assert math.isnan(ask(x, y, Groups(np.zeros(400, dtype=np.int64), alike=True)).low)


def test_exact_change_of_a_percentile_has_limits_where_rows_depend_on_each_other():
    def width(plan):
        change = effects_by_plan(plan, rows=300, percentage=50.0, factors=[0.5], names=["a"])[0].percentiles["y"]
        return change.high - change.low

    once = width(Plan(PROBLEM.tolerances))
    for sampling in ("latin_hypercube", "sobol"):
        assert 0.0 < width(Plan(PROBLEM.tolerances, sampling)) < 1.7 * once


@pytest.mark.parametrize("sampling", ["monte_carlo", "latin_hypercube", "corners"])
@pytest.mark.parametrize("size", [10, 150, 10_000])
def test_exact_effects_are_those_of_drives_of_different_batches(sampling, size):
    """What a drive of an unknown batch can be does not depend on how many others the batch has."""
    same = tuple(replace(tolerance, batch_share=1.0) for tolerance in PROBLEM.tolerances)
    alone = effects_by_plan(Plan(PROBLEM.tolerances, sampling), rows=200)
    assert effects_by_plan(Plan(same, sampling, batch_size=size), rows=200) == alone


def test_exact_one_row_outside_leaves_its_share_open():
    """Without that row nothing varies, and a jackknife of it knows no spread."""
    x = np.arange(200.0)
    assert math.isnan(sensitivity.variance_share(x, (x == 7.0).astype(float)).low)


def test_exact_gradient_of_a_parameter_without_spread():
    never = Tolerance("d", "discrete", 0.0, 0.0, 0.1, 0.2, (1.0 - 1e-9, 1e-9), (0.1, 0.2))
    found = sensitivity.gradient(lambda c: {"y": PROBLEM(c) + c["d"]}, (*PROBLEM.tolerances, never))["y"]
    assert math.isnan(found.slope["d"])
    assert found.share == pytest.approx({**PROBLEM.shares, "d": 0.0}, rel=1e-3)


def test_exact_gradient_of_a_linear_problem():
    found = sensitivity.gradient(lambda columns: {"y": PROBLEM(columns)}, PROBLEM.tolerances)["y"]
    assert found.slope == pytest.approx(PROBLEM.weights)
    assert found.share == pytest.approx(PROBLEM.shares, rel=1e-3)
    assert found.deviation == pytest.approx(PROBLEM.sigma, rel=1e-3)


def run(columns):
    return {"y": PROBLEM(columns)}, np.ones(len(columns["a"]), dtype=bool)


LIMITS = {"y": Spec("y", -math.inf, PROBLEM.mean + 2.0 * PROBLEM.sigma, 0.975)}


def effects_by_plan(plan, **options):
    return effects(lambda plan, n: run(plan.draw(0, n)), plan, LIMITS, ["y"], **options)


@pytest.mark.parametrize(
    "law",
    [
        Tolerance("a", "lognormal", 3.0, 2.0, 0.0, math.inf),
        Tolerance("a", "triangular", 0.0, 0.0, 0.0, 1.0),
        Tolerance("a", "triangular", 1.0, 0.0, 0.0, 1.0),
        Tolerance("a", "discrete", 0.0, 0.0, 0.1, 0.2, (0.5, 0.5), (0.1, 0.2)),
    ],
)
def test_regress_a_gradient_stays_within_the_law(law):
    """Beside the median of a wide lognormal law, and beside a mode at a bound, lay drives that cannot be."""

    def evaluate(columns):
        return {"y": np.where((columns["a"] >= law.lower) & (columns["a"] <= law.upper), 5.0 * columns["a"], np.nan)}

    found = sensitivity.gradient(evaluate, (law,))["y"]
    assert found.slope["a"] == pytest.approx(5.0)
    assert found.deviation == pytest.approx(5.0 * law.deviation)


def test_against_scipy_deviation_of_a_wide_lognormal_law():
    for width in (0.1, 2.0, 4.0):
        law = Tolerance("a", "lognormal", 3.0, width / 2.0, 0.0, math.inf, spread=2.0)
        assert law.deviation == pytest.approx(stats.lognorm(width, scale=3.0).std())


def test_exact_effects_of_a_linear_problem():
    """Without a the spread is sqrt(1.25), with half of it sqrt(2.25); percentile and yield follow."""
    found = effects_by_plan(Plan(PROBLEM.tolerances), rows=20_000)
    changes = {(effect.parameter, effect.factor): effect for effect in found}
    z = stats.norm.ppf(0.99)
    for factor, left in ((0.0, math.sqrt(1.25)), (0.5, 1.5), (1.5, math.sqrt(9 + 1.25))):
        effect = changes["a", factor]
        assert effect.percentiles["y"].covers(z * (left - PROBLEM.sigma))
        truth = stats.norm.cdf(2 * PROBLEM.sigma / left) - stats.norm.cdf(2)
        assert effect.yields["y"].covers(truth)
        assert effect.variances["y"] == pytest.approx(left**2 / 5.25 - 1, abs=0.03)


@pytest.mark.parametrize("changed", [0, 1, 3])
def test_exact_a_change_of_a_yield_is_as_open_as_the_few_rows_it_rests_on(changed):
    rows = 1000

    def evaluate(plan, n):
        return {"y": plan.tolerances[0].spread * (np.arange(n) < changed)}, np.ones(n, dtype=bool)

    found = effects(
        evaluate, Plan(PROBLEM.tolerances), {"y": Spec("y", -math.inf, 0.5, 0.9)}, ["y"], rows=rows, factors=[0.0],
        names=["a"],
    )[0].yields["y"]  # fmt: skip
    low, high = clopper_pearson(changed, rows)
    assert found.value == changed / rows
    assert found.high == pytest.approx(high)
    assert found.value - found.low == pytest.approx(math.hypot(changed / rows - low, clopper_pearson(0, rows)[1]))


@pytest.mark.parametrize(
    ("law", "allowed", "widest"),
    [
        (uniform("a", 0.0, 1.0), (0.0, math.inf), 1.0),
        (uniform("a", 0.2, 1.0), (0.0, math.inf), 1.5),
        (uniform("a", -1.0, 1.0), (0.0, math.inf), 1.0),
        (normal("a", 6.0, 1.0), (0.0, 15.0), 2.0),
        (Tolerance("a", "lognormal", 1.0, 0.1, 0.0, math.inf), (0.0, math.exp(0.6)), 2.0),
        (Tolerance("a", "triangular", 0.0, 0.0, 0.0, 1.0), (0.0, 3.0), 3.0),
        (normal("a", 6.0, 1.0), (-math.inf, math.inf), math.inf),
    ],
)
def test_exact_a_spread_is_widened_within_what_its_parameter_may_be(law, allowed, widest):
    assert law.widest(allowed) == pytest.approx(widest, rel=1e-8)
    found = law.scaled(min(law.widest(allowed), 1e3)).quantile(np.array([0.00135, 0.99865]))
    assert (allowed[0] <= found.min() and found.max() <= allowed[1]) or widest == 1.0


def failing_below_zero(columns):
    y, good = columns["a"], columns["a"] >= 0.0
    return {"y": np.where(good, y, np.nan)}, good


def test_regress_no_factor_makes_drives_that_cannot_be():
    """A limit of the model is no loss of yield, and no reason to tighten."""
    plan, specs = Plan((uniform("a", 0.0, 1.0),)), {"y": Spec("y", -math.inf, 0.96, 0.9)}
    bound = {"allowed": {"a": (0.0, math.inf)}}
    half, wide = effects(
        lambda p, n: failing_below_zero(p.draw(0, n)), plan, specs, ["y"], rows=500, factors=[0.5, 1.5], **bound
    )
    assert (half.used, wide.used, wide.missing) == (0.5, 1.0, 0)
    assert wide.yields["y"].value == wide.percentiles["y"].value == 0.0
    found = allocate(failing_below_zero, plan, specs, **bound)
    assert (found.factors, found.cost, found.reached) == ({"a": 1.0}, 1.0, True)


def test_regress_an_allocation_is_no_worse_than_what_is():
    """What lies beyond the present spread misleads the surface; within it the middle is what is bad."""

    def misleading(columns):
        away = np.abs(columns["a"])
        return {"y": np.select([away > 1.0, away < 0.4], [10.0, 1.0], 0.9)}, np.ones(len(away), dtype=bool)

    specs = {"y": Spec("y", -math.inf, 0.95, 0.55)}
    found = allocate(misleading, Plan((uniform("a", -1.0, 1.0),)), specs, bounds=(0.25, 1.0))
    assert (found.factors, found.cost, found.reached) == ({"a": 1.0}, 1.0, True)


def test_exact_allocation_of_a_linear_problem():
    """Lagrange: with costs 1/f the optimal factors obey f^3 proportional to 1 / variance, here between the bounds."""
    result = allocate(run, Plan(PROBLEM.tolerances, seed=2), LIMITS, bounds=(0.1, 8.0), rows=4000)
    assert result.reached
    assert result.fit["y"] == pytest.approx(1.0)
    variances = np.array([4.0, 0.25, 1.0])
    room = (2.0 * PROBLEM.sigma / stats.norm.ppf(0.975)) ** 2
    best = variances ** (-1 / 3)
    best *= math.sqrt(room / np.sum(best**2 * variances))
    assert list(result.factors.values()) == pytest.approx(best, rel=0.15)
    assert result.cost == pytest.approx(np.mean(1 / best), rel=0.03)
    assert result.cost < 1.0
