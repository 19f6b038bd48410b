"""What can be wrong with a call, as typed exceptions whose text names the argument, its value and what is allowed."""

from __future__ import annotations

import copyreg
import difflib
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hdfast.result import SweepResult


class Carrying:
    """Beside an exception whose class takes more than a message: what it carries comes along from another process."""

    args: tuple[Any, ...]

    def __reduce__(self) -> tuple[Any, ...]:
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class InputError(ValueError):
    """An argument cannot mean anything; raised before anything runs."""


class ParameterError(InputError):
    """A parameter name is unknown, given twice, or its column cannot be used."""


class RowError(Carrying, InputError):
    """With `strict=True`: the first row that cannot be simulated, found before any is run to its end.

    Attributes:
        row: index of the row.
        parameter: name of the offending parameter.
    """

    def __init__(self, message: str, row: int, parameter: str) -> None:
        super().__init__(message)
        self.row = row
        self.parameter = parameter


class ConfigError(InputError):
    """A configuration file is wrong.

    Attributes:
        line: line number in the file, counted from 1, or None when it has none.
    """

    def __init__(self, message: str, line: int | None = None) -> None:
        super().__init__(message)
        self.line = line


class MissingPackageError(ImportError):
    """An optional package is needed for this call."""


class Interrupted(Carrying, KeyboardInterrupt):
    """Ctrl-C ended the sweep; rows that had finished are kept.

    Attributes:
        result: the `SweepResult`; unfinished rows have the status "cancelled".
    """

    def __init__(self, result: SweepResult) -> None:
        counts = result.status_counts()
        super().__init__(f"interrupted: {counts.get('finished', 0)} of {len(result)} rows finished")
        self.result = result


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint such as `"; did you mean 'J_l'?"`, empty when nothing comes close."""
    folded = {candidate.casefold(): candidate for candidate in known}
    given = str(name)[:80].casefold()
    found = sorted((one for one in folded if given and one.startswith(given)), key=len)
    found = found or difflib.get_close_matches(given, list(folded), n=1, cutoff=0.6)
    return f"; did you mean {folded[found[0]]!r}?" if found else ""


def shorten(value: object, limit: int = 60) -> str:
    """The repr of a value, cut to a length that fits a message."""
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def nobody(_: str) -> str:
    """Whose a name is, in words, where that is not known."""
    return ""


def choose(argument: str, value: object, known: Iterable[str], owner: Callable[[str], str] = nobody) -> str:
    """Check that a value is one of the known names and return it; `owner` says of another where it belongs.

    Raises:
        InputError: naming the argument, the value, the nearest and all allowed names.
    """
    names = list(known)
    if isinstance(value, str) and value in names:
        return value
    hint = owner(value) or nearest(value, names) if isinstance(value, str) else ""
    listed = ", ".join(names[:40]) + (", ..." if len(names) > 40 else "")
    raise InputError(f"{argument} = {shorten(value)} is not known{hint} (allowed: {listed})")


def require_package(name: str, extra: str) -> None:
    """Raise `MissingPackageError` with the command that installs an optional package, of an extra of hdfast."""
    import importlib.util

    if importlib.util.find_spec(name) is None:
        raise MissingPackageError(
            f"{name} is not installed: run  python -m pip install {name}  (extra {extra!r} of hdfast)"
        )
