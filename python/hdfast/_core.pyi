"""The compiled core."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Program", "build_info", "layout", "methods", "metrics", "signals", "statuses", "sweep", "terms"]

def build_info() -> dict[str, Any]: ...
def methods() -> list[dict[str, Any]]: ...
def statuses() -> list[tuple[int, str, str]]: ...
def metrics() -> list[dict[str, str]]: ...
def signals() -> list[dict[str, str]]: ...
def terms() -> list[dict[str, Any]]: ...
def layout(
    base: str, spring: str, orders: Sequence[float], labels: Sequence[str], terms: Sequence[str]
) -> list[dict[str, Any]]: ...

@final
class Program:
    def __new__(
        cls,
        segments: NDArray[np.float64],
        t_end: float,
        t_on: float,
        t_off: float,
        t_run: float,
        ring_delay: float,
        ring_width: float,
        ring_on_load: bool,
    ) -> Program: ...

def sweep(
    *,
    base: str,
    spring: str,
    orders: Sequence[float],
    terms: Sequence[str],
    defaults: NDArray[np.float64],
    columns: Sequence[tuple[int, NDArray[np.float64]]],
    rows: int,
    programs: Sequence[Program],
    program_index: NDArray[np.uint32] | None,
    initial: str,
    initial_state: NDArray[np.float64] | None,
    grids: Sequence[NDArray[np.float64]],
    grid_index: NDArray[np.uint32] | None,
    signals: Sequence[str],
    metrics: Sequence[str],
    directions: Sequence[tuple[bool, int]],
    method: str,
    find_stiff: bool,
    rtol: float,
    atol: float,
    max_steps: int,
    max_step: float,
    threads: int,
    progress: Callable[[int, int], object] | None,
) -> dict[str, Any]: ...
