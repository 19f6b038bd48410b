from __future__ import annotations

import math
from dataclasses import replace

import hdfast
import numpy as np
import pytest
from hdfast.printing import interval_text, share_text
from hdfast.tolerance import indices, intervals, limits, statistics
from hdfast.tolerance.intervals import Groups
from hdfast.tolerance.policy import FailedRowsError, gate
from hdfast.tolerance.sample import Plan
from scipy import stats
from toleranced import LinearGaussian

PROBLEM = LinearGaussian()
SEEDS = 200
# 95 % of 200 seeds, less what chance alone takes from an exact interval in one test of a thousand
ENOUGH = int(stats.binom(SEEDS, 0.95).ppf(0.001))
SHARES = (0.01, 0.05, 0.5, 0.95, 0.99)
LIMIT = limits.Spec("y", -math.inf, PROBLEM.law.ppf(0.97), 0.9)


def plans(sampling, **options):
    for seed in range(SEEDS):
        yield Plan(PROBLEM.tolerances, sampling, seed, **options)


def coverage(sampling, rows, **options):
    """In how many of 200 seeds the interval of each statistic holds the truth, and its mean width."""
    hits, widths = {}, {}

    def note(name, low, truth, high):
        hits[name] = hits.get(name, 0) + (low <= truth <= high)
        widths[name] = widths.get(name, 0.0) + (high - low) / SEEDS

    for plan in plans(sampling, **options):
        values, groups = PROBLEM(plan.draw(0, rows)), plan.groups(0, rows)
        for share in SHARES:
            found = intervals.percentile(values if groups else np.sort(values), share, groups)
            note(f"P{100 * share:g}", found.low, PROBLEM.law.ppf(share), found.high)
        found = intervals.mean(values, groups)
        note("mean", found.low, PROBLEM.mean, found.high)
        verdict = limits.judge_values(LIMIT, values, np.ones(rows, dtype=bool), groups=groups)
        note("yield", verdict.interval[0], 0.97, verdict.interval[1])
    return hits, widths


def independent(rows):
    """Widths of the intervals of independent rows, to first order in 1 / sqrt(rows)."""
    spread = {f"P{100 * p:g}": math.sqrt(p * (1 - p)) / PROBLEM.law.pdf(PROBLEM.law.ppf(p)) for p in SHARES}
    spread |= {"mean": PROBLEM.sigma, "yield": math.sqrt(0.97 * 0.03)}
    return {name: 2 * stats.norm.ppf(0.975) * value / math.sqrt(rows) for name, value in spread.items()}


@pytest.mark.parametrize(
    ("sampling", "rows", "options"),
    [
        ("monte_carlo", 500, {}),
        ("latin_hypercube", 2000, {"block": 100}),
        ("sobol", 2048, {"replicates": 16}),
    ],
)
def test_exact_intervals_hold_in_95_percent_of_seeds(sampling, rows, options):
    found, widths = coverage(sampling, rows, **options)
    assert min(found.values()) >= ENOUGH, found
    wide = {name: widths[name] / width for name, width in independent(rows).items()}
    assert max(wide.values()) < 1.8, wide


@pytest.mark.parametrize(
    ("sampling", "rows", "options"),
    [("sobol", 512, {"replicates": 2}), ("sobol", 512, {"replicates": 4}), ("latin_hypercube", 200, {"block": 100})],
)
def test_regress_percentiles_of_few_groups_hold_in_95_percent_of_seeds(sampling, rows, options):
    """Two groups that agree by chance gave limits of no width."""
    found, _ = coverage(sampling, rows, **options)
    assert min(found[f"P{100 * share:g}"] for share in SHARES) >= ENOUGH, found


