# /// script
# dependencies = ["numbalsoda", "numba", "numpy"]
# ///
"""numbalsoda called from a loop compiled by Numba; its one absolute tolerance asks for states scaled to their sizes.

Where no wheel fits it is built from source, which takes `gfortran` and `cmake`.
"""

import equations
import numpy as np

NAME = "numbalsoda"
VARIANTS = ("lsoda", "dop853")
THREADS = False
STIFF = "lsoda"
POINTS = 100  # on the way through half a second, for the peak


def build(variant):
    import numbalsoda
    from numba import carray, cfunc, njit

    compiled = njit(equations.slopes)
    windup = njit(equations.windup)
    method = getattr(numbalsoda, variant)

    def callback(n):
        scales = equations.FLOORS[:n]

        @cfunc(numbalsoda.lsoda_sig)
        def scaled(t, u, du, p):
            out = carray(du, n)
            compiled(t, carray(u, n) * scales, carray(p, 11), out)
            out /= scales

        return scaled

    callbacks = {n: callback(n) for n in (equations.STATES, equations.ALL_STATES)}
    stops = np.array(equations.STOPS)

    @njit
    def sweep(address, parameters, u0, scales, rtol):
        rows, n = u0.shape
        final, peak, rms = np.empty((rows, 5)), np.zeros(rows), np.zeros(rows)
        for row in range(rows):
            u, t0, opening = u0[row].copy(), 0.0, np.zeros(2)
            for t1 in stops:
                points = int(POINTS * (t1 - t0) / 0.5) if n > 5 else 2
                path, success = method(
                    address, u, np.linspace(t0, t1, points), parameters[row], rtol, rtol, mxstep=1_000_000
                )
                u[:] = np.nan
                if success:
                    u[:] = path[-1]
                if n > 5:
                    for point in range(points):
                        peak[row] = max(peak[row], abs(windup(path[point] * scales, parameters[row])))
                    if t1 == 1.0:
                        opening[:] = u[5:] * scales[5:]
                    elif t1 == 2.0:
                        mean, square = u[5] * scales[5] - opening[0], u[6] * scales[6] - opening[1]
                        rms[row] = np.sqrt(square - mean * mean)
                t0 = t1
            final[row] = u[:5] * scales[:5]
        return final, peak, rms

    def solve(parameters, rtol, full):
        y0 = np.stack([equations.start(p, full) for p in parameters])
        scales = equations.FLOORS[: y0.shape[1]]
        return sweep(callbacks[y0.shape[1]].address, parameters, y0 / scales, scales, rtol)

    return solve
