"""What the compiled core offers: methods, row statuses, metrics and signals."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from hdfast import _core, checks
from hdfast.errors import InputError, choose
from hdfast.model import parse_order

FINISHED = "finished"
CANCELLED = "cancelled"
MAX_STEPS = "max_steps"
ON_DEMAND = {"order_": "rad", "speed_order_": "rad/s"}
AUTO_METHOD = "dop853"


@dataclass(frozen=True)
class Quantity:
    """A metric or a signal."""

    name: str
    unit: str
    meaning: str


@dataclass(frozen=True)
class Status:
    """Outcome of a row, with a sentence that says what to do."""

    code: int
    name: str
    remedy: str


def build_info() -> dict[str, Any]:
    """How the core was built: version, profile, chosen and available vector code.

    Raises:
        InputError: the environment variable HDFAST_SIMD names no vector code of this machine.
    """
    try:
        return _core.build_info()
    except ValueError as error:
        raise InputError(str(error)) from None


@cache
def metrics() -> dict[str, Quantity]:
    """Metrics by name. Besides these, `order_<o>` and `speed_order_<o>` give amplitudes at any order.

    They are found over the last whole motor revolutions before t_off that last half a second, whatever the run phase.
    At most 20,000 samples reach back over four times as long at the set speed: NaN where the revolutions began earlier,
    or where an order, or one of the kinematic error, has fewer than 2.5 samples per period. NaN also where the
    revolutions hold less than one turn of the order, or of its difference to another one of the kinematic error: they
    would not tell it from a drift, or from that one.
    """
    return {row["name"]: Quantity(**row) for row in _core.metrics()}


@cache
def signals() -> dict[str, Quantity]:
    """Signals that can be sampled, by name."""
    return {row["name"]: Quantity(**row) for row in _core.signals()}


@cache
def statuses() -> dict[int, Status]:
    """Outcomes of a row by code; 0 is "finished"."""
    return {code: Status(code, name, remedy) for code, name, remedy in _core.statuses()}


def status_code(name: str) -> int:
    """The code of an outcome."""
    return next(code for code, status in statuses().items() if status.name == name)


@cache
def methods() -> dict[str, dict[str, Any]]:
    """Integration methods by name: order, order of the dense output, stages, whether they know terms."""
    return {row["name"]: dict(row) for row in _core.methods()}


def choose_method(method: object, *, terms: bool = False) -> str:
    """The method's name with "auto" resolved.

    Args:
        method: name of a method.
        terms: whether the model has some.

    Raises:
        InputError: an unknown method, or one that does not know terms.
    """
    name = choose("method", method, ["auto", *methods()])
    known = [one for one, row in methods().items() if row["terms"]]
    if terms and name not in ("auto", *known):
        raise InputError(f"method = {name!r} with terms (allowed: auto, {', '.join(known)})")
    return AUTO_METHOD if name == "auto" else name


def order_amplitude(name: object) -> Quantity | None:
    """The metric behind `order_0.5` or `speed_order_2`, None for another name.

    Raises:
        InputError: an order that cannot be.
    """
    for prefix, unit in ON_DEMAND.items():
        if isinstance(name, str) and re.match(re.escape(prefix) + r"\d", name):
            label = str(parse_order(name.removeprefix(prefix)))
            what = "transmission error" if prefix == "order_" else "load speed"
            meaning = f"amplitude of order {label} of the {what} over the last whole revolutions before the stop"
            return Quantity(prefix + label, unit, meaning)
    return None


def metric(name: object) -> Quantity:
    """Look up a metric, including the order amplitudes.

    Raises:
        InputError: naming the nearest known metric.
    """
    order = order_amplitude(name)
    if order is not None:
        return order
    return metrics()[choose("metrics", name, [*metrics(), *(f"{prefix}2" for prefix in ON_DEMAND)])]


def choose_metrics(names: Any) -> list[Quantity]:
    """The asked-for metrics, all fixed ones for None.

    Raises:
        InputError: not a list, an unknown name, or a name twice.
    """
    if names is None:
        return list(metrics().values())
    return _unique("metrics", [metric(name) for name in checks.listed("metrics", names)])


def choose_signals(names: Any, default: tuple[str, ...]) -> list[Quantity]:
    """The asked-for signals, `default` for None.

    Raises:
        InputError: not a list, an unknown name, or a name twice.
    """
    wanted = default if names is None else checks.listed("signals", names)
    return _unique("signals", [signals()[choose("signals", name, signals())] for name in wanted])


def _unique(argument: str, chosen: list[Quantity]) -> list[Quantity]:
    seen: set[str] = set()
    for item in chosen:
        if item.name in seen:
            raise InputError(f"{argument} contains {item.name!r} twice")
        seen.add(item.name)
    return chosen
