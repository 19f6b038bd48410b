"""Which equations a batch solves: base, spring law, orders of the kinematic error, extra physics."""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from hdfast import checks
from hdfast.errors import InputError, choose, shorten
from hdfast.terms import terms

BASES = ("two_inertia", "one_inertia")
SPRINGS = ("polynomial", "piecewise")
STATES = {
    "two_inertia": ("theta_m", "omega_m", "theta_l", "omega_l", "z"),
    "one_inertia": ("theta_m", "omega_m", "z"),
}
MOST_STATES = 8
DEFAULT_ORDERS = tuple(range(1, 16))
MAX_ORDERS = 64

Order = int | float | str | Fraction


def parse_order(value: object) -> Fraction:
    """An order (cycles per motor revolution) from 2, 0.5, "120/121" or a Fraction, exact where it can be."""
    allowed = 'allowed: a positive number such as 2, 0.5 or "120/121"'
    fraction = None
    if isinstance(value, str):
        if re.fullmatch(r"\s*\d+(\.\d+|\s*/\s*\d*[1-9]\d*)?\s*", value) and len(value) < 40:
            fraction = Fraction(value.replace(" ", ""))
    elif isinstance(value, numbers.Rational) and not isinstance(value, bool):
        fraction = Fraction(value)
    elif isinstance(value, numbers.Real) and not isinstance(value, bool) and math.isfinite(value):
        close = Fraction(float(value)).limit_denominator(1000)
        fraction = close if float(close) == float(value) else Fraction(repr(float(value)))
    if fraction is None or not Fraction(1, 10**6) <= fraction <= 10**4:
        raise InputError(f"order {shorten(value)} is not usable ({allowed}, at most 10000)")
    return fraction


def _parse_orders(orders: object) -> tuple[Fraction, ...]:
    parsed = tuple(parse_order(order) for order in checks.listed("orders", orders, "orders", MAX_ORDERS))
    seen: set[Fraction] = set()
    for order in parsed:
        if order in seen:
            raise InputError(f"orders contains {order} twice")
        seen.add(order)
    return parsed


def _check_states(chosen: Iterable[str]) -> None:
    """The core has room for eight hidden states."""
    needed = {term: len(terms()[term].states) for term in chosen if terms()[term].states}
    if sum(needed.values()) > MOST_STATES:
        listed = ", ".join(f"{term} {count}" for term, count in needed.items())
        raise InputError(f"terms have {sum(needed.values())} hidden states ({listed}; allowed: at most {MOST_STATES})")


@dataclass(frozen=True)
class Model:
    """The equations a batch solves. Rows of one batch differ in parameters, never in equations.

    Args:
        base: "two_inertia" (motor and load joined by the gear spring) or "one_inertia" (the rigid limit in the motor
            coordinate, keeping the kinematic error).
        spring: "polynomial" (k1 ... k5 with linear continuation beyond phi_max) or "piecewise" (K1, K2, K3 between the
            torques T1 and T2).
        orders: orders of the kinematic error in cycles per motor revolution: 2, 0.5, "120/121" or a Fraction.
        terms: ids of physics beyond the nominal model, see `hdfast.terms()`; each says which base models it can
            join.

    Raises:
        InputError: naming the argument, its value and what is allowed.
    """

    base: str = "two_inertia"
    spring: str = "polynomial"
    orders: Sequence[Order] = DEFAULT_ORDERS
    terms: Sequence[str] = ()
    _orders: tuple[Fraction, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        choose("base", self.base, BASES)
        choose("spring", self.spring, SPRINGS)
        parsed = _parse_orders(self.orders)
        object.__setattr__(self, "_orders", parsed)
        object.__setattr__(self, "orders", tuple(str(order) for order in parsed))
        object.__setattr__(self, "terms", tuple(checks.listed("terms", self.terms, "term ids")))
        for term in self.terms:
            info = terms()[term]
            if info.channels:
                raise InputError(
                    f"terms: {term!r} acts on a recorded channel, not on the drive "
                    f"(allowed: sensors=hdfast.sensors.SensorStage([({term!r}, {info.channels[0]!r})]))"
                )
            if self.base not in info.bases:
                raise InputError(f"terms: {term!r} with base = {self.base!r} (allowed: {', '.join(info.bases)})")
        if len(set(self.terms)) < len(self.terms):
            raise InputError(f"terms = {shorten(self.terms)} names a term twice")
        _check_states(self.terms)

    @property
    def order_values(self) -> list[float]:
        """The orders as numbers, in the given sequence."""
        return [float(order) for order in self._orders]

    @property
    def order_labels(self) -> list[str]:
        """The orders as printed in parameter names: "2", "120/121"."""
        return [str(order) for order in self._orders]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the reported states, in the columns of `final_state`."""
        return STATES[self.base]
