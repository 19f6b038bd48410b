"""hdfast."""

import numpy as np
import problem

NAME = "hdfast"
VARIANTS = ("dop853", "tsit5", "AVX2", "rodas5p")
THREADS = True
STIFF = "rodas5p"
METRICS = ("te_rms", "peak_windup")


def build(variant):
    import os

    if variant == "AVX2":
        os.environ["HDFAST_SIMD"] = "avx2"
    method = "dop853" if variant == "AVX2" else variant

    def solve(parameters, rtol, full):
        rows = dict(zip(problem.COLUMNS, parameters.T, strict=True))
        result = problem.sweep(rows, METRICS if full else (), rtol=rtol, method=method)
        theta_m, omega_m, theta_l, omega_l, z = np.asarray(result.final_state).T
        final = np.column_stack([theta_m, omega_m, theta_m / problem.NOMINAL["ratio"] - theta_l, omega_l, z])
        return (final, result["peak_windup"], result["te_rms"]) if full else (final, None, None)

    return solve
