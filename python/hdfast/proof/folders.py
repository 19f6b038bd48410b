"""Where a set of cases keeps what is public, what is sealed, and what was answered."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Folders:
    """The folders of a set below one root."""

    root: Path

    @property
    def cases(self) -> Path:
        """Cases, all that a tool may see."""
        return self.root / "cases"

    @property
    def names(self) -> list[str]:
        """The cases' names in order, which is by chance: a name is drawn, and says nothing of its case."""
        return sorted(p.name for p in self.cases.iterdir() if p.is_dir())

    @property
    def sealed(self) -> Path:
        """Labels and salt."""
        return self.root / "sealed"

    @property
    def seal(self) -> Path:
        """Public checksums."""
        return self.root / "seal.json"

    def answers(self, tool: str) -> Path:
        """Answers of one tool."""
        return self.root / "answers" / tool

    def further(self, motion: str) -> Path:
        """Cases with one more recording, of a kind of motion."""
        return self.root / "further" / motion
