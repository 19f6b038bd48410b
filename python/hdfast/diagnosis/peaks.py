"""How unlikely each place of a spectrum is, if the spectrum were smooth there."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy

from hdfast.checks import Floats

TAPERS = 2
NEIGHBOURS, FEWEST = 7, 2
PADDED = 8
NODES, FINEST = 200, 4
RATIOS = np.logspace(-1.0, 8.0, 400)
LEAST = 1e-300


class Spectrum:
    """Multitaper spectrum of a signal, with sine tapers, averaged over pieces that do not overlap.

    Attributes:
        cell: width of a line, at which two places are independent, in cycles per unit of x.
    """

    def __init__(self, x: Floats, values: Floats, pieces: int) -> None:
        """Spectrum of values (n,) over rising x (n,)."""
        n = len(x) // pieces
        even = np.interp(np.linspace(x[0], x[-1], n * pieces), x, values).reshape(pieces, n)
        power = np.linspace(-1.0, 1.0, n)[:, None] ** np.arange(3)
        rest = even - (power @ np.linalg.lstsq(power, even.T, rcond=None)[0]).T
        k, j = np.arange(1, TAPERS + 1)[:, None], np.arange(1, n + 1)
        tapers = np.sin(math.pi * k * j / (n + 1))
        count = 1 << (PADDED * n - 1).bit_length()
        spectra = np.abs(np.fft.rfft(rest[:, None] * tapers, count)) ** 2
        span = (x[-1] - x[0]) / pieces
        self.cell = (TAPERS + 1) / span
        self._power = spectra.sum(axis=(0, 1))
        self._places = np.arange(count // 2 + 1) * (n / (count * span))
        self._freedom = TAPERS * pieces

    def unlikely(self, places: Floats, highest: float) -> Floats:
        """Probability of at least the power at places (d,) beside that of their neighbours, (d,); NaN without enough.

        The level is the upper median of as many neighbours below as above, so that neither a slope nor a line among
        them raises a place.
        """
        power = self.at(places)
        room = np.minimum(places, highest - places) / self.cell - 0.5
        sides = np.clip(np.floor(room), 0, NEIGHBOURS).astype(np.int64)
        found = np.full(len(places), np.nan)
        for side in range(FEWEST, NEIGHBOURS + 1):
            own = sides == side
            steps = self.cell * np.arange(1, side + 1)
            around = self.at(places[own][:, None] + np.concatenate([-steps, steps]))
            level = np.sort(around, axis=1)[:, side]
            ratio = power[own] / np.maximum(level, LEAST)
            found[own] = np.exp(np.interp(np.log(np.maximum(ratio, LEAST)), np.log(RATIOS), _tail(side, self._freedom)))
        return found

    def at(self, places: Floats) -> Floats:
        """Power at places (d,), to an unknown factor."""
        return np.asarray(np.interp(places, self._places, self._power))


@lru_cache
def _tail(side: int, freedom: int) -> Floats:
    """Logarithm of the probability that a power is `RATIOS` times the upper median of 2 `side` others."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    part = 0.5 * (nodes + 1.0)
    u = part**FINEST
    weight = 0.5 * weights * FINEST * part ** (FINEST - 1) * scipy.stats.beta.pdf(u, side + 1, side)
    level = scipy.stats.gamma.ppf(u, freedom)
    return np.asarray(
        np.log(np.maximum(scipy.stats.gamma.sf(np.multiply.outer(RATIOS, level), freedom) @ weight, LEAST))
    )
