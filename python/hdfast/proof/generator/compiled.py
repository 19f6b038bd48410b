"""The one way in which the generator compiles a function."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """The function in machine code, cached on disk between processes.

    The cache notices a change of the function's own file, and none of what it calls: empty `__pycache__` after one.
    """
    made: Any = numba.njit(cache=True, fastmath=True, error_model="numpy", forceinline=True)(function)
    return cast(Function, made)
