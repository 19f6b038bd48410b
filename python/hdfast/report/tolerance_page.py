"""The page of a tolerance study: verdict, distributions, contributions, worst cases, convergence, assumptions."""

from __future__ import annotations

import math

from hdfast.errors import InputError
from hdfast.printing import html_table, interval_text, share_text
from hdfast.report import tables, tolerance_plots
from hdfast.report.html import Section, picture, render
from hdfast.report.tables import number
from hdfast.result import MAIN_METRICS
from hdfast.tolerance.effects import Effect
from hdfast.tolerance.further import EFFECT_ROWS
from hdfast.tolerance.intervals import Estimate
from hdfast.tolerance.limits import JOINT, MET, NOT_MET, Verdict
from hdfast.tolerance.sensitivity import BLOCKS
from hdfast.tolerance.study import Study

SPEC_HEADER = [
    "specification", "outcome", "yield", "95 % interval", "asked for", "outside [ppm]", "lower", "upper", "unit", "Cpk",
    "Ppk",
]  # fmt: skip
WHOLE = (
    "Where 100 % is asked for, which no sample can show, met says only that none of these rows lies outside: the "
    "interval tells how sure that is. For a verdict with confidence state a min_yield below 1."
)
EXPLAINED = 6


def page(study: Study) -> str:
    """The page as HTML."""
    facts = [
        ("rows", f"{study.n:,}"),
        ("finished", f"{int(study.finished.sum()):,}"),
        ("parameters that vary", str(len(study.plan.names))),
        ("sampling", study.plan.sampling.replace("_", " ")),
        ("seed", str(study.plan.seed)),
    ]
    sections = [specification(study), distributions(study)]
    if study.plan.names and study.plan.design.random:
        sections += [contributions(study), effects(study), allocation(study)]
    sections += [worst(study), convergence(study), statistics(study), assumptions(study)]
    lead = (
        f"Tolerance study of {study.n:,} drives, {study.config.scenario.name}, {study.config.scenario.t_end:g} s each."
    )
    verdict = study.met if study.specs else None
    kept = [section for section in sections if section.texts or section.figures or section.tables]
    return render(study.config.title, lead, facts, kept, study.config.text, verdict, headline(study.verdicts))


def headline(verdicts: list[Verdict]) -> str:
    """The verdict in one sentence."""
    failed = [verdict.spec.metric for verdict in verdicts if verdict.outcome == NOT_MET]
    undecided = [verdict.spec.metric for verdict in verdicts if verdict.outcome not in (MET, NOT_MET)]
    if failed:
        return f"Not met: {', '.join(failed)}."
    if undecided:
        return f"Undecided with this number of rows: {', '.join(undecided)}."
    if all(verdict.provable for verdict in verdicts):
        return "Every specification is met, with 95 % confidence each."
    return "Every specification is met by these rows."


def specification(study: Study) -> Section:
    """Limits, yields, verdicts."""
    rows = [_spec_row(study, name, verdict) for name, verdict in study.yields.items()]
    if not rows:
        return Section("Specification", texts=["The file has no limits: add sections [spec.<metric>]."])
    texts = [
        "Met: the whole interval of the yield lies above what is asked for. Not met: the whole interval lies below. "
        "Undecided: it takes more rows to say."
    ]
    if not all(verdict.provable for verdict in study.yields.values()):
        texts.append(WHOLE)
    if not study.plan.design.random:
        texts = ["Worst-case rows, no random sample: met when every one of them lies within the limits."]
    if study.status_counts.keys() - {"finished"}:
        counts = ", ".join(f"{name} {count:,}" for name, count in study.status_counts.items())
        texts.append(f"Outcome of the rows: {counts}. Policy for rows that failed: {study.policy}.")
        first = int(study.finished.argmin())
        texts += [] if first in dict(study.store.poison) else [f"The first that failed is {study.reason(first)}"]
    texts += [
        f"{metric}: {found.ppm.value:.3g} ppm outside ({_span(found.ppm.low, found.ppm.high, '.3g')} at 95 %) by "
        f"subset simulation in {found.levels} levels and {found.evaluations:,} rows{found.note}."
        for metric, found in study.rare_events.items()
    ]
    texts += [f"Row {row} ended its process and counts as failed: {reason}." for row, reason in study.store.poison]
    return Section("Specification", texts, tables=[html_table(SPEC_HEADER, rows, right=range(2, 8))])


