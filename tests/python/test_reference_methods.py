"""The tables of the reference's methods: order conditions, and convergence on the drive itself."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from drives import parameters, problem, segment
from hdfast.reference.drive import Drive
from hdfast.reference.inputs import read_segments
from hdfast.reference.methods import METHODS
from hdfast.reference.stepper import attempt, dense_output

METHOD_LIST = list(METHODS.values())


@functools.cache
def trees(order):
    """Rooted trees with `order` nodes as sorted tuples of their branches."""
    if order == 1:
        return [()]
    found = set()

    def add(branches, left, largest):
        if left == 0:
            found.add(tuple(sorted(branches, key=repr)))
            return
        for size in range(1, min(left, largest) + 1):
            for branch in trees(size):
                add([*branches, branch], left - size, size)

    add([], order - 1, order - 1)
    return sorted(found, key=repr)


TREES = {order: trees(order) for order in range(1, 9)}


def size(tree):
    return 1 + sum(size(branch) for branch in tree)


def density(tree):
    return size(tree) * math.prod(density(branch) for branch in tree)


def arrays(method):
    """(A, c): every stage, the slope at the end of the step, then the stages of the dense output."""
    rows = [{}, *method.stages, method.weights, *method.dense_stages]
    nodes = [0.0, *method.nodes, 1.0, *method.dense_nodes]
    A = np.zeros((len(rows), len(rows)))
    for j, row in enumerate(rows):
        for k, weight in row.items():
            A[j, k] = weight
    return A, np.array(nodes)


def stage_weights(A, tree):
    """Elementary weights of all stages."""
    return math.prod((A @ stage_weights(A, branch) for branch in tree), start=np.ones(len(A)))


def padded(row, length):
    return np.array([row.get(k, 0.0) for k in range(length)])


def dense_weights(method, x, length):
    """Weights b_i(x) of the dense output, read off the nested polynomial."""
    end = padded(method.weights, length)
    first, last = np.zeros(length), np.zeros(length)
    first[0], last[len(method.stages) + 1] = 1.0, 1.0
    terms = [end, first - end, 2 * end - first - last, *(padded(row, length) for row in method.dense)]
    total = np.zeros(length)
    for k in reversed(range(len(terms))):
        total = (x if k % 2 == 0 else 1.0 - x) * (terms[k] + total)
    return total


def test_exact_numbers_of_rooted_trees():
    assert [len(TREES[order]) for order in TREES] == [1, 1, 2, 4, 9, 20, 48, 115]


@pytest.mark.parametrize("method", METHOD_LIST, ids=lambda m: m.name)
def test_exact_order_conditions(method):
    A, c = arrays(method)
    np.testing.assert_allclose(A.sum(axis=1), c, atol=2e-14)
    weights = padded(method.weights, len(A))
    slack = 1e-14 * max(1.0, np.abs(weights).sum())
    for order in range(1, method.order + 1):
        for tree in TREES[order]:
            assert abs(weights @ stage_weights(A, tree) - 1 / density(tree)) < slack, (order, tree)
    if method.order < 8:
        residuals = [weights @ stage_weights(A, tree) - 1 / density(tree) for tree in TREES[method.order + 1]]
        assert max(map(abs, residuals)) > 1e-6


@pytest.mark.parametrize("method", METHOD_LIST, ids=lambda m: m.name)
def test_exact_embedded_error(method):
    A, _ = arrays(method)
    claimed = [5, 3] if method.name == "dop853" else [method.error_order]
    for row, order in zip(method.errors, claimed, strict=True):
        weights = padded(row, len(A))
        for below in range(1, order + 1):
            assert all(abs(weights @ stage_weights(A, tree)) < 1e-14 for tree in TREES[below])
        assert max(abs(weights @ stage_weights(A, tree)) for tree in TREES[order + 1]) > 1e-6


@pytest.mark.parametrize("method", METHOD_LIST, ids=lambda m: m.name)
def test_exact_dense_order_conditions(method):
    A, _ = arrays(method)
    for x in (0.1, 0.37, 0.5, 0.8, 1.0):
        weights = dense_weights(method, x, len(A))
        slack = 1e-14 * max(1.0, np.abs(weights).sum())
        for order in range(1, method.dense_order + 1):
            for tree in TREES[order]:
                assert abs(weights @ stage_weights(A, tree) - x**order / density(tree)) < slack, (x, tree)


SIZES = np.array([1.0, 10.0, 1e-3, 0.1, 1.0])
START = [0.3, 30.0, 4e-4, 0.2, 0.0]
DURATION = 0.05


def ringing_drive():
    """A drive that rings with every nonlinear term at work, smooth everywhere."""
    p = parameters(k2=4e5, phi_max=1.0, te_scale=3.0)
    case = problem(p, [segment(0.0, tau=0.6)], t_end=DURATION, t_off=DURATION)
    drive, row = Drive(case), read_segments(case.segments, p)[0]
    return lambda t, y: drive.slope(t, y, row)


def march(method, slope, steps):
    """Dense outputs of equal steps."""
    h = DURATION / steps
    y, first, dense = START, slope(0.0, START), []
    for k in range(steps):
        step = attempt(method, slope, k * h, y, first, h)
        dense.append(dense_output(method, slope, step))
        y, first = step.end, step.slopes[-1]
    return dense


@functools.cache
def fine():
    """Dense outputs of a run far finer than the compared ones."""
    return march(METHODS["dop853"], ringing_drive(), 640)


def spread(values):
    return math.sqrt(np.mean(np.square(values)))


def observed_order(errors, counts):
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


@pytest.mark.parametrize("method", METHOD_LIST, ids=lambda m: m.name)
def test_exact_convergence_on_the_drive(method):
    """Orders of step ends and of dense output inside the steps, against a far finer run."""
    slope, exact = ringing_drive(), fine()

    def error(step, x):
        t = step.t + x * step.h
        truth = exact[min(int(t / exact[0].h), len(exact) - 1)].at(t)
        return (np.array(step.at(t)) - truth) / SIZES

    counts = {"bs3": [256, 512, 1024], "dop853": [48, 64, 80]}.get(method.name, [128, 256, 512])
    runs = [march(method, slope, count) for count in counts]
    ends = [spread([error(step, 1.0) for step in run]) for run in runs]
    inside = [spread([error(step, x) for step in run for x in (0.3, 0.6)]) for run in runs]
    assert abs(observed_order(ends, counts) - method.order) < 0.2, ends
    expected = min(method.order, method.dense_order + 1)
    assert abs(observed_order(inside, counts) - expected) < 0.2, inside


@pytest.mark.parametrize("method", METHOD_LIST, ids=lambda m: m.name)
def test_exact_local_order_of_dense_output(method):
    """One step from an exact state: the interpolation error falls with one power more than the dense order."""
    slope = ringing_drive()
    base = DURATION / {"bs3": 256, "dop853": 24}.get(method.name, 96)
    errors, factors = [], [1.0, 0.8, 0.64]
    for factor in factors:
        h = base * factor
        step = attempt(method, slope, 0.0, START, slope(0.0, START), h)
        dense = dense_output(method, slope, step)
        truth = march_to(slope, 0.45 * h)
        errors.append(np.max(np.abs(np.array(dense.at(0.45 * h)) - truth) / SIZES))
    observed = np.polyfit(np.log(factors), np.log(errors), 1)[0]
    assert observed > method.dense_order + 1 - 0.4, errors


def march_to(slope, t, steps=12):
    y, h = START, t / steps
    for k in range(steps):
        y = attempt(METHODS["dop853"], slope, k * h, y, slope(k * h, y), h).end
    return np.array(y)
