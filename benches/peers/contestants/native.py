"""Compiles a C++ source beside this file for this machine and loads it."""

import ctypes
import os
import subprocess
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
OUT = HERE.parents[2] / "target" / "peers"
PROCESSORS = len(os.sched_getaffinity(0))
FLAGS = [
    "-std=c++20",
    "-O3",
    "-march=native",
    "-mprefer-vector-width=512",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-fno-trapping-math",
]


def tableaus() -> str:
    """Dormand-Prince 5(4) and 8(5,3) with SciPy's coefficients, the last row of weights being the solution's."""
    from scipy.integrate import DOP853, RK45
    from scipy.integrate._ivp import dop853_coefficients as d

    def line(kind, name, values):
        return f"static constexpr double {name}{kind} = {{{', '.join(float(x).hex() for x in np.ravel(values))}}};"

    text = ["#pragma once"]
    for name, a, b, c, error, second, order in (
        ("Dopri5", RK45.A, RK45.B, RK45.C, RK45.E, None, 5),
        ("Dop853", d.A[:12, :12], d.B, d.C[:12], d.E5, d.E3, 8),
    ):
        stages = len(b)
        weights = np.zeros((stages + 1, stages + 1))
        weights[:stages, : a.shape[1]] = a
        weights[stages, :stages] = b
        assert DOP853.n_stages == 12
        text += [
            f"struct {name} {{",
            f"static constexpr int stages = {stages}, order = {order};",
            line(f"[{stages + 1}][{stages + 1}]", "weights", weights),
            line(f"[{stages + 1}]", "nodes", [*c, 1.0]),
            line(f"[{stages + 1}]", "error", error),
            f"static constexpr bool has_second_error = {str(second is not None).lower()};",
            line(f"[{stages + 1}]", "second_error", np.zeros(stages + 1) if second is None else second),
            "};",
        ]
    return "\n".join(text)


def library(source: str, *flags: str) -> ctypes.CDLL:
    """The compiled source."""
    folder = OUT / Path(source).stem
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tableaus.hpp").write_text(tableaus())
    built = folder / "solver.so"
    command = [
        "g++",
        *FLAGS,
        *flags,
        f"-I{folder}",
        "-shared",
        "-fPIC",
        "-pthread",
        str(HERE / source),
        "-o",
        str(built),
    ]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(built))


def solver(loaded: ctypes.CDLL, method: int):
    """`sweep` of the library as a contestant's `solve`."""
    pointer = np.ctypeslib.ndpointer(np.float64, flags="C_CONTIGUOUS")
    integer, size = ctypes.c_int, ctypes.c_long
    loaded.sweep.argtypes = [integer, pointer, size, ctypes.c_double, integer, integer, pointer, pointer, pointer]

    def solve(parameters, rtol, full):
        rows = len(parameters)
        final, peak, rms = np.empty((rows, 5)), np.empty(rows), np.empty(rows)
        loaded.sweep(method, np.ascontiguousarray(parameters), rows, rtol, full, PROCESSORS, final, peak, rms)
        return final, peak, rms

    return solve
