"""How far a study is: rows done, of how many, and when it will end."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hdfast.errors import InputError, shorten


class Meter:
    """Counts rows for a bar or a function.

    Args:
        show: called with the number of rows done so far.
        done: rows that were there before.
    """

    def __init__(self, show: Callable[[int], None], done: int) -> None:
        self.show, self.done = show, done

    def within(self, done: int, total: int) -> None:
        """Rows done inside the chunk under way; `total` is its size."""
        self.show(self.done + min(done, total))

    def chunk(self, rows: int) -> None:
        """A chunk is finished."""
        self.done += rows
        self.show(self.done)


def _nothing(_rows: int) -> None:
    """Shows nothing."""


@contextmanager
def meter(progress: Any, total: int, done: int) -> Iterator[Meter]:
    """A meter for what a user gave as `progress`: True (a bar with the estimated end), False or a function.

    Raises:
        InputError: it is none of these.
    """
    if progress is True:
        from tqdm import tqdm

        with tqdm(total=total, initial=done, unit="row", file=sys.stderr, dynamic_ncols=True, leave=False) as bar:
            yield Meter(lambda rows: bar.update(rows - bar.n), done)
    elif progress is False or progress is None:
        yield Meter(_nothing, done)
    elif callable(progress):
        yield Meter(lambda rows: progress(rows, total), done)
    else:
        raise InputError(f"progress = {shorten(progress)} is not True, False or a function of (done, total)")
