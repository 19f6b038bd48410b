"""Rows whose damping in the mesh is a thousand times the nominal one: 23,000 1/s beside motions of a second."""

import statistics
from pathlib import Path

import matching
import numpy as np
import problem
import reference
from environments import Contestant
from processes import Worker, WorkerError

FACTOR = 1000.0
TARGETS = (1e-4, 1e-6)
COLUMN = problem.COLUMNS.index("B_sp")
SECTION = 0.5  # [s] of processor time that a timed section aims at
MOST_ROWS = 1024


def exact() -> dict[str, np.ndarray]:
    """The checked rows by an implicit method."""
    parameters = problem.matrix(reference.CHECKED)
    parameters[:, COLUMN] *= FACTOR
    final, peak, rms = reference.solve(parameters, "LSODA")
    return {"final": final, "peak": peak, "rms": rms}


def compare(contestants: list[Contestant], pythons: dict[str, Path], rounds: int, processor: int) -> list[dict]:
    """Rows per second of every contestant that names a method for stiff rows."""
    truth, scale = exact(), [[COLUMN, FACTOR]]
    workers: dict[str, Worker] = {}
    found: dict[str, dict[float, matching.Match]] = {}
    for contestant in contestants:
        if not contestant.stiff or contestant.file not in pythons:
            continue
        title = f"{contestant.name}, {contestant.stiff}"
        try:
            workers[title] = Worker(pythons[contestant.file], contestant.file, contestant.stiff, [processor])
            found[title] = matching.matches(workers[title], truth, TARGETS, scale=scale)
        except WorkerError as error:
            print(f"  stiff rows: {title}: {error}", flush=True)
            found[title] = {}
        print(f"  stiff rows: {title} {[f'{match.rtol:.1e}' for match in found[title].values()]}", flush=True)
    seconds: dict[tuple[str, float], list[float]] = {}
    for _ in range(rounds):
        for title, reached in found.items():
            for target, match in reached.items():
                rows = max(2, min(MOST_ROWS, int(SECTION / match.seconds_per_row)))
                answer = workers[title].run(match.rtol, rows, scale=scale)
                seconds.setdefault((title, target), []).append(answer["cpu"] / rows)
    for worker in workers.values():
        worker.stop()
    return [
        {
            "title": title,
            "rates": {f"{target:.0e}": 1 / statistics.median(seconds[title, target]) for target in reached},
        }
        for title, reached in found.items()
    ]
