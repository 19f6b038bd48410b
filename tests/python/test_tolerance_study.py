from __future__ import annotations

import json
import math
import re
from pathlib import Path

import hdfast
import numpy as np
import pyarrow.csv as pc
import pyarrow.parquet as pq
import pytest
from hdfast import config
from hdfast.cli import main
from hdfast.report import tolerance_page
from hdfast.tolerance.policy import FailedRowsError
from test_report import Reader
from toleranced import SMALL

ROOT = Path(__file__).parents[2]
FAILING = SMALL.replace(
    '[tolerance.J_l]\ndistribution = "normal"\nrelative = true\nsigma = 0.05\n',
    '[tolerance.J_l]\ndistribution = "normal"\nmean = 0.05\nsigma = 0.02\n',
)


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def study():
    return hdfast.tolerance(config.parse(SMALL), n=400)


def test_exact_study_is_the_sweep_of_its_rows(study):
    rows = {**study.config.drive, **study.plan.draw(0, 400)}
    direct = hdfast.sweep(rows, scenario=study.config.scenario, metrics=list(study.metrics))
    for metric in study.metrics:
        assert np.array_equal(study.column(metric), direct[metric])
    assert study.percentiles["te_pp"][50.0].value == np.percentile(direct["te_pp"], 50)
    assert study.yields["te_pp"].within == np.count_nonzero(direct["te_pp"] <= 3e-4)
    assert study.status_counts == {"finished": 400}


def test_exact_joint_yield_is_not_the_product(study):
    tight = config.parse(SMALL.replace("upper = 3e-4", "upper = 1.7e-4").replace("upper = 1e-3", "upper = 9e-6"))
    found = hdfast.tolerance(tight, n=400)
    both = (found.column("te_pp") <= 1.7e-4) & (found.column("peak_windup") <= 9e-6)
    assert found.yields["all together"].within == both.sum()
    assert not found.met


def test_exact_worst_rows_are_the_worst(study):
    worst = study.worst(3)
    assert [row["margin"] for row in worst] == sorted(study.worst_margin)[:3]
    assert worst[0]["te_pp"] == study.column("te_pp").max()
    assert worst[0]["J_l"] == study.column("J_l")[worst[0]["row"]]
    with pytest.raises(hdfast.InputError, match=r"count = 2.5"):
        study.worst(2.5)


def test_exact_contributions_name_the_driver(study):
    shares = study.contributions["te_pp"]
    assert shares["te_scale"].value > 0.9
    assert shares["J_l"].high < 0.2
    assert study.rank_correlations("te_pp")["te_scale"].low > 0.9


def test_exact_sensitivity_designs_agree_on_a_drive(study):
    """Four ways to ask for the share of te_scale in the variance of te_pp."""
    designs = study.sobol(64)["te_pp"], study.gradients()["te_pp"], study.contributions["te_pp"]
    sobol, gradient, shares = designs
    assert sobol.total["te_scale"].covers(gradient.share["te_scale"])
    assert sobol.total["te_scale"].high - sobol.total["te_scale"].low < 0.5
    assert shares["te_scale"].value == pytest.approx(gradient.share["te_scale"], abs=0.05)
    screening = study.morris(6)["te_pp"]
    assert max(screening.mean_size, key=lambda name: screening.mean_size[name].value) == "te_scale"


def test_exact_correlated_parameters_have_no_sobol_indices():
    text = SMALL + '[correlation]\npairs = [["J_l", "k1", 0.5]]\n'
    coupled = hdfast.tolerance(config.parse(text), n=30)
    with pytest.raises(hdfast.InputError, match="independent"):
        coupled.sobol(8)
    assert coupled.effects_of(["J_l"], rows=20)[0].parameter == "J_l"


def test_exact_convergence_ends_at_the_result(study):
    course = study.convergence("te_pp", 99.0)
    assert course.rows[-1] == 400
    assert course.estimates[-1] == study.percentiles["te_pp"][99.0]
    assert study.convergence("te_pp").estimates[-1].value == study.yields["te_pp"].yield_