def test_exact_intervals_of_batches_hold():
    """Rows of a batch resemble each other: binomial intervals would be far too narrow here."""
    tolerances = tuple(replace(tolerance, batch_share=0.6) for tolerance in PROBLEM.tolerances)
    hits, naive, width = 0, 0, 0.0
    for seed in range(SEEDS):
        plan = Plan(tolerances, seed=seed, batch_size=40)
        values = PROBLEM(plan.draw(0, 4000))
        held = values <= PROBLEM.law.ppf(0.9)
        found = intervals.share(held, plan.groups(0, 4000))
        hits += found.covers(0.9)
        width += (found.high - found.low) / SEEDS
        naive += intervals.share(held).covers(0.9)
    assert hits >= ENOUGH - 6
    assert naive < 150
    assert width < 2 * stats.norm.ppf(0.975) * math.sqrt(0.09 / 100)  # a batch tells at least as much as one row


@pytest.mark.parametrize(("batches", "size", "share"), [(20, 50, 0.8), (40, 100, 0.9), (200, 50, 0.5)])
def test_exact_percentiles_of_batches_hold_where_few_of_them_reach_into_the_tail(batches, size, share):
    """Of 20 batches two or three hold the largest hundredth, and held P99 in 84 % of samples when all 20 counted."""
    groups, draw = Groups(np.repeat(np.arange(batches), size), alike=True), np.random.default_rng(7).normal
    hits, width = 0, 0.0
    for _ in range(150):
        common, own = draw(size=(batches, 1)), draw(size=(batches, size))
        values = (math.sqrt(share) * common + math.sqrt(1.0 - share) * own).ravel()
        found = intervals.percentile(values, 0.99, groups)
        hits += found.covers(stats.norm.ppf(0.99))
        width += (found.value - found.low) / 150
    assert hits >= 0.95 * 150
    assert width < {20: 1.0, 40: 0.7, 200: 0.16}[batches]


def test_exact_capability_holds_in_95_percent_of_seeds():
    upper, lower = PROBLEM.mean + 3.5 * PROBLEM.sigma, PROBLEM.mean - 4.5 * PROBLEM.sigma
    hits = {"one": 0, "two": 0, "large": 0}
    widths = dict.fromkeys(hits, 0.0)
    for plan in plans("monte_carlo"):
        values, many = PROBLEM(plan.draw(0, 200)), PROBLEM(plan.draw(0, 6000))
        for name, rows, low in (("one", values, -math.inf), ("two", values, lower), ("large", many, -math.inf)):
            found = statistics.capability(rows, low, upper).cpk
            hits[name] += found.covers(3.5 / 3)
            widths[name] += (found.high - found.low) / SEEDS
    assert min(hits.values()) >= ENOUGH, hits
    bissell = {n: 2 * stats.norm.ppf(0.975) * math.sqrt(1 / (9 * n) + (3.5 / 3) ** 2 / (2 * n)) for n in (200, 6000)}
    assert widths == pytest.approx({"one": bissell[200], "two": bissell[200], "large": bissell[6000]}, rel=0.03)


def standard(rows):
    """Values of mean 0 and standard deviation 1."""
    values = np.linspace(-1.0, 1.0, rows)
    return values / np.std(values, ddof=1)


@pytest.mark.parametrize(
    ("rows", "share", "factor"),
    [(2, 0.95, 26.260), (3, 0.95, 7.656), (10, 0.95, 2.911), (20, 0.95, 2.396), (2, 0.99, 37.094), (10, 0.99, 3.981)],
)
def test_against_tables_of_one_sided_tolerance_factors(rows, share, factor):
    """Mean + k s is above a share of a normal law with 95 % confidence (Owen 1963)."""
    for lower, upper in ((-math.inf, factor), (-factor, math.inf)):
        cpk = statistics.capability(standard(rows), lower, upper, confidence=0.9).cpk
        assert 3 * cpk.low == pytest.approx(stats.norm.ppf(share), abs=2e-4)


