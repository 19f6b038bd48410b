"""The cubic spline through samples, row by row."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats

STEEPER = 4.0  # than the two pieces before and the two after; a sine is at most 3 times as steep, at an end


class Spline:
    """The C2 cubic spline (not-a-knot) through samples of many rows, continued beyond both ends.

    Every operation is element by element over the rows, so that a row has the same bits in any company. A row may end
    in NaN; the spline is NaN from there on.

    Args:
        t: knots [s], shape (T,), strictly increasing, T of at least 4.
        x: samples, shape (..., T).
        moving: continue beyond the ends at the speed there; else hold the value, and pass jumps in a straight line.
        jumps: pieces over which what is held jumps, shape (..., T-1); default those far steeper than the ones around.
    """

    def __init__(self, t: Floats, x: Floats, *, moving: bool, jumps: NDArray[np.bool_] | None = None) -> None:
        self.t = t
        known = np.isfinite(x)
        self._end = np.where(known.all(axis=-1), np.inf, t[np.maximum(known.sum(axis=-1) - 1, 0)])
        self._end[~known[..., 0]] = -np.inf
        self.x = x if known.all() else _held(x, known)
        h = np.diff(t)
        slope = np.diff(self.x, axis=-1) / h
        self.jumps = _jumps(slope) if jumps is None and not moving else jumps
        straight: Floats | float = 0.0
        if self.jumps is not None and self.jumps.any():
            straight = np.where(self.jumps, slope - _around(slope), 0.0)
            slope = slope - straight
        self.rates = _knot_rates(h, slope)
        before, after = self.rates[..., :-1], self.rates[..., 1:]
        c2 = (3.0 * slope - 2.0 * before - after) / h
        c3 = (before + after - 2.0 * slope) / h**2
        zero = np.zeros((*x.shape[:-1], 1))
        ends = self.rates[..., [0, -1]] if moving else np.concatenate([zero, zero], axis=-1)
        self.start_rate = ends[..., :1]
        self._anchor = np.concatenate([t[:1], t])
        self._c = (
            np.concatenate([self.x[..., :1], self.x], axis=-1),
            np.concatenate([ends[..., :1], before + straight, ends[..., 1:]], axis=-1),
            np.concatenate([zero, c2, zero], axis=-1),
            np.concatenate([zero, c3, zero], axis=-1),
        )

    def coefficients(self, power: int) -> Floats:
        """Coefficients of (s - t_k)^power, 0 to 3, between the knots, shape (..., T-1)."""
        return self._c[power][..., 1:-1]

    def at(self, s: Floats) -> Floats:
        """Values at the times s [s], shape (M, K) for all rows or (..., K)."""
        u, (c0, c1, c2, c3) = self._found(s, self._c)
        return self.until_end(s, c0 + u * (c1 + u * (c2 + u * c3)))

    def rate(self, s: Floats) -> Floats:
        """Derivatives by time at the times s."""
        u, (c1, c2, c3) = self._found(s, self._c[1:])
        return self.until_end(s, c1 + u * (2.0 * c2 + u * (3.0 * c3)))

    def area(self, s: Floats) -> Floats:
        """Integrals from the first knot to the times s, also beyond the end of a row."""
        h = np.diff(self.t)
        c0, c1, c2, c3 = (self.coefficients(power) for power in range(4))
        whole = np.cumsum(h * (c0 + h * (c1 / 2.0 + h * (c2 / 3.0 + h * c3 / 4.0))), axis=-1)
        zero = np.zeros((*whole.shape[:-1], 1))
        before = np.concatenate([zero, zero, whole], axis=-1)
        u, (start, b0, b1, b2, b3) = self._found(s, [before, *self._c])
        return np.asarray(start + u * (b0 + u * (b1 / 2.0 + u * (b2 / 3.0 + u * b3 / 4.0))))

    def until_end(self, s: Floats, values: Floats) -> Floats:
        """Values that belong to the times s, NaN where the row has ended."""
        ends = self._end[..., None]
        return np.asarray(values if np.isposinf(ends).all() else np.where(s <= ends, values, np.nan), dtype=np.float64)

    def _found(self, s: Floats, tables: Sequence[Floats]) -> tuple[Floats, list[Floats]]:
        """Time since the knot before, and what the tables (..., T + 1) hold of the piece between."""
        piece = np.searchsorted(self.t, s, side="right")
        wide = np.broadcast_to(piece, (*self.x.shape[:-1], piece.shape[-1]))
        found = [np.take_along_axis(table, wide, axis=-1) for table in tables]
        return np.asarray(s - self._anchor[piece]), found


def _held(x: Floats, known: NDArray[np.bool_]) -> Floats:
    last = np.where(known.any(axis=-1), known.sum(axis=-1) - 1, 0)
    value = np.nan_to_num(np.take_along_axis(x, last[..., None], axis=-1))
    return np.asarray(np.where(known, x, value))


def _jumps(slope: Floats) -> NDArray[np.bool_]:
    steep = np.abs(slope)
    held = np.zeros((*slope.shape[:-1], 2))
    near = np.concatenate([held, steep, held], axis=-1)
    pairs = np.maximum(near[..., :-1], near[..., 1:])
    return np.asarray(steep > STEEPER * np.maximum(pairs[..., :-3], pairs[..., 3:]))


def _around(slope: Floats) -> Floats:
    """Mean slope of the pieces before and after, 0 beyond the ends."""
    held = np.zeros((*slope.shape[:-1], 1))
    return np.asarray(
        0.5 * np.concatenate([held, slope[..., :-1]], axis=-1) + 0.5 * np.concatenate([slope[..., 1:], held], axis=-1)
    )


def _knot_rates(h: Floats, slope: Floats) -> Floats:
    """Derivatives at the knots, (..., T): continuous curvature, one cubic over the first and the last two pieces."""
    size = len(h) + 1
    lower, diagonal, upper = np.zeros(size), np.empty(size), np.zeros(size)
    by_piece = np.moveaxis(slope, -1, 0)
    right = np.empty((size, *by_piece.shape[1:]))
    lower[1:-1], diagonal[1:-1], upper[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * np.moveaxis(h[1:] * slope[..., :-1] + h[:-1] * slope[..., 1:], -1, 0)
    for k, (near, far), (first, second) in (
        (0, (h[0], h[1]), (by_piece[0], by_piece[1])),
        (-1, (h[-1], h[-2]), (by_piece[-1], by_piece[-2])),
    ):
        both = near + far
        diagonal[k] = far
        right[k] = ((near + 2.0 * both) * far * first + near**2 * second) / both
    upper[0], lower[-1] = h[0] + h[1], h[-1] + h[-2]
    banded = np.zeros((3, size))
    banded[0, 1:], banded[1], banded[2, :-1] = upper[:-1], diagonal, lower[1:]
    rates = scipy.linalg.solve_banded((1, 1), banded, right.reshape(size, -1), check_finite=False).reshape(right.shape)
    return np.ascontiguousarray(np.moveaxis(rates, 0, -1))
