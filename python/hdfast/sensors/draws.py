"""Random numbers by position: a pure function of seed, name, row and reading, whatever is asked for around them."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats

Words = NDArray[np.uint64]
STEP = np.uint64(0x9E3779B97F4A7C15)


def normal(seed: Sequence[int], name: str, row: NDArray[np.int64], index: NDArray[np.int64]) -> Floats:
    """Standard normal numbers for rows (M, 1) and readings (M, K)."""
    return np.asarray(scipy.special.ndtri(uniform(seed, name, row, index)))


def uniform(seed: Sequence[int], name: str, row: NDArray[np.int64], index: NDArray[np.int64]) -> Floats:
    """Numbers in (0, 1) for rows (M, 1) and readings (M, K): SplitMix64 (Steele, Lea, Flood 2014) as a hash."""
    word = np.zeros(1, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for part in (*seed, zlib.crc32(name.encode())):
            word = _mixed(word + STEP * np.uint64(part % 2**64))
        key = _mixed(word + STEP * row.astype(np.uint64))
        bits = _mixed(key + STEP * index.astype(np.uint64))
    return ((bits >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53


def _mixed(word: Words) -> Words:
    word = word + STEP
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return word ^ (word >> np.uint64(31))
