"""Write docs/terms.md, the catalogue of terms, from the compiled core."""

from pathlib import Path

import hdfast
from hdfast.terms import Term

HEAD = """# Terms

Physics beyond the nominal model, in the order in which the terms act. `hdfast.Model(terms=[...])` switches
them on, `[[terms]]` does it in a TOML file; their parameters are columns like all others. Written by
`python tools/terms.py`; a test keeps it current.
"""


def page() -> str:
    """The whole page as Markdown."""
    return HEAD + "".join(section(term) for term in hdfast.terms())


def section(term: Term) -> str:
    """One term: sentence, equation, table of parameters, source."""
    parts = [
        f"\n## {term.id}\n",
        f"{term.description}\n",
        f"Place: {term.place}. Amplitude: `{term.amplitude}`.\n",
        f"    {term.equation}\n",
    ]
    if term.states:
        parts.append("Hidden states: " + ", ".join(f"{name} [{unit}]" for name, unit in term.states) + ".\n")
    parts += ["| parameter | unit | default | plausible | meaning |", "|---|---|--:|---|---|"]
    for p in term.parameters:
        parts.append(f"| `{p.name}` | {p.unit} | {p.default:.4g} | {p.low:.4g} .. {p.high:.4g} | {p.meaning} |")
    parts.append(f"\nSource: {term.source}\n")
    return "\n".join(parts)


if __name__ == "__main__":
    (Path(__file__).parent.parent / "docs" / "terms.md").write_text(page())
