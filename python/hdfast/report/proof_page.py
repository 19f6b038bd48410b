"""The published page and table of the blind benchmark, from `proof.json` alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hdfast.printing import html_table
from hdfast.report import html, proof_plots
from hdfast.report.html import Section

SCORE_HEADER = ("score", "value", "95 % interval", "cases", "mark", "met", "note")
FAILURE_HEADER = (
    "case",
    "failure",
    "stratum",
    "truth",
    "size / detectable",
    "answer",
    "named",
    "nuisance named",
    "detail",
)
LIMITS = "Limits"
BY_EFFECT = "Single effects found, by size"
SECOND_HEADER = ("case", "truth", "undecided about", "with the motion asked for", "with one at random")
SECOND = (
    "What an undecided answer asks for is recorded, and the tool answers again; beside it with a usual motion, as long "
    "and within the same limits."
)


def score_rows(proof: dict[str, Any]) -> list[tuple[str, ...]]:
    """The table of scores, missed marks as such."""
    rows = []
    for s in proof["scores"]:
        met = {True: "yes", False: "MISSED", None: ""}[s["passed"]]
        interval = f"{_number(s['low'])} to {_number(s['high'])}"
        rows.append((s["name"], _number(s["value"]), interval, str(s["count"]), s["mark"], met, s["note"]))
    return rows + [(name, "not scored", "", "", "", "", reason) for name, reason in proof["unavailable"].items()]


def compared_rows(proof: dict[str, Any]) -> list[tuple[str, ...]]:
    """Everybody who answered the same cases, and the lead of the own tool in utility."""
    return [
        (
            one["tool"],
            _with_interval(one["ahead"]) if one["ahead"] else "",
            *(_number(s["value"]) for s in one["scores"].values()),
        )
        for one in proof["compared"]
    ]


def _compared_header(proof: dict[str, Any]) -> tuple[str, ...]:
    return ("tool", "utility ahead (95 %)", *proof["compared"][0]["scores"])


def _with_interval(score: dict[str, Any]) -> str:
    return f"{_number(score['value'])} ({_number(score['low'])} to {_number(score['high'])})"


def effect_rows(proof: dict[str, Any]) -> list[tuple[str, ...]]:
    """How many single effects of each kind were found at each size, of how many."""
    return [
        (one["effect"], *(f"{size['found']} of {size['count']}" if size["count"] else "" for size in one["sizes"]))
        for one in proof["by_effect"]
    ]


def _effect_header(proof: dict[str, Any]) -> tuple[str, ...]:
    return ("effect", *(f"about {row['amplitude_over_mda']:g} detectable" for row in proof["power"]))


def failure_rows(proof: dict[str, Any]) -> list[tuple[str, ...]]:
    """Every failure."""
    return [
        (
            f["case"], f["failure"], f["stratum"], ", ".join(f["truth"]) or "nothing", _number(f["amplitude_over_mda"]),
            f["answer"], ", ".join(f["named"]), ", ".join(f["named_nuisance"]), f["detail"],
        )
        for f in proof["failures"]
    ]  # fmt: skip


def second_rows(proof: dict[str, Any]) -> list[tuple[str, ...]]:
    """Every case of the second round: what was held possible, and both further answers."""
    return [
        (
            one["case"], ", ".join(one["truth"]) or "nothing", ", ".join(one["first"]),
            *(
                f"{one[motion]['outcome']}: {one[motion]['answer']} {', '.join(one[motion]['named'])}".strip()
                for motion in ("asked", "drawn")
            ),
        )
        for one in proof["second"]
    ]  # fmt: skip


def _second_round(proof: dict[str, Any]) -> list[Section]:
    if not proof["second"]:
        return []
    return [Section("Second round", texts=[SECOND], tables=[html_table(SECOND_HEADER, second_rows(proof))])]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _comparison(proof: dict[str, Any]) -> list[Section]:
    if not proof["compared"]:
        return []
    header = _compared_header(proof)
    table = html_table(header, compared_rows(proof), right=range(1, len(header)))
    return [Section("Beside others", texts=[_shared(proof), *_who(proof)], tables=[table])]


def _shared(proof: dict[str, Any]) -> str:
    return f"All on the same {proof['shared']} of {len(proof['cases'])} cases, the first by name."


def _who(proof: dict[str, Any]) -> list[str]:
    """Who the others are."""
    return [f"{one['tool']}: {one['text']}." for one in proof["compared"] if one["text"]]


def markdown(proof: dict[str, Any]) -> str:
    """Scores, every failure and limits as Markdown."""
    lines = [f"Blind benchmark, {len(proof['cases'])} cases, tool `{proof['tool']}`, {_machine(proof)}.", ""]
    lines += _markdown_table(SCORE_HEADER, score_rows(proof))
    if proof["compared"]:
        lines += ["", "## Beside others", "", _shared(proof), ""]
        lines += _markdown_table(_compared_header(proof), compared_rows(proof))
        lines += ["", *(f"- {who}" for who in _who(proof))]
    if proof["second"]:
        lines += ["", "## Second round", "", SECOND, "", *_markdown_table(SECOND_HEADER, second_rows(proof))]
    lines += ["", f"## {BY_EFFECT}", "", *_markdown_table(_effect_header(proof), effect_rows(proof))]
    lines += ["", f"## Every failure ({len(proof['failures'])})", ""]
    lines += _markdown_table(FAILURE_HEADER, failure_rows(proof))
    lines += ["", f"## {LIMITS}", "", *(f"- {one}" for one in proof["limitations"])]
    return "\n".join(lines) + "\n"


def _markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    cells = ([cell.replace("|", "\\|") for cell in row] for row in (header, ["---"] * len(header), *rows))
    return [f"| {' | '.join(row)} |" for row in cells]


def _machine(proof: dict[str, Any]) -> str:
    m = proof["machine"]
    return f"hdfast {m['version']}, Python {m['python']}, {m['system']}, {m['cores']} cores"


def page(proof: dict[str, Any]) -> str:
    """The page; the same `proof.json` gives the same bytes."""
    missed = [s["name"] for s in proof["scores"] if s["passed"] is False]
    facts = [
        ("cases", str(len(proof["cases"]))),
        ("failures", str(len(proof["failures"]))),
        ("marks missed", str(len(missed))),
        ("cores", str(proof["machine"]["cores"])),
    ]
    cases = [
        (c["case"], ", ".join(c["kind"]), ", ".join(c["truth"]) or "nothing", _number(c["amplitude_over_mda"]),
         c["answer"], ", ".join(c["named"]), _number(c["probability"]), c["outcome"], _number(c["seconds"]))
        for c in proof["cases"]
    ]  # fmt: skip
    by_size = _effect_header(proof)
    confusion = [(c["truth"], c["answer"], str(c["count"])) for c in proof["confusion"]]
    sections = [
        Section("Scores", tables=[html_table(SCORE_HEADER, score_rows(proof), right=(1, 2, 3, 4))]),
        *_comparison(proof),
        *_second_round(proof),
        Section(
            "Power and calibration",
            figures=[
                html.picture(proof_plots.power(proof["power"]), "Single effects found, by their size."),
                html.picture(
                    proof_plots.reliability(proof["reliability"]),
                    "Reliability of the stated probability; numbers are counts of answers.",
                ),
            ],
        ),
        Section(BY_EFFECT, tables=[html_table(by_size, effect_rows(proof), right=range(1, len(by_size)))]),
        Section("Every failure", tables=[html_table(FAILURE_HEADER, failure_rows(proof), right=(4,))]),
        Section(
            "Truth and answer, single effects",
            tables=[html_table(("truth", "leading answer", "cases"), confusion, right=(2,))],
        ),
        Section(
            "Every case",
            tables=[
                html_table(
                    (
                        "case",
                        "kind",
                        "truth",
                        "size / detectable",
                        "answer",
                        "named",
                        "probability",
                        "outcome",
                        "seconds",
                    ),
                    cases,
                    right=(3, 6, 8),
                )
            ],
        ),
        Section(LIMITS, texts=[*proof["limitations"], f"Seal: SHA-256 {proof['seal']}. {_machine(proof)}."]),
    ]
    headline = "Every mark is met." if not missed else f"Marks missed: {', '.join(missed)}."
    lead = f"Blind cases answered by {proof['tool']}: one effect concealed in each, or none."
    return html.render("Blind benchmark", lead, facts, sections, "", not missed, headline)
