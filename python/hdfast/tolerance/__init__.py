"""Tolerance studies: from distributions to yield.

`hdfast.tolerance("file.toml", n=100_000)` runs a whole study: `help(hdfast.tolerance.run.tolerance)` has its
arguments. The modules of this package are its parts.
"""

from __future__ import annotations

import sys
import types
from typing import Any


class _Package(types.ModuleType):
    """This package, which may also be called: `hdfast.tolerance(...)` is `hdfast.tolerance.run.tolerance(...)`."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        from hdfast.tolerance.run import tolerance

        return tolerance(*arguments, **options)


sys.modules[__name__].__class__ = _Package