@pytest.mark.parametrize("rows", [2, 3, 10, 20, 30, 10_000])
def test_regress_few_rows_have_a_capability_whatever_the_distance_of_the_limit(rows):
    """The non-central t of SciPy is NaN in tails that these reach."""
    for cpk in (-15.0, -1.0, 0.0, 0.3, 0.5, 1.33, 1.67, 60.0):
        found = statistics.capability(standard(rows), -math.inf, 3 * cpk).cpk
        assert -math.inf < found.low < found.value < found.high < math.inf
        mirrored = statistics.capability(standard(rows), 3 * cpk, math.inf).cpk
        assert (mirrored.low, mirrored.high) == pytest.approx((-found.high, -found.low))


def test_exact_tolerance_intervals_cover_what_they_claim():
    covered = []
    for plan in plans("monte_carlo"):
        values = PROBLEM(plan.draw(0, 300))
        low, high = PROBLEM.law.cdf(statistics.tolerance_interval(values, 0.95))
        covered.append(high - low)
    hits = sum(share >= 0.95 for share in covered)
    assert hits >= ENOUGH, hits
    assert np.mean(covered) == pytest.approx(1 - 2 * 4 / 301, abs=2e-3)  # from the 4th smallest to the 4th largest


@pytest.mark.parametrize(
    ("coverage", "one", "two"), [(0.95, 59, 93), (0.99, 299, 473), (0.9973, 1109, 1756), (0.999, 2995, 4742)]
)
def test_exact_sample_sizes_of_wilks(coverage, one, two):
    assert statistics.sample_size(coverage) == one
    assert statistics.sample_size(coverage, sides=2) == two
    values = np.arange(float(two))
    assert statistics.tolerance_interval(values, coverage) == (0.0, two - 1.0)
    assert statistics.tolerance_interval(values[:-1], coverage) == (-math.inf, math.inf)


@pytest.mark.parametrize("coverage", [0.0, 1.0, 2.0])
def test_exact_no_number_of_rows_covers_everything(coverage):
    with pytest.raises(hdfast.InputError, match="coverage"):
        statistics.sample_size(coverage)


def test_against_openturns_on_the_same_sample():
    import openturns as ot

    values = PROBLEM(Plan(PROBLEM.tolerances, seed=4).draw(0, 1000))
    sample = ot.Sample(values.reshape(-1, 1))
    assert statistics.sample_size(0.95) == ot.Wilks.ComputeSampleSize(0.95, 0.95, 0)
    assert statistics.sample_size(0.99) == ot.Wilks.ComputeSampleSize(0.99, 0.95, 0)
    summary = statistics.summarise("y", "", gate(values, np.ones(1000, dtype=bool), "refuse", "y"))
    assert summary.mean.value == pytest.approx(sample.computeMean()[0], rel=1e-12)
    assert summary.deviation == pytest.approx(sample.computeStandardDeviation()[0], rel=1e-12)
    ordered = np.sort(values)
    for share in (0.01, 0.5, 0.99):
        nearest = sample.computeQuantilePerComponent(share)[0]
        mine = intervals.percentile(ordered, share).value
        place = np.searchsorted(ordered, mine)
        assert ordered[max(place - 2, 0)] <= nearest <= ordered[min(place + 2, 999)]


def test_against_scipy_quantile_interval():
    values = np.sort(PROBLEM(Plan(PROBLEM.tolerances, seed=9).draw(0, 700)))
    for share in (0.05, 0.5, 0.97):
        truth = stats.quantile_test(values, p=share).confidence_interval(0.95)
        found = intervals.percentile(values, share)
        assert (found.low, found.high) == pytest.approx((truth.low, truth.high))


def test_against_scipy_clopper_pearson():
    for hits, rows in ((0, 10), (37, 40), (40, 40), (9_999_990, 10_000_000)):
        truth = stats.binomtest(hits, rows).proportion_ci(0.95, method="exact")
        assert intervals.clopper_pearson(hits, rows) == pytest.approx((truth.low, truth.high), rel=1e-9)


@pytest.mark.parametrize("rows", [1, 2, 3, 58, 59, 300])
def test_exact_percentile_limits_are_infinite_when_rows_do_not_suffice(rows):
    found = intervals.percentile(np.arange(float(rows)), 0.95)
    exists = 1 - 0.95**rows >= 0.975
    assert math.isfinite(found.high) == exists


