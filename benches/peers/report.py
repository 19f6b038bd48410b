"""RESULTS.md and its picture from the measured results.

Usage: python benches/peers/report.py RESULTS.json FOLDER
"""

import json
import sys
from pathlib import Path

TARGETS = ("1e-04", "1e-06", "1e-08", "1e-10")
OWN = "hdfast"
MATCH = "1e-06"
STIFF = (1e-4, 1e-6)
KINDS = {"full": "final state, rms of te and peak windup", "final": "final state alone"}


def rate(entry: dict, target: str, kind: str) -> float | None:
    """Rows per second on one processor."""
    seconds = entry["targets"].get(target, {}).get(kind)
    return 1 / seconds if seconds else None


def complete(entry: dict, target: str) -> bool:
    """Whether all outputs are there."""
    return entry["targets"][target]["peak_error"] is not None


def fastest(entries: list[dict], target: str, kind: str) -> dict | None:
    """The fastest of some entries."""
    able = [entry for entry in entries if rate(entry, target, kind) and (kind == "final" or complete(entry, target))]
    return max(able, key=lambda entry: rate(entry, target, kind)) if able else None


def number(value: float | None) -> str:
    """Three figures, thousands apart."""
    if value is None:
        return "-"
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 100 else f"{value:.3g}"


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """A Markdown table, the first column to the left."""
    line = lambda cells: "| " + " | ".join(cells) + " |"  # noqa: E731
    return [line(head), "|" + "|".join(["---"] + ["--:"] * (len(head) - 1)) + "|", *map(line, rows), ""]


def speeds(results: dict, kind: str) -> list[str]:
    """Rows per second of every variant at every error."""
    entries = results["entries"]
    own = [entry for entry in entries if entry["name"] == OWN]
    order = sorted(entries, key=lambda entry: -(rate(entry, MATCH, kind) or 0.0))
    rows = []
    for entry in order:
        cells = [f"{entry['name']}, {entry['variant']}"]
        for target in TARGETS:
            mine, theirs = fastest(own, target, kind), rate(entry, target, kind)
            behind = (
                f" ({number(rate(mine, target, kind) / theirs)})" if mine and theirs and entry["name"] != OWN else ""
            )
            cells.append(number(theirs) + behind)
        rows.append(cells)
    return table(["", *(f"error {float(target):.0e}" for target in TARGETS)], rows)


def particulars(results: dict) -> list[str]:
    """Settings, accuracy of the peak, effort of the best variant of every contestant."""
    rows = []
    for name in dict.fromkeys(entry["name"] for entry in results["entries"]):
        mine = [entry for entry in results["entries"] if entry["name"] == name]
        entry = fastest(mine, MATCH, "full")
        if not entry:
            continue
        match = entry["targets"][MATCH]
        peak = "none" if match["peak_error"] is None else f"{100 * match['peak_error']:.2g} %"
        two = number(1 / entry["two_cores"]) if entry["two_cores"] else "-"
        told = [entry["version"], f"{match['rtol']:.1e}", f"{match['error']:.1e}", peak, two]
        effort = [f"{entry['compile']:.1f}", f"{entry['memory'] / 1e6:.0f}", str(entry["lines"])]
        rows.append([f"{name}, {entry['variant']}", *told, *effort])
    head = ["", "version", "rtol", "error of rms", "worst peak", "rows/s, 2 cores", "compile s", "MB", "lines"]
    return table(head, rows)


def troubles(results: dict) -> list[str]:
    """What one bad row does."""
    rows = [
        [f"{entry['name']}, {entry['variant']}", *(entry["trouble"].get(kind, "-") for kind in ("NaN row", "slow row"))]
        for entry in results["entries"]
        if entry["trouble"]
    ]
    return table(["", "a row of NaN", "a row of many steps"], rows)


def picture(results: dict, path: Path) -> None:
    """Work-precision curves, the best variants in colour."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "peers"
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(9, 6), layout="constrained")
    names = list(dict.fromkeys(entry["name"] for entry in results["entries"]))
    names.sort(key=lambda name: name != OWN)
    for position, name in enumerate(names):
        points = []
        for target in TARGETS:
            best = fastest([entry for entry in results["entries"] if entry["name"] == name], target, "full")
            if best:
                points.append((best["targets"][target]["error"], rate(best, target, "full")))
        if points:
            style = {"color": "black", "linewidth": 3} if name == OWN else {"color": plt.get_cmap("tab20")(position)}
            marker = "os^vD<>p*hX"[position % 11]
            axes.plot(*zip(*points, strict=True), marker=marker, label=name, **style)
    axes.set(xscale="log", yscale="log", xlabel="median relative error of the rms of te", ylabel="rows/s on one core")
    axes.invert_xaxis()
    axes.grid(which="both", alpha=0.3)
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(path, metadata={"Date": None})


def write(results: dict, folder: Path) -> None:
    """`RESULTS.md` and `work-precision.svg`."""
    picture(results, folder / "work-precision.svg")
    where = results["machine"]
    text = [
        "# hdfast beside its peers",
        "",
        "Written by `make bench-peers`. Every contestant at the loosest tolerance that brings the median error of",
        f"the rms of te to the target; {results['rounds']} interleaved rounds, medians of processor time.",
        "In brackets: hdfast's best over it.",
        "",
        f"{where['processor']}, {where['cores']} cores, {where['vectors']}, {where['system']},",
        f"Python {where['python']},",
        f"load average {where['load']} during the run.",
        "",
        "![work-precision](work-precision.svg)",
        "",
    ]
    for kind, outputs in KINDS.items():
        text += [f"## Rows per second on one core: {outputs}", "", *speeds(results, kind)]
    text += ["## The best of each at an error of 1e-6", "", *particulars(results)]
    text += ["Lines: what a user writes, the statement of the problem included.", ""]
    text += ["## One bad row in a batch of 256", "", *troubles(results)]
    rows = [
        [line["title"], *(number(line["rates"].get(f"{target:.0e}")) for target in STIFF)] for line in results["stiff"]
    ]
    head = ["", *(f"error {target:.0e}" for target in STIFF)]
    text += [
        "## Stiff rows per second on one core: damping in the mesh a thousand times as strong",
        "",
        *table(head, rows),
    ]
    refused = [f"- {name}: {why}" for name, why in results["absent"].items()]
    refused += [f"- {e['name']}, {e['variant']}: {e['failure']}" for e in results["entries"] if e["failure"]]
    if refused:
        text += ["## Left out", "", *refused, ""]
    (folder / "RESULTS.md").write_text("\n".join(text), encoding="utf-8")


if __name__ == "__main__":
    write(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")), Path(sys.argv[2]))
