from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import hdfast
import numpy as np
import pytest
from hdfast import config
from hdfast.tolerance.correlation import correlation
from hdfast.tolerance.designs import DESIGNS
from hdfast.tolerance.distributions import Tolerance
from hdfast.tolerance.reading import read_tolerance
from hdfast.tolerance.sample import Plan
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from toleranced import normal, uniform

MIXED = (normal("J_l", 1.0, 0.1), uniform("k1", 2.0, 3.0), Tolerance("B_m", "lognormal", 1.0, 0.3, 0.0, math.inf))
COUPLED = correlation([["J_l", "k1", 0.6]], "scores", ["J_l", "k1", "B_m"])


def tolerance(entry, nominal=2.0, folder=None):
    return read_tolerance("J_l", entry, nominal, lambda found, allowed: None, folder)


LAWS = [
    ({"distribution": "beta", "a": 2, "b": 5, "lower": 1, "upper": 3}, stats.beta(2, 5, 1, 2)),
    ({"distribution": "capability", "tolerance": 0.3, "cp": 1.0}, stats.norm(2, 0.1)),
    ({"distribution": "capability", "tolerance": 0.3, "cp": 2.0, "cpk": 1.0}, stats.norm(2.15, 0.05)),
    ({"distribution": "capability", "tolerance": 0.3, "cp": 2, "cpk": 1, "side": "lower"}, stats.norm(1.85, 0.05)),
    ({"distribution": "capability", "tolerance": 0.2, "cpk": 0.5, "inspected": True},
     stats.truncnorm(-1.5, 1.5, 2, 0.4 / 3)),
]  # fmt: skip


@pytest.mark.parametrize(("entry", "law"), LAWS)
def test_against_scipy_laws(entry, law):
    u = np.linspace(0.001, 0.999, 999)
    assert tolerance(entry).quantile(u) == pytest.approx(law.ppf(u), rel=1e-9)
    assert tolerance(entry).describe()


def test_exact_capability_is_what_it_says():
    """The Cp and Cpk of a large sample are those asked for."""
    values = tolerance({"distribution": "capability", "tolerance": 0.3, "cp": 1.5, "cpk": 1.2}).sample(400_000, 1)
    sigma = values.std()
    assert 0.3 / (3 * sigma) == pytest.approx(1.5, rel=0.01)
    assert min(2.3 - values.mean(), values.mean() - 1.7) / (3 * sigma) == pytest.approx(1.2, rel=0.01)


def test_exact_discrete_shares():
    found = tolerance({"distribution": "discrete", "values": [3, 1, 2], "weights": [1, 2, 1]})
    values, counts = np.unique(found.quantile((np.arange(4000) + 0.5) / 4000), return_counts=True)
    assert values.tolist() == [1, 2, 3]
    assert counts.tolist() == [2000, 1000, 1000]


def test_regress_large_weights_are_weights():
    law = tolerance({"distribution": "discrete", "values": [1.0, 2.0, 3.0], "weights": [1e308, 0.0, 1e308]})
    assert (law.points, law.shape) == ((1.0, 3.0), (0.5, 0.5))


def test_exact_measured_values_from_list_and_file(tmp_path):
    measured = [1.0, 5.0, 2.0, 4.0, 3.0]
    (tmp_path / "m.csv").write_text("part,J_l\n" + "\n".join(f"a,{value}" for value in measured))
    one = tolerance({"distribution": "empirical", "values": measured})
    two = tolerance({"distribution": "empirical", "file": "m.csv"}, folder=tmp_path)
    assert one == two
    assert one.quantile(np.array([0.0, 0.1, 0.5, 0.9, 1.0])).tolist() == [1, 1, 3, 5, 5]


def test_exact_values_beyond_the_bounds_are_cut_off():
    found = tolerance({"distribution": "discrete", "values": [3, 1, 2], "weights": [2, 1, 1], "upper": 2.5})
    values, counts = np.unique(found.quantile((np.arange(4000) + 0.5) / 4000), return_counts=True)
    assert (values.tolist(), counts.tolist()) == ([1, 2], [2000, 2000])
    never = tolerance({"distribution": "discrete", "values": [1, 2, 3], "weights": [1, 1, 0]})
    assert never.extremes() == (1, 2)
    cut = tolerance({"distribution": "empirical", "values": [5, 1, 4, 2, 3], "upper": 3.5})
    assert cut == tolerance({"distribution": "empirical", "values": [1, 2, 3]})


