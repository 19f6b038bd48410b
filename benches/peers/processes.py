"""A contestant at work in its own process, bound to the processors it may use."""

import json
import os
import select
import signal
import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
#: No hidden threads; idle ones sleep.
QUIET = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1") | {
    "OMP_WAIT_POLICY": "passive"
}
START_LIMIT = 600.0  # [s], compilers included


class WorkerError(Exception):
    """The contestant refused, died or took too long."""


class Worker:
    """One variant of one contestant."""

    def __init__(self, python: Path, file: str, variant: str, processors: list[int]) -> None:
        self.log = tempfile.TemporaryFile("w+")  # noqa: SIM115
        self.process = subprocess.Popen(
            [python, HERE / "worker.py", file, variant, ",".join(map(str, processors))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.log,
            env={**os.environ, **QUIET},
            start_new_session=True,
        )
        self.compile_seconds = self.answer(START_LIMIT)["compile"]

    def send(self, rtol: float, rows: int, *, full: bool = True, **more: object) -> None:
        """Starts a command."""
        command = {"rtol": rtol, "rows": rows, "full": full, **more}
        self.process.stdin.write((json.dumps(command) + "\n").encode())
        self.process.stdin.flush()

    def answer(self, limit: float) -> dict:
        """The answer to the last command within `limit` seconds."""
        ready, _, _ = select.select([self.process.stdout], [], [], limit)
        if not ready:
            self.stop()
            raise WorkerError(f"no answer within {limit:.0f} s")
        line = self.process.stdout.readline()
        if not line:
            self.process.wait()
            self.log.seek(0)
            said = self.log.read().strip().splitlines()
            raise WorkerError(f"died with status {self.process.returncode}: {said[-1][:160] if said else 'no word'}")
        answer = json.loads(line)
        if "error" in answer:
            raise WorkerError(answer["error"])
        return answer

    def run(self, rtol: float, rows: int, *, full: bool = True, limit: float = 300.0, **more: object) -> dict:
        """Runs a command."""
        self.send(rtol, rows, full=full, **more)
        return self.answer(limit)

    def outcome(self, rtol: float, rows: int, limit: float = 300.0, **more: object) -> dict:
        """Runs a command and returns its arrays `final`, `peak` and `rms` beside its seconds."""
        with tempfile.NamedTemporaryFile(suffix=".npz") as file:
            answer = self.run(rtol, rows, limit=limit, save=file.name, **more)
            with np.load(file.name, allow_pickle=True) as arrays:
                return answer | {name: arrays[name] for name in arrays.files}

    def stop(self) -> None:
        """Ends the process."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
