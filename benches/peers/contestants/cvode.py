# /// script
# dependencies = ["scikit-sundae", "numba", "numpy"]
# ///
"""CVODE of SUNDIALS through scikit-sundae, the right-hand side compiled by Numba."""

import equations

NAME = "CVODE (scikit-sundae)"
VARIANTS = ("Adams", "BDF")
THREADS = False
STIFF = "BDF"


def build(variant):
    import numba
    from sksundae.cvode import CVODE

    compiled = numba.njit(equations.slopes)

    def rates(t, y, out, row):
        compiled(t, y, row[0], out)

    def solve(parameters, rtol, full):
        def integrate(t0, t1, y, p):
            atol = rtol * equations.FLOORS[: len(y)]
            solver = CVODE(rates, method=variant, rtol=rtol, atol=atol, userdata=(p,), max_num_steps=10_000_000)
            answer = solver.solve([t0, t1], y)
            return answer.y[-1], answer.y.T

        return equations.row_by_row(integrate, parameters, full)

    return solve
