"""Rows that a logger has written twice."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats


def doubled(columns: Mapping[str, Floats]) -> NDArray[np.bool_]:
    """(n,) rows that say what an earlier row has said, time and all, one after the other or in blocks."""
    t = columns["t"]
    found = np.zeros(len(t), dtype=bool)
    rows = np.flatnonzero(np.isfinite(t))
    if np.unique(t[rows]).size == rows.size:
        return found
    others = [values[rows] for name, values in columns.items() if name != "t"]
    order = np.lexsort([*others, t[rows]])
    alike = np.ones(max(len(order) - 1, 0), dtype=bool)
    for values in [t[rows], *others]:
        before, after = values[order[:-1]], values[order[1:]]
        alike &= (before == after) | (np.isnan(before) & np.isnan(after))
    found[rows[order[1:][alike]]] = True
    return found