def test_exact_failure_policies():
    """Some of these drives have a negative inertia: the rows fail, and each policy says so in its way."""
    parsed = config.parse(FAILING)
    refused = hdfast.tolerance(parsed, n=200)
    bad = int(np.sum(~refused.finished))
    assert 0 < bad < 20
    for ask in ("yields", "percentiles", "capabilities", "contributions", "worst_margin"):
        with pytest.raises(FailedRowsError, match=f"{bad} of 200 rows have no"):
            getattr(refused, ask)
    excluded = hdfast.tolerance(parsed, n=200, failed="exclude")
    assert excluded.yields["te_pp"].rows == 200 - bad
    assert excluded.summaries["te_pp"].note == f"{bad} rows left out"
    worst = hdfast.tolerance(parsed, n=200, failed="worst")
    assert worst.yields["te_pp"].within <= 200 - bad
    assert worst.yields["te_pp"].rows == 200
    assert worst.summaries["te_pp"].high == math.inf
    assert math.isfinite(worst.contributions["te_pp"]["te_scale"].value)
    page = tolerance_page.page(excluded)
    assert f"{bad} rows left out" in page


def test_regress_a_study_says_why_rows_failed(tmp_path, capsys):
    """In the words of the sweep, of the first of them: refused, asked again and on the page."""
    parsed = config.parse(FAILING)
    swept = hdfast.sweep({**parsed.drive, **parsed.plan().draw(0, 200)}, scenario=parsed.scenario, metrics=["te_pp"])
    first = int(np.argmin(swept.finished))
    assert "bad_parameters (J_l = -" in swept.message(first)
    file, out = tmp_path / "small.toml", tmp_path / "out"
    file.write_text(FAILING)
    assert main(["tolerance", str(file), "--rows", "200"]) == 1
    assert swept.message(first).removesuffix(".") in capsys.readouterr().err
    with pytest.raises(FailedRowsError, match=r"bad_parameters .* narrow the tolerances"):
        hdfast.tolerance(parsed, n=200).sobol(256)
    excluded = hdfast.tolerance(parsed, n=200, failed="exclude", out=out)
    assert excluded.reason(first) == swept.message(first)
    assert f"The first that failed is {swept.message(first)}" in tolerance_page.specification(excluded).texts


def test_regress_gradients_of_drives_that_fail_are_refused():
    broad = config.parse(SMALL.replace("relative = true\nsigma = 0.05", "mean = 0.1\nsigma = 2.0"))
    with pytest.raises(FailedRowsError, match=r"1 of 7 rows .* bad_parameters"):
        hdfast.tolerance(broad, n=20, failed="exclude").gradients()


def test_regress_excluded_rows_do_not_hide_the_worst_drives():
    parsed = config.parse(FAILING)
    excluded, worst = (hdfast.tolerance(parsed, n=200, failed=policy) for policy in ("exclude", "worst"))
    assert [row["margin"] for row in excluded.worst(3)] == sorted(excluded.worst_margin[excluded.finished])[:3]
    assert worst.worst(1)[0]["margin"] == -math.inf
    assert len(excluded.worst(200)) == excluded.finished.sum()


