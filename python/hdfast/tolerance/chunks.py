"""Chunks of rows through this process: engine in front, writing behind, poison found by halving."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol

from hdfast.errors import InputError
from hdfast.tolerance.progress import ProgressError
from hdfast.tolerance.task import Piece, join

Range = tuple[int, int]
Report = Callable[[int], None]


class Work(Protocol):
    """What is done to a chunk: `Task`, or anything with the same face."""

    def __call__(self, start: int, stop: int) -> Piece:
        """Rows start to stop."""
        ...

    def poisoned(self, row: int, reason: str) -> Piece:
        """What stands for a row that cannot be run."""
        ...


class Store(Protocol):
    """Where chunks go: `MemoryStore` or `FolderStore`.

    Attributes:
        chunk: rows per chunk.
        files: where a result folder has the rows.
    """

    chunk: int
    files: str

    def done(self, start: int, stop: int) -> bool:
        """True when these rows are there."""
        ...

    def put(self, piece: Piece) -> None:
        """Keep a finished chunk."""
        ...

    def column(self, name: str) -> Any:
        """(n,) values in row order."""
        ...

    def status(self) -> Any:
        """(n,) status names in row order."""
        ...

    def rows(self, numbers: list[int]) -> list[dict[str, Any]]:
        """All columns of some rows."""
        ...

    @property
    def poison(self) -> list[tuple[int, str]]:
        """Rows that took their process down."""
        ...


def ranges(rows: int, chunk: int) -> list[Range]:
    """Chunks of `chunk` rows, the last one shorter."""
    return [(start, min(start + chunk, rows)) for start in range(0, rows, chunk)]


def run_here(work: Work, todo: list[Range], store: Store, report: Report) -> None:
    """Run chunks one after the other; the engine has the threads, one more thread writes the chunk before."""
    with ThreadPoolExecutor(1, thread_name_prefix="hdfast-store") as writer:
        behind: Future[None] | None = None
        for start, stop in todo:
            piece = halving(work, start, stop)
            if behind is not None:
                behind.result()
            behind = writer.submit(store.put, piece)
            report(stop - start)
        if behind is not None:
            behind.result()


def halving(work: Work, start: int, stop: int) -> Piece:
    """Rows start to stop; when they raise, each half by itself, down to the row that is to blame."""
    try:
        return work(start, stop)
    except (InputError, ProgressError):
        raise
    except Exception as error:
        if stop - start == 1:
            return work.poisoned(start, describe(error))
        middle = (start + stop) // 2
        return join([halving(work, start, middle), halving(work, middle, stop)])


def describe(error: BaseException) -> str:
    """Kind and first line of an error."""
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0]}" if lines else type(error).__name__
