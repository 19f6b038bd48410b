"""What a refit of a model's parameters takes out of a signal, and what it leaves."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import CAP, Index, Layout, inner, members
from hdfast.diagnosis.fitted import Fit

REPEATS, FELT = 8, 1.0


class Projector:
    """Takes out of a signal what a refit of the model's parameters would absorb, priors included."""

    def __init__(self, fit: Fit, layout: Layout) -> None:
        self.layout = layout
        self.mismatch = fit.white(layout, fit.mismatch)
        self.A = fit.white(layout, fit.slopes)
        self.inverse = np.linalg.inv(inner(self.A, self.A) + np.diag(fit.structure.sigma**-2))

    def absorbed(self, signal: Floats) -> Floats:
        """Coordinates (P, ...) that a refit gives to a whitened signal (N, ...)."""
        coordinates: Floats = self.inverse @ inner(self.A, signal)
        return coordinates

    def left(self, signal: Floats, absorbed: Floats | None = None) -> Floats:
        """A whitened signal (N, ...) without what is absorbed, coordinates (P, ...) where these are known."""
        remaining: Floats = signal - self.A @ (self.absorbed(signal) if absorbed is None else absorbed)
        return remaining

    @cached_property
    def residual(self) -> Floats:
        """The whitened mismatch (N,) without what is absorbed; no sample counts for more than `CAP` of them."""
        return self.left(np.clip(self.mismatch, -CAP, CAP))

    def residual_about(self, unit: Floats) -> Floats:
        """The same (N,), where no sample counts for more beside what lies along orthonormal columns (N, d)."""
        residual = self.residual
        for _ in range(REPEATS):
            along = unit @ (unit.T @ residual)
            if np.max(np.abs(along), initial=0.0) < FELT:
                break
            residual = self.left(np.clip(self.mismatch - along, -CAP, CAP)) + along
        return residual

    def levered(self, residual: Floats) -> Floats:
        """(I - P_bb)^(-1/2) r block by block: undoes how much the fit followed each block."""
        corrected = residual.copy()
        for rows, B, vectors, factor in self._followed:
            corrected[rows] += B @ (vectors @ (factor * (vectors.T @ (B.T @ residual[rows]))))
        return corrected

    @cached_property
    def _followed(self) -> list[tuple[Index, Floats, Floats, Floats]]:
        """How the fit followed each block: rows (n,), slopes (n, P), their directions (P, P), factor of each (P,)."""
        root = np.linalg.cholesky(self.inverse)
        found = []
        for rows in members(self.layout.block):
            B = self.A[rows] @ root
            values, vectors = np.linalg.eigh(B.T @ B)
            values = np.clip(values, 0.0, 1.0 - 1e-6)
            factor = np.where(values > 1e-10, (1.0 / np.sqrt(1.0 - values) - 1.0) / np.maximum(values, 1e-10), 0.5)
            found.append((rows, B, vectors, factor))
        return found


def orthonormal(signature: Floats) -> Floats:
    """Columns (N, d) of unit length at right angles, the first along the first."""
    basis, triangle = np.linalg.qr(signature)
    return np.asarray(basis * np.sign(np.diag(triangle) + (np.diag(triangle) == 0.0)))
