"""Linear least squares with a covariance that holds when the errors differ in size (HC3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats

UNTOLD = 1e-12  # eigenvalue of scaled normal equations, over the largest: they are hardly more exact
SHARE = 1e-3  # of a coefficient in a direction that the data leave open


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Coefficients (p,), their covariance (p, p), residuals (n,) and degrees of freedom."""

    coefficients: Floats
    covariance: Floats
    residuals: Floats
    freedom: int

    @property
    def sigma(self) -> Floats:
        """Standard deviations (p,); infinite without a degree of freedom, when residuals tell nothing."""
        return np.sqrt(np.diag(self.covariance)) if self.freedom > 0 else np.full_like(self.coefficients, np.inf)


def fit(columns: Floats, data: Floats) -> LinearFit:
    """Least squares of data (n,) on columns (n, p), scaled to unit length inside.

    Residuals are divided by 1 - leverage in the covariance (MacKinnon and White 1985, HC3).
    """
    length = np.linalg.norm(columns, axis=0)
    length[length == 0.0] = 1.0
    q, r = np.linalg.qr(columns / length)
    scaled = np.linalg.lstsq(r, q.T @ data, rcond=None)[0]
    residuals = data - (columns / length) @ scaled
    leverage = np.minimum(np.einsum("ij,ij->i", q, q), 0.999)
    inverse = np.linalg.pinv(r)
    weighted = q * (residuals / (1.0 - leverage))[:, None]
    covariance = inverse @ (weighted.T @ weighted) @ inverse.T
    return LinearFit(scaled / length, covariance / np.outer(length, length), residuals, len(data) - columns.shape[1])


def untold(gram: Floats) -> NDArray[np.bool_]:
    """Coefficients (p,) that normal equations (p, p) do not tell apart from others, or from zero."""
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    size, direction = np.linalg.eigh(gram / np.outer(scale, scale))
    return np.asarray(np.any(np.abs(direction[:, size < UNTOLD * size[-1]]) > SHARE, axis=1))
