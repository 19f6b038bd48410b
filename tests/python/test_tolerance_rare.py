from __future__ import annotations

import math

import hdfast
import numpy as np
import pytest
from hdfast.tolerance import rare
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.intervals import clopper_pearson
from hdfast.tolerance.rare import subset_simulation
from hdfast.tolerance.sample import Plan
from scipy import stats
from toleranced import SMALL

SEEDS = 200
ENOUGH = int(stats.binom(SEEDS, 0.95).ppf(0.001))


def ratio(probability, levels, rows, replicates=8):
    """How far apart, as a factor, Au and Beck's coefficient of variation puts the limits of so many replicates.

    Rows of a level that grew from one seed count as a quarter each (their 1 + gamma = 4).
    """
    last = probability / 0.1 ** (levels - 1)
    variance = (0.9 / 0.1 + 4.0 * (levels - 2) * 0.9 / 0.1 + 4.0 * (1.0 - last) / last) / rows
    reach = stats.t.ppf(0.975, replicates - 1) * math.sqrt(variance / replicates)
    return math.exp(2.0 * reach)


def plane(beta, dimensions):
    return lambda scores: beta - scores.sum(axis=1) / math.sqrt(dimensions)


@pytest.mark.parametrize("ppm", [1000.0, 50.0, 1.0])
def test_exact_linear_gaussian_probability_in_95_percent_of_seeds(ppm):
    truth = ppm * 1e-6
    beta = stats.norm.isf(truth)
    found = [subset_simulation(plane(beta, 5), 5, rows=400, seed=seed).probability for seed in range(SEEDS)]
    hits = sum(probability.covers(truth) for probability in found)
    assert hits >= ENOUGH - 4, hits
    apart = np.median([probability.high / probability.low for probability in found])
    assert apart < 1.25 * ratio(truth, math.ceil(-math.log10(truth)), 400)


def test_exact_two_failure_regions():
    """|u1| > 4: two regions apart, where chains must not all end in one."""
    truth = 2 * stats.norm.sf(4.0)
    found = subset_simulation(lambda scores: 4.0 - np.abs(scores[:, 0]), 3, rows=1000, seed=5)
    assert found.probability.covers(truth)
    assert found.probability.high / found.probability.low < 2.0 * ratio(truth, 5, 1000)


def test_against_openturns_subset_sampling():
    import openturns as ot

    ot.RandomGenerator.SetSeed(1)
    vector = ot.RandomVector(ot.Normal(2))
    function = ot.SymbolicFunction(["x1", "x2"], ["5.5 - x1 - x2 + 0.1 * (x1 - x2)^2"])
    event = ot.ThresholdEvent(ot.CompositeRandomVector(function, vector), ot.Less(), 0.0)
    algorithm = ot.SubsetSampling(event)
    algorithm.setMaximumOuterSampling(20_000)
    algorithm.run()
    theirs = algorithm.getResult()
    mine = subset_simulation(lambda s: 5.5 - s[:, 0] - s[:, 1] + 0.1 * (s[:, 0] - s[:, 1]) ** 2, 2, rows=2000, seed=1)
    spread = 3 * theirs.getStandardDeviation()
    assert mine.probability.low <= theirs.getProbabilityEstimate() + spread
    assert mine.probability.high >= theirs.getProbabilityEstimate() - spread
    assert mine.probability.high < 2.0 * mine.probability.low


def test_exact_missing_margin_counts_as_the_event_and_nothing_found_is_bounded():
    found = subset_simulation(lambda scores: np.where(scores[:, 0] > 1.0, np.nan, 1.0), 2, rows=1000)
    assert found.probability.covers(stats.norm.sf(1.0))
    assert found.probability.high < 1.2 * found.probability.low  # 8,000 rows alone put 1.11 between them
    never = subset_simulation(lambda scores: 100.0 - scores[:, 0], 2, rows=100, smallest=1e-6)
    assert never.probability.value == 0.0
    assert never.probability.high == 1e-6


def test_exact_margins_of_two_values_are_counted():
    """A duration outside a range is 0 for most drives: no level is nearer to the event than the one before."""
    limit = stats.norm.isf(1e-3)
    found = subset_simulation(lambda scores: np.where(scores[:, 0] > limit, -1.0, 0.001), 2)
    assert found.levels == 1
    assert 1e-4 <= found.probability.value <= 2e-3
    assert found.probability.covers(1e-3)


def test_exact_a_margin_of_zero_is_within():
    found = subset_simulation(lambda scores: np.zeros(len(scores)), 2)
    assert found.probability.value == 0.0
    assert found.probability.high == pytest.approx(clopper_pearson(0, 1000)[1])


def test_exact_probability_of_margins_on_steps():
    """Margins in steps of a half tie at every level; the event is a sum of 3 standard deviations and more."""
    truth, hits, apart = stats.norm.sf(3.0), 0, []
    for seed in range(60):
        found = subset_simulation(lambda scores: np.ceil(2 * plane(2.5, 5)(scores)) / 2, 5, rows=400, seed=seed)
        hits += found.probability.covers(truth)
        apart.append(found.probability.high / found.probability.low)
    assert hits >= int(stats.binom(60, 0.95).ppf(0.001)), hits
    assert np.median(apart) < 1.5 * ratio(truth, 3, 400)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_exact_tail_of_a_single_parameter_down_to_the_smallest_probability(side):
    """A parameter is drawn through its probability; beyond 8.2 standard deviations it has no more values."""
    plan = Plan((Tolerance("a", "normal", 0.0, 1.0, -math.inf, math.inf),))
    truth = 1e-14
    found = subset_simulation(
        lambda scores: stats.norm.isf(truth) - side * plan.from_scores(scores)["a"], 1, rows=2000, smallest=1e-15
    )
    assert found.probability.covers(truth)
    assert found.probability.high < 10.0 * found.probability.low


def test_regress_replicates_far_apart_have_an_interval():
    """Their lognormal limit is beyond what a number can be."""
    found = rare._combine(np.array([1e-9, 1e-3]), np.zeros(2), 0.95)
    assert found.low < 1e-9
    assert found.high == 1.0


def test_exact_wrong_arguments():
    for options, name in (
        ({"rows": 10}, "rows"), ({"replicates": 1}, "replicates"), ({"share": 0.9}, "share"),
        ({"smallest": 1e-16}, "smallest"),
    ):  # fmt: skip
        with pytest.raises(hdfast.InputError, match=name):
            subset_simulation(plane(3, 2), 2, **options)


def test_against_brute_force_on_a_drive(tmp_path, long):
    """Transmission error beyond a limit of about 600 (with --long 100) ppm: subset simulation and counting agree."""
    rows = 200_000 if long else 20_000
    limit = "2.35e-4" if long else "2.25e-4"
    path = tmp_path / "drive.toml"
    path.write_text(SMALL.replace("upper = 3e-4", f"upper = {limit}"))
    study = hdfast.tolerance(path, n=rows)
    verdict = study.yields["te_pp"]
    outside = verdict.rows - verdict.within
    assert outside >= 5
    counted = clopper_pearson(outside, rows, 0.99)
    found = study.rare("te_pp", rows=400, replicates=6)
    assert found.probability.low <= counted[1]
    assert found.probability.high >= counted[0]
    assert found.probability.high / found.probability.low < 2.0 * ratio(outside / rows, 4, 400, 6)
    assert found.evaluations < rows
