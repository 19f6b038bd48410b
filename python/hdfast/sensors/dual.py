"""Dual numbers: values and their derivatives, carried through the formulas that are written for values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import NDArray

from hdfast.checks import Floats

PARTIALS: dict[np.ufunc, Callable[..., tuple[Any, ...]]] = {
    np.add: lambda *_: (1.0, 1.0),
    np.subtract: lambda *_: (1.0, -1.0),
    np.multiply: lambda _, a, b: (b, a),
    np.divide: lambda y, _, b: (1.0 / b, -y / b),
    np.sin: lambda _, a: (np.cos(a),),
    np.cos: lambda _, a: (-np.sin(a),),
    np.negative: lambda *_: (-1.0,),
    np.exp: lambda y, _: (y,),
    np.expm1: lambda y, _: (y + 1.0,),
}
STEPWISE = {np.floor, np.greater, np.less}


class Dual(NDArrayOperatorsMixin):
    """Numbers and their derivatives along W directions; the numbers are those of the same formula without derivatives.

    Attributes:
        value: numbers, shape (M, T).
        slopes: their derivatives, shape (W, M, T) or what broadcasts to it.
    """

    def __init__(self, value: Floats, slopes: Floats) -> None:
        self.value = value
        self.slopes = slopes

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options:
            return NotImplemented
        values = [value(x) for x in inputs]
        y = ufunc(*values)
        if ufunc in STEPWISE:
            return y
        if ufunc not in PARTIALS:
            return NotImplemented
        partials = PARTIALS[ufunc](y, *values)
        moving = [p * x.slopes for p, x in zip(partials, inputs, strict=True) if isinstance(x, Dual)]
        return Dual(y, sum(moving[1:], start=moving[0]))

    def __getitem__(self, key: Any) -> Dual:
        """Along the last axis: `[..., k]`."""
        return Dual(self.value[key], _full(self)[key])


Number: TypeAlias = Floats | Dual


def value(x: Number) -> Floats:
    """The numbers alone."""
    return x.value if isinstance(x, Dual) else x


def slopes(x: Number) -> Any:
    """The derivatives alone; those of a constant are 0."""
    return x.slopes if isinstance(x, Dual) else 0.0


def with_slopes_of(x: Number, values: Floats) -> Number:
    """Other values with the derivatives of x."""
    return Dual(values, x.slopes) if isinstance(x, Dual) else values


def select(condition: NDArray[np.bool_], a: Any, b: Any) -> Number:
    """Like `numpy.where`."""
    values = np.where(condition, value(a), value(b))
    if not isinstance(a, Dual) and not isinstance(b, Dual):
        return values
    return Dual(values, np.where(condition, slopes(a), slopes(b)))


def along(function: Callable[[Floats], Floats], x: Number) -> Number:
    """A function that is linear along the last axis."""
    return Dual(function(x.value), function(_full(x))) if isinstance(x, Dual) else function(x)


def take(x: Number, place: NDArray[np.int64]) -> Number:
    """Numbers (M, K) of x (M, T) at the places (M, K) along the last axis."""
    return along(lambda a: np.take_along_axis(a, place.reshape((1,) * (a.ndim - place.ndim) + place.shape), axis=-1), x)


def recurrence(first: Number, factor: Number, term: Number) -> Number:
    """The sequence y_0 = first (M, 1), y_(k+1) = factor_k y_k + term_k along the last axis, shape (M, T)."""
    y = _sequence(value(first), value(factor), value(term))
    if not any(isinstance(x, Dual) for x in (first, factor, term)):
        return y
    change = slopes(factor) * y[..., :-1] + slopes(term)
    return Dual(y, _sequence(slopes(first), value(factor), change))


def _full(x: Dual) -> Floats:
    """The derivatives, shape (W, M, T)."""
    return np.broadcast_to(x.slopes, (len(x.slopes), *x.value.shape))


def _sequence(first: Floats, factor: Floats, term: Floats) -> Floats:
    by_step = [np.ascontiguousarray(np.moveaxis(x, -1, 0)) for x in (factor, term)]
    y = np.empty((len(by_step[1]) + 1, *by_step[1].shape[1:]))
    y[0] = first[..., 0]
    for k, (a, b) in enumerate(zip(*by_step, strict=True)):
        y[k + 1] = a * y[k] + b
    return np.ascontiguousarray(np.moveaxis(y, 0, -1))