def _spec_row(study: Study, name: str, verdict: Verdict) -> list[str]:
    found = study.capabilities.get(name)
    joint = name == JOINT
    return [
        name,
        verdict.outcome + (f", {verdict.missing} rows left out" if verdict.missing else ""),
        share_text(verdict.yield_, 3),
        interval_text(verdict.interval, 3),
        f"{100 * verdict.spec.min_yield:g} %",
        f"{verdict.ppm.value:.0f} ({_span(verdict.ppm.low, verdict.ppm.high, '.0f')})" if verdict.rows else "not known",
        "" if joint else number(verdict.spec.lower),
        "" if joint else number(verdict.spec.upper),
        "" if joint else study.units[name],
        f"{number(found.cpk.value)} ({_span(found.cpk.low, found.cpk.high, '.4g')})" if found else "",
        number(found.ppk) if found else "",
    ]


def _span(low: float, high: float, style: str) -> str:
    return "not known" if math.isnan(low) else f"{low:{style}} .. {high:{style}}"


def main_metrics(study: Study) -> list[str]:
    """Metrics shown in pictures: those with limits, then the main ones."""
    order = dict.fromkeys([*study.specs, "te_pp", "stop_time", *MAIN_METRICS, *study.metrics])
    return [metric for metric in order if metric in study.summaries]


def distributions(study: Study) -> Section:
    """Histograms."""
    names = main_metrics(study)[:9]
    figure = tolerance_plots.distributions({name: study.usable(name) for name in names}, study.units, study.specs)
    texts = [
        f"{metric}: {count} finished rows lack it, so no statistic is made of it; choose failed = 'exclude' or 'worst'."
        for metric, count in study.withheld.items()
    ]
    return Section("Distributions", texts, [picture(figure, "Each drive is one row.")])


def contributions(study: Study) -> Section:
    """Shares of variance and of yield loss."""
    names = main_metrics(study)[:EXPLAINED]
    figure = tolerance_plots.contributions({name: study.contributions[name] for name in names}, study.plan.names)
    caption = (
        "Share of the variance that each tolerance explains alone (first-order index), with 95 % intervals. What is "
        "missing to 100 % is interaction."
    )
    if study.plan.correlation is not None or study.plan.batched:
        caption += " Parameters are correlated: what they explain together counts for each of them."
    if any(math.isnan(share.value) for name in names for share in study.contributions[name].values()):
        caption += f" Not known: fewer than {2 * BLOCKS} rows, a metric that does not vary, or too few batches."
    rows = [
        [metric, name, f"{100 * share.value:.1f} %", _span(100 * share.low, 100 * share.high, ".1f")]
        for metric, shares in study.loss_contributions.items()
        for name, share in shares.items()
        if math.isfinite(share.value) and share.low > 0.0
    ]
    header = ["specification", "tolerance", "share of being out of limits", "95 % interval [%]"]
    texts = [] if rows or not study.specs else ["Too few rows are out of limits to say which tolerance put them there."]
    return Section(
        "What each tolerance contributes",
        texts,
        [picture(figure, caption)],
        [html_table(header, rows, right=(2, 3))] if rows else [],
    )


