"""Text tables: comma, semicolon or tab between the columns, decimal point or comma, an optional line of units."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hdfast.errors import InputError, shorten
from hdfast.recordings.formats.source import Source, Wanted, check_memory, check_size
from hdfast.recordings.units import known_unit

SEPARATORS = (";", "\t", ",")
LINE_END = r"\r\n|\r|\n"
OPEN_END = "the last line has no line end: if the file was cut short, so may be its last number"
DECIMAL_COMMA = "; decimal commas need ; or tab between columns"
DATES = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}([ T].*)?|\d{1,2}:\d{2}.*")
THOUSANDS = re.compile(r"[+-]?\d{1,3}([., ]\d{3})+([.,]\d*)?")
SEPARATOR_LINE = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
MISSING = ("", "nan", "NaN", "NAN", "NA", "null")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_PART = re.compile(r"[+-]?\d+([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Layout:
    """How a text is written: separator, names, units and the number of the first line with samples."""

    separator: str
    names: list[str]
    units: dict[str, str]
    first: int


def read(path: Path, wanted: Wanted) -> Source:
    """Read a text table with a header line; lines that begin with # are skipped.

    While it is taken apart, about four copies of the text stand in memory.

    Raises:
        InputError: naming file, line and column.
    """
    check_memory(path, "its lines of text", path.stat().st_size)
    text, notes = _decode(path)
    every = re.split(LINE_END, text.removeprefix("\ufeff"))
    if _counts(every[-1]):
        notes = (*notes, OPEN_END)
    lines = [(number, line) for number, line in enumerate(every, 1) if _counts(line)]
    layout = _layout(path, lines)
    body = [(number, line) for number, line in lines if number >= layout.first]
    check_size(path, len(body), len(layout.names))
    columns = _fast(body, layout, wanted)
    if columns is None:
        columns = _exact(path, body, layout, wanted)
    return Source([name for name in layout.names if name], columns, layout.units, notes)


def _decode(path: Path) -> tuple[str, tuple[str, ...]]:
    data = path.read_bytes()
    if not data.strip():
        raise InputError(f"{path}: the file is empty")
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            try:
                return data.decode(encoding), ()
            except UnicodeDecodeError as error:
                raise InputError(f"{path}: not {encoding} text at byte {error.start}") from None
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        raise InputError(f"{path}, line {line}: not a text file (byte 0)")
    try:
        return data.decode("utf-8"), ()
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace"), ("read as Windows-1252 text",)


def _counts(line: str) -> bool:
    stripped = line.strip()
    return bool(stripped) and not stripped.startswith("#")


def _fields(line: str, separator: str) -> list[str]:
    return [item.strip() for item in next(csv.reader([line], delimiter=separator))]


def _layout(path: Path, lines: list[tuple[int, str]]) -> Layout:
    if not lines:
        raise InputError(f"{path}: no header line with the names of the columns")
    if SEPARATOR_LINE.fullmatch(lines[0][1].strip()):
        return _layout(path, lines[1:])
    number, header = lines[0]
    separator = next((item for item in SEPARATORS if item in header), ",")
    names = _fields(header, separator)
    if any(_NUMBER.fullmatch(name) for name in names):
        raise InputError(
            f"{path}, line {number}: the header line holds the number {next(filter(_NUMBER.fullmatch, names))!r}, "
            "not only names of columns"
        )
    twice = next((name for name in names if name and names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{path}, line {number}: two columns are named {twice!r}: rename one")
    units: dict[str, str] = {}
    following = lines[1:2]
    if following:
        stated = _fields(following[0][1], separator)
        bare = [item.strip("[]() ") for item in stated]
        if any(bare) and len(bare) <= len(names) and all(known_unit(item) for item in bare if item):
            units = {name: unit for name, unit in zip(names, bare, strict=False) if unit}
            following = lines[2:3]
    if not following:
        raise InputError(f"{path}: no samples after the header line")
    return Layout(separator, names, units, following[0][0])


def _fast(body: list[tuple[int, str]], layout: Layout, wanted: Wanted) -> dict[str, Any] | None:
    """The wanted columns, None when anything but plain numbers stands in the text."""
    import pyarrow as pa
    from pyarrow import csv as arrow

    text = "\n".join(line for _, line in body)
    comma = layout.separator != "," and "," in text
    if comma and "." in text:
        return None
    names = [name or f"\0{position}" for position, name in enumerate(layout.names)]
    used = [name for name in names if name in wanted]
    if not used:
        return {}
    try:
        table = arrow.read_csv(
            io.BytesIO(text.encode()),
            read_options=arrow.ReadOptions(column_names=names, use_threads=False),
            parse_options=arrow.ParseOptions(delimiter=layout.separator),
            convert_options=arrow.ConvertOptions(
                decimal_point="," if comma else ".",
                column_types=dict.fromkeys(used, pa.float64()),
                include_columns=used,
                null_values=list(MISSING),
            ),
        )
    except pa.ArrowInvalid:
        return None
    return {name: table.column(name).to_numpy() for name in used}


def _exact(path: Path, body: list[tuple[int, str]], layout: Layout, wanted: Wanted) -> dict[str, Any]:
    """As `_fast`, line by line, naming the first line and column that is wrong."""
    used = [(position, name) for position, name in enumerate(layout.names) if name in wanted]
    values = np.empty((len(body), len(used)))
    marks: set[str] = set()
    for row, (number, cells) in enumerate(_rows(path, body, layout)):
        for place, (position, name) in enumerate(used):
            cell = cells[position]
            where = f"{path}, line {number}, column {name!r}"
            values[row, place] = _number(where, cell)
            marks.update(mark for mark in ".," if mark in cell)
            if marks == {","} and layout.separator == ",":
                raise InputError(f"{where}: {shorten(cell)} has a decimal comma{DECIMAL_COMMA}")
            if len(marks) > 1:
                raise InputError(f"{where}: {shorten(cell)} mixes decimal comma and decimal point")
    return {name: values[:, place].copy() for place, (_, name) in enumerate(used)}


def _rows(path: Path, body: list[tuple[int, str]], layout: Layout) -> Iterator[tuple[int, list[str]]]:
    size = len(layout.names)
    for number, line in body:
        cells = _fields(line, layout.separator)
        while len(cells) > size and not cells[-1]:
            cells.pop()
        if len(cells) != size:
            hint = DECIMAL_COMMA if layout.separator == "," and _halved(cells, size) else ""
            raise InputError(f"{path}, line {number}: {len(cells)} values, the header line has {size} names{hint}")
        yield number, cells


def _halved(cells: list[str], size: int) -> bool:
    """Whether these look like so many numbers, some of them cut in two at a decimal comma."""
    return size < len(cells) <= 2 * size and all(_PART.fullmatch(cell) for cell in cells)


def _number(where: str, cell: str) -> float:
    if cell in MISSING:
        return float("nan")
    if not _NUMBER.fullmatch(cell):
        hint = "; write times in seconds" if DATES.fullmatch(cell) else ""
        hint = hint or ("; write it without marks between thousands" if THOUSANDS.fullmatch(cell) else "")
        raise InputError(f"{where}: {shorten(cell)} is not a number{hint}")
    return float(cell.replace(",", "."))
