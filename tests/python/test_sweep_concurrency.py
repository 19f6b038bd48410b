"""Sweeps from several threads, after a fork, in spawned processes, and interrupted ones."""

from __future__ import annotations

import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import hdfast
import numpy as np
import pytest
from processes import interruptible

SHORT = hdfast.Scenario.start_stop(t_end=0.6, t_off=0.3)
PROGRAM = """
import multiprocessing, os, sys
import numpy as np
import hdfast

SHORT = hdfast.Scenario.start_stop(t_end=0.6, t_off=0.3)


def job(seed):
    rows = {"J_l": np.random.default_rng(seed).uniform(0.4, 0.6, 40)}
    return hdfast.sweep(rows, scenario=SHORT, metrics=["te_pp"], threads=2)["te_pp"].tobytes()
"""
FORK = """
expected = job(1)
child = os.fork()
if child == 0:
    os._exit(0 if job(1) == expected else 3)
assert os.waitpid(child, 0)[1] == 0
assert job(1) == expected
"""
SPAWN = """
if __name__ == "__main__":
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        assert pool.map(job, range(4)) == [job(seed) for seed in range(4)]
"""


def job(seed):
    rows = {"J_l": np.random.default_rng(seed).uniform(0.4, 0.6, 40)}
    return hdfast.sweep(rows, scenario=SHORT, metrics=["te_pp"], threads=2)["te_pp"].tobytes()


def test_exact_four_python_threads_at_once():
    expected = [job(seed) for seed in range(8)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(job, range(8))) == expected


@pytest.mark.parametrize("ending", [FORK, SPAWN], ids=["fork", "spawn"])
def test_exact_other_processes(ending, tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM + ending)
    command = [sys.executable, "-W", "ignore", str(tmp_path / "program.py")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


def test_exact_other_python_code_runs_meanwhile():
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.002):
            ticks.append(1)

    thread = threading.Thread(target=tick)
    thread.start()
    result = hdfast.sweep({"J_l": np.full(600, 0.5)}, metrics=["te_pp"], threads=1)
    stop.set()
    thread.join()
    assert len(ticks) > 0.05 * result.seconds / 0.002


def test_exact_failing_progress_function_stops_the_sweep():
    class MineError(Exception):
        pass

    def fail(done, total):
        raise MineError(f"{total} rows")

    with pytest.raises(MineError, match="50000 rows"):
        hdfast.sweep({"J_l": np.full(50_000, 0.5)}, metrics=["te_pp"], progress=fail, threads=1)


def printed(code):
    process = interruptible([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    told, complaint = process.communicate(timeout=120)
    assert process.returncode == 0, complaint
    return told


def test_exact_interrupt_keeps_finished_rows_and_neighbours():
    code = """
import _thread, threading, time
import numpy as np
import hdfast

rows = {"J_l": np.linspace(0.4, 0.6, 200_000)}
moment = []

def stop():
    moment.append(time.perf_counter())
    _thread.interrupt_main()

threading.Timer(1.0, stop).start()
try:
    hdfast.sweep(rows, metrics=["te_pp"], threads=2)
except hdfast.Interrupted as caught:
    waited = time.perf_counter() - moment[0]
    result = caught.result
done = np.flatnonzero(result.finished)[:50]
assert 0 < result.finished.sum() < 200_000
assert set(result.status_counts()) == {"finished", "cancelled"}
again = hdfast.sweep({"J_l": rows["J_l"][done]}, metrics=["te_pp"])
assert np.array_equal(result["te_pp"][done], again["te_pp"])
assert np.isnan(result["te_pp"][~result.finished]).all()
print(waited / (1.0 + waited) * result.finished.mean())
"""
    assert float(printed(code)) < 0.05  # of the time that the whole sweep would have taken


def test_exact_interrupt_is_heeded_among_bad_rows():
    code = """
import _thread
import numpy as np
import hdfast

rows = {"J_l": np.full(3_000_000, -1.0)}
try:
    hdfast.sweep(rows, metrics=[], threads=1, progress=lambda done, total: _thread.interrupt_main())
except hdfast.Interrupted as caught:
    result = caught.result
counts = result.status_counts()
assert result.message(-1) == "row 2999999: cancelled, not begun: " + hdfast.statuses()[int(result.status[-1])].remedy
print(counts["bad_parameters"], counts["cancelled"])
"""
    bad, cancelled = map(int, printed(code).split())
    assert bad + cancelled == 3_000_000
    assert cancelled > 0


def test_exact_rows_that_an_interrupt_leaves_without_some_derivatives_are_not_finished():
    code = """
import _thread, threading
import numpy as np
import hdfast

rows = {"J_l": np.linspace(0.4, 0.6, 50_000)}
threading.Timer(1.0, _thread.interrupt_main).start()
try:
    hdfast.sweep(rows, metrics=["te_rms"], sensitivities=["J_l", "J_m", "k1", "B_m", "B_l"], threads=2)
except hdfast.Interrupted as caught:
    result = caught.result
assert 0 < result.finished.sum() < 50_000
slopes = result.metric_sensitivities["te_rms"]
assert np.isfinite(slopes[result.finished]).all()
assert set(result.status_counts()) == {"finished", "cancelled"}
"""
    printed(code)


def test_exact_what_a_signal_handler_raises_reaches_the_caller():
    code = """
import signal
import numpy as np
import hdfast

class TimeIsUp(Exception):
    pass

def ring(number, frame):
    raise TimeIsUp

signal.signal(signal.SIGALRM, ring)
signal.setitimer(signal.ITIMER_REAL, 0.5)
try:
    hdfast.sweep({"J_l": np.full(200_000, 0.5)}, metrics=["te_pp"], threads=2)
except TimeIsUp:
    print("told")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert done.stdout == "told\n", done.stderr


def test_exact_more_threads_than_rows():
    rows = {"J_l": np.full(3, 0.5)}
    many, one = (hdfast.sweep(rows, scenario=SHORT, metrics=["te_pp"], threads=threads) for threads in (1024, 1))
    assert many["te_pp"].tobytes() == one["te_pp"].tobytes()
