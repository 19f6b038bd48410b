"""How close the engine comes to what the machine can do, each figure beside its bar.

Fraction of the arithmetic limit, growth with rows and simulated time, cost of metrics and samples, gain of a second
thread, lanes kept busy by rows of very different cost. Run by `make bench-peers`; interleaved, medians of rounds,
processor time except for threads.
"""

from __future__ import annotations

import ctypes
import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import hdfast
import numpy as np
import problem

ROUNDS = 7
ROWS = 4096
#: Fused multiply-adds, additions, products and extrema of one evaluation of the right-hand side at 15 orders: the
#: error's four polynomials 60, sine and cosine 20, inputs, controller, spring and both inertias 32.
EVALUATION = 60 + 20 + 32
#: The same of one attempted step of dop853: 12 evaluations, 58 weights and 12 sums for each of 5 states, stage times,
#: two error estimates of 8 weights, their norms, and the controller.
ATTEMPT = 12 * EVALUATION + 5 * (58 + 12) + 12 + 5 * 16 + 60 + 25
BARS = {"avx512": 0.75, "avx2": 0.70}


def main() -> None:
    print(", ".join(f"{key} {value}" for key, value in hdfast.build_info().items()))
    for path, bar in BARS.items():
        if path in hdfast.build_info()["simd_available"]:
            arithmetic(path, bar)
    outputs()
    growth()
    threads()
    occupancy()


def say(what: str, figure: str, bar: str) -> None:
    print(f"{what:58s} {figure:>12s}   bar {bar}", flush=True)


def interleaved(
    works: dict[str, Callable[[], object]], clock: Callable[[], float] = time.process_time
) -> dict[str, float]:
    """Median seconds of every work over the rounds."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(ROUNDS):
        for name, work in works.items():
            begin = clock()
            work()
            seconds[name].append(clock() - begin)
    return {name: statistics.median(values) for name, values in seconds.items()}


def run(rows: dict[str, np.ndarray], metrics: tuple[str, ...] = (), **options) -> hdfast.SweepResult:
    """A sweep on one thread."""
    return problem.sweep(rows, metrics, **{"method": "dop853", "threads": 1} | options)


def arithmetic(path: str, bar: float) -> None:
    """Operations of all attempted steps against the rate of fused multiply-adds in the same rounds."""
    rows = problem.columns(ROWS)
    steps = run(rows)
    attempts = float(np.sum(steps.steps) + np.sum(steps.rejected))
    peak = fused_multiply_adds()
    width = 64 if path == "avx512" else 32
    fractions = []
    for _ in range(ROUNDS):
        best = peak(width)
        os.environ["HDFAST_SIMD"] = path
        begin = time.process_time()
        run(rows)
        seconds = time.process_time() - begin
        del os.environ["HDFAST_SIMD"]
        fractions.append(attempts * ATTEMPT / seconds / (best + peak(width)) * 2)
    say(
        f"share of the multiply-add peak, {path}, {best / 1e9:.1f} G/s",
        f"{statistics.median(fractions):.2f}",
        f">= {bar}",
    )


def fused_multiply_adds() -> Callable[[int], float]:
    """The machine's rate [1/s] of fused multiply-adds in vectors of so many bytes, per processor second."""
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "peak.so"
        flags = [
            "-std=c++20",
            "-O3",
            "-march=native",
            "-mprefer-vector-width=512",
            "-ffp-contract=fast",
            "-shared",
            "-fPIC",
        ]
        subprocess.run(["g++", *flags, str(Path(__file__).parent / "peak.cpp"), "-o", str(built)], check=True)
        measure = ctypes.CDLL(str(built)).fused_multiply_adds
    measure.restype = ctypes.c_double
    measure.argtypes = [ctypes.c_int, ctypes.c_double]

    def peak(width: int) -> float:
        begin, begin_cpu = time.perf_counter(), time.process_time()
        rate = measure(width, 0.05)
        return rate * (time.perf_counter() - begin) / (time.process_time() - begin_cpu)

    return peak


