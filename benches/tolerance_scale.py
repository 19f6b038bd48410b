"""A whole tolerance study against the engine alone: 1,000,000 rows of examples/benchmark.toml, stored and summarised.

Usage: python benches/tolerance_scale.py [rows]
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import hdfast
from hdfast import catalogue
from hdfast.tolerance import task

EXAMPLE = Path(__file__).parents[1] / "examples" / "benchmark.toml"
engine = [0.0]
simulate = task.simulate


def timed(*arguments: Any, **options: Any) -> Any:
    """The engine call of every chunk, with its own seconds added up."""
    result = simulate(*arguments, **options)
    engine[0] += result.seconds
    return result


task.simulate = timed
rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
with tempfile.TemporaryDirectory() as folder:
    begin = time.monotonic()
    study = hdfast.tolerance(EXAMPLE, n=rows, out=Path(folder) / "study")
    study.yields  # noqa: B018
    study.percentiles  # noqa: B018
    seconds = time.monotonic() - begin
memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
print(f"{catalogue.build_info()['profile']} build, {catalogue.build_info()['simd']}")
print(f"{rows:,} rows: {seconds:.1f} s with storage and statistics, engine alone {engine[0]:.1f} s")
print(f"ratio {seconds / engine[0]:.3f}, resident memory {memory:.2f} GB")
