"""MAT files of version 5: numeric arrays and fields of structs, read without trust in what the file says of itself.

MathWorks, "MAT-File Format": a header of 128 bytes, then elements of type, size and data, whole variables compressed.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError
from hdfast.recordings.formats.source import Source, Wanted, check_size, one_dimensional

HEADER = 128
MATRIX, COMPRESSED = 14, 15
STRUCT, OPAQUE = 2, 17  # opaque: strings, dates and tables, whose head has a name and no shape
NUMERIC = range(6, 16)
COMPLEX = 0x800
DTYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
PREFIX = 4096
DEEPEST = 8


@dataclass(frozen=True)
class Element:
    """One element of a file: its type and its bytes."""

    kind: int
    data: memoryview


@dataclass(frozen=True)
class Matrix:
    """The head of an array: class, flags, shape, name and the elements that follow."""

    kind: int
    flags: int
    shape: tuple[int, ...]
    name: str
    rest: memoryview


def read(path: Path, wanted: Wanted) -> Source:
    """Read the wanted variables, "run.angle" being the field `angle` of the struct `run`.

    Raises:
        InputError: naming the file and the variable.
    """
    return _Reader(path, wanted).source()


class _Reader:
    """Walks through the elements of one file."""

    def __init__(self, path: Path, wanted: Wanted) -> None:
        self.path = path
        self.wanted = wanted
        self.names: list[str] = []
        self.columns: dict[str, Floats] = {}
        self.order = "<"

    def source(self) -> Source:
        data = memoryview(self.path.read_bytes())
        if len(data) < HEADER or bytes(data[126:128]) not in (b"IM", b"MI"):
            raise InputError(f"{self.path}: not a MAT file of version 5 or 7; save it with -v7 or -v7.3")
        self.order = "<" if bytes(data[126:128]) == b"IM" else ">"
        for element in self.elements(data[HEADER:]):
            self.variable(element)
        return Source(self.names, self.columns)

    def elements(self, data: memoryview) -> Iterator[Element]:
        place = 0
        while place + 8 <= len(data):
            kind, size = struct.unpack(self.order + "II", data[place : place + 8])
            if kind >> 16:
                yield Element(kind & 0xFFFF, self.cut(data, place + 4, kind >> 16))
                place += 8
                continue
            yield Element(kind, self.cut(data, place + 8, size))
            place += 8 + size + (0 if kind == COMPRESSED else -size % 8)

    def cut(self, data: memoryview, begin: int, size: int) -> memoryview:
        if begin + size > len(data):
            raise InputError(f"{self.path}: the file ends within a variable")
        return data[begin : begin + size]

    def variable(self, element: Element) -> None:
        if element.kind == COMPRESSED:
            start = zlib.decompressobj().decompress(element.data, PREFIX)
            head = self.head(memoryview(start)[8:])
            if not any(name.split(".", maxsplit=1)[0] == head.name for name in self.wanted):
                self.names.append(head.name)
                return
            limit = int(checks.memory_limit() / 4.0)
            opened = zlib.decompressobj().decompress(element.data, limit)
            if len(opened) >= limit:
                raise InputError(f"{self.path}: variable {head.name!r} needs more than {limit / 1e9:.3g} GB")
            for inner in self.elements(memoryview(opened)):
                self.matrix(inner, "", 0)
        else:
            self.matrix(element, "", 0)

    def head(self, data: memoryview) -> Matrix:
        """Flags, shape and name, from the front of an array that may be cut off behind them."""
        parts: list[memoryview] = []
        place = 0
        for _ in range(3):
            kind, size = struct.unpack(self.order + "II", self.cut(data, place, 8))
            small = kind >> 16
            parts.append(self.cut(data, place + 4, small) if small else self.cut(data, place + 8, size))
            place += 8 if small else 8 + size + -size % 8
        flags = struct.unpack(self.order + "I", self.cut(parts[0], 0, 4))[0]
        kind = flags & 0xFF
        sizes, name = (parts[0][:0], parts[1]) if kind == OPAQUE else (parts[1], parts[2])
        shape = tuple(int(size) for size in np.frombuffer(sizes, self.order + "i4"))
        return Matrix(kind, flags, shape, bytes(name).decode("latin-1"), data[place:])

    def matrix(self, element: Element, prefix: str, depth: int) -> None:
        if element.kind != MATRIX or not len(element.data):
            return
        head = self.head(element.data)
        name = prefix + head.name if depth == 0 else prefix
        if head.kind == STRUCT and head.shape == (1, 1) and depth < DEEPEST:
            self.fields(head, name, depth)
            return
        self.names.append(name)
        if name not in self.wanted:
            return
        if head.kind not in NUMERIC or head.flags & COMPLEX:
            raise InputError(f"{self.path}: column {name!r} holds no real numbers")
        one_dimensional(self.path, name, head.shape)
        check_size(self.path, max(head.shape))
        part = next(self.elements(head.rest), None)
        if part is None or part.kind not in DTYPES:
            raise InputError(f"{self.path}: column {name!r} holds no numbers")
        values = np.frombuffer(part.data, np.dtype(self.order + DTYPES[part.kind])).astype(np.float64)
        if values.size != np.prod(head.shape):
            raise InputError(f"{self.path}: column {name!r} holds {values.size} numbers, its shape is {head.shape}")
        self.columns[name] = values

    def fields(self, head: Matrix, name: str, depth: int) -> None:
        parts = self.elements(head.rest)
        width, names = next(parts, None), next(parts, None)
        if width is None or names is None:
            raise InputError(f"{self.path}: the struct {name!r} has no fields")
        size = struct.unpack(self.order + "I", self.cut(width.data, 0, 4))[0]
        starts = range(0, len(names.data), max(size, 1))
        labels = [bytes(names.data[k : k + size]).split(b"\0")[0].decode("latin-1") for k in starts]
        for label, element in zip(labels, parts, strict=False):
            self.matrix(element, f"{name}.{label}", depth + 1)
