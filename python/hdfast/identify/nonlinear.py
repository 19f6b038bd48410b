"""Nonlinear least squares with standard deviations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdfast.checks import Floats


@dataclass(frozen=True, eq=False)
class NonlinearFit:
    """Parameters (p,), standard deviations (p,), residuals (n,), degrees of freedom, BIC."""

    values: Floats
    sigma: Floats
    residuals: Floats
    freedom: int
    bic: float


def fit(residual: Callable[[Floats], Floats], start: Any, *, correlation: float = 1.0) -> NonlinearFit:
    """Least squares from a start; the scale of each parameter is taken from its start value.

    Args:
        residual: parameters (p,) -> residuals (n,).
        start: first guess (p,), no zeros.
        correlation: samples that count as one, widens the standard deviations.
    """
    from scipy.optimize import least_squares

    first = np.asarray(start, dtype=np.float64)
    found = least_squares(lambda x: residual(x * first), np.ones_like(first), method="lm", xtol=1e-12, ftol=1e-12)
    count = len(found.fun)
    freedom = max(count - len(first), 1)
    variance = float(found.fun @ found.fun) / freedom
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * variance * correlation
    bic = count / correlation * np.log(max(float(found.fun @ found.fun) / count, 1e-300))
    sigma = np.sqrt(np.diag(covariance)) * np.abs(first)
    return NonlinearFit(
        found.x * first, sigma, found.fun, freedom, float(bic + len(first) * np.log(count / correlation))
    )
