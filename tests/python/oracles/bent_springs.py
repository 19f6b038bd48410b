"""The two-inertia drive with a spring of straight pieces, solved piece after piece by SciPy.

Every solution ends where the windup leaves its piece or the motor torque jumps; the next one starts there.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

TOLERANCES = {"method": "DOP853", "rtol": 1e-13, "atol": [1e-12, 1e-12, 1e-17, 1e-14]}


def law(p, gap=None):
    """Windups at which the stiffness changes, and the stiffnesses between them."""
    if gap is not None:
        return [-gap, gap], [p["k1"], 0.0, p["k1"]]
    first = p["T1"] / p["K1"]
    second = first + (p["T2"] - p["T1"]) / p["K2"]
    return [-second, -first, first, second], [p["K3"], p["K2"], p["K1"], p["K2"], p["K3"]]


def torques_at(edges, stiffnesses):
    """Torque at every edge; zero windup carries none."""
    middle = len(edges) // 2
    found = np.zeros(len(edges))
    found[middle] = stiffnesses[middle] * edges[middle]
    found[middle - 1] = stiffnesses[middle] * edges[middle - 1]
    for k in range(middle + 1, len(edges)):
        found[k] = found[k - 1] + stiffnesses[k] * (edges[k] - edges[k - 1])
    for k in range(middle - 2, -1, -1):
        found[k] = found[k + 1] - stiffnesses[k + 1] * (edges[k + 1] - edges[k])
    return found


def te_on(times, p, torque_pieces, load, spring, orders=()):
    """Transmission error from rest at zero angles; `torque_pieces` are (until, motor torque)."""
    edges, stiffnesses = spring
    at_edges = torques_at(edges, stiffnesses)
    cosines, sines = (np.array([p[f"te_{kind}_{n}"] for n in orders]) * p["te_scale"] for kind in ("cos", "sin"))
    orders = np.array(orders, dtype=float)

    def windup(state):
        angles = orders * state[0]
        return state[2] - cosines @ np.cos(angles) - sines @ np.sin(angles)

    def rates(_, state, piece, motor_torque):
        theta_m, omega_m, _, omega_l = state
        slope = orders * (sines * np.cos(orders * theta_m) - cosines * np.sin(orders * theta_m))
        upsilon = 1.0 / p["ratio"] - slope.sum()
        edge = min(piece, len(edges) - 1)
        elastic = at_edges[edge] + stiffnesses[piece] * (windup(state) - edges[edge])
        gear = elastic + p["B_sp"] * (upsilon * omega_m - omega_l)
        slip = p["B_ml"] * (omega_m - p["s"] * omega_l)
        return [
            omega_m,
            (motor_torque - p["B_m"] * omega_m - slip - upsilon * gear) / p["J_m"],
            omega_m / p["ratio"] - omega_l,
            (gear - p["B_l"] * omega_l + p["s"] * slip - load) / p["J_l"],
        ]

    def leaves(edge, direction):
        def distance(_, state, *__):
            return windup(state) - edges[edge]

        distance.terminal, distance.direction = True, direction
        return distance

    state, t, found = np.zeros(4), 0.0, np.full(len(times), np.nan)
    piece = int(np.searchsorted(edges, windup(state)))
    for until, motor_torque in torque_pieces:
        while t < until:
            ways = [(piece - 1, -1), (piece, +1)]
            ways = [(edge, way) for edge, way in ways if 0 <= edge < len(edges)]
            run = solve_ivp(
                rates,
                (t, until),
                state,
                args=(piece, motor_torque),
                events=[leaves(*way) for way in ways],
                dense_output=True,
                **TOLERANCES,
            )
            inside = (times >= t) & (times <= run.t[-1])
            found[inside] = run.sol(times[inside])[2]
            t, state = run.t[-1], run.y[:, -1]
            piece += sum(way for (_, way), at in zip(ways, run.t_events, strict=True) if len(at))
    return found
