"""What is printed: plain-text and HTML tables from rows of strings, and JSON."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Sequence
from typing import Any

from hdfast.files import json_ready


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """A table aligned with spaces; columns listed in `right` are right-aligned."""
    widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    lines = []
    for row in [header, ["-" * width for width in widths], *rows]:
        cells = [
            cell.rjust(width) if i in right else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def html_table(header: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """The same as an HTML table, every cell escaped."""

    def cells(tag: str, row: Sequence[str]) -> str:
        styles = [' class="n"' if i in right else "" for i in range(len(row))]
        return "".join(f"<{tag}{style}>{html.escape(cell)}</{tag}>" for cell, style in zip(row, styles, strict=True))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<table><thead><tr>{cells('th', header)}</tr></thead><tbody>{body}</tbody></table>"


def enumerated(names: Sequence[str]) -> str:
    """Names as in a sentence: "a, b and c"."""
    *others, last = names or [""]
    return f"{', '.join(others)} and {last}" if others else last


def percent(share: float, digits: int = 1) -> str:
    """A share in percent, a dash where there is none."""
    return f"{100.0 * share:.{digits}f} %" if math.isfinite(share) else "-"


def percents(before: float, after: float) -> tuple[str, str]:
    """Two shares in percent, with as many digits, up to three, as it takes to tell them apart."""
    shown = [(percent(before, digits), percent(after, digits)) for digits in (1, 2, 3)]
    return next((pair for pair in shown if pair[0] != pair[1]), shown[0])


def share_text(share: float, digits: int = 2) -> str:
    """A share in percent, 100 only where it is all; "not known" where there is none."""
    return "not known" if math.isnan(share) else f"{_percentage(share, digits)} %"


def interval_text(interval: tuple[float, float], digits: int = 2) -> str:
    """The same of both ends of an interval of a share."""
    low, high = interval
    return "not known" if math.isnan(low) else f"{_percentage(low, digits)} .. {_percentage(high, digits)} %"


def _percentage(share: float, digits: int) -> str:
    """With as many digits more as it takes not to round up to 100."""
    text = f"{100.0 * share:.{digits}f}"
    return _percentage(share, digits + 1) if share < 1.0 and float(text) == 100.0 and digits < 15 else text


def moment(t: float) -> str:
    """A time [s], also one on a clock that counts from 1970, to six digits or to the millisecond."""
    return f"{t:.6g}" if abs(t) < 1e3 else f"{t:.3f}"


def json_text(numbers: Any) -> str:
    """JSON; null where a number is not finite."""
    return json.dumps(json_ready(numbers), indent=2, allow_nan=False)
