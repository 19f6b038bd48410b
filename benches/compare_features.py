"""What derivatives, terms and stiff rows cost beside the plain model.

All in one run, interleaved, medians of rounds, processor time of one thread. Run by `make bench`.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import hdfast
import numpy as np
import problem

ROWS = 1_000
ROUNDS = 11
COLUMNS = ["J_m", "J_l", "B_m", "B_sp", "k1", "te_scale", "K_p", "omega_set"]
METRICS = {
    "final state": (),
    "rms and peak": ("te_rms", "peak_windup"),
    "orders": ("order_1", "order_2", "speed_order_2"),
    "all": tuple(hdfast.metrics()),
}
TERMS: dict[str, tuple[list[str], dict[str, float]]] = {
    "none": ([], {}),
    "dry friction": (["coulomb_friction"], {}),
    "hysteresis": (["hysteresis"], {}),
    "backlash, soft windup": (["backlash", "soft_windup"], {}),
    "LuGre friction": (["presliding_friction"], {}),
    "five terms": (["stribeck_friction", "load_side_friction", "hysteresis", "viscoelastic", "te_load_dependence"], {}),
    "stiff: current loop of 10 us": (["actuator_lag"], {"tau_e": 1e-5}),
}


def seconds(works: dict[str, Callable[[], Any]]) -> dict[str, float]:
    """Median processor time of each work, in turn."""
    taken: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(ROUNDS):
        for name, work in works.items():
            start = time.process_time()
            work()
            taken[name].append(time.process_time() - start)
    return {name: statistics.median(times) for name, times in taken.items()}


def cost_of_a_column(rows: dict[str, np.ndarray], metrics: tuple[str, ...]) -> float:
    """Processor time of one column of derivatives over that of the values."""
    few = {name: values[: ROWS // len(COLUMNS)] for name, values in rows.items()}
    taken = seconds(
        {
            "values": lambda: problem.sweep(rows, metrics, threads=1),
            "columns": lambda: problem.sweep(few, metrics, threads=1, sensitivities=COLUMNS),
        }
    )
    return taken["columns"] / taken["values"]


def main() -> None:
    rows = problem.columns(ROWS)
    print(f"benchmark problem, {ROWS} rows, medians of {ROUNDS} interleaved rounds")
    print("one column of derivatives over the values, by metrics:")
    for name, metrics in METRICS.items():
        print(f"  {name:30s} {cost_of_a_column(rows, metrics):6.2f}")

    def with_terms(terms: list[str], values: dict[str, float]) -> Any:
        columns = rows | {name: np.full(ROWS, value) for name, value in values.items()}
        return problem.sweep(columns, model=hdfast.Model(terms=terms), threads=1)

    taken = seconds({name: lambda choice=choice: with_terms(*choice) for name, choice in TERMS.items()})
    print("rows with terms over rows without, method auto:")
    for name, time_taken in taken.items():
        print(f"  {name:30s} {time_taken / taken['none']:6.2f}")


if __name__ == "__main__":
    main()
