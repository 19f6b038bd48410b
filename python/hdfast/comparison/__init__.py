"""The nominal drive as given against recordings, nothing fitted."""

from hdfast.comparison.compare import Comparison, compare

__all__ = ["Comparison", "compare"]
