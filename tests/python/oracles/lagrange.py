"""An independent formulation: generalised coordinates (theta_m, theta_l), solved by SciPy's DOP853 at rtol 1e-12.

Written from the energies T, V and the Rayleigh function D only: with q = (theta_m, theta_l),
M q'' = Q - dV/dq - dD/dq'. The windup phi(q) = theta_m/i - theta_e(theta_m) - theta_l has the gradient g = (Y, -1);
V depends on q through phi, and D is the quadratic form of diag(B_m, B_l) + B_ml v v^T + B_sp g g^T with v = (1, -s).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp

RTOL = 1e-12


class Lagrangian:
    """Gradients of the energies of one drive; `p` maps parameter names to values."""

    def __init__(self, p, orders, labels, spring):
        self.p = p
        self.orders = np.asarray(orders, dtype=float)
        cosine = np.array([p[f"te_cos_{label}"] for label in labels])
        sine = np.array([p[f"te_sin_{label}"] for label in labels])
        self.phasor = p["te_scale"] * (cosine - 1j * sine)  # theta_e = Re sum phasor exp(i n theta)
        self.mass = np.array([p["J_m"], p["J_l"]])
        self.slip = np.array([1.0, -p["s"]])
        self.spring_torque = polynomial_spring(p) if spring == "polynomial" else piecewise_spring(p)

    def theta_e(self, theta, derivative=0):
        turning = (1j * self.orders) ** derivative * self.phasor
        return (turning @ np.exp(1j * np.multiply.outer(self.orders, theta))).real

    def windup(self, q):
        return q[0] / self.p["ratio"] - self.theta_e(q[0]) - q[1]

    def windup_gradient(self, q):
        return np.array([1.0 / self.p["ratio"] - self.theta_e(q[0], 1), -1.0])

    def damping(self, q):
        g = self.windup_gradient(q)
        p = self.p
        return np.diag([p["B_m"], p["B_l"]]) + p["B_ml"] * np.outer(self.slip, self.slip) + p["B_sp"] * np.outer(g, g)

    def forces(self, q, v):
        """Everything but the external torques: -dV/dq - dD/dv."""
        return -self.spring_torque(self.windup(q)) * self.windup_gradient(q) - self.damping(q) @ v


def polynomial_spring(p):
    """Torque of the fitted polynomial, continued by its tangents outside the fitted range."""
    law = Polynomial([0.0, p["k1"], p["k2"], p["k3"], p["k4"], p["k5"]])
    tangent = law.deriv()
    ends = p["phi_max"]

    def torque(phi):
        nearest = np.clip(phi, -ends, ends)
        return law(nearest) + tangent(nearest) * (phi - nearest)

    return torque


def piecewise_spring(p):
    """Torque interpolated on the corners of the catalogue curve."""
    first = p["T1"] / p["K1"]
    second = first + (p["T2"] - p["T1"]) / p["K2"]
    far = 1.0
    corners = np.array([0.0, first, second, second + far])
    torques = np.array([0.0, p["T1"], p["T2"], p["T2"] + p["K3"] * far])

    def torque(phi):
        return np.sign(phi) * np.interp(abs(phi), corners, torques)

    return torque


@dataclass
class Solution:
    """Piecewise solution; `at(t)` gives theta_m, omega_m, theta_l, omega_l, z in rows of a (5, T) array."""

    pieces: list
    edges: list[float]

    def at(self, t):
        t = np.atleast_1d(np.asarray(t, dtype=float))
        index = np.clip(np.searchsorted(self.edges, t, side="left") - 1, 0, len(self.pieces) - 1)
        states = np.empty((5, len(t)))
        for k in np.unique(index):
            states[:, index == k] = self.pieces[k](t[index == k])
        return states


def solve(p, orders, labels, spring, segments, t_end, start, rtol=RTOL):
    """Integrate between breakpoints from (theta_m, omega_m, theta_l, omega_l, z); `segments` has the shape (n, 21)."""
    drive = Lagrangian(p, orders, labels, spring)
    segments = np.asarray(segments, dtype=float)
    edges = [*segments[:, 0], t_end]
    sustain, hold = sustaining_torque(p), holding_torque(drive, start, load_at_start(p, segments))
    atol = rtol * np.array([1.0, 1.0, 1e-3, 0.1, 0.1])
    pieces, y, torque = [], np.asarray(start, dtype=float), None
    for row, begin, end in zip(segments, edges, edges[1:], strict=False):
        command = Command(row, p, sustain, hold)
        y = command.enter(y, begin, torque)

        def slope(t, y, command=command):
            q, v = y[[0, 2]], y[[1, 3]]
            tau, z_rate = command.torque(t, v[0], y[4])
            external = np.array([tau, -command.load(t)])
            if command.kind == 2:
                q = np.array([command.motion(t)[0], q[1]])
                v = np.array([command.motion(t)[1], v[1]])
            acceleration = (external + drive.forces(q, v)) / drive.mass
            if command.kind == 2:
                acceleration[0] = command.motion(t)[2]
            return np.array([v[0], acceleration[0], v[1], acceleration[1], z_rate])

        solution = solve_ivp(slope, (begin, end), y, method="DOP853", rtol=rtol, atol=atol, dense_output=True)
        if not solution.success:
            raise RuntimeError(solution.message)
        pieces.append(solution.sol)
        y = solution.y[:, -1]
        torque = command.torque(end, y[1], y[4])[0]
    return Solution(pieces, edges)


def sustaining_torque(p):
    """Motor torque that balances all viscous losses at the set speed of a gear without error, plus the load."""
    motion = np.array([1.0, 1.0 / p["ratio"]])
    slip = np.array([1.0, -p["s"]]) @ motion
    power = p["B_m"] + p["B_l"] * motion[1] ** 2 + p["B_ml"] * slip**2
    return power * p["omega_set"] + p["tau_load"] / p["ratio"]


def load_at_start(p, segments):
    """Load torque at t = 0."""
    first = segments[0]
    return first[13] + first[15] * p["tau_load"]


def holding_torque(drive, state, load):
    """Motor torque that does as much work as the load torque where the gear turns without winding up further."""
    return drive.windup_gradient(np.asarray(state, dtype=float)[[0, 2]])[0] * load


class Command:
    """One row of the input table."""

    def __init__(self, row, p, sustain, hold):
        self.begin, self.kind, self.bumpless = row[0], int(row[1]), bool(row[2])
        self.tau_line = row[3:5] + sustain * row[5:7] + hold * row[7:9]
        self.reference_line = row[9:11] + p["omega_set"] * row[11:13]
        self.load_line = row[13:15] + p["tau_load"] * row[15:17]
        self.angle = Polynomial(row[17:21])
        self.gains = p["K_p"], p["K_i"], p["tau_max"]

    def line(self, pair, t):
        return pair[0] + pair[1] * (t - self.begin)

    def load(self, t):
        return self.line(self.load_line, t)

    def motion(self, t):
        s = t - self.begin
        return self.angle(s), self.angle.deriv()(s), self.angle.deriv(2)(s)

    def torque(self, t, speed, z):
        if self.kind == 0:
            return self.line(self.tau_line, t), 0.0
        if self.kind == 2:
            return 0.0, 0.0
        K_p, K_i, limit = self.gains
        error = self.line(self.reference_line, t) - speed
        asked = K_p * error + K_i * z
        given = float(np.clip(asked, -limit, limit))
        return given, error + ((given - asked) / K_p if K_p > 0 else 0.0)

    def enter(self, y, t, torque_before):
        y = np.array(y)
        if self.kind == 2:
            y[0], y[1] = self.motion(t)[:2]
        K_p, K_i, _ = self.gains
        if self.kind == 1 and self.bumpless and torque_before is not None and K_i > 0:
            y[4] = (torque_before - K_p * (self.line(self.reference_line, t) - y[1])) / K_i
        return y


def relaxed_start(p, orders, labels, spring, segments):
    """At rest in equilibrium with the load torque, which a speed controller holds by its integrator."""
    from scipy.optimize import brentq

    drive, load = Lagrangian(p, orders, labels, spring), load_at_start(p, segments)
    windup = brentq(lambda phi: drive.spring_torque(phi) - load, -0.1, 0.1, xtol=1e-18, rtol=1e-15)
    theta_m = p["theta_m0"]
    state = np.array([theta_m, 0.0, theta_m / p["ratio"] - drive.theta_e(theta_m) - windup, 0.0, 0.0])
    if segments[0][1] == 1 and p["K_i"] > 0:
        state[4] = holding_torque(drive, state, load) / p["K_i"]
    return state
