"""Rows held against the same rows of another sweep, bit by bit."""

from __future__ import annotations

import hdfast
import numpy as np


def same(one, other, chosen=slice(None)):
    """Every number of some rows (index or slice)."""
    np.testing.assert_array_equal(one.final_state[chosen], other.final_state[chosen])
    np.testing.assert_array_equal(one.steps[chosen], other.steps[chosen])
    for name in {**one.metrics, **one.samples}:
        np.testing.assert_array_equal(one[name][chosen], other[name][chosen])


def same_on_every_path(expected, again, monkeypatch):
    """A sweep run again on every path this CPU has."""
    for path in hdfast.build_info()["simd_available"]:
        monkeypatch.setenv("HDFAST_SIMD", path)
        same(expected, again())
