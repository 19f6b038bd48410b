"""A TOML file on its way to objects: complaints name file, line and, for an unknown key, the nearest known one."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from hdfast.errors import ConfigError, InputError, nearest, nobody, shorten
from hdfast.toml_lines import Lines
from hdfast.toml_lines import Path as Keys

OF_A_DRIVE = ("title", "drive", "kinematic_error", "terms")
OF_A_SWEEP = ("scenario", "tolerance", "correlation", "batches", "spec", "run", "trajectories")
OF_A_CAMPAIGN = ("controller", "sensors", "columns", "recording")
KNOWN = (*OF_A_DRIVE, *OF_A_SWEEP, *OF_A_CAMPAIGN)


class Sections:
    """The sections of one file.

    Attributes:
        data: what the parser found.
        name: the file in messages.
        text: the file as read.
    """

    def __init__(self, text: str, name: str) -> None:
        try:
            self.data: dict[str, Any] = tomllib.loads(text)
        except (tomllib.TOMLDecodeError, RecursionError) as error:
            raise ConfigError(f"{name}: {error}") from None
        self.name = name
        self.text = text
        self._lines = Lines(text)
        self.known((), self.data, KNOWN)

    @classmethod
    def read(cls, path: str | Path) -> Sections:
        """Read a file.

        Raises:
            ConfigError: it is not there, is no UTF-8 text or no TOML, or has an unknown section.
        """
        try:
            text = Path(path).read_text(encoding="utf-8-sig")
        except FileNotFoundError:
            raise ConfigError(f"{path}: no such file") from None
        except IsADirectoryError:
            inside = sorted(file.name for file in Path(path).glob("*.toml"))
            listed = f"it holds {', '.join(inside)}" if inside else "it holds no TOML file"
            raise ConfigError(f"{path}: a folder, not a file ({listed[:400]})") from None
        except UnicodeDecodeError as error:
            raise ConfigError(f"{path}: not a UTF-8 text file ({error.reason})") from None
        except (OSError, ValueError) as error:
            raise ConfigError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
        return cls(text, str(path))

    @property
    def title(self) -> str:
        """The key `title`, else the stem of the file."""
        title = self.data.get("title", Path(self.name).stem)
        if not isinstance(title, str):
            raise self.error(("title",), f"title = {shorten(title)} is not text")
        return title

    def error(self, path: Keys, message: str) -> ConfigError:
        """The complaint about a key path, with file and line."""
        line = self._lines.of(path)
        where = f"{self.name}, line {line}" if line else self.name
        return ConfigError(f"{where}: {message}", line)

    def guard(self, path: Keys, action: Callable[..., Any], *arguments: Any) -> Any:
        """Call the action; what it finds wrong gets file and line."""
        try:
            return action(*arguments)
        except ConfigError:
            raise
        except InputError as error:
            raise self.error(path, str(error)) from None

    def known(
        self,
        path: Keys,
        found: Iterable[str],
        allowed: Iterable[str],
        owner: Callable[[str], str] = nobody,
    ) -> None:
        """Refuse keys that are not allowed; `owner` says of one where it belongs."""
        names = list(allowed)
        for key in found:
            if key not in names:
                inside = ".".join(part for part in path if isinstance(part, str))
                section = f"[{inside}] " if inside else ""
                hint = owner(key) or nearest(key, names)
                raise self.error((*path, key), f"{section}unknown key {key!r}{hint} (allowed: {_listed(names)})")

    def section(self, name: str) -> dict[str, Any]:
        """The section [name], empty when the file has none."""
        return self.table((name,), self.data.get(name, {}))

    def table(self, path: Keys, value: Any) -> dict[str, Any]:
        """A value that must be a table."""
        if not isinstance(value, dict):
            name = ".".join(map(str, path))
            raise self.error(path, f"{name} = {shorten(value)} is not a section [{name}]")
        return value

    def listed(self, name: str) -> list[dict[str, Any]]:
        """The sections [[name]] in the order of the file."""
        entries = self.data.get(name, [])
        if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
            raise self.error((name,), f"{name} is not a list of sections [[{name}]]")
        return entries


def _listed(names: list[str]) -> str:
    return ", ".join(names[:24]) + (", ..." if len(names) > 24 else "")
