"""What does not depend on each other, side by side."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from threading import Event
from typing import TypeVar

from hdfast.diagnosis.replay import Replay
from hdfast.threads import resolve_threads

Part = TypeVar("Part")
Found = TypeVar("Found")


def side_by_side(
    replay: Replay, work: Callable[[Replay, Part], Found], parts: Sequence[Part]
) -> Generator[Found, None, None]:
    """What `work` makes of each part, in their order: the same as one after another.

    The few rows of one part would leave most lanes of all threads empty: every part gets its share of the threads. When
    one fails, the user interrupts or asks for no more, the others' simulations end with `CancelledError`.
    """
    stopped = Event()

    def unless_stopped(_done: int, _rows: int) -> None:
        if stopped.is_set():
            raise CancelledError

    threads = resolve_threads(replay.plant.threads)
    workers = max(1, min(threads, len(parts)))
    share = replace(replay, plant=replace(replay.plant, threads=threads // workers, progress=unless_stopped))
    with ThreadPoolExecutor(workers) as pool:
        try:
            yield from pool.map(partial(work, share), parts)
        except BaseException:
            stopped.set()
            raise


def on_threads(threads: int | None, work: Callable[[Part], Found], parts: Sequence[Part]) -> list[Found]:
    """As `side_by_side`, for work that simulates nothing."""
    with ThreadPoolExecutor(max(1, min(resolve_threads(threads), len(parts)))) as pool:
        return list(pool.map(work, parts))
