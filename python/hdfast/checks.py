"""Checks of single numbers and arrays; each names the argument, the value and the allowed range."""

from __future__ import annotations

import contextlib
import math
import numbers
import os
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hdfast.errors import InputError, shorten

Floats = NDArray[np.float64]

MAX_SEED = 2**63 - 1
MAX_ENTRIES = 1000
_NUMERIC = "biuf"


def number(argument: str, value: Any, low: float = -math.inf, high: float = math.inf, unit: str = "") -> float:
    """A real number within [low, high]; infinities only when the bound itself is infinite, NaN never."""
    suffix = f" {unit}" if unit else ""
    unbounded = low == -math.inf and high == math.inf
    allowed = "allowed: any number, not NaN" if unbounded else f"allowed: a number from {low:g} to {high:g}{suffix}"
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise InputError(f"{argument} = {shorten(value)} is not a number ({allowed})")
    try:
        result = float(value)
    except OverflowError:
        raise InputError(f"{argument} = {shorten(value)}{suffix} is out of range ({allowed})") from None
    if not low <= result <= high:
        raise InputError(f"{argument} = {result:g}{suffix} is out of range ({allowed})")
    return result


def finite(argument: str, value: Any, low: float = -math.inf, high: float = math.inf, unit: str = "") -> float:
    """As `number`, without infinities."""
    result = number(argument, value, low, high, unit)
    if math.isinf(result):
        raise InputError(f"{argument} = {result:g} must be finite")
    return result


def positive(argument: str, value: Any, high: float = math.inf, unit: str = "") -> float:
    """A number greater than zero and at most `high`."""
    result = number(argument, value, 0.0, high, unit)
    if result == 0.0:
        raise InputError(f"{argument} = 0 must be greater than zero")
    return result


def whole(argument: str, value: Any, low: int, high: int) -> int:
    """A whole number within [low, high]."""
    allowed = f"allowed: a whole number from {low} to {high}"
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral):
        raise InputError(f"{argument} = {shorten(value)} is not a whole number ({allowed})")
    result = int(value)
    if not low <= result <= high:
        raise InputError(f"{argument} = {shorten(result)} is out of range ({allowed})")
    return result


def listed(argument: str, value: Any, allowed: str = "names", most: int = MAX_ENTRIES) -> list[Any]:
    """The entries, up to `most`, of anything in order but a text; `allowed` says what they are, for messages."""
    unordered = isinstance(value, (str, bytes, set, frozenset)) or not isinstance(value, Iterable)
    if unordered or getattr(value, "ndim", 1) != 1:
        raise InputError(f"{argument} = {shorten(value)} is not a list (allowed: {allowed})")
    entries = list(value)
    if len(entries) > most:
        raise InputError(f"{argument} has {len(entries)} entries (allowed: at most {most})")
    return entries


def flag(argument: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{argument} = {shorten(value)} is not true or false")
    return bool(value)


def as_floats(argument: str, value: Any) -> Floats:
    """A float64 array in native byte order; a view when it already is one.

    Strides that are not whole elements (packed records) and unaligned data are copied: the core walks in elements.
    """
    if isinstance(value, np.ma.MaskedArray):
        return np.ma.filled(value.astype(np.float64), np.nan)
    try:
        array = np.asarray(value)
    except (ValueError, TypeError) as error:
        raise InputError(f"{argument} is not an array: {error}") from None
    if array.dtype.kind == "O" and hasattr(value, "to_numpy"):
        with contextlib.suppress(TypeError, ValueError):
            array = value.to_numpy(dtype=np.float64, na_value=np.nan)
    if array.dtype.kind not in _NUMERIC or array.dtype.kind == "b":
        raise InputError(f"{argument} has dtype {array.dtype}, allowed: real numbers (float64 is used as it is)")
    exact = array.dtype == np.float64 and array.flags.aligned and all(step % 8 == 0 for step in array.strides)
    return array if exact else array.astype(np.float64)


def table(argument: str, value: Any) -> Floats:
    """A finite one-dimensional float64 array with at least one element."""
    array = as_floats(argument, value)
    if array.ndim != 1 or array.size == 0:
        raise InputError(f"{argument} has shape {array.shape}, allowed: (n,) with n of at least 1")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise InputError(f"{argument}[{bad[0]}] = {array[bad[0]]} must be finite")
    return array


def times(argument: str, value: Any, end: float = math.inf, *, strictly: bool = True) -> Floats:
    """Sorted times in seconds within [0, end]."""
    array = rising(argument, value, strictly=strictly)
    if array[0] < 0.0 or array[-1] > end:
        value_out = array[0] if array[0] < 0.0 else array[-1]
        raise InputError(f"{argument} = {value_out:g} s is out of range (allowed: from 0 to {end:g} s)")
    return array


def rising(argument: str, value: Any, *, strictly: bool = True) -> Floats:
    """Sorted times in seconds."""
    array = table(argument, value)
    steps = np.diff(array)
    wrong = np.flatnonzero(steps <= 0.0 if strictly else steps < 0.0)
    if wrong.size:
        here, following = array[wrong[0] : wrong[0] + 2]
        order = "strictly increase" if strictly else "not decrease"
        raise InputError(f"{argument} must {order}: {argument}[{wrong[0]}] = {here:g} s, next {following:g} s")
    return array


def memory_limit() -> int:
    """Physical memory in bytes, the size above which an output is refused."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 2**40