def outputs() -> None:
    """Metrics and samples on top of the final state."""
    rows = problem.columns(ROWS)
    grid = np.linspace(0.0, 3.0, 301)
    seconds = interleaved(
        {
            "final state": lambda: run(rows),
            "rms": lambda: run(rows, ("te_rms",)),
            "rms and peak": lambda: run(rows, ("te_rms", "peak_windup")),
            "te": lambda: run(rows, t_eval=grid, signals=["te"]),
            "the windup": lambda: run(rows, t_eval=grid, signals=["windup"]),
            "write": lambda: np.empty((ROWS, len(grid))).fill(1.0),
        }
    )
    base = seconds["final state"]
    say("cost of the rms", f"{100 * (seconds['rms'] / base - 1):.0f} %", "<= 10 %")
    say("cost of rms and peak windup", f"{100 * (seconds['rms and peak'] / base - 1):.0f} %", "<= 10 %")
    for signal in ("te", "the windup"):
        written = (seconds[signal] - seconds["write"]) / base - 1
        say(f"cost of 301 samples of {signal} beyond the writing", f"{100 * written:.0f} %", "<= 25 %")


def growth() -> None:
    """Cost per row from 100 to 1,000,000 rows, all of them copies of the same 100, and per simulated second."""
    counts = (100, 10_000, 1_000_000)
    few = problem.columns(counts[0])
    per_row = {}
    for count in counts:
        rows = {name: np.tile(values, count // counts[0]) for name, values in few.items()}
        turns = 1 if count > 100_000 else max(1, 20_000 // count)
        times = []
        for _ in range(1 if count > 100_000 else ROUNDS):
            begin = time.process_time()
            for _ in range(turns):
                run(rows, ("te_rms",))
            times.append((time.process_time() - begin) / (count * turns))
        per_row[count] = statistics.median(times)
    for count in counts[1:]:
        ratio = per_row[count] / per_row[counts[0]] - 1
        say(f"cost of a row among {count:,} against among {counts[0]}", f"{100 * ratio:+.0f} %", "within 5 %")
    rows = problem.columns(ROWS)
    shared = problem.constants() | rows

    def steady(end: float) -> object:
        scenario = hdfast.Scenario.speed_profile(
            t=(0.0, 0.5, end), relative=(0, 1, 1), K_p=problem.K_P, K_i=problem.K_I, tau_max=np.inf
        )
        return hdfast.sweep(shared, scenario=scenario, metrics=["te_rms"], method="dop853", threads=1)

    seconds = interleaved({f"{end}": lambda end=end: steady(end) for end in (2.0, 4.0, 8.0)})
    ratio = (seconds["8.0"] - seconds["4.0"]) / 2 / (seconds["4.0"] - seconds["2.0"]) - 1
    say("cost of a second of 4..8 s against 2..4 s", f"{100 * ratio:+.0f} %", "within 5 %")


def threads() -> None:
    """Time on the clock of two threads against one."""
    rows = problem.columns(4 * ROWS)
    works = {f"{count}": lambda count=count: run(rows, threads=count) for count in (1, 2)}
    seconds = interleaved(works, time.perf_counter)
    say("two threads against one", f"{seconds['1'] / seconds['2']:.2f}", ">= 1.95")


def occupancy() -> None:
    """Lanes kept busy: time per attempted step with rows alike against rows whose costs spread 100:1."""
    alike = {name: np.full(ROWS, np.median(values)) for name, values in problem.columns(ROWS).items()}
    spread = {name: values[:1024] for name, values in alike.items()}
    spread["B_sp"] = spread["B_sp"] * np.random.default_rng(1).choice(np.geomspace(1.0, 1500.0, 64), 1024)
    attempts, costs = {}, {}
    for name, rows in (("alike", alike), ("spread", spread)):
        result = run(rows)
        costs[name] = result.steps + result.rejected
        attempts[name] = float(np.sum(costs[name]))
    seconds = interleaved({"alike": lambda: run(alike), "spread": lambda: run(spread)})
    busy = seconds["alike"] / attempts["alike"] / (seconds["spread"] / attempts["spread"])
    ratio = costs["spread"].max() / costs["spread"].min()
    say(f"lanes busy with row costs of {ratio:.0f}:1", f"{100 * busy:.0f} %", ">= 85 %")


if __name__ == "__main__":
    main()