def test_exact_group_intervals_need_two_groups():
    one = Groups(np.zeros(100, dtype=np.int64), alike=False)
    values = np.arange(100.0)
    for found in (
        intervals.mean(values, one),
        intervals.percentile(values, 0.5, one),
        intervals.share(values > 5, one),
    ):
        assert math.isnan(found.low)
        assert math.isfinite(found.value)


@pytest.mark.parametrize("alike", [True, False])
def test_exact_few_rows_outside_are_no_better_than_none_and_no_group_better_than_independent_rows(alike):
    groups = Groups(np.repeat(np.arange(10), 1000), alike)
    held = np.ones(10_000, dtype=bool)
    none = intervals.share(held, groups)
    assert none.low == pytest.approx(0.025 ** (1 / 10 if alike else 1 / 10_000))
    for outside in range(1, 6):
        held[1000 * outside] = False
        found = intervals.share(held, groups)
        low, high = intervals.clopper_pearson(10_000 - outside, 10_000)
        assert found.low <= (none.low if outside == 1 else low)
        assert found.high >= high


def test_exact_interval_of_batches_that_are_good_or_bad_as_a_whole():
    """A batch of equal rows is one row, whatever its size: Clopper and Pearson's interval of 40 rows is exact."""
    groups = Groups(np.repeat(np.arange(40), 25), alike=True)
    for bad in range(41):
        held = groups.number >= bad
        assert intervals.share(held, groups).high >= intervals.clopper_pearson(40 - bad, 40)[1] - 1e-12
        assert intervals.share(held, groups).low <= intervals.clopper_pearson(40 - bad, 40)[0] + 1e-12


def test_against_leaving_out_each_of_unequal_groups():
    sizes = [1000, 1, 10]
    number = np.repeat(np.arange(3), sizes)
    values = np.random.default_rng(1).normal(size=sum(sizes))
    changes = [values[number != k].mean() - values.mean() for k in range(3)]
    spread = math.sqrt(2 / 3 * sum(change**2 for change in changes))
    assert intervals.mean_spread(values, Groups(number, alike=False)) == pytest.approx(spread)
    means = values[:1000].reshape(8, 125).mean(axis=1)
    equal = Groups(np.repeat(np.arange(8), 125), alike=False)
    assert intervals.mean_spread(values[:1000], equal) == pytest.approx(means.std(ddof=1) / math.sqrt(8))


def test_exact_percentile_limits_where_the_failed_rows_are_all_of_one_batch():
    """Whether this batch could be any other is as open as for numbers beyond all others, be they infinite or equal."""
    values, groups = np.random.default_rng(1).normal(size=1000), Groups(np.repeat(np.arange(20), 50), alike=True)
    different, equal, failed = values.copy(), values.copy(), values.copy()
    different[:11], equal[:11], failed[:11] = np.arange(11) + 99.0, 99.0, np.inf
    truth = intervals.percentile(different, 0.99, groups)
    assert truth.low < 3.0
    for found in (equal, failed):
        assert intervals.percentile(found, 0.99, groups).low == pytest.approx(truth.low, rel=0.1)
        assert intervals.percentile(-found, 0.01, groups).high == -intervals.percentile(found, 0.99, groups).low


NAN_ROW = np.array([1.0, 2.0, np.nan, 4.0, 5.0])
ALL = np.ones(5, dtype=bool)


