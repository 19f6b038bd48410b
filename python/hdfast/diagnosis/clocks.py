"""From the clock of a recorder to the working rate that all recordings are compared at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.band import CLOCK, PASS_SHARE, Band, low_pass
from hdfast.diagnosis.source import Source
from hdfast.errors import InputError
from hdfast.recordings.clock import period

FEWEST = 5


@dataclass(frozen=True)
class Clocks:
    """Times of one recording.

    Attributes:
        recorded: times of the samples from 0 on [s], shape (m,).
        even: the same without its gaps and unrest, by its period [s], shape (k,).
        working: times at the working rate [s], shape (n,).
        stride: every so many even times are about as far apart as working ones.
        alike: whether these are the working ones.
    """

    recorded: Floats
    even: Floats
    working: Floats
    stride: int
    alike: bool

    @classmethod
    def of(cls, source: Source, band: Band) -> Clocks:
        """Those of a recording.

        Raises:
            InputError: too few samples are left of it at the working rate.
        """
        recorded = source.recording["t"] - source.recording["t"][0]
        step = period(recorded)
        even = np.arange(0.0, recorded[-1] + 0.5 * step, step)
        stride = max(1, round(1.0 / (step * band.rate)))
        alike = abs(1.0 / (step * stride * band.rate) - 1.0) <= CLOCK
        working = even[::stride] if alike else np.arange(0.0, even[-1], 1.0 / band.rate)
        if len(working) < FEWEST:
            raise InputError(
                f"{source.name}: {len(working)} samples are left of its {recorded[-1]:.3g} s at {band.rate:.3g} Hz, at "
                f"which all recordings are compared (allowed: at least {FEWEST}); leave it out, or the slowest or the "
                "longest of them"
            )
        return cls(recorded, even, working, stride, alike)

    @property
    def step(self) -> float:
        """Period of the recorder [s]."""
        return float(self.even[1])

    @property
    def widest(self) -> float:
        """Corner from which on a low-pass takes nothing that the recorder has [Hz]."""
        return (1.0 - CLOCK) * PASS_SHARE / self.step

    def filled(self, values: Floats) -> Floats:
        """Recorded values (m,), some of them missing, at the even times (k,)."""
        known = np.isfinite(values)
        return np.interp(self.even, self.recorded[known], values[known])

    def thinned(self, even: Floats, corner: float, *, whole: bool = True) -> Floats:
        """Even values (k,) through a low-pass at the working rate (n,), if `whole` without one from the widest on."""
        if corner < self.widest or not whole:
            even = low_pass(even, corner, 1.0 / self.step)
        return np.ascontiguousarray(even[:: self.stride] if self.alike else np.interp(self.working, self.even, even))

    def bring(self, values: Floats, corner: float, *, whole: bool = True) -> Floats:
        """Recorded values (m,) as `thinned` has them."""
        return self.thinned(self.filled(values), corner, whole=whole)
