from __future__ import annotations

import os
import signal

import dask
import distributed
import hdfast
import numpy as np
import pytest
from hdfast import config
from hdfast.tolerance.chunks import ranges
from hdfast.tolerance.cluster import LOCAL_SETTINGS, outcome, run_on_cluster
from hdfast.tolerance.store import MemoryStore
from hdfast.tolerance.task import Task
from test_tolerance_storage import contents
from toleranced import SMALL

pytestmark = [  # sockets of a killed worker that nobody closes
    pytest.mark.filterwarnings("default::ResourceWarning"),
    pytest.mark.filterwarnings("default::pytest.PytestUnraisableExceptionWarning"),
]


FAILURES = "distributed.scheduler.allowed-failures"


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


def test_exact_one_of_two_workers_killed_gives_identical_bytes(small, tmp_path, long):
    rows = 4000 if long else 400
    hdfast.tolerance(small, n=rows, out=tmp_path / "here", chunk=25)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        first = next(iter(cluster.workers.values()))
        killed = []

        def kill_once(done, total):
            if not killed and 0 < done < total:
                killed.append(first.pid)
                os.kill(first.pid, signal.SIGKILL)

        hdfast.tolerance(
            small, n=rows, out=tmp_path / "there", chunk=25, cluster=cluster.scheduler_address, progress=kill_once
        )
    assert killed
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


class Deadly:
    """The task of a study in which one row takes its process down."""

    def __init__(self, task, row):
        self.task, self.row = task, row

    def __call__(self, start, stop):
        if start <= self.row < stop:
            os._exit(1)
        return self.task(start, stop)

    def poisoned(self, row, reason):
        return self.task.poisoned(row, reason)


@pytest.mark.long
def test_exact_a_row_that_kills_workers_is_found_by_halving(monkeypatch):
    """A task is given up after one death instead of three, each of which costs a start of a process."""
    assert LOCAL_SETTINGS[FAILURES] == 2
    monkeypatch.setitem(LOCAL_SETTINGS, FAILURES, 0)
    parsed = config.parse(SMALL)
    task = Task(parsed, parsed.plan(), ("te_pp",), 1)
    store = MemoryStore()
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "10 ms"}):
        run_on_cluster(Deadly(task, 5), ranges(12, 4), store, lambda rows: None, workers=2)
    assert store.poison == [(5, "KilledWorker: 1 workers died while running this row alone")]
    whole = task(0, 12).table.column("te_pp").to_numpy()
    good = np.arange(12) != 5
    assert np.array_equal(store.column("te_pp")[good], whole[good])


def test_exact_what_cannot_mean_anything_is_no_rows_fault():
    class Refused:
        def result(self):
            raise hdfast.InputError("threads = -1 is out of range")

    with pytest.raises(hdfast.InputError, match="threads = -1"):
        outcome(Refused())


def test_exact_wrong_cluster_is_refused(small):
    with pytest.raises(hdfast.InputError, match="cluster = 3"):
        hdfast.tolerance(small, n=10, cluster=3)
