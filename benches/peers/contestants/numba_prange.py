# /// script
# dependencies = ["numba", "numpy"]
# ///
"""Dormand-Prince 5(4) written by hand and compiled by Numba, rows in parallel (`benches/numba_rows.py`)."""

import equations

NAME = "Numba, hand-written"
VARIANTS = ("Dormand-Prince 5(4), prange",)
THREADS = True


def build(_variant):
    import numba_rows

    def solve(parameters, rtol, _full):
        final, peak, rms = numba_rows.solve(parameters, rtol, parameters[:, 9] * equations.COSINES.sum())
        return final[:, :5], peak, rms

    return solve
