"""Line numbers of keys in a TOML text, which the parser of the standard library does not report."""

from __future__ import annotations

import re
from collections.abc import Iterator

_HEADER = re.compile(r"^\s*(\[{1,2})\s*([^\[\]]+?)\s*\]{1,2}\s*(#.*)?$")
_KEY = re.compile(r"""^\s*((?:[\w-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[\w-]+|"[^"]*"|'[^']*'))*)\s*=""")
_STRINGS = (r'"{3}(?:\\.|[^\\])*?"{3,5}', r"'{3}.*?'{3,5}", r'"(?:\\.|[^"\\])*"', r"'[^']*'")
_TOKEN = re.compile("|".join([*_STRINGS, r"#[^\n]*", r"[][{}\n]"]), re.DOTALL)
_PART = re.compile(r"""[\w-]+|"[^"]*"|'[^']*'""")

Path = tuple[str | int, ...]


class Lines:
    """Finds the line of a key, or of the nearest enclosing key that has a line of its own.

    The n-th [[section]] of a list is the path ("section", n), counted from 0; without n it is the first.
    """

    def __init__(self, text: str) -> None:
        self._lines: dict[Path, int] = {}
        counts: dict[str, int] = {}
        table: Path = ()
        for number, line in _statements(text):
            if header := _HEADER.match(line):
                table = _path(header[2])
                if header[1] == "[[" and len(table) == 1:
                    counts[header[2]] = counts.get(header[2], 0) + 1
                self._note(table, 0, counts, number)
            elif key := _KEY.match(line):
                self._note((*table, *_path(key[1])), len(table) + 1, counts, number)

    def _note(self, path: Path, shortest: int, counts: dict[str, int], number: int) -> None:
        for length in range(shortest, len(path) + 1) if shortest else (len(path),):
            self._lines.setdefault(path[:length], number)
            if path[0] in counts:
                self._lines.setdefault((path[0], counts[str(path[0])] - 1, *path[1:length]), number)

    def of(self, path: Path) -> int | None:
        """Line of a key path counted from 1, None when no part of it is found."""
        for length in range(len(path), 0, -1):
            if path[:length] in self._lines:
                return self._lines[path[:length]]
        for known, number in self._lines.items():
            if known[: len(path)] == path:
                return number
        return None


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Lines that begin outside of any value, with their numbers."""
    begun, depth = 1, 0
    inside: set[int] = set()
    for token in _TOKEN.findall(text):
        depth += (token in ("[", "{")) - (token in ("]", "}"))
        following = range(begun + 1, begun + 1 + token.count("\n"))
        if depth or token != "\n":
            inside.update(following)
        begun += len(following)
    return ((number, line) for number, line in enumerate(text.split("\n"), 1) if number not in inside)


def _path(text: str) -> Path:
    return tuple(part.strip("\"'") for part in _PART.findall(text))
