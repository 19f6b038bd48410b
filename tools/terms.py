"""Write docs/terms.md, the catalogue of terms, from the compiled core."""

from pathlib import Path

import hdfast
from hdfast.terms import Term

HEAD = """# Terms

Physics beyond the nominal model, in the order in which the terms act. `hdfast.Model(terms=[...])` switches
them on, `[[terms]]` does it in a TOML file; their parameters are columns like all others. Effects at the place
`sensor` act on the channels of a recording: `hdfast.sensors.SensorStage([(effect, channel), ...])`, `[[terms]]` with
the key `channel`, and `[sensors.<channel>]` for what a data sheet says. Written by `python tools/terms.py`; a test
keeps it current.
"""


def page() -> str:
    """The whole page as Markdown."""
    return HEAD + "".join(section(term) for term in hdfast.terms())


def section(term: Term) -> str:
    """One term: sentence, equation, table of parameters, source."""
    parts = [
        f"\n## {term.id}\n",
        f"{term.description}\n",
        f"Place: {term.place}. Amplitude: `{term.amplitude}`.{channels(term)}\n",
        f"    {term.equation}\n",
    ]
    if term.states:
        parts.append("Hidden states: " + ", ".join(f"{name} [{unit}]" for name, unit in term.states) + ".\n")
    parts += ["| parameter | unit | default | plausible | meaning |", "|---|---|--:|---|---|"]
    for p in term.parameters:
        parts.append(f"| `{p.name}` | {p.unit} | {p.default:.4g} | {p.low:.4g} .. {p.high:.4g} | {p.meaning} |")
    parts.append(f"\nSource: {term.source}\n")
    return "\n".join(parts)


def channels(term: Term) -> str:
    """The channels of a sensor effect."""
    return f" Channels: {', '.join(f'`{name}`' for name in term.channels)}." if term.channels else ""


if __name__ == "__main__":
    (Path(__file__).parent.parent / "docs" / "terms.md").write_text(page())