def test_exact_one_nan_row_never_turns_a_statistic_wrong():
    with pytest.raises(FailedRowsError, match="1 of 5 rows have no te_pp") as caught:
        gate(NAN_ROW, ALL, "refuse", "te_pp")
    assert caught.value.rows == [2]
    excluded = statistics.summarise("te_pp", "rad", gate(NAN_ROW, ALL, "exclude", "te_pp"))
    assert excluded.mean.value == 3.0
    assert (excluded.rows, excluded.missing, excluded.note) == (4, 1, "1 rows left out")
    worst = statistics.summarise("te_pp", "rad", gate(NAN_ROW, ALL, "worst", "te_pp"))
    assert math.isnan(worst.mean.value)
    assert worst.percentiles[50.0].value == 4.0
    assert worst.high == math.inf
    assert math.isnan(statistics.capability(gate(NAN_ROW, ALL, "worst", "te_pp").values, 0.0, 9.0).cpk.value)


def test_exact_missing_values_are_the_lowest_under_a_lower_limit():
    usable = gate(NAN_ROW, ALL, "worst", "te_pp", -math.inf)
    found = statistics.summarise("te_pp", "rad", usable, percentages=(12.5, 50.0))
    assert found.percentiles[12.5].value == -math.inf
    assert found.percentiles[50.0].value == 2.0


def test_exact_equal_values_have_no_spread_although_numpy_finds_one():
    equal = np.full(3, 0.1)
    assert np.std(equal) > 0.0
    found = statistics.summarise("te_pp", "rad", gate(equal, ALL[:3], "refuse", "te_pp"))
    assert found.deviation == 0.0
    assert math.isnan(found.skewness)
    assert statistics.capability(equal, 0.0, 1.0).cpk.value == math.inf
    assert math.isnan(indices.sobol_indices(equal, ["a"]).first["a"].value)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_exact_a_failed_row_never_counts_as_good(bad):
    values = np.array([1.0, 1.0, bad, 1.0])
    spec = limits.Spec("te_pp", 0.0, 2.0, 0.9)
    for policy, rows in (("worst", 4), ("refuse", 4), ("exclude", 3)):
        verdict = limits.judge_values(spec, values, np.ones(4, dtype=bool), policy=policy)
        assert (verdict.within, verdict.rows) == (3, rows)
    finished = np.array([True, False, True, True])
    assert limits.judge_values(spec, np.ones(4), finished).within == 3


def test_exact_verdicts():
    spec = limits.Spec("te_pp", -math.inf, 1.0, 0.95)
    assert limits.Verdict(spec, 990, 1000, (0.98, 0.995)).outcome == "met"
    assert limits.Verdict(spec, 900, 1000, (0.88, 0.92)).outcome == "not met"
    assert limits.Verdict(spec, 960, 1000, (0.94, 0.97)).outcome == "undecided"
    assert limits.Verdict(spec, 990, 1000, (0.98, 0.995)).ppm.value == pytest.approx(10_000)
    whole = replace(spec, min_yield=1.0)
    assert limits.Verdict(whole, 1000, 1000, (0.996, 1.0)).outcome == "met"
    assert limits.Verdict(whole, 999, 1000, (0.99, 1.0)).outcome == "not met"


def test_regress_a_yield_as_asked_for_is_met():
    """0.55 times 100 is more than 55."""
    for percent in range(1, 101):
        spec = limits.Spec("te_pp", -math.inf, 1.0, float(f"{percent / 100:g}"))
        assert limits.Verdict(spec, percent, 100, (0.0, 1.0)).met
        assert not limits.Verdict(spec, percent - 1, 100, (0.0, 1.0)).met
    assert not limits.Verdict(spec, 0, 0, (math.nan, math.nan)).met


def test_regress_a_yield_is_not_rounded_up_to_all_rows():
    """One row of 50,000 out of limits was printed as 100 % beside "not met"."""
    assert [share_text(share) for share in (49_999 / 50_000, 1.0, 0.9741, math.nan)] == [
        "99.998 %", "100.00 %", "97.41 %", "not known",
    ]  # fmt: skip
    assert share_text(1.0 - 2.0**-53) == "99.99999999999999 %"
    assert interval_text((0.99986, 0.9999994)) == "99.99 .. 99.9999 %"
    assert interval_text((0.9999, 1.0), 3) == "99.990 .. 100.000 %"
    assert interval_text((math.nan, math.nan)) == "not known"