def effects(study: Study) -> Section:
    """What tightening and relaxing does."""
    metrics = main_metrics(study)[:3]
    if "stop_time" in study.summaries and "stop_time" not in metrics:
        metrics = [*metrics[:2], "stop_time"]
    limits = {metric: study.specs.get(metric) for metric in metrics}
    figure = tolerance_plots.percentile_effects(study.effects, limits, study.units, study.plan.names)
    rows = []
    for name in study.plan.names:
        found = {effect.factor: effect for effect in study.effects if effect.parameter == name}
        rows.append([name, *(_change(found[factor]) for factor in sorted(found))])
    header = ["tolerance", "held at its middle", "spread halved", "spread times 1.5"]
    texts = [
        f"The same {EFFECT_ROWS:,} drives simulated again with one spread changed. Where an interval includes 0 these "
        "drives do not tell a change from none, and a change as large as its ends is not excluded."
    ]
    limited = [
        f"{effect.parameter} times {effect.used:.3g} ({study.config.table[effect.parameter].limits.split(';')[0]})"
        for effect in study.effects
        if effect.used < effect.factor
    ]
    if limited:
        texts.append(f"Spreads are widened no further than their parameters may go: {', '.join(limited)}.")
    missing = max(effect.missing for effect in study.effects)
    if missing:
        texts.append(f"Up to {missing} of them lack a metric before or after a change and are left out of its figure.")
    if not study.specs:
        return Section("What tightening and relaxing does", texts, [picture(figure, "With 95 % intervals.")])
    return Section(
        "What tightening and relaxing does",
        [*texts, "Change of the yield of all specifications together, in percentage points, with 95 % intervals:"],
        [picture(figure, "With 95 % intervals.")],
        [html_table(header, rows, right=(1, 2, 3))],
    )


def allocation(study: Study) -> Section:
    """The cheapest spreads that meet the specification."""
    title = "Cheapest spreads that meet the specification"
    try:
        found = study.allocate(rows=EFFECT_ROWS)
    except InputError as error:
        return Section(title, [f"Not computed: {error}."])
    rows = [
        [
            tolerance.name,
            number(tolerance.cost),
            f"{found.factors[tolerance.name]:.2f}",
            _advice(found.factors[tolerance.name]) if found.reached else "",
        ]
        for tolerance in study.plan.tolerances
    ]
    yields = ", ".join(
        f"{verdict.spec.metric} {share_text(verdict.yield_)} ({interval_text(verdict.interval)}, {verdict.outcome})"
        for verdict in found.verdicts
    )
    reached = "as asked for in these rows" if found.reached else "short of what is asked for within these bounds"
    texts = [
        "Halving a spread is taken to double its cost (1 where the tolerance names none); factors "
        "stay between 0.25 and 2, and within what their parameters may be. The cost falls to "
        f"{100 * found.cost:.0f} % of what it is now. A simulation of "
        f"{EFFECT_ROWS:,} drives with these spreads has the yields {yields}: {reached}.",
        "The search ends at the first spreads with which these drives have yields as asked for. Where the interval of "
        "one includes what is asked for, it is undecided whether all drives have: a study with these spreads and "
        "another seed tells.",
        "The search ran on a quadratic surface of each metric, which explains "
        + ", ".join(f"{100 * fit:.1f} % of {metric}" for metric, fit in found.fit.items())
        + ".",
    ]
    if found.cost >= 1.0:
        texts[0] = texts[0].replace("falls to", "rises to" if found.cost > 1.0 else "stays at")
    return Section(
        title, texts, tables=[html_table(["tolerance", "cost", "factor on the spread", ""], rows, right=(1, 2))]
    )


def _advice(factor: float) -> str:
    if factor < 0.95:
        return "tighten"
    return "may be relaxed" if factor > 1.05 else "keep"


def _change(effect: Effect) -> str:
    estimate = effect.yields.get(JOINT)
    if estimate is None:
        return "-"
    if effect.used == 1.0 < effect.factor:
        return "not possible"
    return f"{100 * estimate.value:+.2f} ({_span(100 * estimate.low, 100 * estimate.high, '+.2f')})"


def worst(study: Study) -> Section:
    """The worst rows with their parameters."""
    rows = study.worst()
    if not rows:
        return Section("Worst cases")
    header = ["row", "margin [σ]", *study.specs, *study.plan.names]
    cells = [[str(r["row"]), *(number(float(r[key] if r[key] is not None else math.nan)) for key in
              ("margin", *study.specs, *study.plan.names))] for r in rows]  # fmt: skip
    texts = [
        "Rows nearest to their limits, or furthest beyond: margin is the distance to the nearest limit of all in "
        "standard deviations of that metric, negative outside. Values in SI units."
    ]
    return Section("Worst cases", texts, tables=[html_table(header, cells, right=range(len(header)))])


