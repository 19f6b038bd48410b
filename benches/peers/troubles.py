"""What one bad row does to its batch, and what stiff rows cost."""

from pathlib import Path

import numpy as np
import problem
from environments import Contestant
from processes import Worker, WorkerError

ROWS = 256
BAD = 5
MESH_DAMPING = problem.COLUMNS.index("B_sp")
STIFF = 1000.0
LIMIT = 60.0  # [s]


def bad_row(contestant: Contestant, variant: str, python: Path, rtol: float, processor: int) -> dict[str, str]:
    """A row of NaN and a row of many thousand steps among good ones."""
    worker = Worker(python, contestant.file, variant, [processor])
    said = {}
    try:
        worker.run(rtol, ROWS)
        clean = worker.outcome(rtol, ROWS)
        said["slow row"] = slow(worker, rtol, clean)
        said["NaN row"] = spoiled(worker, rtol, clean)
    except WorkerError as error:
        said.setdefault("slow row", str(error))
        said.setdefault("NaN row", f"{error}")
    finally:
        worker.stop()
    return said


def others(outcome: dict) -> np.ndarray:
    """Bits of the final states of the good rows."""
    return np.delete(outcome["final"].astype(float), BAD, axis=0)


def neighbours(clean: dict, outcome: dict) -> str:
    """How many good rows changed."""
    changed = int(np.sum(np.any(others(clean) != others(outcome), axis=1)))
    return "neighbours unchanged" if changed == 0 else f"{changed} of {ROWS - 1} neighbours changed"


def slow(worker: Worker, rtol: float, clean: dict) -> str:
    """One stiff row among good ones."""
    outcome = worker.outcome(rtol, ROWS, LIMIT, spoil=[[BAD, MESH_DAMPING, STIFF]])
    return f"batch takes {outcome['cpu'] / clean['cpu']:.1f} times as long, {neighbours(clean, outcome)}"


def spoiled(worker: Worker, rtol: float, clean: dict) -> str:
    """One row of NaN among good ones."""
    outcome = worker.outcome(rtol, ROWS, LIMIT, spoil=[[BAD, 0, float("nan")]])
    row = outcome["final"][BAD].astype(float)
    return f"{'finite numbers' if np.all(np.isfinite(row)) else 'NaN'} in its row, {neighbours(clean, outcome)}"
