"""Where the rows lie in the unit cube. Every design answers for any range of rows without the ones before it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.tolerance.streams import block_stream, key, stream

if TYPE_CHECKING:
    from hdfast.tolerance.sample import Plan

SOBOL_BITS = 32  # more would meet an error of scipy 1.17 in fast_forward


@dataclass(frozen=True)
class Design:
    """A way to place rows.

    Attributes:
        points: (plan, start, stop) to (stop - start, d) probabilities, or to levels -1, 0, 1 of a worst-case design.
        random: True when shares of rows estimate probabilities.
        size: number of rows of a finite design, None for one that goes on for ever.
        groups: (plan, start, stop) to the group of every row when rows are only independent between groups.
    """

    points: Callable[[Plan, int, int], Floats]
    random: bool
    size: Callable[[Plan], int] | None = None
    groups: Callable[[Plan, int, int], NDArray[np.int_]] | None = None


def monte_carlo(plan: Plan, start: int, stop: int) -> Floats:
    """Independent rows."""
    return np.column_stack([stream(plan.seed, name, start, stop - start) for name in plan.names])


def latin_hypercube(plan: Plan, start: int, stop: int) -> Floats:
    """Blocks of `plan.block` rows, each a Latin hypercube of its own; a dependence is induced block by block."""
    size, dependence = plan.block, plan.parts
    parts = []
    for block in range(start // size, (stop - 1) // size + 1):
        whole = np.column_stack([_strata(plan.seed, name, block, size) for name in plan.names])
        if dependence is not None:
            columns = [plan.names.index(name) for name in dependence.names]
            whole[:, columns] = dependence.reorder(whole[:, columns])
        parts.append(whole[max(start - block * size, 0) : stop - block * size])
    return np.concatenate(parts)


def _strata(seed: int, name: str, block: int, size: int) -> Floats:
    generator = block_stream(seed, name, block)
    return (generator.permutation(size) + generator.random(size)) / size


def sobol(plan: Plan, start: int, stop: int) -> Floats:
    """`plan.replicates` scrambled Sobol sequences that take turns: row i is point i // R of sequence i mod R."""
    return interleaved_sobol(len(plan.names), plan.seed, plan.replicates, start, stop)


def interleaved_sobol(dimensions: int, seed: int, replicates: int, start: int, stop: int) -> Floats:
    """(stop - start, dimensions) points: those of several scrambled Sobol sequences in turn."""
    points = np.empty((stop - start, dimensions))
    for replicate in range(replicates):
        first = start + (replicate - start) % replicates
        count = len(range(first, stop, replicates))
        if count:
            points[first - start :: replicates] = sobol_points(dimensions, seed, replicate, first // replicates, count)
    return points


def sobol_points(dimensions: int, seed: int, replicate: int, start: int, count: int) -> Floats:
    """(count, dimensions) points of a scrambled Sobol sequence (scrambling of Matousek) from position `start` on."""
    generator = np.random.default_rng([seed, key("sobol"), replicate])
    engine = scipy.stats.qmc.Sobol(dimensions, scramble=True, bits=SOBOL_BITS, rng=generator)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="The balance properties")
        if start:
            engine.fast_forward(start)
        return np.asarray(engine.random(count) + 0.5 ** (SOBOL_BITS + 1))


def corners(plan: Plan, start: int, stop: int) -> Floats:
    """Every combination of the worst-case values, and the nominal drive as row 0."""
    rows = np.arange(start, stop)
    bits = (np.maximum(rows - 1, 0)[:, None] >> np.arange(len(plan.names))) & 1
    return np.where(rows[:, None] == 0, 0.0, 2.0 * bits - 1.0)


def one_at_a_time(plan: Plan, start: int, stop: int) -> Floats:
    """The nominal drive as row 0, then each parameter at its lower and its upper worst-case value."""
    rows = np.arange(start, stop)
    points = np.zeros((len(rows), len(plan.names)))
    moved = rows > 0
    points[moved, (rows[moved] - 1) // 2] = np.where(rows[moved] % 2 == 1, -1.0, 1.0)
    return points


def factorial(plan: Plan, start: int, stop: int) -> Floats:
    """Every combination of `plan.levels` equally spaced levels from the lower to the upper worst-case value.

    A discrete parameter takes that of its values which is nearest to each level.
    """
    rows = np.arange(start, stop)[:, None]
    digits = (rows // plan.levels ** np.arange(len(plan.names))) % plan.levels
    return -1.0 + 2.0 * digits / (plan.levels - 1)


DESIGNS = {
    "monte_carlo": Design(monte_carlo, random=True),
    "latin_hypercube": Design(
        latin_hypercube, random=True, groups=lambda plan, start, stop: np.arange(start, stop) // plan.block
    ),
    "sobol": Design(sobol, random=True, groups=lambda plan, start, stop: np.arange(start, stop) % plan.replicates),
    "corners": Design(corners, random=False, size=lambda plan: 1 + 2 ** len(plan.names)),
    "one_at_a_time": Design(one_at_a_time, random=False, size=lambda plan: 1 + 2 * len(plan.names)),
    "factorial": Design(factorial, random=False, size=lambda plan: int(plan.levels ** len(plan.names))),
}
