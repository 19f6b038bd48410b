"""Random numbers that can be asked for by position: the same bits however the rows are cut into pieces."""

from __future__ import annotations

import zlib

import numpy as np

from hdfast.checks import Floats


def key(name: str) -> int:
    """A number for a name, the same on every machine and in every process."""
    return zlib.crc32(name.encode())


def stream(seed: int, name: str, start: int, count: int) -> Floats:
    """(count,) uniform numbers in [0, 1) of the stream of a name, from position `start` on."""
    bits = np.random.PCG64([seed, key(name)])
    bits.advance(start)
    return np.random.Generator(bits).random(count)


def block_stream(seed: int, name: str, block: int) -> np.random.Generator:
    """A generator of its own for one block of a name."""
    return np.random.default_rng([seed, key(name), 1, block])
