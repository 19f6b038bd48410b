"""Instructions of the kernel for a step, counted by valgrind: a slower kernel shows on any machine, however busy."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import hdfast
import pytest

#: Instructions per attempted step of a row: dop853, 15 orders, final state alone, AVX2, all lanes in step.
EXPECTED = 1041
COMPILER = "1.95"
BAND = 0.02
KERNEL = re.compile(r"hdfast::batch::dispatch::\w+::compiled")
PROGRAM = """
import sys
import numpy as np
import problem
rows = {name: np.full(64, np.median(values)) for name, values in problem.columns(64).items()}
result = problem.sweep(rows, (), method="dop853", threads=1)
sys.stdout.write(str(int(np.sum(result.steps) + np.sum(result.rejected))))
"""


def compiler() -> str:
    """Version of the Rust compiler, which builds the extension in this tree."""
    rustc = shutil.which("rustc")
    return subprocess.run([rustc, "--version"], capture_output=True, text=True, check=True).stdout if rustc else ""


def counted(report: Path) -> dict[str, int]:
    """Instructions by function from cachegrind's report."""
    totals: dict[str, int] = {}
    function = ""
    for line in report.read_text(encoding="utf-8").splitlines():
        if line.startswith("fn="):
            function = line[3:]
        elif line[:1].isdigit():
            totals[function] = totals.get(function, 0) + int(line.split()[1])
    return totals


@pytest.mark.long
@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed: instructions are not counted")
@pytest.mark.skipif("avx2" not in hdfast.build_info()["simd_available"], reason="recorded for the AVX2 path")
def test_regress_instructions_of_a_step(tmp_path: Path) -> None:
    if f" {COMPILER}." not in compiler():
        pytest.skip(f"recorded with rustc {COMPILER}, here {compiler().strip() or 'none'}")
    root = Path(__file__).parents[2]
    report = tmp_path / "cachegrind"
    tool = ["valgrind", "--tool=cachegrind", "--cache-sim=no", f"--cachegrind-out-file={report}"]
    paths = os.pathsep.join([str(Path(hdfast.__file__).parents[1]), str(root / "benches")])
    environment = os.environ | {"PYTHONPATH": paths, "HDFAST_SIMD": "avx2", "OPENBLAS_NUM_THREADS": "1"}
    answer = subprocess.run(
        [*tool, sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False
    )
    assert answer.returncode == 0, answer.stderr[-2000:]
    kernel = sum(count for function, count in counted(report).items() if KERNEL.search(function))
    per_step = kernel / int(answer.stdout)
    assert abs(per_step / EXPECTED - 1) <= BAND, f"{per_step:.0f} instructions per step, {EXPECTED} expected"
