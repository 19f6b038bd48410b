"""Speed of the lanes against the scalar instance, against Numba at matched error, and of two threads against one.

All in one run, interleaved, medians of rounds. One-thread figures count processor time, which a busy
machine distorts least; the gain of a second thread counts time on the clock. Run by `make bench`.
"""

import os
import statistics
import time
from collections.abc import Callable
from typing import Any

import hdfast
import numba
import numba_rows
import numpy as np
import problem

ROWS = 2_000
CHECKED = 64
WANTED_ERROR = 1e-6
ROUNDS = 11
RTOLS = 10.0 ** -np.arange(3.0, 9.01, 0.25)


def timed(work: Callable[[], Any], clock: Callable[[], float]) -> float:
    """Seconds that `work` takes by a clock."""
    start = clock()
    work()
    return clock() - start


def on_path(path: str, rows: dict[str, np.ndarray], threads: int = 1, rtol: float = 1e-6) -> Any:
    """A sweep forced onto one CPU path."""
    os.environ["HDFAST_SIMD"] = path
    try:
        return problem.sweep(rows, rtol=rtol, threads=threads)
    finally:
        del os.environ["HDFAST_SIMD"]


def matched_rtol(rms_at: Callable[[float], np.ndarray], exact: np.ndarray) -> tuple[float, float]:
    """The loosest tolerance whose median error of the rms is within the wanted one, and that error."""
    for rtol in RTOLS:
        error = float(np.median(np.abs(rms_at(float(rtol)) / exact - 1)))
        if error <= WANTED_ERROR:
            return float(rtol), error
    raise SystemExit(f"no tolerance reaches an error of {WANTED_ERROR}")


def first(rows: dict[str, np.ndarray], count: int) -> dict[str, np.ndarray]:
    """The first rows."""
    return {name: values[:count] for name, values in rows.items()}


def main() -> None:
    numba.set_num_threads(1)
    rows = problem.columns(ROWS)
    checked = first(rows, CHECKED)
    few = first(rows, 400)
    exact = problem.sweep(checked, rtol=1e-12)
    own_rtol, own_error = matched_rtol(lambda rtol: problem.sweep(checked, rtol=rtol)["te_rms"], exact["te_rms"])
    numba_rtol, numba_error = matched_rtol(lambda rtol: numba_rows.sweep(checked, rtol)[2], exact["te_rms"])
    peaks = numba_rows.sweep(checked, numba_rtol)[1]
    own_peaks = problem.sweep(checked, rtol=own_rtol)["peak_windup"]

    info = hdfast.build_info()
    paths = [path for path in info["simd_available"] if path != "portable"]
    works: dict[str, tuple[int, Callable[[], Any]]] = {
        path: (ROWS if path != "scalar" else 400, lambda path=path: on_path(path, rows if path != "scalar" else few))
        for path in paths
    }
    works["two threads"] = (4 * ROWS, lambda: on_path(paths[0], problem_rows_large, threads=2))
    works["one thread"] = (4 * ROWS, lambda: on_path(paths[0], problem_rows_large, threads=1))
    works["matched"] = (ROWS, lambda: on_path(paths[0], rows, rtol=own_rtol))
    works["numba matched"] = (400, lambda: numba_rows.sweep(few, numba_rtol))
    problem_rows_large = problem.columns(4 * ROWS)
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(ROUNDS):
        for name, (count, work) in works.items():
            clock = time.perf_counter if name.endswith(("thread", "threads")) else time.process_time
            seconds[name].append(timed(work, clock) / count)
    rate = {name: 1 / statistics.median(values) for name, values in seconds.items()}

    print("build:", ", ".join(f"{key} {value}" for key, value in info.items()))
    print(f"\nrows per second, benchmark problem, rtol 1e-6, median of {ROUNDS} interleaved rounds")
    for path in paths:
        print(f"  {path:10s} {rate[path]:10.0f}   {rate[path] / rate['scalar']:6.2f} x scalar")
    print(f"  two threads over one: {rate['two threads'] / rate['one thread']:.2f}")
    print(f"\nat a median error of the rms of at most {WANTED_ERROR:g}: final state, peak windup, rms of te")
    worst = np.max(np.abs(own_peaks / exact["peak_windup"] - 1)), np.max(np.abs(peaks / exact["peak_windup"] - 1))
    for name, rtol, error, peak in (
        ("hdfast", own_rtol, own_error, worst[0]),
        ("Numba Dormand-Prince 5(4)", numba_rtol, numba_error, worst[1]),
    ):
        speed = rate["matched"] if name == "hdfast" else rate["numba matched"]
        print(f"  {name:26s} {speed:10.0f} rows/s   rtol {rtol:.1e}   rms off {error:.1e}   worst peak off {peak:.1e}")
    print(f"  hdfast over Numba: {rate['matched'] / rate['numba matched']:.1f}")


if __name__ == "__main__":
    main()
