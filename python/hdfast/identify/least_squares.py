"""Linear least squares with a covariance that holds when the errors differ in size (HC3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats


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
