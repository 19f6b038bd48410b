"""How far a study is: rows done, of how many, and when it will end."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hdfast.errors import InputError, shorten


class ProgressError(Exception):
    """The function a user gave as `progress` raised `error`, which is no row's fault."""

    def __init__(self, error: Exception) -> None:
        super().__init__(str(error))
        self.error = error


class Meter:
    """Counts rows for a bar or a function.

    Args:
        show: called with the number of rows done so far; what it raises becomes a `ProgressError`.
        done: rows that were there before.
    """

    def __init__(self, show: Callable[[int], None], done: int) -> None:
        self._show, self.done = show, done

    def show(self, rows: int) -> None:
        """Rows done so far."""
        try:
            self._show(rows)
        except Exception as error:
            raise ProgressError(error) from error

    def within(self, done: int, total: int) -> None:
        """Rows done inside the chunk under way; `total` is its size."""
        self.show(self.done + min(done, total))

    def chunk(self, rows: int) -> None:
        """A chunk is finished."""
        self.done += rows
        self.show(self.done)


@contextmanager
def meter(progress: Any, total: int, done: int) -> Iterator[Meter]:
    """A meter for what a user gave as `progress`: True (a bar with the estimated end), False or a function.

    Raises:
        InputError: it is none of these.
    """
    with _shown(progress, total, done) as show:
        try:
            yield Meter(show, done)
        except ProgressError as stop:
            raise stop.error from stop.error.__cause__


@contextmanager
def _shown(progress: Any, total: int, done: int) -> Iterator[Callable[[int], None]]:
    if progress is True:
        from tqdm import tqdm

        with tqdm(total=total, initial=done, unit="row", file=sys.stderr, dynamic_ncols=True, leave=False) as bar:
            yield lambda rows: bar.update(rows - bar.n)
    elif progress is False or progress is None:
        yield lambda _rows: None
    elif callable(progress):
        yield lambda rows: progress(rows, total)
    else:
        raise InputError(f"progress = {shorten(progress)} is not True, False or a function of (done, total)")
