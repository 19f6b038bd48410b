"""How many orders: error of the fit, BIC and blocked cross-validation over the number of orders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.identify.orders import Design

KNEE_GAIN, KNEE_LOOK = 0.01, 3


@dataclass(frozen=True, eq=False)
class Selection:
    """Curves over the number of orders 1 ... n and what they suggest.

    Attributes:
        rmse: root mean square error of the fit [rad], (n,).
        bic: Bayesian information criterion with the effective sample size, (n,).
        held_out: root mean square error on left-out revolutions [rad], (n,); NaN where no run has two of them.
        knee: first number after which each of the next three lowers the error by less than 1 %.
        suggested: smallest number whose held-out error is within one standard error of the best, else that of BIC.
    """

    rmse: Floats
    bic: Floats
    held_out: Floats
    knee: int
    best_bic: int
    suggested: int


def select(problem: Design, most: int) -> Selection:
    """Walk through 1 ... `most` orders, which must all be in the design."""
    equations = problem.by_fold
    folds, groups = problem.folds, range(len(equations.rows))
    rmse, held = np.empty(most), np.full((most, folds), np.nan)
    numbers = np.arange(1, most + 1)
    for n in numbers:
        chosen = problem.columns([float(k) for k in range(1, n + 1)])
        whole = equations.solve(chosen)
        rmse[n - 1] = np.sqrt(
            sum(equations.loss(b, chosen, whole) * equations.rows[b] for b in groups) / equations.rows.sum()
        )
        if folds > 1:
            held[n - 1] = [equations.loss(b, chosen, equations.solve(chosen, leave=b)) for b in range(folds)]
    effective = float(equations.rows.sum()) * effective_share(problem.residuals(chosen, whole))
    bic = effective * np.log(rmse**2) + (len(problem.nuisances) + 2 * numbers) * np.log(effective)
    best_bic = int(np.argmin(bic)) + 1
    if folds == 1:
        return Selection(rmse, bic, np.full(most, np.nan), knee(rmse), best_bic, best_bic)
    mean = held.mean(axis=1)
    best = int(np.argmin(mean))
    allowed = mean[best] + held[best].std(ddof=1) / np.sqrt(folds)
    suggested = int(np.flatnonzero(mean <= allowed)[0]) + 1
    return Selection(rmse, bic, np.sqrt(mean), knee(rmse), best_bic, suggested)


def knee(rmse: Floats) -> int:
    """First number of orders after which each of the next three lowers the error by less than 1 %."""
    gain = 1.0 - rmse[1:] / rmse[:-1]
    for n in range(len(rmse)):
        following = gain[n : n + KNEE_LOOK]
        if len(following) == 0 or np.all(following < KNEE_GAIN):
            return n + 1
    return len(rmse)


def effective_share(residuals: Sequence[Floats]) -> float:
    """Effective share of independent samples, from the autocorrelation up to its first change of sign."""
    shares, weights = [], []
    for values in residuals:
        centred = values - values.mean()
        size = len(centred)
        spectrum = np.abs(np.fft.rfft(centred, 2 * size)) ** 2
        correlation = np.fft.irfft(spectrum)[: size // 2]
        correlation = correlation / correlation[0]
        below = np.flatnonzero(correlation <= 0.0)
        last = int(below[0]) if below.size else len(correlation)
        shares.append(1.0 / (1.0 + 2.0 * float(correlation[1:last].sum())))
        weights.append(size)
    return float(np.average(shares, weights=weights))
