# /// script
# dependencies = ["heyoka", "numpy"]
# ///
"""heyoka's Taylor integrator: batches of the machine's vector width driven by hand, and its own ensemble interface.

The reference is linear in time in every segment and enters by parameters; the peak is taken at the ends of the steps.
"""

import equations
import numpy as np
import problem

NAME = "heyoka"
NO_PEAK, ENSEMBLE = "batch, no peak", "ensemble of batches, no peak"
VARIANTS = ("batch", NO_PEAK, ENSEMBLE)
THREADS = False
FROM, TO = (0, 1, 1, 1, 0), (1, 1, 1, 0, 0)


def kinematic_error(theta_m):
    """theta_e and its slope, unscaled."""
    import heyoka as hy

    value, slope = [], []
    for n, (a, b) in enumerate(zip(equations.COSINES, equations.SINES, strict=True), start=1):
        c, s = hy.cos(float(n) * theta_m), hy.sin(float(n) * theta_m)
        value.append(float(a) * c + float(b) * s)
        slope.append(float(n * b) * c - float(n * a) * s)
    return hy.sum(value), hy.sum(slope)


def system(full):
    """Equations; parameters 0 to 9 are the row's, 10 and 11 the reference at t = 0 and its rate."""
    import heyoka as hy

    theta_m, omega_m, te, omega_l, z, mean, square = hy.make_vars("theta_m", "omega_m", "te", "omega_l", "z", "q", "r")
    inverse_j_m, inverse_j_l, b_m, b_l, b_ml, b_sp, k1, k3, k5, scale = (hy.par[i] for i in range(10))
    error, slope = kinematic_error(theta_m)
    windup = te - scale * error
    upsilon = 1 / equations.RATIO - scale * slope
    gear = windup * (k1 + windup**2 * (k3 + windup**2 * k5)) + b_sp * (upsilon * omega_m - omega_l)
    off = hy.par[10] + hy.par[11] * hy.time - omega_m
    slip = b_ml * (omega_m - omega_l)
    asked = problem.K_P * off + problem.K_I * z
    rates = [
        (theta_m, omega_m),
        (omega_m, (asked - b_m * omega_m - slip - upsilon * gear) * inverse_j_m),
        (te, omega_m / equations.RATIO - omega_l),
        (omega_l, (gear - b_l * omega_l + slip) * inverse_j_l),
        (z, off),
    ]
    return [*rates, (mean, te), (square, te * te)] if full else rates


def begin(rows, full):
    """States and parameters of a batch; inertias inverted, as a division costs a Taylor recursion."""
    pars = rows[:, :10].T.copy()
    pars[:2] = 1 / pars[:2]
    return np.stack([equations.start(p, full) for p in rows], axis=1), pars


def reference(rows, segment):
    """The reference of a segment at t = 0 and its rate."""
    t0, t1 = (0.0, *equations.STOPS)[segment : segment + 2]
    rate = rows[:, 10] * (TO[segment] - FROM[segment]) / (t1 - t0)
    return rows[:, 10] * FROM[segment] - rate * t0, rate


def build(variant):
    import heyoka as hy

    width = hy.recommended_simd_size()
    theta_m = hy.make_vars("theta_m")
    error = hy.cfunc([kinematic_error(theta_m)[0]], [theta_m])
    made = {}

    def integrator(tol, full):
        """Compiled once per tolerance."""
        if (tol, full) not in made:
            states = np.zeros((equations.ALL_STATES if full else equations.STATES, width))
            made[tol, full] = hy.taylor_adaptive_batch(
                system(full), states, pars=np.zeros((12, width)), tol=tol, fast_math=True
            )
        return made[tol, full]

    path, length = np.empty((100_000, equations.ALL_STATES, width)), 0

    def keep(ta):
        """Called by the integrator after every step."""
        nonlocal length
        path[length] = ta.state
        length += 1
        return True

    def highest(path, rows):
        """Peak windup of states (steps, n, width)."""
        errors = error(np.ascontiguousarray(path[:, 0].reshape(1, -1))).reshape(-1, width)
        return np.max(np.abs(path[:, 2] - rows[:, 9] * errors), axis=0)

    def batches(ta, batch, full):
        """All segments of every batch (count, width, 11), one batch after the other."""
        nonlocal length
        for rows in batch:
            ta.state[:], ta.pars[:10] = begin(rows, full)
            ta.set_time(0.0)
            length, opening, rms = 0, None, None
            callback = keep if full and variant != NO_PEAK else None
            for segment, t1 in enumerate(equations.STOPS):
                ta.pars[10:] = reference(rows, segment)
                ta.propagate_until(t1, callback=callback)
                if full and t1 == 1.0:
                    opening = ta.state[5:].copy()
                elif full and t1 == 2.0:
                    rms = equations.deviation(opening, ta.state[5:])
            yield ta.state[:5].T.copy(), highest(path[:length], rows) if length else None, rms

    def ensemble(ta, batch, full):
        """Segment by segment through all batches."""
        ta.set_time(0.0)
        states, pars = zip(*(begin(rows, full) for rows in batch), strict=True)
        opening, rms = None, [None] * len(batch)
        for segment, t1 in enumerate(equations.STOPS):

            def prepare(ta, index, segment=segment, states=states):
                ta.set_time((0.0, *equations.STOPS)[segment])
                ta.state[:], ta.pars[:10] = states[index], pars[index]
                ta.pars[10:] = reference(batch[index], segment)
                return ta

            done = hy.ensemble_propagate_until_batch(ta, t1, len(batch), prepare)
            states = np.array([each[0].state for each in done])
            if full and t1 == 1.0:
                opening = states[:, 5:]
            elif full and t1 == 2.0:
                rms = [equations.deviation(a, b) for a, b in zip(opening, states[:, 5:], strict=True)]
        return [(state[:5].T, None, each) for state, each in zip(states, rms, strict=True)]

    def solve(parameters, rtol, full):
        count = -(-len(parameters) // width)
        batch = np.resize(parameters, (count, width, parameters.shape[1]))
        run = ensemble if variant == ENSEMBLE else batches
        parts = zip(*run(integrator(rtol, full), batch, full), strict=True)
        return tuple(None if part[0] is None else np.concatenate(part)[: len(parameters)] for part in parts)

    return solve
