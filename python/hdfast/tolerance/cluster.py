"""The same chunks on Dask distributed: workers may die, a chunk that kills them is halved down to the row to blame."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hdfast.errors import InputError, require_package
from hdfast.threads import available_threads
from hdfast.tolerance.chunks import Range, Report, Store, Work, describe
from hdfast.tolerance.task import Piece, join

LOCAL = "local"
MAX_WORKERS = 4096
LOCAL_SETTINGS = {
    "distributed.scheduler.allowed-failures": 2,
    "distributed.deploy.lost-worker-timeout": "1 day",
}
AHEAD = 2


def run_on_cluster(
    work: Work, todo: list[Range], store: Store, report: Report, *, address: str = LOCAL, workers: int | None = None
) -> None:
    """Run chunks on a cluster; finished ones are stored by this process, so the bytes are those of a local run.

    Args:
        work: what is done to a chunk; must be picklable.
        address: of a scheduler, or "local" for a `LocalCluster` on this machine.
        workers: processes of the local cluster; default one per CPU.

    Raises:
        MissingPackageError: Dask distributed is not installed.
    """
    with connect(address, workers) as client:
        _Dispatch(client, work, store, report).run(todo)


@contextmanager
def connect(address: str = LOCAL, workers: int | None = None) -> Iterator[Any]:
    """A Dask client; a local cluster lives as long as the client.

    A local cluster gives a worker up for good when, some time after its death, it happens to be starting again; with
    rows that kill many workers none would be left to wait for, so that this time outlasts any study.
    """
    require_package("distributed", "cluster")
    import dask
    from distributed import Client, LocalCluster

    if address != LOCAL:
        with Client(address) as client:  # type: ignore[no-untyped-call]
            yield client
        return
    with (
        dask.config.set(LOCAL_SETTINGS),
        LocalCluster(  # type: ignore[no-untyped-call]
            n_workers=workers or available_threads(), threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        Client(cluster) as client,  # type: ignore[no-untyped-call]
    ):
        yield client


def blame(failure: Exception) -> str:
    """Why a row cannot be run, in words that are the same in every run."""
    from distributed import KilledWorker

    if isinstance(failure, KilledWorker):
        return f"KilledWorker: {failure.allowed_failures + 1} workers died while running this row alone"
    return describe(failure)


def outcome(future: Any) -> Piece | Exception:
    """What a finished task left: its piece, or why there is none; a piece can die with the worker that holds it.

    Raises:
        InputError: what was asked for cannot mean anything, which is no row's fault.
    """
    try:
        piece: Piece = future.result()
    except InputError:
        raise
    except Exception as failure:
        return failure
    return piece


class _Dispatch:
    """Keeps a few chunks per worker under way and puts the parts of a halved chunk together again."""

    def __init__(self, client: Any, work: Work, store: Store, report: Report) -> None:
        self.client, self.work, self.store, self.report = client, work, store, report
        self.parts: dict[Range, list[Piece]] = {}
        self.origin: dict[str, tuple[Range, Range]] = {}
        self.suspects: list[tuple[Range, Range]] = []

    def run(self, todo: list[Range]) -> None:
        from distributed import as_completed

        waiting = iter(todo)
        under_way: Any = as_completed()  # type: ignore[no-untyped-call]
        workers = max(1, len(self.client.scheduler_info(n_workers=-1)["workers"]))
        for _, chunk in zip(range(AHEAD * workers), waiting, strict=False):
            under_way.add(self.submit(chunk, chunk))
        for future in under_way:
            chunk, part = self.origin.pop(future.key)
            found = outcome(future)
            if not isinstance(found, Exception):
                self.collect(chunk, found)
            elif part[1] - part[0] == 1:
                self.suspects.append((chunk, part))
            else:
                middle = (part[0] + part[1]) // 2
                for half in ((part[0], middle), (middle, part[1])):
                    under_way.add(self.submit(chunk, half))
            future.release()
            settled = chunk not in self.parts or (chunk, part) in self.suspects
            if settled and (following := next(waiting, None)) is not None:
                under_way.add(self.submit(following, following))
        self.judge_suspects()

    def judge_suspects(self) -> None:
        """Runs single rows that failed once more, each alone: a dying worker takes the blame of others with it."""
        from distributed import wait

        for chunk, part in self.suspects:
            future = self.submit(chunk, part)
            wait(future)  # type: ignore[no-untyped-call]
            found = outcome(future)
            if isinstance(found, Exception):
                found = self.work.poisoned(part[0], blame(found))
            self.collect(chunk, found)
            future.release()

    def submit(self, chunk: Range, part: Range) -> Any:
        future = self.client.submit(self.work, *part, pure=False)
        self.origin[future.key] = (chunk, part)
        self.parts.setdefault(chunk, [])
        return future

    def collect(self, chunk: Range, piece: Piece) -> None:
        parts = self.parts[chunk]
        parts.append(piece)
        if sum(part.stop - part.start for part in parts) == chunk[1] - chunk[0]:
            del self.parts[chunk]
            self.store.put(join(parts))
            self.report(chunk[1] - chunk[0])