NEGATIVE = [
    {"distribution": "normal", "mean": 1.1, "sigma": 0.1},
    {"distribution": "triangular", "mode": 1.05, "lower": 0.9, "upper": 1.1},
    {"distribution": "beta", "a": 2, "b": 5, "lower": 0.9, "upper": 1.1},
    {"distribution": "discrete", "values": [0.9, 1.0, 1.1], "weights": [3, 1, 1]},
    {"distribution": "empirical", "values": [0.9, 1.0, 1.3]},
]


@pytest.mark.parametrize("entry", NEGATIVE, ids=lambda entry: entry["distribution"])
def test_exact_relative_laws_of_a_negative_nominal_value_are_mirrored(entry):
    u = (np.arange(500) + 0.5) / 500
    mirrored = tolerance(entry | {"relative": True}, -2.0).quantile(u)
    assert mirrored == pytest.approx(-tolerance(entry | {"relative": True}, 2.0).quantile(1.0 - u))
    assert np.all(np.diff(mirrored) >= 0.0)


def test_exact_impossible_and_certain_probabilities_have_finite_values():
    values = normal("a", 0.0, 1.0).quantile(np.array([0.0, 1.0]))
    assert values == pytest.approx([stats.norm.ppf(2.0**-54), stats.norm.isf(2.0**-53)], rel=1e-6)


def test_exact_a_table_with_a_column_twice_is_refused(tmp_path):
    (tmp_path / "m.csv").write_text("J_l,J_l\n1,2\n3,4\n")
    with pytest.raises(hdfast.InputError, match="2 columns 'J_l'"):
        tolerance({"distribution": "empirical", "file": "m.csv"}, folder=tmp_path)


@pytest.mark.parametrize(
    "name", ["./worst.csv", "rows/000000000000.parquet", "data/../rows/m.csv", "trajectories.zarr/m.csv", "input.toml"]
)
def test_exact_a_table_in_the_place_of_a_result_is_refused(name, tmp_path):
    (tmp_path / "data").mkdir()
    place = tmp_path / name
    place.resolve().parent.mkdir(exist_ok=True)
    place.write_text("J_l\n1\n2\n")
    with pytest.raises(hdfast.InputError, match=rf"file = '{name}' is in the place of [a-z.]+, a result of hdfast"):
        tolerance({"distribution": "empirical", "file": name}, folder=tmp_path)


WRONG = [
    ({"distribution": "discrete", "values": [1, 2], "weights": [1, 0]}, "1 different numbers that can occur"),
    ({"distribution": "empirical", "values": [1, 2, 3], "upper": 1.5}, "1 different numbers that can occur"),
    ({"distribution": "beta", "a": -1, "b": 1, "lower": 0, "upper": 1}, "a = -1"),
    ({"distribution": "beta", "a": 1, "b": 1, "lower": 0}, "'upper'"),
    ({"distribution": "discrete", "values": [1]}, "at least 2"),
    ({"distribution": "discrete", "values": [1, 2], "weights": [1]}, "weights has 1"),
    ({"distribution": "empirical"}, "either 'values' or 'file'"),
    ({"distribution": "empirical", "file": "nothing.csv"}, "no such file"),
    ({"distribution": "capability", "tolerance": 0.1}, "'cp', 'cpk' or both"),
    ({"distribution": "capability", "tolerance": 0.1, "cp": 1, "cpk": 2}, "cpk = 2 is out of range"),
    (
        {"distribution": "capability", "tolerance": 0.1, "cpk": -0.2},
        r"cpk = -0.2 is out of range \(allowed: a number from 0 to 100\)",
    ),
    ({"distribution": "capability", "tolerance": 0.1, "cp": 1, "side": "left"}, "side = 'left'"),
    ({"distribution": "normal", "sigma": 1, "batch_share": 2}, "batch_share = 2"),
]


