"""Work-precision of hdfast and of what a user would take instead, side by side. Run by `make bench-peers`.

Every contestant solves the benchmark problem in its own process and environment, each at the tolerance that
brings it to the same error. Timed sections are short and go round in turn; medians of the rounds count.

Usage: python benches/peers/compare.py [--only FILE[,FILE...]] [--rounds N] [--out FOLDER]
"""

import argparse
import dataclasses
import json
import os
import platform
import statistics
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import matching
import problem
import reference
import report
import stiff
import troubles
from environments import OUT, Contestant, contestants, interpreter, version
from processes import Worker, WorkerError

SECTION = 0.25  # [s] of processor time that a timed section aims at
BUDGET = 5.0  # [s] that one entry may take over all rounds
MOST_ROWS = 4096
TWO_CORES_TARGET = 1e-6
BUSY = 1.5  # load average, of which this run makes 1, beyond which clock times mean nothing


@dataclasses.dataclass
class Entry:
    """One variant of a contestant through the comparison."""

    contestant: Contestant
    variant: str
    python: Path
    worker: Worker | None = None
    matches: dict[float, matching.Match] = dataclasses.field(default_factory=dict)
    seconds: dict[tuple[float, str], list[float]] = dataclasses.field(default_factory=dict)
    wall_two: list[float] = dataclasses.field(default_factory=list)
    memory: float = 0.0
    failure: str = ""

    @property
    def title(self) -> str:
        """Name and variant."""
        return f"{self.contestant.name}: {self.variant}"

    def rows(self, target: float) -> int:
        """Rows of a timed section: whole batches."""
        batch = self.contestant.batch
        wanted = int(SECTION / self.matches[target].seconds_per_row)
        return max(2, batch, min(MOST_ROWS, wanted // batch * batch))


def enter(contestant: Contestant, python: Path, exact: dict, processor: int) -> list[Entry]:
    """Starts the variants of a contestant and finds their tolerances."""
    entries = []
    for variant in contestant.variants:
        entry = Entry(contestant, variant, python)
        entries.append(entry)
        try:
            entry.worker = Worker(python, contestant.file, variant, [processor])
            entry.matches = matching.matches(entry.worker, exact)
            for target in entry.matches:
                warm_up(entry, target)
        except WorkerError as error:
            entry.failure = str(error)
        found = ", ".join(f"{target:.0e} at {match.rtol:.1e}" for target, match in entry.matches.items())
        print(f"  {entry.title}: {found or 'none'} {entry.failure}", flush=True)
    return entries


def warm_up(entry: Entry, target: float) -> None:
    """Compiles what depends on the size of the batch, and learns the cost of a row in it."""
    match = entry.matches[target]
    for full in (False, True):
        answer = entry.worker.run(match.rtol, entry.rows(target), full=full)
    match.seconds_per_row = answer["cpu"] / entry.rows(target)


def go_round(entries: list[Entry], target: float, kind: str, spent: dict) -> None:
    """One timed section of every entry that reaches the target and has time left."""
    for entry in entries:
        if target not in entry.matches or entry.failure or spent.get((entry.title, target, kind), 0.0) > BUDGET:
            continue
        try:
            answer = entry.worker.run(entry.matches[target].rtol, entry.rows(target), full=kind == "full")
        except WorkerError as error:
            entry.failure = str(error)
            continue
        key = entry.title, target, kind
        spent[key] = spent.get(key, 0.0) + answer["cpu"]
        entry.seconds.setdefault((target, kind), []).append(answer["cpu"] / entry.rows(target))
        entry.memory = max(entry.memory, answer["memory"])


def two_cores(entries: list[Entry], processors: list[int], rounds: int) -> None:
    """Clock time on two processors: own threads where there are any, else two processes with half the rows each."""
    target, teams = TWO_CORES_TARGET, {}
    for entry in entries:
        file, variant = entry.contestant.file, entry.variant
        if entry.contestant.threads:
            teams[entry.title] = [Worker(entry.python, file, variant, processors)]
        else:
            teams[entry.title] = [Worker(entry.python, file, variant, [each]) for each in processors]
    for turn in range(rounds + 1):
        for entry in entries:
            team = teams[entry.title]
            rows = 2 * entry.rows(target) // len(team)
            begin = time.perf_counter()
            for worker in team:
                worker.send(entry.matches[target].rtol, rows)
            for worker in team:
                worker.answer(300.0)
            if turn > 0:
                entry.wall_two.append((time.perf_counter() - begin) / (rows * len(team)))
    for worker in (worker for team in teams.values() for worker in team):
        worker.stop()


def best(entries: list[Entry], target: float, kind: str = "full") -> list[Entry]:
    """The fastest variant of every contestant at a target."""
    by_name: dict[str, list[Entry]] = {}
    for entry in entries:
        if entry.seconds.get((target, kind)) and entry.matches[target].peak_error is not None:
            by_name.setdefault(entry.contestant.name, []).append(entry)
    return [min(group, key=lambda entry: statistics.median(entry.seconds[target, kind])) for group in by_name.values()]


def told(entry: Entry, versions: dict[str, str], trouble: dict[str, str]) -> dict:
    """What the report needs of an entry."""
    targets = {
        f"{target:.0e}": dataclasses.asdict(match)
        | {
            kind: statistics.median(entry.seconds[target, kind])
            for kind in ("full", "final")
            if (target, kind) in entry.seconds
        }
        for target, match in entry.matches.items()
    }
    return {
        "name": entry.contestant.name,
        "variant": entry.variant,
        "version": versions[entry.contestant.file],
        "lines": entry.contestant.lines,
        "compile": entry.worker.compile_seconds if entry.worker else None,
        "memory": entry.memory,
        "targets": targets,
        "two_cores": statistics.median(entry.wall_two) if entry.wall_two else None,
        "trouble": trouble,
        "failure": entry.failure,
    }


def machine() -> dict[str, str | int]:
    """Where this was measured."""
    info = Path("/proc/cpuinfo").read_text(encoding="utf-8") if Path("/proc/cpuinfo").exists() else ""
    names = [line.partition(":")[2].strip() for line in info.splitlines() if line.startswith("model name")]
    flags = [line for line in info.splitlines() if line.startswith("flags")]
    widest = next((name for name in ("avx512f", "avx2") if flags and name in flags[0]), "")
    return {
        "processor": names[0] if names else platform.processor(),
        "vectors": widest,
        "cores": len(os.sched_getaffinity(0)),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load": f"{os.getloadavg()[0]:.1f}",
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="contestants to run, by file, separated by commas")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--out", type=Path, default=HERE)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    chosen = [each for each in contestants() if not options.only or each.file in options.only.split(",")]
    processors = sorted(os.sched_getaffinity(0))[-2:]

    print("reference: SciPy DOP853 at rtol 1e-12", flush=True)
    final, peak, rms = reference.solve(problem.matrix(reference.CHECKED))
    exact = {"final": final, "peak": peak, "rms": rms}
    entries, versions, absent, pythons = [], {}, {}, {}
    for contestant in chosen:
        python = interpreter(contestant)
        if isinstance(python, str):
            absent[contestant.name] = python
            print(f"  {contestant.name} {python}", flush=True)
            continue
        versions[contestant.file], pythons[contestant.file] = version(contestant, python), python
        entries += enter(contestant, python, exact, processors[-1])

    spent: dict = {}
    for turn in range(options.rounds):
        print(f"round {turn + 1} of {options.rounds}", flush=True)
        for target in matching.TARGETS:
            for kind in ("full", "final"):
                go_round(entries, target, kind, spent)
    finalists = best(entries, TWO_CORES_TARGET)
    for entry in entries:
        if entry.worker:
            entry.worker.stop()
    if os.getloadavg()[0] <= BUSY:
        print("two processors", flush=True)
        two_cores(finalists, processors, options.rounds)
    else:
        print("no clock times on two processors: other work is on this machine", flush=True)
    print("one bad row", flush=True)
    trouble: dict[str, dict[str, str]] = {}
    for entry in finalists:
        rtol = entry.matches[TWO_CORES_TARGET].rtol
        trouble[entry.title] = troubles.bad_row(entry.contestant, entry.variant, entry.python, rtol, processors[-1])

    results = {
        "machine": machine(),
        "rounds": options.rounds,
        "entries": [told(entry, versions, trouble.get(entry.title, {})) for entry in entries],
        "absent": absent,
        "stiff": stiff.compare(chosen, pythons, options.rounds, processors[-1]),
    }
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "results.json").write_text(json.dumps(results, indent=1), encoding="utf-8")
    report.write(results, options.out)


if __name__ == "__main__":
    main()
