"""Who else answers the cases."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from hdfast.errors import require_package
from hdfast.proof.rivals.ablations import ABLATIONS

RIVALS = {
    "refit": "refit of the nominal model, nothing else",
    "whiteness": "alarm of residual tests at 99 %, names nothing",
    "forward_bic": "forward selection over the same library by BIC with independent samples",
    "sparse_regression": "bagged sparse regression (pysindy) over the same terms",
}


@dataclass(frozen=True)
class Contender:
    """Somebody who answers the same cases.

    Attributes:
        name: for tables and for the folder of answers.
        text: what it does, in one sentence.
        command: answers one case; with the places {campaign} and {out}.
        rival: True for a strategy of its own, False for the diagnosis without one of its parts.
    """

    name: str
    text: str
    command: Sequence[str]
    rival: bool


def rivals() -> list[Contender]:
    """Other strategies.

    Raises:
        MissingPackageError: pysindy is not installed.
    """
    require_package("pysindy", "proof")
    return [Contender(name, text, command(name), True) for name, text in RIVALS.items()]


def ablations() -> list[Contender]:
    """The diagnosis without one of its parts."""
    return [Contender(name, one.text, command(name), False) for name, one in ABLATIONS.items()]


def command(name: str) -> tuple[str, ...]:
    """The command that answers one case."""
    return (sys.executable, "-m", "hdfast.proof.rivals", name, "{campaign}", "{out}")
