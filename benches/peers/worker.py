"""One contestant in its own process: `worker.py CONTESTANT VARIANT PROCESSORS`, then JSON commands by line.

A command names tolerance, rows and outputs; the answer gives seconds of processor and clock, and peak memory.
"""

import importlib
import importlib.metadata
import json
import os
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE / "contestants")]
os.sched_setaffinity(0, map(int, sys.argv[3].split(",")))  # before libraries count processors
import numpy as np
import problem


def main() -> None:
    name, variant = sys.argv[1:3]
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what solvers print is not an answer
    begin = time.perf_counter()
    module = importlib.import_module(name)
    solve = module.build(variant)
    first = problem.matrix(8)
    solve(first, 1e-3, True)
    first_call = time.perf_counter() - begin
    begin = time.perf_counter()
    solve(first, 1e-3, True)
    ready = {"compile": first_call - (time.perf_counter() - begin)}
    print(json.dumps(ready), file=answers)
    for line in sys.stdin:
        print(json.dumps(obey(solve, json.loads(line))), file=answers)


def obey(solve, command: dict) -> dict:
    """Runs a command."""
    parameters = problem.matrix(command["rows"])
    for column, factor in command.get("scale", []):
        parameters[:, column] *= factor
    for row, column, value in command.get("spoil", []):
        parameters[row, column] *= value
    begin, begin_cpu = time.perf_counter(), time.process_time()
    try:
        final, peak, rms = solve(parameters, command["rtol"], command["full"])
    except Exception as error:
        return {"error": f"{type(error).__name__}: {error}"[:200]}
    seconds = {"cpu": time.process_time() - begin_cpu, "wall": time.perf_counter() - begin}
    if "save" in command:
        np.savez(command["save"], final=final, peak=peak, rms=rms)
    status = dict(line.split(":") for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines())
    return seconds | {"memory": 1024 * int(status["VmHWM"].split()[0])}


if __name__ == "__main__":
    main()