def test_exact_excluded_rows_are_excluded_everywhere():
    """Rows that failed have no say in the course of a yield, in what drives a loss, or in what a tolerance does."""
    half = config.parse(FAILING.replace("sigma = 0.02", "sigma = 0.05").replace("upper = 3e-4", "upper = 1"))
    study = hdfast.tolerance(half, n=300, failed="exclude")
    lost = int(np.sum(~study.finished))
    assert 20 < lost < 150
    assert study.yields["te_pp"].yield_ == 1.0
    assert study.convergence("te_pp").rows[-1] == 300 - lost
    assert study.convergence("te_pp").estimates[-1].value == 1.0
    assert math.isnan(study.loss_contributions["te_pp"]["J_l"].value)
    still, worst = (
        hdfast.tolerance(half, n=300, failed=policy).effects_of(["J_l"], rows=300, factors=[0.0])[0]
        for policy in ("exclude", "worst")
    )
    assert still.missing == worst.missing == lost
    assert still.yields["te_pp"].value == 0.0
    assert worst.yields["te_pp"].value == pytest.approx(lost / 300)
    refused = hdfast.tolerance(half, n=300)
    for ask in (lambda: refused.convergence("te_pp"), lambda: refused.loss_contributions):
        with pytest.raises(FailedRowsError):
            ask()


def test_exact_worst_case_sampling_judges_every_corner(small):
    corners = hdfast.tolerance(small, sampling="corners")
    assert corners.n == 9
    assert corners.yields["te_pp"].outcome == "met"
    assert math.isnan(corners.yields["te_pp"].interval[0])
    assert "no random sample" in tolerance_page.page(corners)
    assert re.search(r"te_pp +100\.00 % +not known +\d+(\.\d+)? % +met", repr(corners))
    tight = config.parse(SMALL.replace("upper = 3e-4", "upper = 2e-4"))
    assert hdfast.tolerance(tight, sampling="corners").yields["te_pp"].outcome == "not met"


def test_regress_no_confidence_is_stated_where_none_follows():
    """Three rows within show no yield of 100 %, and corners no probability."""
    certain, sure = "with 95 % confidence each", "Where 100 % is asked for"
    for text, options, stated, explained in (
        (SMALL, {}, True, False),
        (SMALL.replace("min_yield = 0.9\n", ""), {"n": 3}, False, True),
        (SMALL, {"sampling": "corners"}, False, False),
    ):
        found = hdfast.tolerance(config.parse(text), **options)
        assert found.met
        assert (certain in tolerance_page.headline(found.verdicts)) == stated
        assert (sure in " ".join(tolerance_page.specification(found).texts)) == explained


def test_exact_effects_of_a_worst_case_study_are_those_of_its_random_drives():
    parsed = config.parse(SMALL + '[correlation]\npairs = [["J_l", "te_scale", 0.9]]\n')
    corners, random = hdfast.tolerance(parsed, sampling="corners"), hdfast.tolerance(parsed, n=10)
    assert corners.effects_of(["J_l"], rows=40) == random.effects_of(["J_l"], rows=40)


def test_exact_discrete_and_batched_inputs_run_through():
    text = SMALL.replace(
        'distribution = "lognormal"\nsigma_log = 0.1', 'distribution = "discrete"\nvalues = [0.9, 1.1]'
    )
    text = text.replace("sigma = 0.05\n", "sigma = 0.05\nbatch_share = 0.5\n") + "[batches]\nsize = 10\n"
    study = hdfast.tolerance(config.parse(text), n=200)
    assert study.groups.alike
    assert set(study.column("te_scale")) == {0.9, 1.1}
    assert study.contributions["te_pp"]["te_scale"].value > 0.9
    assert "batch means" in tolerance_page.page(study)


def test_regress_corners_have_no_limits_although_the_file_has_batches(small, capsys):
    batched = SMALL.replace("sigma = 0.05\n", "sigma = 0.05\nbatch_share = 0.5\n") + "[batches]\nsize = 2\n"
    small.write_text(batched)
    found = hdfast.tolerance(small, sampling="corners")
    assert math.isnan(found.percentiles["te_pp"][99.0].low)
    assert "batch means" not in tolerance_page.page(found)
    assert found.effects_of(["J_l"], rows=40) == hdfast.tolerance(small, n=10).effects_of(["J_l"], rows=40)
    assert main(["tolerance", str(small), "--sampling", "corners"]) == 0
    assert "not known" in capsys.readouterr().out


