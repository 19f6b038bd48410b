# /// script
# dependencies = ["diffrax", "jax", "numpy"]
# ///
"""diffrax, batches of 256 rows through vmap and jit; states scaled to their sizes, as a tolerance is one number."""

import equations
import numpy as np
import problem

NAME = "diffrax"
VARIANTS = ("Dopri8, vmap", "Tsit5, vmap")
THREADS = False
BATCH = 256
STEPS = 4096  # most of a segment


def build(variant):
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    starts = (0.0, *equations.STOPS)

    def windup_and_slope(y, p):
        c1, s1 = jnp.cos(y[0]), jnp.sin(y[0])
        c, s, c_before, s_before, error, slope = c1, s1, 1.0, 0.0, 0.0, 0.0
        for n, (a, b) in enumerate(zip(equations.COSINES, equations.SINES, strict=True), start=1):
            error += a * c + b * s
            slope += n * b * c - n * a * s
            c, c_before, s, s_before = 2 * c1 * c - c_before, c, 2 * c1 * s - s_before, s
        return y[2] - p[9] * error, p[9] * slope

    def integrate(p, u, segment, rtol):
        n = len(u)
        scales = equations.FLOORS[:n]
        t0, t1 = starts[segment : segment + 2]
        first, last = (0, 1, 1, 1, 0)[segment], (1, 1, 1, 0, 0)[segment]

        def rates(t, u, p):
            y = u * scales
            windup, slope = windup_and_slope(y, p)
            upsilon = 1 / equations.RATIO - slope
            gear = windup * (p[6] + windup**2 * (p[7] + windup**2 * p[8])) + p[5] * (upsilon * y[1] - y[3])
            off = p[10] * (first + (last - first) * (t - t0) / (t1 - t0)) - y[1]
            slip = p[4] * (y[1] - y[3])
            alpha_m = (problem.K_P * off + problem.K_I * y[4] - p[2] * y[1] - slip - upsilon * gear) / p[0]
            alpha_l = (gear - p[3] * y[3] + slip) / p[1]
            all_rates = [y[1], alpha_m, y[1] / equations.RATIO - y[3], alpha_l, off, y[2], y[2] ** 2]
            return jnp.stack(all_rates[:n]) / scales

        end = diffrax.SubSaveAt(t1=True)
        way = diffrax.SubSaveAt(steps=True, fn=lambda _t, u, p: jnp.abs(windup_and_slope(u * scales, p)[0]))
        answer = diffrax.diffeqsolve(
            diffrax.ODETerm(rates),
            getattr(diffrax, variant.split(",")[0])(),
            t0,
            t1,
            None,
            u,
            args=p,
            saveat=diffrax.SaveAt(subs=[end, way] if n > equations.STATES else [end]),
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol, pcoeff=0.1, icoeff=0.3),
            max_steps=STEPS,
            throw=False,
        )
        return answer.ys[0][0], answer.ys[1] if n > equations.STATES else jnp.zeros(1)

    def row(p, u, rtol):
        peak, opening, rms = 0.0, 0.0, 0.0
        for segment, t1 in enumerate(equations.STOPS):
            u, heights = integrate(p, u, segment, rtol)
            peak = jnp.maximum(peak, jnp.max(jnp.where(jnp.isfinite(heights), heights, 0.0)))
            integrals = u[equations.STATES :] * equations.FLOORS[equations.STATES : len(u)]
            if t1 == 1.0:
                opening = integrals
            elif t1 == 2.0 and len(u) > equations.STATES:
                mean, square = integrals - opening
                rms = jnp.sqrt(square - mean**2)
        return u[: equations.STATES] * equations.FLOORS[: equations.STATES], peak, rms

    compiled = jax.jit(jax.vmap(row, in_axes=(0, 0, None)))

    def solve(parameters, rtol, full):
        count = -(-len(parameters) // BATCH) if len(parameters) > BATCH else 1
        size = min(BATCH, len(parameters))
        parts = []
        for batch in np.resize(parameters, (count, size, parameters.shape[1])):
            start = np.stack([equations.start(p, full) for p in batch])
            parts.append(jax.block_until_ready(compiled(batch, start / equations.FLOORS[: start.shape[1]], rtol)))
        return tuple(np.concatenate(part)[: len(parameters)] for part in zip(*parts, strict=True))

    return solve
