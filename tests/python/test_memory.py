"""A sweep needs the memory of its inputs and outputs, and little more."""

import subprocess
import sys
from pathlib import Path

import pytest

ALLOWANCE_MB = 30  # all 45 columns of 150,000 rows would be 54 MB

MEASURE = """
import sys
from pathlib import Path
import numpy as np
import hdfast

def peak():
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024

rows = int(sys.argv[1])
columns = {name: np.full(rows, value) for name, value in [("J_l", 0.5), ("J_m", 3e-4), ("te_scale", 1.0)]}
columns["J_l"] *= np.random.default_rng(1).normal(1, 0.05, rows)
scenario = hdfast.Scenario.start_stop(t_off=0.05, t_end=0.1)
hdfast.sweep({name: values[:64] for name, values in columns.items()}, scenario=scenario, metrics=METRICS)
before = peak()
result = hdfast.sweep(columns, scenario=scenario, metrics=METRICS)
arrays = [result.final_state, result.status, result.steps, result.time, *result.metrics.values()]
outputs = sum(array.nbytes for array in arrays)
print(peak() - before, outputs / 2**20, result.status_counts())
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peak memory of a process is read from /proc")
@pytest.mark.parametrize("rows", [150_000, pytest.param(1_000_000, marks=pytest.mark.long)])
def test_exact_memory_is_outputs_plus_allowance(rows: int) -> None:
    script = MEASURE.replace("METRICS", '["te_rms", "peak_windup"]')
    done = subprocess.run([sys.executable, "-c", script, str(rows)], capture_output=True, text=True, check=True)
    growth, outputs = map(float, done.stdout.split()[:2])
    assert growth < outputs + ALLOWANCE_MB, done.stdout