def test_regress_a_study_without_a_usable_row_has_a_page_that_says_so(small, tmp_path):
    small.write_text(SMALL + "max_steps = 20\n")
    options = ["--rows", "200", "--failed", "exclude", "--out", str(tmp_path / "out"), "--quiet"]
    assert main(["tolerance", str(small), *options]) == 1
    page = (tmp_path / "out" / "index.html").read_text()
    assert "No row is left" in page
    assert "200 rows left out" in page
    assert "nan" not in re.split("<h2>", page)[1]


def test_regress_shares_that_are_not_known_have_no_bar(study):
    """With fewer than 100 rows nothing says what a tolerance contributes, and nothing is left to interaction."""
    for found, unknown in ((hdfast.tolerance(config.parse(SMALL), n=20), True), (study, False)):
        section = tolerance_page.contributions(found)
        assert ("not known" in section.figures[0].svg) == unknown
        assert ("fewer than 100 rows" in section.figures[0].caption) == unknown


def test_regress_the_percentile_followed_is_named_by_metric(study):
    """te_pp has an upper limit, peak_windup here a lower one only."""
    lower = config.parse(SMALL.replace("upper = 1e-3", "lower = 1e-9"))
    svg = tolerance_page.effects(hdfast.tolerance(lower, n=20)).figures[0].svg
    assert "change of P1 [" in svg
    assert "change of P99 [" in svg
    assert "change of P1 [" not in tolerance_page.effects(study).figures[0].svg


def test_regress_extremes_assume_neither_correlation_nor_independence(study):
    text = SMALL + "[correlation]\npairs = [['J_l', 'k1', 0.5]]\n"
    corners = hdfast.tolerance(config.parse(text), sampling="corners")
    for found, random in ((corners, False), (study, True)):
        said = " ".join(tolerance_page.assumptions(found).texts)
        assert ("copula" in said or "independent of" in said) == random
        assert ("the same whatever [correlation] and [batches] say" in said) != random


def test_regress_no_evidence_of_an_effect_is_no_advice_to_relax():
    """A limit so far away that hardly any drive tells what a wider spread does to the yield."""
    far = config.parse(SMALL.replace("upper = 3e-4", "upper = 3.6e-4"))
    section = tolerance_page.effects(hdfast.tolerance(far, n=50))
    assert "+0.00 (-" in section.tables[0]
    assert "do not tell a change from none, and a change as large as its ends is not excluded" in section.texts[0]
    assert "relax" not in " ".join(section.texts)


def test_regress_a_page_names_spreads_that_cannot_be_wider_and_advises_what_was_reached_only():
    text = SMALL + '[tolerance.B_l]\ndistribution = "uniform"\nlower = 0.0\nupper = 1.0\n'
    bounded = hdfast.tolerance(config.parse(text), n=20)
    section = tolerance_page.effects(bounded)
    assert "B_l times 1 (allowed: finite, from 0)" in " ".join(section.texts)
    assert section.tables[0].count("not possible") == 1
    assert bounded.allocate(rows=200).factors["B_l"] == 1.0
    far = hdfast.tolerance(config.parse(SMALL.replace("upper = 3e-4", "upper = 1e-5")), n=20)
    section = tolerance_page.allocation(far)
    assert "short of what is asked for" in " ".join(section.texts)
    assert "tighten" not in section.tables[0]


def test_regress_an_allocation_says_how_sure_its_yields_are():
    """The cheapest spreads have hardly more than the yield asked for."""
    study = hdfast.tolerance(config.parse(SMALL.replace("upper = 3e-4", "upper = 2e-4")), n=20)
    text = " ".join(tolerance_page.allocation(study).texts)
    assert re.search(r"te_pp 9[\d.]+ % \([\d.]+ \.\. [\d.]+ %, undecided\), peak_windup", text)
    assert "as asked for in these rows" in text
    assert "it is undecided whether all drives have" in text


