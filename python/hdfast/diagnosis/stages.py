"""How far a diagnosis is: a bar for people, sentences for programs, nothing for the rest."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from hdfast.errors import InputError, shorten

BAR = "{desc:<46.46} {bar} {n_fmt}/{total_fmt} {elapsed}"


def _nobody(_: Any) -> None:
    pass


@dataclass(frozen=True)
class Stages:
    """Receives what a diagnosis has done; how much there is to do shows on the way.

    Attributes:
        tell: is told every sentence.
        grow: is told how many more steps are coming.
        step: is called after each of them with its sentence.
    """

    tell: Callable[[str], Any] = _nobody
    grow: Callable[[int], Any] = _nobody
    step: Callable[[str], Any] = _nobody

    def expect(self, steps: int) -> None:
        """So many more steps are coming."""
        self.grow(steps)

    def done(self, sentence: str) -> None:
        """One of the expected steps is done."""
        self.tell(sentence)
        self.step(sentence)

    def say(self, sentence: str) -> None:
        """Something worth knowing between two steps."""
        self.tell(sentence)


@contextmanager
def stages(progress: Any) -> Iterator[Stages]:
    """What a user gave as `progress`: True (a bar on stderr), False, or a function that is told every sentence.

    Raises:
        InputError: it is none of these.
    """
    if progress is True:
        from tqdm import tqdm

        with tqdm(total=0, file=sys.stderr, dynamic_ncols=True, leave=False, mininterval=0.0, bar_format=BAR) as bar:

            def grow(steps: int) -> None:
                bar.total += steps
                bar.refresh()

            def step(sentence: str) -> None:
                bar.set_description_str(sentence, refresh=False)
                bar.update(1)

            yield Stages(bar.set_description_str, grow, step)
    elif progress is False:
        yield Stages()
    elif callable(progress):
        yield Stages(tell=progress)
    else:
        raise InputError(f"progress = {shorten(progress)} is not True, False or a function of one sentence")
