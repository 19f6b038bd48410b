"""What is right: SciPy at rtol 1e-12, and the peak from its dense output, for the rows that are checked."""

import equations
import numpy as np
from scipy.integrate import solve_ivp

CHECKED = 16
POINTS = 20_000  # of every segment, for the peak


def solve(parameters: np.ndarray, method: str = "DOP853") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Final states (M, 5), peak windup (M,) and rms of te (M,)."""
    import numba

    rates = numba.njit(equations.slopes)

    def compiled(t, y, p):
        out = np.empty(len(y))
        rates(t, y, p, out)
        return out

    compiled = numba.njit(compiled)

    def integrate(t0, t1, y, p):
        answer = solve_ivp(
            compiled, (t0, t1), y, method=method, rtol=1e-12, atol=1e-14 * TIGHT, args=(p,), dense_output=True
        )
        assert answer.success, answer.message
        return answer.y[:, -1], around_peak(answer.sol, t0, t1, p)

    return equations.row_by_row(integrate, parameters, full=True)


def around_peak(solution, t0: float, t1: float, p: np.ndarray) -> np.ndarray:
    """States close around the largest windup of a segment."""
    times = np.linspace(t0, t1, POINTS)
    top = int(np.argmax(np.abs(equations.windups(solution(times), p))))
    close = np.linspace(times[max(top - 1, 0)], times[min(top + 1, POINTS - 1)], 2001)
    return solution(close)


TIGHT = np.minimum(equations.FLOORS, 1.0)
