"""Problems with known answers for the tests of tolerance studies, and a small study of a real drive."""

from __future__ import annotations

import math
from types import MappingProxyType

import numpy as np
from hdfast.tolerance.distributions import Tolerance
from scipy import stats

SMALL = """title = "small"
[scenario]
t_end = 0.6
t_off = 0.4
[tolerance.J_l]
distribution = "normal"
relative = true
sigma = 0.05
[tolerance.k1]
distribution = "uniform"
relative = true
lower = 0.9
upper = 1.1
[tolerance.te_scale]
distribution = "lognormal"
sigma_log = 0.1
[spec.te_pp]
upper = 3e-4
min_yield = 0.9
[spec.peak_windup]
upper = 1e-3
min_yield = 0.9
[run]
rows = 60
seed = 3
metrics = ["te_rms"]
"""


def normal(name, mean, sigma, **options):
    return Tolerance(name, "normal", mean, sigma, -math.inf, math.inf, **options)


def uniform(name, lower, upper):
    return Tolerance(name, "uniform", 0.0, 0.0, lower, upper)


class LinearGaussian:
    """y = 1 + 2 a - b + c / 2 of independent normal parameters."""

    tolerances = (normal("a", 0.0, 1.0), normal("b", 1.0, 0.5), normal("c", -1.0, 2.0))
    weights = MappingProxyType({"a": 2.0, "b": -1.0, "c": 0.5})
    mean = 1.0 - 1.0 - 0.5
    sigma = math.sqrt(4.0 + 0.25 + 1.0)
    law = stats.norm(mean, sigma)
    shares = MappingProxyType({"a": 4.0 / 5.25, "b": 0.25 / 5.25, "c": 1.0 / 5.25})

    def __call__(self, columns):
        return 1.0 + sum(weight * columns[name] for name, weight in self.weights.items())


def ishigami(u, a=7.0, b=0.1):
    """Ishigami and Homma (1990) on the unit cube."""
    x = math.pi * (2.0 * u - 1.0)
    return np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])


def ishigami_indices(a=7.0, b=0.1):
    """First and total order, closed form."""
    alone = 0.5 * (1.0 + b * math.pi**4 / 5.0) ** 2
    shared = b**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    whole = alone + a**2 / 8.0 + shared
    return np.array([alone, a**2 / 8.0, 0.0]) / whole, np.array([alone + shared, a**2 / 8.0, shared]) / whole


G = np.array([0.0, 1.0, 4.5, 9.0, 99.0, 99.0])


def g_function(u):
    """G-function of Sobol on the unit cube."""
    return np.prod((np.abs(4.0 * u - 2.0) + G) / (1.0 + G), axis=1)


def g_indices():
    """First and total order, closed form."""
    parts = 1.0 / (3.0 * (1.0 + G) ** 2)
    whole = np.prod(1.0 + parts) - 1.0
    return parts / whole, parts * np.prod(1.0 + parts) / (1.0 + parts) / whole


DRIVE = np.array([0.6, 0.5, 0.3, 0.1])


def additive(u):
    """Stop time of a drive as the sum of what four tolerances do to it, each normal."""
    return 0.8 + stats.norm.ppf(np.clip(u, 1e-15, 1.0 - 1e-15)) @ DRIVE


def additive_indices():
    share = DRIVE**2 / np.sum(DRIVE**2)
    return share, share
