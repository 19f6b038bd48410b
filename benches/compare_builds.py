"""Whether another build of the package is faster: the same sweeps in both, interleaved, processor time of one thread.

    python benches/compare_builds.py OTHER/python [--bar 1.03]

`OTHER/python` is the folder of a built checkout that holds `hdfast`. The exit status is 1 where the plain model is
slower than the other build by more than the bar.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

ROUNDS = 15
PLAIN = ("plain", "plain, avx2")
CASES = (*PLAIN, "samples", "dry friction", "replay", "replay of a weight", "replay of a loop", "derivatives, stiff")
#: What the gear of a replayed recording has besides the base model.
TERMS = {"replay": (), "replay of a weight": ("gravity_unbalance",), "replay of a loop": ("hysteresis",)}


def work(case: str) -> float:
    """Processor time of one case in this process."""
    import hdfast
    import numpy as np
    import problem

    if case in TERMS:
        return replayed(TERMS[case])
    rows = problem.columns(6_000 if case == "plain" else 1_500)
    if case.endswith("avx2"):
        os.environ["HDFAST_SIMD"] = "avx2"
    options = {
        "samples": {"metrics": (), "t_eval": np.linspace(0.0, 3.0, 301)},
        "dry friction": {"model": hdfast.Model(terms=["coulomb_friction"])},
        "derivatives, stiff": {"method": "rodas5p", "sensitivities": ["J_m", "J_l", "k1", "B_sp"]},
    }.get(case, {})
    if case == "derivatives, stiff":
        rows = {name: values[:8] * (1000.0 if name == "B_sp" else 1.0) for name, values in rows.items()}
    start = time.process_time()
    problem.sweep(rows, threads=1, **options)
    taken = time.process_time() - start
    os.environ.pop("HDFAST_SIMD", None)
    return taken


def replayed(terms: tuple[str, ...]) -> float:
    """Processor time of the replays of a recorded motion, 5 s at 500 Hz, sampled at 2 kHz as the diagnosis does."""
    import hdfast
    import numpy as np
    import problem

    t = np.linspace(0.0, 5.0, 2501)
    scenario = hdfast.Scenario.motion(t, 60.0 * np.sin(1.3 * t) + np.sin(11.0 * t))
    rows = {name: values for name, values in problem.columns(24).items() if name != "omega_set"}
    start = time.process_time()
    hdfast.sweep(
        problem.constants() | rows,
        model=hdfast.Model(terms=list(terms)),
        scenario=scenario,
        metrics=(),
        t_eval=np.linspace(0.0, 5.0, 10001),
        signals=["tau_m", "te"],
        method="tsit5",
        rtol=1e-6,
        threads=1,
    )
    return time.process_time() - start


def serve() -> None:
    """Answers every case on standard input by its time."""
    for line in sys.stdin:
        print(work(line.strip()), flush=True)


def start(folder: Path) -> subprocess.Popen[str]:
    """A process that has the package of a folder."""
    command = [sys.executable, __file__, "--serve"]
    environment = os.environ | {"PYTHONPATH": str(folder)}
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)


def ask(process: subprocess.Popen[str], case: str) -> float:
    """The time of one case in a process."""
    assert process.stdin is not None
    assert process.stdout is not None
    print(case, file=process.stdin, flush=True)
    return float(process.stdout.readline())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", type=Path, nargs="?")
    parser.add_argument("--bar", type=float, default=1.03)
    parser.add_argument("--serve", action="store_true")
    given = parser.parse_args()
    if given.serve:
        serve()
        return 0
    if given.other is None:
        parser.error("which build to compare with?")
    own, other = start(Path(__file__).parent.parent / "python"), start(given.other)
    slower = False
    for case in CASES:
        ratios = [ask(own, case) / ask(other, case) for _ in range(ROUNDS + 1)][1:]
        ratio = statistics.median(ratios)
        slower |= case in PLAIN and ratio > given.bar
        print(f"{case:16s} this build over the other: {ratio:.3f}", flush=True)
    for process in (own, other):
        process.communicate()
    return int(slower)


if __name__ == "__main__":
    sys.exit(main())
