"""Fourier series against the motor angle by least squares, nested over the number of orders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats

Columns = NDArray[np.int64]

TURN = 2.0 * math.pi
LARGEST_PHASE = 1.2
FEWEST_LEFT, WIDER = 6.0, 1.5
ROUNDING = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Run:
    """One run in blocks of samples, each (n,).

    Attributes:
        angle, time, error: means of motor angle [rad], time [s] and error [rad].
        step: motor angle from one sample of a block to the next [rad].
        samples: number in a block.
    """

    angle: Floats
    time: Floats
    error: Floats
    step: Floats
    samples: int

    @property
    def direction(self) -> float:
        """+1 forward, -1 backward."""
        return 1.0 if self.angle[-1] > self.angle[0] else -1.0

    @property
    def revolutions(self) -> float:
        """Motor revolutions covered."""
        return float(abs(self.angle[-1] - self.angle[0]) + abs(self.step.mean()) * self.samples) / TURN

    @property
    def whole(self) -> int:
        """Whole revolutions, at least 1; the first one may lack a part of a block."""
        return max(round(self.revolutions), 1)


def blocks(t: Floats, angle: Floats, error: Floats, highest: float) -> Run:
    """Average neighbouring samples as long as the highest order turns by less than 1.2 rad within a block.

    Only the last whole number of motor revolutions is kept.
    """
    travelled = np.abs(angle - angle[-1])
    whole = math.floor(travelled[0] / TURN) * TURN
    start = int(np.flatnonzero(travelled >= whole)[-1]) if whole else 0
    t, angle, error = t[start:], angle[start:], error[start:]
    per_sample = abs(angle[-1] - angle[0]) / (len(angle) - 1)
    size = max(1, min(int(LARGEST_PHASE / (highest * per_sample)), len(angle) // 64))
    count = len(angle) // size
    parts = [values[len(values) - count * size :].reshape(count, size) for values in (angle, t, error)]
    step = (parts[0][:, -1] - parts[0][:, 0]) / (size - 1) if size > 1 else np.full(count, per_sample)
    means = [part.mean(axis=1) for part in parts]
    return Run(means[0], means[1], means[2], step, size)


def series(run: Run, orders: Sequence[float]) -> Floats:
    """Columns cos n theta, sin n theta (n, 2 len(orders)), reduced by what averaging over a block takes away."""
    columns = np.empty((len(run.angle), 2 * len(orders)))
    turn = np.exp(1j * run.angle)
    power, at = np.ones_like(turn), 0
    for j, n in enumerate(orders):
        if n == int(n) and n > at:
            for _ in range(int(n) - at):
                power = power * turn
            at = int(n)
        wave = power if n == at else np.exp(1j * n * run.angle)
        kept = scipy.special.diric(n * run.step, run.samples)
        columns[:, 2 * j], columns[:, 2 * j + 1] = wave.real * kept, wave.imag * kept
    return columns


def nuisance(runs: Sequence[Run]) -> tuple[list[Floats], list[str]]:
    """Columns of each run for offsets, ratio or scale error (per motor angle) and clock skew (per time).

    Angle and time can be told apart only when the runs go both ways.
    """
    both = len({run.direction for run in runs}) == 2
    names = [f"offset_{i}" for i in range(len(runs))] + ["scale_error"] + (["clock_skew"] if both else [])
    scale = max(float(np.max(np.abs(run.angle))) for run in runs)
    columns = []
    for i, run in enumerate(runs):
        block = np.zeros((len(run.angle), len(names)))
        block[:, i] = 1.0
        block[:, len(runs)] = (run.angle - run.angle.mean()) / scale
        if both:
            block[:, -1] = (run.time - run.time.mean()) / np.ptp(run.time)
        columns.append(block)
    return columns, names


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations by fold: G (b, p, p), g (b, p), y'y (b,), rows (b,)."""

    gram: Floats
    right: Floats
    power: Floats
    rows: Floats

    def solve(self, columns: Columns, leave: int | None = None) -> Floats:
        """Coefficients of the chosen columns, optionally without one fold."""
        gram, right = self.gram.sum(axis=0), self.right.sum(axis=0)
        if leave is not None:
            gram, right = gram - self.gram[leave], right - self.right[leave]
        return _solve(gram[np.ix_(columns, columns)], right[columns])

    def without(self, fold: int) -> Normal:
        """The same with one fold emptied."""
        kept = (np.arange(len(self.rows)) != fold).astype(np.float64)
        return Normal(self.gram * kept[:, None, None], self.right * kept[:, None], self.power * kept, self.rows * kept)

    def loss(self, fold: int, columns: Columns, coefficients: Floats) -> float:
        """Mean square residual of one fold, at least what rounding leaves of the difference."""
        gram, right = self.gram[fold][np.ix_(columns, columns)], self.right[fold][columns]
        square = self.power[fold] - 2.0 * coefficients @ right + coefficients @ gram @ coefficients
        return float(max(square, ROUNDING * self.power[fold]) / self.rows[fold])


