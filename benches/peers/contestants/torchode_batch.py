# /// script
# dependencies = ["torchode", "torch", "numpy"]
# ///
"""torchode, batches of rows with a step each; states scaled to their sizes, as a tolerance is one number."""

import equations
import numpy as np
import problem

NAME = "torchode"
VARIANTS = ("Tsit5, batch", "Dopri5, batch")
THREADS = False
BATCH = 256
POINTS = 100  # on the way through half a second, for the peak


def build(variant):
    import torch
    import torchode

    torch.set_default_dtype(torch.float64)
    torch.set_num_threads(1)
    orders = torch.arange(1.0, 16.0)
    # value and slope from the cosines and sines of all orders in one product
    cosines, sines = torch.tensor(equations.COSINES), torch.tensor(equations.SINES)
    series = torch.stack([torch.cat([cosines, sines]), torch.cat([orders * sines, -orders * cosines])], dim=1)

    def error_and_slope(theta_m):
        angles = theta_m[..., None] * orders
        return (torch.cat([torch.cos(angles), torch.sin(angles)], dim=-1) @ series).unbind(-1)

    def rates(t, u, args):
        p, scales, first, rate = args
        theta_m, omega_m, te, omega_l, z, *_ = (u * scales).unbind(1)
        j_m, j_l, b_m, b_l, b_ml, b_sp, k1, k3, k5, scale, _ = p
        error, slope = error_and_slope(theta_m)
        windup, upsilon = te - scale * error, 1 / equations.RATIO - scale * slope
        gear = windup * (k1 + windup**2 * (k3 + windup**2 * k5)) + b_sp * (upsilon * omega_m - omega_l)
        off = first + rate * t - omega_m
        slip = b_ml * (omega_m - omega_l)
        alpha_m = (problem.K_P * off + problem.K_I * z - b_m * omega_m - slip - upsilon * gear) / j_m
        alpha_l = (gear - b_l * omega_l + slip) / j_l
        out = [omega_m, alpha_m, omega_m / equations.RATIO - omega_l, alpha_l, off, te, te**2]
        return torch.stack(out[: u.shape[1]], dim=1) / scales

    def batch(parameters, rtol, full):
        p = torch.tensor(parameters.T)
        scales = torch.tensor(equations.FLOORS[: equations.ALL_STATES if full else equations.STATES])
        u = torch.tensor(np.stack([equations.start(row, full) for row in parameters])) / scales
        peak, opening, rms = torch.zeros(len(parameters)), None, None
        for segment, (t0, t1) in enumerate(zip((0.0, *equations.STOPS), equations.STOPS, strict=False)):
            rate = p[10] * (2, 0, 0, -2, 0)[segment]
            first = p[10] * (0, 1, 1, 1, 0)[segment] - rate * t0
            points = round(POINTS * (t1 - t0) / 0.5) if full else 2
            term = torchode.ODETerm(rates, with_args=True)
            answer = torchode.solve_ivp(
                term,
                u,
                torch.linspace(t0, t1, points),
                method=variant.split(",")[0].lower(),
                controller=torchode.PIDController(rtol, rtol, 0.2, 0.5, 0.0, term=term),
                args=(p, scales, first, rate),
            )
            u = answer.ys[:, -1]
            if full:
                path = answer.ys * scales
                heights = (path[..., 2] - p[9][:, None] * error_and_slope(path[..., 0])[0]).abs()
                peak = torch.maximum(peak, heights.amax(1))
                if t1 == 1.0:
                    opening = path[:, -1, 5:]
                elif t1 == 2.0:
                    mean, square = (path[:, -1, 5:] - opening).unbind(1)
                    rms = torch.sqrt(square - mean**2)
        return (u * scales)[:, :5].numpy(), peak.numpy(), rms.numpy() if full else peak.numpy()

    def solve(parameters, rtol, full):
        with torch.no_grad():
            parts = [batch(parameters[i : i + BATCH], rtol, full) for i in range(0, len(parameters), BATCH)]
        return tuple(np.concatenate(part) for part in zip(*parts, strict=True))

    return solve