@pytest.mark.parametrize(("entry", "message"), WRONG)
def test_exact_wrong_tolerances_say_what_is_allowed(entry, message):
    with pytest.raises(hdfast.InputError, match=message):
        tolerance(entry)


@pytest.mark.parametrize("sampling", DESIGNS)
@pytest.mark.parametrize("batches", [1, 7])
@pytest.mark.parametrize("coupled", [None, COUPLED])
def test_exact_rows_do_not_depend_on_the_pieces(sampling, batches, coupled):
    tolerances = tuple(
        Tolerance(t.name, t.distribution, t.centre, t.width, t.lower, t.upper, batch_share=0.3) for t in MIXED
    )
    plan = Plan(tolerances, sampling, 11, replicates=5, block=30, levels=5, correlation=coupled, batch_size=batches)
    rows = plan.rows(100)
    whole = plan.draw(0, rows)
    for cuts in ([0, 1, 2, rows], [0, rows // 3, rows // 2, rows], list(range(rows + 1))):
        parts = [plan.draw(a, b) for a, b in pairwise(cuts) if b > a]
        for name in plan.names:
            assert np.array_equal(np.concatenate([part[name] for part in parts]), whole[name])


@pytest.mark.parametrize("sampling", ["monte_carlo", "latin_hypercube", "sobol"])
def test_against_scipy_marginals_of_every_sampling(sampling):
    drawn = Plan(MIXED, sampling, 5, block=500, correlation=COUPLED).draw(0, 8000)
    assert stats.kstest(drawn["J_l"], stats.norm(1, 0.1).cdf).pvalue > 1e-3
    assert stats.kstest(drawn["k1"], stats.uniform(2, 1).cdf).pvalue > 1e-3
    assert stats.kstest(drawn["B_m"], stats.lognorm(0.3).cdf).pvalue > 1e-3
    scores = stats.norm.ppf((stats.rankdata(drawn["J_l"]) - 0.5) / 8000), stats.norm.ppf(drawn["k1"] - 2.0)
    assert np.corrcoef(*scores)[0, 1] == pytest.approx(0.6, abs=0.025)
    assert abs(np.corrcoef(drawn["J_l"], drawn["B_m"])[0, 1]) < 0.04


@pytest.mark.parametrize("sampling", ["monte_carlo", "latin_hypercube", "sobol"])
def test_exact_rank_correlation_is_what_was_asked_for(sampling):
    coupled = correlation([["J_l", "k1", -0.7]], "rank", ["J_l", "k1", "B_m"])
    drawn = Plan(MIXED, sampling, 5, block=1000, correlation=coupled).draw(0, 16_000)
    assert stats.spearmanr(drawn["J_l"], drawn["k1"]).statistic == pytest.approx(-0.7, abs=0.02)


TIED = {
    "a": tolerance({"distribution": "discrete", "values": [0.4, 0.6]}),
    "b": tolerance({"distribution": "discrete", "values": [1.0, 2.0, 2.0, 5.0], "weights": [3, 1, 1, 5]}),
    "c": tolerance({"distribution": "empirical", "values": [1.0, 1.0, 1.0, 2.0, 4.0]}),
    "e": tolerance({"distribution": "discrete", "values": np.arange(2000.0) // 2}),
    "d": tolerance({"distribution": "normal", "sigma": 1.0}),
}


@pytest.mark.parametrize(
    ("pair", "asked"), [("aa", 0.8), ("ab", -0.6), ("bc", 0.5), ("cd", 0.9), ("ad", 0.7), ("ee", 0.8)]
)
def test_against_scipy_rank_correlation_of_laws_with_ties(pair, asked):
    laws = {"x": replace(TIED[pair[0]], name="x"), "y": replace(TIED[pair[1]], name="y")}
    coupled = correlation([["x", "y", asked]], "rank", list(laws), laws)
    drawn = Plan(tuple(laws.values()), seed=5, correlation=coupled).draw(0, 100_000)
    assert stats.spearmanr(drawn["x"], drawn["y"]).statistic == pytest.approx(asked, abs=0.01)


def test_exact_rank_correlation_beyond_that_of_laws_with_ties_is_refused():
    """Two values of equal weight against a continuous law: at most sqrt(3) / 2."""
    laws = {"x": TIED["a"], "y": TIED["d"]}
    with pytest.raises(hdfast.InputError, match=r"x and y = -0\.9 is beyond .* above -0\.866 and below 0\.866"):
        correlation([["x", "y", -0.9]], "rank", list(laws), laws)


def test_exact_latin_hypercube_fills_every_stratum_even_when_correlated():
    plan = Plan(MIXED, "latin_hypercube", 5, block=50, correlation=COUPLED)
    points = plan.design.points(plan, 0, 100)
    for block in (points[:50], points[50:]):
        for column in block.T:
            assert sorted((column * 50).astype(int)) == list(range(50))


def test_exact_sobol_replicates_are_balanced():
    plan = Plan(MIXED, "sobol", 5, replicates=4)
    points = plan.design.points(plan, 0, 4 * 64)
    for replicate in range(4):
        for column in points[replicate::4].T:
            assert sorted((column * 64).astype(int)) == list(range(64))


def test_exact_batches_share_what_they_should():
    plan = Plan((normal("a", 0.0, 1.0, batch_share=0.36),), seed=2, batch_size=10)
    values = plan.draw(0, 100_000)["a"].reshape(-1, 10)
    assert values.var() == pytest.approx(1.0, rel=0.03)
    within = values.var(axis=1, ddof=1).mean()
    assert within == pytest.approx(0.64, rel=0.03)


PAIR = correlation([["a", "b", 0.8]], "scores", ["a", "b"])


def batched_pair(first, second):
    return normal("a", 0.0, 1.0, batch_share=first), normal("b", 0.0, 1.0, batch_share=second)


@pytest.mark.parametrize("sampling", ["monte_carlo", "latin_hypercube", "sobol"])
@pytest.mark.parametrize("shares", [(0.5, 0.5), (0.5, 0.2), (1.0, 0.7)])
def test_exact_correlation_holds_for_drives_of_batches(sampling, shares):
    plan = Plan(batched_pair(*shares), sampling, 3, correlation=PAIR, batch_size=2)
    drawn = plan.draw(0, 40_000)
    assert np.corrcoef(drawn["a"], drawn["b"])[0, 1] == pytest.approx(0.8, abs=0.015)
    if sampling == "sobol":  # neighbours are of two scramblings, which are too few to average over
        return
    for share, values in zip(shares, drawn.values(), strict=True):
        assert np.corrcoef(values[::2], values[1::2])[0, 1] == pytest.approx(share, abs=0.03)


def test_exact_correlation_that_batches_make_impossible_is_refused():
    with pytest.raises(hdfast.InputError, match=r"by 0.8 with batch_share = 0.5 and 0 \(allowed: less than 0.707"):
        Plan(batched_pair(0.5, 0.0), correlation=PAIR, batch_size=50)
    with pytest.raises(hdfast.InputError, match=r"batch_share = 1 and 0 \(allowed: less than 0 "):
        Plan(batched_pair(1.0, 0.0), correlation=PAIR, batch_size=50)
    assert Plan(batched_pair(0.5, 0.0), correlation=PAIR).parts == PAIR


def test_exact_documented_file_has_the_correlation_it_states():
    page = (Path(__file__).parents[2] / "docs" / "sweep-file.md").read_text()
    plan = config.parse(page.split("```toml\n")[1].split("```")[0]).plan()
    drawn = plan.draw(0, 40_000)
    assert np.corrcoef(np.log(drawn["B_m"]), np.log(drawn["B_ml"]))[0, 1] == pytest.approx(0.8, abs=0.04)


def test_exact_worst_case_designs():
    plan = Plan((uniform("a", 0.0, 2.0), normal("b", 5.0, 1.0)), "corners")
    rows = plan.draw(0, plan.rows(1))
    assert plan.rows(1) == 5
    assert rows["a"].tolist() == [1, 0, 2, 0, 2]
    assert rows["b"] == pytest.approx([5, 2, 2, 8, 8])
    single = Plan(plan.tolerances, "one_at_a_time").draw(0, 5)
    assert single["a"].tolist() == [1, 0, 2, 1, 1]
    assert single["b"] == pytest.approx([5, 5, 5, 2, 8])
    grid = Plan(plan.tolerances, "factorial", levels=3).draw(0, 9)
    assert len({(a, b) for a, b in zip(grid["a"], grid["b"], strict=True)}) == 9
    many = Plan(tuple(uniform(f"p{i}", 0, 1) for i in range(40)), "corners")
    with pytest.raises(hdfast.InputError, match=r"1.1e\+12 rows"):
        many.rows(1)


@settings(max_examples=60, deadline=None)
@given(st.floats(-5, 5), st.floats(0.1, 3), st.floats(-4, 4), st.floats(0.1, 5), st.floats(0, 3))
def test_exact_bounds_hold_whatever_the_law(centre, width, lower, span, spread):
    law = Tolerance("a", "normal", centre, width, lower, lower + span)
    u = np.array([0.0, 1e-300, 0.3, 0.5, 1.0 - 1e-16, 1.0])
    values = law.quantile(u)
    assert np.all((values >= lower) & (values <= lower + span))
    assert np.all(np.diff(values) >= 0)
    scaled = law.scaled(spread).quantile(u)
    assert scaled - law.middle == pytest.approx(spread * (values - law.middle), abs=1e-9)


@pytest.mark.parametrize(
    ("entry", "median"),
    [
        ({"distribution": "truncated_normal", "mean": 0, "sigma": 0.5, "lower": 0.4, "upper": 1.0},
         stats.truncnorm(0.8, 2.0, 0, 0.5).median()),
        ({"distribution": "truncated_normal", "mean": 3, "sigma": 0.5, "lower": 0.4, "upper": 1.0},
         stats.truncnorm(-5.2, -4.0, 3, 0.5).median()),
        ({"distribution": "capability", "tolerance": 0.2, "cp": 1, "cpk": -0.5, "inspected": True},
         stats.truncnorm(-7.5, -1.5, 2.3, 0.2 / 3).median()),
        ({"distribution": "lognormal", "median": 1, "sigma_log": 0.5, "lower": 1.2, "upper": 2},
         math.exp(stats.truncnorm(math.log(1.2) / 0.5, math.log(2) / 0.5, 0, 0.5).median())),
    ],
)  # fmt: skip
def test_against_scipy_a_law_cut_beside_its_centre_contracts_to_its_median(entry, median):
    law = tolerance(entry)
    assert law.scaled(0.0).quantile(np.array([0.0, 0.3, 1.0])) == pytest.approx(3 * [median])
    assert Plan((law,), "factorial").draw(0, 3)["J_l"] == pytest.approx([law.lower, median, law.upper])


def test_exact_a_factorial_design_has_only_values_that_can_occur():
    own = [1e-4, 2e-4, 9e-4]
    discrete = tolerance({"distribution": "discrete", "values": own})
    for levels in range(2, 12):
        found = Plan((discrete,), "factorial", levels=levels).draw(0, levels)[discrete.name]
        assert set(found) <= set(own)
        assert (found[0], found[-1]) == (1e-4, 9e-4)
        assert np.all(np.diff(found) >= 0.0)
    wide = Plan((discrete.scaled(2.0),), "factorial", levels=5).draw(0, 5)[discrete.name]
    assert sorted(set(wide)) == pytest.approx([0.0, 2e-4, 16e-4])


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([["J_l", "J_l", 0.5]], "no pair of different"),
        ([["J_l", "k9", 0.5]], "'k9' is not known"),
        ([["J_l", "k1", 1.5]], "1.5 is out of range"),
        ([["J_l", "k1", 0.9], ["k1", "B_m", 0.9], ["J_l", "B_m", -0.9]], "no distribution has"),
    ],
)
def test_exact_impossible_correlations_are_refused(pairs, message):
    with pytest.raises(hdfast.InputError, match=message):
        correlation(pairs, "scores", ["J_l", "k1", "B_m"])


def test_exact_file_sections():
    parsed = config.parse(
        "[tolerance.J_l]\ndistribution = 'normal'\nsigma = 0.01\nbatch_share = 0.5\n"
        "[tolerance.k1]\ndistribution = 'normal'\nsigma = 100\n"
        "[correlation]\nkind = 'rank'\npairs = [['J_l', 'k1', 0.5]]\n[batches]\nsize = 20\n"
        "[run]\nsampling = 'sobol'\nreplicates = 8\nfailed = 'worst'\n[trajectories]\nsignals = ['te']\nstep = 0.01\n"
    )
    plan = parsed.plan()
    assert (plan.sampling, plan.replicates, plan.batch_size) == ("sobol", 8, 20)
    assert plan.correlation.matrix[0][1] == pytest.approx(2 * math.sin(math.pi / 12))
    assert parsed.trajectories.signals == ("te",)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("[correlation]\npairs = [['J_l', 'k1', 0.5]]\n", 1, r"'J_l' needs a section \[tolerance.J_l\] .*: none"),
        (
            "[tolerance.J_l]\ndistribution = 'normal'\nsigma = 0.01\n[correlation]\npairs = [['J_l', 'J_1', 0.5]]\n",
            4,
            r"'J_1' needs a section \[tolerance.J_1\]; did you mean 'J_l'",
        ),
        ("[batches]\nsize = 0\n", 2, "size = 0"),
        (
            "[tolerance.J_l]\ndistribution = 'normal'\nsigma = 0.01\nbatch_share = 0.9\n[batches]\n",
            4,
            r"batch_share = 0.9 has no meaning without a size in \[batches\]",
        ),
        ("[trajectories]\nsignals = ['te']\nstep = 1e-9\n", 1, "step = 1e-09 s is out of range"),
        ("[trajectories]\nsignals = ['te']\nstep = inf\n", 1, "step = inf s is out of range"),
        ("[run]\nsampling = 'sobl'\n", 2, "did you mean 'sobol'"),
        ("[run]\nfailed = 'ignore'\n", 2, "failed = 'ignore'"),
        ("[trajectories]\nsignals = ['te']\n", 1, "needs the key 'step'"),
        ("[trajectories]\nsignals = ['tee']\nstep = 0.1\n", 1, "did you mean 'te'"),
    ],
)
def test_exact_wrong_sections_name_the_line(text, line, message):
    with pytest.raises(hdfast.ConfigError, match=message) as caught:
        config.parse(text)
    assert caught.value.line == line


