"""Nonlinear least squares with standard deviations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.identify import least_squares


@dataclass(frozen=True, eq=False)
class NonlinearFit:
    """Parameters (p,), standard deviations (p,), residuals (n,), degrees of freedom, BIC.

    Without a degree of freedom the residuals tell nothing and the standard deviations are infinite; so are those of
    parameters that the residuals do not tell apart.
    """

    values: Floats
    sigma: Floats
    residuals: Floats
    freedom: int
    bic: float


def fit(
    residual: Callable[[Floats], Floats], start: Any, *, correlation: float = 1.0, uneven: bool = False
) -> NonlinearFit:
    """Least squares from a start; the scale of each parameter is taken from its start value.

    Args:
        residual: parameters (p,) -> residuals (n,), n >= p.
        start: first guess (p,), no zeros.
        correlation: samples that count as one, widens the standard deviations.
        uneven: the weights of the residuals may be off; standard deviations are those of `least_squares.fit`, where
            they are larger. A residual that one parameter has for itself is zero and tells no size of its own.
    """
    first = np.asarray(start, dtype=np.float64)
    found = scipy.optimize.least_squares(
        lambda x: residual(x * first), np.ones_like(first), method="lm", xtol=1e-12, ftol=1e-12
    )
    count = len(found.fun)
    freedom = count - len(first)
    variance = float(found.fun @ found.fun) / max(freedom, 1)
    gram = found.jac.T @ found.jac
    square = np.diag(np.linalg.pinv(gram)) * variance * correlation
    if uneven:
        square = np.maximum(square, np.diag(least_squares.fit(found.jac, found.fun).covariance))
    bic = count / correlation * np.log(max(float(found.fun @ found.fun) / count, 1e-300))
    sigma = np.sqrt(square) * np.abs(first) if freedom else np.full_like(first, np.inf)
    sigma[least_squares.untold(gram)] = np.inf
    return NonlinearFit(
        found.x * first, sigma, found.fun, freedom, float(bic + len(first) * np.log(count / correlation))
    )
