"""The equations of a drive and what is free in them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.model import Model

TORQUE_SCALE, TORQUE_LEAD = "torque_scale", "torque_lead"
REVERSAL = "reversal_impulse"
NUISANCE = (TORQUE_SCALE, TORQUE_LEAD, REVERSAL)
#: Terms in whose gap a load moves as chance has it: what noise adds there cannot be told.
RATTLING = frozenset({"backlash"})
LARGEST = 700.0


@dataclass(frozen=True)
class Free:
    """A parameter that is fitted: `coordinate` is its logarithm where it must stay positive.

    Attributes:
        name: column of the model, or a nuisance of the recordings.
        value: prior centre.
        sigma: prior standard deviation of the coordinate.
        positive: fitted as a logarithm.
        low, high: bounds of the value.
        unit: SI unit.
        times: name of an earlier parameter of the same unit of which this one is a multiple; value, sigma and bounds
            are then of the factor.
        ends: whether it may end at a bound and mean something there, as a share that is nearly whole.
    """

    name: str
    value: float
    sigma: float
    positive: bool
    unit: str
    low: float = -np.inf
    high: float = np.inf
    times: str | None = None
    ends: bool = False

    def coordinate(self, value: Floats | float) -> Floats:
        """Coordinates of values."""
        return np.asarray(np.log(value) if self.positive else value, dtype=np.float64)

    def from_coordinate(self, coordinate: Floats) -> Floats:
        """Values of coordinates, within the bounds."""
        value = np.exp(np.minimum(coordinate, LARGEST)) if self.positive else coordinate
        return np.clip(value, self.low, self.high)

    @property
    def bounds(self) -> tuple[float, float]:
        """Coordinates of the bounds."""
        if not self.positive:
            return self.low, self.high
        return math.log(self.low) if self.low > 0.0 else -math.inf, math.log(self.high)


@dataclass(frozen=True)
class Structure:
    """Equations and what is free in them.

    Attributes:
        model: base, spring, orders of the kinematic error, terms.
        fixed: values of parameters that are not fitted.
        free: the fitted parameters.
        sensors: (effect, channel) pairs of the sensor stage.
    """

    model: Model
    fixed: Mapping[str, float]
    free: tuple[Free, ...]
    sensors: tuple[tuple[str, str], ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the free parameters."""
        return [free.name for free in self.free]

    @property
    def rattles(self) -> bool:
        """Whether a load moves in a gap."""
        return bool(RATTLING & set(self.model.terms))

    @property
    def sensed(self) -> list[str]:
        """Names of the sensor stage's parameters, fixed or free."""
        own = tuple(f"{channel}_{effect}_" for effect, channel in self.sensors)
        return [name for name in {**self.fixed, **dict.fromkeys(self.names)} if own and name.startswith(own)]

    def fits(self, effect: str, channel: str) -> bool:
        """Whether a parameter of a sensor's effect is free."""
        return any(name.startswith(f"{channel}_{effect}_") for name in self.names)

    @property
    def start(self) -> Floats:
        """Prior centre in coordinates, shape (P,)."""
        return np.array([float(free.coordinate(free.value)) for free in self.free])

    @property
    def sigma(self) -> Floats:
        """Prior standard deviations in coordinates, shape (P,)."""
        return np.array([free.sigma for free in self.free])

    @property
    def bounds(self) -> Floats:
        """Coordinates of the lower and upper bounds, shape (2, P)."""
        return np.array([free.bounds for free in self.free]).reshape(-1, 2).T

    def values(self, coordinates: Floats) -> dict[str, Floats]:
        """Columns by name from coordinates (M, P)."""
        found: dict[str, Floats] = {}
        for j, free in enumerate(self.free):
            own = free.from_coordinate(coordinates[..., j])
            found[free.name] = own if free.times is None else own * found[free.times]
        return found

    def with_terms(
        self,
        terms: Sequence[str],
        orders: Sequence[str],
        sensors: Sequence[tuple[str, str]],
        fixed: Mapping[str, float],
        free: Sequence[Free],
    ) -> Structure:
        """More terms, more orders of the kinematic error, more sensor effects, and their parameters.

        What was fixed may become free.
        """
        model = replace(
            self.model,
            terms=(*self.model.terms, *(term for term in terms if term not in self.model.terms)),
            orders=(*self.model.orders, *(order for order in orders if order not in self.model.orders)),
        )
        stage = (*self.sensors, *(pair for pair in sensors if pair not in self.sensors))
        freed = {one.name for one in free}
        kept = {name: value for name, value in {**self.fixed, **fixed}.items() if name not in freed}
        return Structure(model, kept, (*self.free, *free), stage)

    def without(self, parts: Collection[str]) -> tuple[Structure, list[int]]:
        """Without some terms, orders of the kinematic error or sensor effects, and the indices of what stays free."""
        orders = [part for part in parts if part in self.model.orders]
        own = tuple(f"{part}_" for part in parts if part not in orders)
        gone = {f"te_{wave}_{order}" for order in orders for wave in ("cos", "sin")}
        kept = [j for j, name in enumerate(self.names) if not name.startswith(own) and name not in gone]
        model = replace(
            self.model,
            terms=tuple(term for term in self.model.terms if term not in parts),
            orders=tuple(order for order in self.model.orders if order not in orders),
        )
        fixed = {name: value for name, value in self.fixed.items() if not name.startswith(own) and name not in gone}
        sensors = tuple(pair for pair in self.sensors if f"{pair[1]}_{pair[0]}" not in parts)
        return Structure(model, fixed, tuple(self.free[j] for j in kept), sensors), kept