def convergence(study: Study) -> Section:
    """Running estimates."""
    if not study.plan.design.random:
        return Section("Convergence")
    courses = []
    for metric, spec in study.specs.items():
        courses.append((f"yield, {tolerance_plots.title(metric)}", "share", study.convergence(metric), spec.min_yield))
    for metric in main_metrics(study)[:3]:
        limit = study.specs[metric].upper if metric in study.specs else math.nan
        course = study.convergence(metric, 99.0)
        largest = max((estimate.value for estimate in course.estimates), default=math.nan)
        near = limit if 0.5 * largest < limit < 2.0 * largest else math.nan
        courses.append((f"P99, {tolerance_plots.title(metric)}", study.units[metric], course, near))
    courses = [entry for entry in courses if entry[2].rows]
    if not courses:
        return Section("Convergence", ["No row is left to say anything about."])
    caption = (
        "Estimates after more and more rows; no band where the rows do not suffice for limits. An interval that still "
        "moves asks for more rows."
    )
    return Section("Convergence", figures=[picture(tolerance_plots.convergence(courses[:6]), caption)])


def statistics(study: Study) -> Section:
    """Percentiles with limits."""
    rows = []
    for metric, found in study.summaries.items():
        cells = [
            number(e.value) if q == 50.0 else f"{number(e.value)} ({_limits(e)})"
            for q, e in found.percentiles.items()
            if q in (1.0, 50.0, 99.0)
        ]
        rows.append([metric, found.unit, number(found.mean.value), number(found.deviation), *cells, str(found.rows)])
        rows[-1].insert(-1, f"{number(found.tolerance[0])} .. {number(found.tolerance[1])}")
    header = ["metric", "unit", "mean", "standard deviation", "P1", "P50", "P99", "95 % / 95 %", "rows"]
    texts = [
        "In brackets the 95 % limits of each percentile; 95 % / 95 %: between these values lie, with 95 % confidence, "
        "at least 95 % of all drives, whatever the distribution. statistics.parquet and statistics.csv hold all "
        f"percentiles, moments and extremes; {study.store.files} holds every row."
    ]
    return Section("Statistics of every metric", texts, tables=[html_table(header, rows, right=range(2, 9))])


def _limits(estimate: Estimate) -> str:
    ends = [number(end) if math.isfinite(end) else "?" for end in (estimate.low, estimate.high)]
    return " .. ".join(ends)


def assumptions(study: Study) -> Section:
    """What the verdict rests on."""
    plan = study.plan
    texts = [
        "The equations, the scenario and the numerical settings are those of the input below; effects the model leaves "
        "out are not in the spread.",
        _independence(study),
        "Percentile limits and yield intervals assume no distribution of the metric. Cpk is taken with the standard "
        "deviation of all rows; it and its interval assume a normal law. Ppk comes from percentiles and does not.",
        f"Rows that failed or lack a metric: policy '{study.policy}'.",
    ]
    if not plan.design.random:
        texts.append("The extremes are the same whatever [correlation] and [batches] say.")
    elif plan.correlation is not None:
        kind = "rank correlation" if plan.correlation.kind == "rank" else "correlation of the normal scores"
        pairs = "; ".join(f"{a} and {b}: {value:g}" for a, b, value in plan.correlation.pairs)
        texts.append(f"Gaussian copula, {kind}: {pairs}. All other parameters are independent.")
    else:
        texts.append("All parameters that vary are independent of each other.")
    table = html_table(tables.TOLERANCE_HEADER, tables.tolerance_rows(study.config), right=(2,))
    return Section("Assumptions", texts, tables=[table])


def _independence(study: Study) -> str:
    plan = study.plan
    if not plan.design.random:
        return "The rows are extremes, not a random sample: no probabilities follow from them."
    if plan.batched:
        return (
            f"Batches of {plan.batch_size} drives have part of their spread in common; intervals come from batch means."
        )
    if plan.sampling == "sobol":
        return f"{plan.replicates} scrambled Sobol sequences in turn; intervals come from their differences."
    if plan.sampling == "latin_hypercube":
        return f"Latin hypercubes of {plan.block} rows each; intervals come from their differences."
    return "Rows are independent random drives; intervals are exact binomial ones (Clopper-Pearson, order statistics)."
