"""Runs the code of docs/article.md and writes its pictures and docs/claims.md.

Usage: python tools/article.py [FOLDER]; FOLDER is docs unless given.
"""

from __future__ import annotations

import os
import re
import sys
from functools import cache
from pathlib import Path

from hdfast.studies import STUDIES

DOCS = Path(__file__).resolve().parents[1] / "docs"
HEAD = """# The article's claims, decided by computation

Written by `python tools/article.py`.

- Reproduced: every scenario that could show the claim shows it.
- Reproduced under some scenarios: the scenarios disagree; the reason says which shows it.
- Contradictory: none shows it.
- Not reproducible: data or physics is missing.

J_m, J_l: inertia of motor and load; J_M = ratio² J_m, the motor's inertia seen at the output; K: stiffness; A:
amplitude; f: frequency of the torsional mode; TE: transmission error.

| claim | the article says | verdict | why |
|---|---|---|---|
"""


def main() -> int:
    """Run every block of code in the target folder, then write the claims."""
    target = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else DOCS
    text = (DOCS / "article.md").read_text(encoding="utf-8")
    (target / "images" / "article").mkdir(parents=True, exist_ok=True)
    os.chdir(target)
    STUDIES.update({name: cache(study) for name, study in STUDIES.items()})  # the claims ask for them again
    names: dict[str, object] = {}
    for number, block in enumerate(re.findall(r"```python\n(.*?)```", text, re.DOTALL), 1):
        exec(compile(block, f"docs/article.md, block {number}", "exec"), names)
    (target / "claims.md").write_text(claims(), encoding="utf-8")
    return 0


def claims() -> str:
    """Table of all claims in Markdown."""
    found = [claim for make in STUDIES.values() for claim in make().claims]
    lines = [f"| {claim.item} | {claim.text} | {claim.verdict} | {claim.reason} |" for claim in found]
    return HEAD + "\n".join(sorted(lines, key=_number)) + "\n"


def _number(line: str) -> int:
    return int(re.findall(r"\d+", line)[0])


if __name__ == "__main__":
    raise SystemExit(main())
