"""Write docs/terms.md and a page with a picture for every term, from the catalogue and the engine.

Usage: python tools/terms.py [text]; with `text` the pictures are left as they are.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import hdfast
from hdfast.terms import Term, TermParameter
from PIL import Image
from signatures import SIGNATURES, draw

DOCS = Path(__file__).parents[1] / "docs"
COLORS = 48
HEAD = """# Terms

Physics beyond the nominal model, in the order in which the terms act. `hdfast.Model(terms=[...])` switches
them on, `[[terms]]` does it in a TOML file; their parameters are columns like all others. Effects at the place
`sensor` act on the channels of a recording: `hdfast.sensors.SensorStage([(effect, channel), ...])`, `[[terms]]` with
the key `channel`, and `[sensors.<channel>]` for what a data sheet says. Every page has the equation, the parameters
and a picture of the effect. Written by `python tools/terms.py`; a test keeps it current.

Symbols of the equations: i ratio; theta_m, omega_m motor, theta_l, omega_l load; phi windup; theta_e kinematic error;
tau_c torque asked of the drive, tau_a what reaches the rotor; tau_fm, tau_fl friction of motor and load shaft without
the viscous part; B both B_m and B_ml; tau_s torque of the spring, tau_h torque beside it, T_g gear torque (tau_g in the
README). *Amplitude* is the parameter that scales an effect, *hidden states* are what it adds to the state of the drive,
*plausible* is the range for a size-25 unit.

| term | place | what it is |
|---|---|---|
"""


def index() -> str:
    """The table of all terms as Markdown."""
    rows = [f"| [{term.id}](terms/{term.id}.md) | {term.place} | {term.description} |" for term in hdfast.terms()]
    return HEAD + "\n".join(rows) + "\n"


def page(term: Term) -> str:
    """One term as Markdown: sentence, equation, picture, parameters, source."""
    place = f"Place: {term.place}. Amplitude: `{term.amplitude}`."
    for what, names in (("Base models", term.bases), ("Channels", term.channels)):
        if names:
            place += f" {what}: {', '.join(f'`{name}`' for name in names)}."
    parts = [
        f"# {term.id}\n",
        f"{term.description}\n",
        f"    {term.equation}\n",
        f"![{term.id}](../images/terms/{term.id}.png)\n",
        f"{SIGNATURES[term.id].caption}\n",
        f"{place}\n",
    ]
    if term.states:
        parts.append("Hidden states: " + ", ".join(f"{name} [{unit}]" for name, unit in term.states) + ".\n")
    parts += ["| parameter | symbol | unit | default | plausible | meaning |", "|---|---|---|--:|---|---|"]
    parts += [row(parameter) for parameter in term.parameters]
    parts.append(f"\nSource: {term.source}\n")
    return "\n".join(parts)


def row(p: TermParameter) -> str:
    """One parameter as a row of the table."""
    return f"| `{p.name}` | {p.symbol} | {p.unit} | {p.default:.4g} | {p.low:.4g} .. {p.high:.4g} | {p.meaning} |"


def picture(term: Term) -> bytes:
    """The signature of a term as PNG with a small palette."""
    buffer = io.BytesIO()
    draw(SIGNATURES[term.id]).savefig(buffer, format="png", dpi=110)
    image = Image.open(buffer).convert("RGB").quantize(COLORS)
    small = io.BytesIO()
    image.save(small, format="png", optimize=True)
    return small.getvalue()


def main() -> None:
    """Write everything."""
    pages, pictures = DOCS / "terms", DOCS / "images" / "terms"
    for folder in (pages, pictures):
        folder.mkdir(parents=True, exist_ok=True)
    (DOCS / "terms.md").write_text(index(), encoding="utf-8")
    for term in hdfast.terms():
        (pages / f"{term.id}.md").write_text(page(term), encoding="utf-8")
        if "text" not in sys.argv[1:]:
            (pictures / f"{term.id}.png").write_bytes(picture(term))


if __name__ == "__main__":
    main()