def test_exact_small_blocks_cannot_be_correlated():
    """Two or three rows reordered are often in one line; their correlation then has no inverse."""
    for block in (2, 3, 21):
        with pytest.raises(hdfast.InputError, match=f"block = {block} is too small"):
            Plan(MIXED, "latin_hypercube", block=block, correlation=COUPLED)
    for seed in range(200):
        Plan(MIXED, "latin_hypercube", seed, block=22, correlation=COUPLED).draw(0, 44)
    assert Plan(MIXED, "latin_hypercube", block=2).draw(0, 4)["J_l"].shape == (4,)


@pytest.mark.parametrize(
    "entry",
    [
        {"distribution": "capability", "tolerance": 1.0, "cpk": 1.0, "inspected": True, "lower": 4.0},
        {"distribution": "truncated_normal", "sigma": 0.1, "lower": 3.0, "upper": 4.0},
        {"distribution": "truncated_normal", "sigma": 0.1, "lower": 0.0, "upper": 1.0},
        {"distribution": "normal", "sigma": 0.1, "lower": 6.0},
        {"distribution": "lognormal", "sigma_log": 0.01, "lower": 3.0},
    ],
)
def test_exact_bounds_that_leave_nothing_of_a_law_are_refused(entry):
    with pytest.raises(hdfast.InputError, match=r"not below upper|nothing of the law"):
        tolerance(entry)


def test_exact_extremes_of_a_lognormal_law_heed_both_bounds():
    bounded = tolerance({"distribution": "lognormal", "sigma_log": 0.5, "lower": 1.0, "upper": 5.0})
    assert bounded.extremes() == (1.0, 5.0)
    open_below = tolerance({"distribution": "lognormal", "sigma_log": 0.5, "upper": 5.0})
    assert open_below.extremes()[0] == pytest.approx(open_below.quantile(np.array(stats.norm.cdf(-3.0))), rel=1e-6)