def test_exact_command_writes_the_folder(small, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["tolerance", str(small), "--rows", "200", "--out", str(out), "--chunk", "64"]) == 0
    text = capsys.readouterr().out
    assert "met" in text
    assert "95 % limits of P99" in text
    names = {path.name for path in out.iterdir()}
    assert names == {
        "index.html", "input.toml", "manifest.json", "rows", "statistics.csv", "statistics.parquet", "summary.json",
        "worst.csv", "worst.parquet",
    }  # fmt: skip
    summary = json.loads((out / "summary.json").read_text())
    assert summary["specifications"]["te_pp"]["outcome"] == "met"
    assert summary["rows"] == 200
    assert pq.read_table(out / "statistics.parquet").column_names == pc.read_csv(out / "statistics.csv").column_names
    reader = Reader()
    reader.feed((out / "index.html").read_text())
    assert all(reference.startswith("#") for reference in reader.references)
    assert "script" not in reader.tags
    assert reader.tags.count("svg") == 4
    titles = re.findall("<h2>(.*?)</h2>", (out / "index.html").read_text())
    assert titles[:2] == ["Specification", "Distributions"]
    assert titles[-2:] == ["Assumptions", "Input"]


@pytest.mark.long
def test_exact_folder_is_the_same_after_resume_and_has_no_clock(small, tmp_path):
    written = []
    for more in ([], ["--resume"]):
        assert main(["tolerance", str(small), "--out", str(tmp_path / "out"), "--quiet", *more]) == 0
        written.append({path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()})
    assert written[0] == written[1]


def test_exact_exit_codes(small, tmp_path, capsys, undrawn):
    small.write_text(SMALL.replace("upper = 3e-4", "upper = 1.6e-4"))
    assert main(["tolerance", str(small), "--quiet"]) == 1
    small.write_text(SMALL.replace("upper = 3e-4", "upper = 1.6e-4").replace("min_yield = 0.9\n", "", 1))
    assert main(["tolerance", str(small)]) == 1
    assert "not met" in capsys.readouterr().out
    small.write_text(FAILING)
    assert main(["tolerance", str(small), "--rows", "200", "--out", str(tmp_path / "out")]) == 1
    assert "with --resume --failed" in capsys.readouterr().err
    assert main(["tolerance", str(small), "--rows", "200"]) == 1
    without = capsys.readouterr().err
    assert "failed='exclude'" in without
    assert "--resume" not in without
    again = ["tolerance", str(small), "--rows", "200", "--out", str(tmp_path / "out"), "--quiet"]
    assert main(again) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*again, "--resume", "--failed", "exclude"]) == 0
    assert (tmp_path / "out" / "index.html").exists()
    assert main(["tolerance", "missing.toml"]) == 2
    with pytest.raises(SystemExit):
        main(["tolerance", str(small), "--sampling", "sobl"])


