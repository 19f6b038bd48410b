# /// script
# dependencies = ["CyRK", "numba", "numpy"]
# ///
"""CyRK's C++ solver called from a loop compiled by Numba."""

import equations
import numpy as np

NAME = "CyRK"
VARIANTS = ("DOP853", "Vern8", "RK45", "LSODA")
THREADS = False
STIFF = "LSODA"


def build(variant):
    import CyRK
    from numba import carray, njit

    compiled = njit(equations.slopes)
    windup = njit(equations.windup)

    def all_states(dy, t, y, args):
        compiled(t, carray(y, 7), carray(args, 11), carray(dy, 7))

    def states(dy, t, y, args):
        compiled(t, carray(y, 5), carray(args, 11), carray(dy, 5))

    addresses = {True: CyRK.nb_diffeq_addr(all_states), False: CyRK.nb_diffeq_addr(states)}
    stops = np.array(equations.STOPS)

    @njit
    def sweep(address, method, parameters, y0, rtols, atols):
        rows, n = y0.shape
        final, peak, rms = np.empty((rows, 5)), np.zeros(rows), np.zeros(rows)
        for row in range(rows):
            y, t0, opening = y0[row].copy(), 0.0, np.zeros(2)
            for t1 in stops:
                answer = CyRK.nbsolve2_ivp(
                    address, (t0, t1), y, method=method, args=parameters[row], rtols=rtols, atols=atols
                )
                path = answer.y
                y[:] = np.nan
                if answer.success:
                    y[:] = path[:n, -1]
                if n > 5:
                    for point in range(path.shape[1]):
                        peak[row] = max(peak[row], abs(windup(path[:, point], parameters[row])))
                    if t1 == 1.0:
                        opening[:] = y[5:]
                    elif t1 == 2.0:
                        mean, square = y[5] - opening[0], y[6] - opening[1]
                        rms[row] = np.sqrt(square - mean * mean)
                answer.free()
                t0 = t1
            final[row] = y[:5]
        return final, peak, rms

    def solve(parameters, rtol, full):
        y0 = np.stack([equations.start(p, full) for p in parameters])
        n = y0.shape[1]
        return sweep(addresses[full], variant, parameters, y0, np.full(n, rtol), rtol * equations.FLOORS[:n])

    return solve
