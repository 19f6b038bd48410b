"""The cubic spline through samples: what a sampled quantity did between its samples."""

from __future__ import annotations

import numpy as np

from hdfast.checks import Floats


class Curve:
    """The C2 cubic spline (not-a-knot) through samples of M rows, continued beyond both ends.

    Every operation is element by element over the rows, so that a row has the same bits in any company. A row may end
    in NaN; the curve is NaN from there on.

    Args:
        t: knots [s], shape (T,), strictly increasing, T of at least 4.
        x: samples, shape (M, T).
        moving: continue beyond the ends at the speed there; else hold the value.
    """

    def __init__(self, t: Floats, x: Floats, *, moving: bool) -> None:
        self.t = t
        known = np.isfinite(x)
        self._end = np.where(known.all(axis=1), np.inf, t[np.maximum(known.sum(axis=1) - 1, 0)])
        self._end[~known[:, 0]] = -np.inf
        filled = x if known.all() else _held(x, known)
        h = np.diff(t)
        slope = np.diff(filled, axis=1) / h
        d = _knot_slopes(h, slope)
        c2 = (3.0 * slope - 2.0 * d[:, :-1] - d[:, 1:]) / h
        c3 = (d[:, :-1] + d[:, 1:] - 2.0 * slope) / h**2
        ends = d[:, [0, -1]] if moving else np.zeros((len(x), 2))
        zero = np.zeros((len(x), 1))
        self.x = filled
        self.start_slope = ends[:, 0]
        self._anchor = np.concatenate([t[:1], t])
        self._c = (
            np.concatenate([filled[:, :1], filled], axis=1),
            np.concatenate([ends[:, :1], d[:, :-1], ends[:, 1:]], axis=1),
            np.concatenate([zero, c2, zero], axis=1),
            np.concatenate([zero, c3, zero], axis=1),
        )

    def pieces(self) -> tuple[Floats, ...]:
        """Coefficients of (s - t_k)^0 ... (s - t_k)^3 between the knots, each (M, T-1)."""
        return tuple(c[:, 1:-1] for c in self._c)

    def at(self, s: Floats) -> Floats:
        """Values at the times s [s], shape (M, K)."""
        piece, u = self._locate(s)
        c0, c1, c2, c3 = (np.take_along_axis(c, piece, axis=1) for c in self._c)
        return self._known(s, c0 + u * (c1 + u * (c2 + u * c3)))

    def mean(self, s: Floats, window: Floats) -> Floats:
        """Mean over [s - window, s], exactly, shape (M, K); the value at s where the window is zero."""
        width = np.where(window > 0.0, window, 1.0)
        area = (self._area(s) - self._area(s - width)) / width
        return self._known(s, np.where(window > 0.0, area, self.at(s)))

    def _area(self, s: Floats) -> Floats:
        h = np.diff(self.t)
        c0, c1, c2, c3 = self.pieces()
        whole = np.cumsum(h * (c0 + h * (c1 / 2.0 + h * (c2 / 3.0 + h * c3 / 4.0))), axis=1)
        zero = np.zeros((len(whole), 1))
        before = np.concatenate([zero, zero, whole], axis=1)
        piece, u = self._locate(s)
        b0, b1, b2, b3 = (np.take_along_axis(c, piece, axis=1) for c in self._c)
        inside = u * (b0 + u * (b1 / 2.0 + u * (b2 / 3.0 + u * b3 / 4.0)))
        return np.asarray(np.take_along_axis(before, piece, axis=1) + inside)

    def _locate(self, s: Floats) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.intp]], Floats]:
        piece = np.searchsorted(self.t, s, side="right")
        return piece, np.asarray(s - self._anchor[piece])

    def _known(self, s: Floats, values: Floats) -> Floats:
        ends = self._end[:, None]
        return np.asarray(values if np.isposinf(ends).all() else np.where(s <= ends, values, np.nan), dtype=np.float64)


def _held(x: Floats, known: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Floats:
    last = np.where(known.any(axis=1), known.sum(axis=1) - 1, 0)
    value = np.nan_to_num(np.take_along_axis(x, last[:, None], axis=1))
    return np.asarray(np.where(known, x, value))


def _knot_slopes(h: Floats, slope: Floats) -> Floats:
    """Slopes at the knots, (M, T): continuous curvature, one cubic over the first and the last two pieces."""
    rows, size = len(slope), len(h) + 1
    lower, diagonal, upper = np.zeros(size), np.empty(size), np.zeros(size)
    right = np.empty((size, rows))
    by_piece = slope.T
    lower[1:-1], diagonal[1:-1], upper[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * (h[1:, None] * by_piece[:-1] + h[:-1, None] * by_piece[1:])
    for k, (near, far), (first, second) in (
        (0, (h[0], h[1]), (by_piece[0], by_piece[1])),
        (-1, (h[-1], h[-2]), (by_piece[-1], by_piece[-2])),
    ):
        both = near + far
        diagonal[k] = far
        right[k] = ((near + 2.0 * both) * far * first + near**2 * second) / both
    upper[0], lower[-1] = h[0] + h[1], h[-1] + h[-2]
    for k in range(1, size):
        factor = lower[k] / diagonal[k - 1]
        diagonal[k] -= factor * upper[k - 1]
        right[k] -= factor * right[k - 1]
    right[-1] /= diagonal[-1]
    for k in range(size - 2, -1, -1):
        right[k] = (right[k] - upper[k] * right[k + 1]) / diagonal[k]
    return np.ascontiguousarray(right.T)