@pytest.mark.parametrize("interrupted", [pytest.param(False, marks=pytest.mark.long), True])
def test_regress_nothing_is_said_of_fewer_rows_once_more_are_run(small, tmp_path, interrupted, undrawn):
    small.write_text(FAILING)
    bad = int(np.argmin(hdfast.tolerance(small, n=200).finished))
    out = tmp_path / "out"
    assert main(["tolerance", str(small), "--rows", str(bad), "--out", str(out), "--quiet"]) == 0
    before = {path.name for path in out.iterdir()}
    for wrong in ({"progress": 3}, {"n": bad - 1}):
        with pytest.raises(hdfast.InputError):
            hdfast.tolerance(small, **{"n": 200, "out": out, "resume": True, **wrong})
    assert {path.name for path in out.iterdir()} == before
    if interrupted:
        with pytest.raises(ZeroDivisionError):
            hdfast.tolerance(small, n=200, out=out, resume=True, progress=lambda done, total: 1 // 0)
    else:
        assert main(["tolerance", str(small), "--rows", "200", "--out", str(out), "--resume", "--quiet"]) == 1
    assert {path.name for path in out.iterdir()} == {"input.toml", "manifest.json", "rows"}


def test_exact_failed_rows_are_a_sentence_when_quiet(small, capsys):
    small.write_text(SMALL + "max_steps = 20\n")
    assert main(["tolerance", str(small), "--rows", "2", "--quiet"]) == 1
    assert "2 of 2 rows have no" in capsys.readouterr().err


def test_exact_json_and_progress(small, capsys):
    assert main(["tolerance", str(small), "--json", "--progress"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["metrics"]["te_pp"]["unit"] == "rad"
    assert "row" in captured.err
    seen = []
    hdfast.tolerance(small, n=50, chunk=20, threads=1, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (50, 50)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    with pytest.raises(hdfast.InputError, match="progress = 3"):
        hdfast.tolerance(small, progress=3)


def test_exact_wrong_arguments_name_value_and_range(small):
    for options, text in (
        ({"n": 0}, "n = 0 is out of range"),
        ({"n": 1.5}, "n = 1.5 is not a whole number"),
        ({"seed": -1}, "seed = -1"),
        ({"sampling": "sobl"}, "did you mean 'sobol'"),
        ({"failed": "drop"}, "failed = 'drop'"),
        ({"chunk": 0}, "chunk = 0"),
        ({"workers": -3}, "workers = -3"),
        ({"threads": -1, "cluster": "local"}, "threads = -1 is out of range"),
        ({"threads": 0, "cluster": "local"}, "threads = 0 is out of range"),
        ({"sampling": "latin_hypercube", "n": 100}, "n = 100 rows are a single Latin hypercube"),
        ({"workers": 2}, "cluster = 'local' only"),
        ({"workers": 2, "cluster": "tcp://here:1"}, "cluster = 'local' only"),
    ):
        with pytest.raises(hdfast.InputError, match=re.escape(text)):
            hdfast.tolerance(small, **options)


@pytest.mark.parametrize(
    ("ask", "text"),
    [
        (lambda study: study.effects_of(["nope"]), "names = 'nope' is not known"),
        (lambda study: study.effects_of(["J_l"], rows=0), "rows = 0"),
        (lambda study: study.effects_of(["J_l"], factors=[-1.0]), "factors = -1"),
        (lambda study: study.effects_of(["J_l"], percentage=101), "percentage = 101"),
        (lambda study: study.gradients(step=0), "step = 0"),
        (lambda study: study.convergence("te_pp", 500), "percentage = 500"),
        (lambda study: study.allocate(bounds=(1,)), "bounds = (1,)"),
        (
            lambda study: study.effects_of(["J_l"], factors=0.5),
            "factors = 0.5 is not a list (allowed: numbers",
        ),
        (lambda study: study.allocate(bounds=2.0), "bounds = 2.0 is not a list (allowed: smallest and largest factor)"),
        (lambda study: study.allocate(rows=0), "rows = 0"),
        (lambda study: study.rare("te_pp", smallest=0.0), "smallest = 0"),
        (lambda study: study.rare("te_pp", seed=-1), "seed = -1 is out of range (allowed: a whole number from 0"),
        (lambda study: study.rare("te_pp", confidence=2.0), "confidence = 2 is out of range (allowed: a number from"),
    ],
)
def test_exact_wrong_questions_name_value_and_range(study, ask, text):
    with pytest.raises(hdfast.InputError, match=re.escape(text)):
        ask(study)


def test_exact_a_study_in_which_nothing_varies_says_so():
    fixed = config.parse("[scenario]\nt_end = 0.4\n[spec.te_pp]\nupper = 1\n")
    study = hdfast.tolerance(fixed, n=3)
    for ask in (study.sobol, study.morris, study.gradients, lambda: study.rare("te_pp")):
        with pytest.raises(hdfast.InputError, match="need parameters that vary"):
            ask()


def test_exact_help_shows_an_example(capsys):
    with pytest.raises(SystemExit):
        main(["tolerance", "--help"])
    assert "example:\n  hdfast tolerance" in capsys.readouterr().out


def test_exact_documented_study_runs_and_ends_in_its_decision(long, monkeypatch, capsys):
    text = (ROOT / "docs" / "tolerance-study.md").read_text()
    [example] = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    if not long:
        example = example.replace("40_000", "2000").replace("4000", "400")
    monkeypatch.chdir(ROOT)
    names = {}
    exec(compile(example, "tolerance-study.md", "exec"), names)
    assert "P99" in capsys.readouterr().out
    shares = names["study"].contributions
    assert shares["te_pp"]["te_scale"].value > 0.98
    assert {name for name, share in shares["stop_time"].items() if share.value > 0.3} == {"B_m", "B_ml"}
    factors = names["plan"].factors
    assert min(factors, key=factors.get) == "te_scale"


def test_exact_sweep_command_says_nothing_it_does_not_know(small, tmp_path, capsys):
    """Corners are no random sample: `hdfast sweep` judges them, without an interval."""
    small.write_text(SMALL + 'sampling = "corners"\n')
    assert main(["sweep", str(small), "--out", str(tmp_path / "out")]) == 0
    assert "not known" in capsys.readouterr().out
    assert "Sweep of 9 drives (corners)" in (tmp_path / "out" / "index.html").read_text()
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["rows"] == 9
    assert summary["specifications"]["te_pp"]["interval_95"] is None


def test_exact_report_of_a_study_in_memory_holds_its_rows(study, tmp_path, undrawn):
    page = study.report(tmp_path / "out")
    assert page.name == "index.html"
    table = pq.read_table(tmp_path / "out" / "rows.parquet")
    assert table.num_rows == 400
    assert np.array_equal(table["te_pp"].to_numpy(), study.column("te_pp"))


def test_regress_a_report_without_limits_leaves_no_worst_rows_of_an_earlier_one(tmp_path, undrawn):
    for text, written in ((SMALL, True), (re.sub(r"\[spec\.\w+\]\n.*\n.*\n", "", SMALL), False)):
        hdfast.tolerance(config.parse(text), n=3).report(tmp_path)
        assert [(tmp_path / f"worst.{kind}").exists() for kind in ("csv", "parquet")] == [written, written]


def test_regress_rare_events_of_a_file_without_tolerances_are_refused_before_any_row(tmp_path, capsys):
    (tmp_path / "fixed.toml").write_text("[scenario]\nt_end = 0.4\n[spec.te_pp]\nupper = 1\n")
    out = tmp_path / "out"
    assert main(["tolerance", str(tmp_path / "fixed.toml"), "--rare", "te_pp", "--quiet", "--out", str(out)]) == 2
    assert "--rare = 'te_pp' needs parameters that vary: the file has no [tolerance.<name>]" in capsys.readouterr().err
    assert not out.exists()


def test_exact_rare_event_is_in_the_report(study, undrawn):
    found = study.rare("te_pp", rows=100, replicates=2, smallest=1e-5)
    assert study.rare_events == {"te_pp": found}
    assert "by subset simulation" in tolerance_page.page(study)


def test_regress_a_rare_event_says_that_failed_rows_count_as_outside(study):
    """Under "exclude" the yields beside it leave them out."""
    half = config.parse(FAILING.replace("sigma = 0.02", "sigma = 0.05").replace("upper = 3e-4", "upper = 1"))
    excluded = hdfast.tolerance(half, n=100, failed="exclude")
    found = excluded.rare("te_pp", rows=100, replicates=2)
    assert excluded.yields["te_pp"].yield_ == 1.0
    assert found.missing > 10
    text = " ".join(tolerance_page.specification(excluded).texts)
    assert f"{found.evaluations:,} rows; {found.missing} of its rows failed, which counts as outside here." in text
    assert study.rare("te_pp", rows=100, replicates=2, smallest=1e-5).note == ""
