# /// script
# dependencies = ["scipy", "numba", "numpy"]
# ///
"""SciPy's solve_ivp, row by row, with a NumPy right-hand side or one compiled by Numba."""

import equations
import numpy as np

NAME = "SciPy solve_ivp"
VARIANTS = ("RK45, NumPy", "DOP853, NumPy", "LSODA, NumPy", "RK45, Numba", "DOP853, Numba", "LSODA, Numba")
THREADS = False
STIFF = "LSODA, Numba"


def build(variant):
    from scipy.integrate import solve_ivp

    method, kind = variant.split(", ")
    rates = equations.slopes_numpy
    if kind == "Numba":
        import numba

        compiled = numba.njit(equations.slopes)

        def rates(t, y, p):
            out = np.empty(len(y))
            compiled(t, y, p, out)
            return out

        rates = numba.njit(rates)

    def solve(parameters, rtol, full):
        def integrate(t0, t1, y, p):
            atol = rtol * equations.FLOORS[: len(y)]
            answer = solve_ivp(rates, (t0, t1), y, method=method, rtol=rtol, atol=atol, args=(p,))
            return answer.y[:, -1], answer.y

        return equations.row_by_row(integrate, parameters, full)

    return solve