@dataclass(frozen=True, eq=False)
class Design:
    """Nuisances and series of all runs, and their normal equations by folds of whole revolutions.

    Attributes:
        runs: the runs.
        matrices: columns of each run: nuisances, then a cosine and a sine for each order.
        nuisances: names of the nuisances.
        orders: the orders.
        folds: how many of them are left out in turn. A run of a single revolution is in none, last in `by_fold`:
            nothing else tells its offset.
        by_fold, by_run: normal equations.
    """

    runs: Sequence[Run]
    matrices: Sequence[Floats]
    nuisances: list[str]
    orders: list[float]
    folds: int
    by_fold: Normal
    by_run: Normal

    def columns(self, orders: Sequence[float]) -> Columns:
        """Columns of the nuisances and of some orders."""
        fixed = len(self.nuisances)
        where = [fixed + 2 * self.orders.index(order) + part for order in orders for part in (0, 1)]
        return np.array([*range(fixed), *where], dtype=np.int64)

    def residuals(self, columns: Columns, coefficients: Floats) -> list[Floats]:
        """Residual of each run."""
        return [run.error - m[:, columns] @ coefficients for m, run in zip(self.matrices, self.runs, strict=True)]


def design(runs: Sequence[Run], orders: Sequence[float], folds: int) -> Design:
    """Set up the least-squares problem for all orders that may be asked for; every run has its share of the folds."""
    fixed, names = nuisance(runs)
    listed = list(dict.fromkeys(orders))
    matrices = [np.hstack([block, series(run, listed)]) for block, run in zip(fixed, runs, strict=True)]
    folds = min(folds, max(run.whole for run in runs))
    fold = []
    for run in runs:
        revolution = np.floor(np.abs(run.angle - run.angle[0]) / TURN).astype(np.int64)
        shared = np.minimum(revolution * folds // run.whole, folds - 1)
        fold.append(shared if run.whole > 1 else np.full_like(revolution, folds))
    index = [np.full(len(run.angle), j) for j, run in enumerate(runs)]
    return Design(runs, matrices, names, listed, folds, _normal(matrices, runs, fold), _normal(matrices, runs, index))


def _normal(matrices: Sequence[Floats], runs: Sequence[Run], groups: Sequence[Columns]) -> Normal:
    parts = []
    for group in np.unique(np.concatenate(groups)):
        gram: Any = 0.0
        right: Any = 0.0
        power = rows = 0.0
        for matrix, run, found in zip(matrices, runs, groups, strict=True):
            chosen = found == group
            part, data = matrix[chosen], run.error[chosen]
            gram, right = gram + part.T @ part, right + part.T @ data
            power, rows = power + float(data @ data), rows + len(data)
        parts.append((gram, right, power, rows))
    return Normal(*(np.array([part[k] for part in parts]) for k in range(4)))


def _solve(gram: Floats, right: Floats) -> Floats:
    """Solution of normal equations of columns scaled to unit length."""
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    return np.asarray(np.linalg.lstsq(gram / np.outer(scale, scale), right / scale, rcond=1e-13)[0] / scale)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Residual of a run of some revolutions, by cycles 1, 2, ... over all of them.

    Attributes:
        turns: revolutions.
        power: what a white residual has in every cycle is its variance, (n,).
        left: share of it that the fit leaves of a white residual, (n,).
    """

    turns: float
    power: Floats
    left: Floats

    def near(self, order: float, reach: float) -> NDArray[np.bool_]:
        """Which cycles are as close to an order as 0.4 orders or 6 cycles, times a reach."""
        cycles = np.arange(1, len(self.power) + 1)
        return np.asarray(np.abs(cycles - order * self.turns) <= reach * max(0.4 * self.turns, 6.0))


def spectra(problem: Design, columns: Columns, residuals: Sequence[Floats], inverse: Floats) -> list[Spectrum]:
    """Spectra of the residuals of a fit of some columns, whose normal matrix has this inverse (p, p)."""
    found = []
    for run, matrix, values in zip(problem.runs, problem.matrices, residuals, strict=True):
        waves = np.fft.rfft(matrix[:, columns], axis=0)[1:]
        taken = np.sum((waves @ inverse) * waves.conj(), axis=1).real / len(values)
        power = np.abs(np.fft.rfft(values)[1:]) ** 2 / len(values)
        found.append(Spectrum(run.revolutions, power, np.maximum(1.0 - taken, 0.0)))
    return found


def density(found: Sequence[Spectrum], order: float) -> float:
    """Spectral density of the residual near an order, as the variance a white residual of that level would have.

    The band is widened until the fit leaves enough of it; infinite where it leaves too little of all.
    """
    reach = 1.0
    while True:
        bands = [spectrum.near(order, reach) for spectrum in found]
        left = sum(float(spectrum.left[band].sum()) for spectrum, band in zip(found, bands, strict=True))
        if left >= FEWEST_LEFT:
            return sum(float(spectrum.power[band].sum()) for spectrum, band in zip(found, bands, strict=True)) / left
        if all(band.all() for band in bands):
            return math.inf
        reach *= WIDER
