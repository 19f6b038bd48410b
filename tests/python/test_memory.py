"""A sweep needs the memory of its inputs and outputs, and little more."""

import subprocess
import sys
from pathlib import Path

import hdfast
import numpy as np
import pytest

ALLOWANCE_MB = 30  # all 45 columns of 150,000 rows would be 54 MB

PEAK = """
import sys
from pathlib import Path
import numpy as np
import hdfast

def peak():
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024

"""
MEASURE = """
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
LONG_ROW = """
scenario = hdfast.Scenario.start_stop(speed_rpm=600.0, start="speed_ramp", stop="brake", t_off=14.0, t_end=15.0)
names = ["steady_speed", "rise_time", "stop_time"]
expected = hdfast.sweep({}, scenario=scenario, metrics=names, rtol=1e-9)
before = peak()
found = hdfast.sweep({}, scenario=scenario, metrics=names, max_step=4e-5)
print(peak() - before, found.steps[0], *(found[name][0] / expected[name][0] - 1.0 for name in names))
"""

from_proc = pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="peak memory of a process is read from /proc"
)


def answer(script: str, *arguments: str) -> list[str]:
    """What a script prints whose process has run nothing before."""
    command = [sys.executable, "-c", PEAK + script, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


@from_proc
@pytest.mark.parametrize("rows", [150_000, pytest.param(1_000_000, marks=pytest.mark.long)])
def test_exact_memory_is_outputs_plus_allowance(rows: int) -> None:
    script = MEASURE.replace("METRICS", '["te_rms", "peak_windup"]')
    growth, outputs = map(float, answer(script, str(rows))[:2])
    assert growth < outputs + ALLOWANCE_MB


@from_proc
def test_exact_steps_of_a_long_row_take_bounded_memory() -> None:
    """Of 375,000 steps, 40 MB, those of the rise, of the steady run and of the stop are enough."""
    growth, steps, *errors = map(float, answer(LONG_ROW))
    assert steps > 370_000
    assert growth < ALLOWANCE_MB
    assert max(map(abs, errors)) < 1e-6


def test_exact_what_was_read_off_forgotten_steps_is_missing() -> None:
    """The steady run and the way up to it take more steps than are remembered."""
    scenario = hdfast.Scenario.start_stop(t_off=1.0, t_end=1.1)
    row = {"metrics": ["steady_speed", "rise_time", "dead_time", "order_2"], "scenario": scenario}
    found = hdfast.sweep({}, max_step=1e-5, **row)
    assert found.finished.all()
    assert all(np.isnan(values).all() for values in found.metrics.values())
