"""Closed forms: what can be written down without integrating anything (theta_e = 0, linear spring, unless said)."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm


def two_mass_matrix(p):
    """System matrix of x = (theta_m/i, theta_l, their rates) and the column of the motor torque; stiffness k1."""
    i, K, s = p["ratio"], p["k1"], p["s"]
    mass = np.diag([i**2 * p["J_m"], p["J_l"]])
    stiffness = K * np.array([[1.0, -1.0], [-1.0, 1.0]])
    cross = -p["B_sp"] - i * s * p["B_ml"]
    damping = np.array(
        [
            [i**2 * (p["B_m"] + p["B_ml"]) + p["B_sp"], cross],
            [cross, p["B_l"] + s**2 * p["B_ml"] + p["B_sp"]],
        ]
    )
    matrix = np.zeros((4, 4))
    matrix[:2, 2:] = np.eye(2)
    matrix[2:, :2] = -np.linalg.solve(mass, stiffness)
    matrix[2:, 2:] = -np.linalg.solve(mass, damping)
    motor = np.zeros(4)
    motor[2] = i / mass[0, 0]
    load = np.zeros(4)
    load[3] = -1.0 / mass[1, 1]
    return matrix, motor, load


def two_mass_response(p, t, torque, load=0.0, start=None):
    """State (theta_m, omega_m, theta_l, omega_l) at time t for constant torques, by the matrix exponential."""
    matrix, motor, resisting = two_mass_matrix(p)
    augmented = np.zeros((5, 5))
    augmented[:4, :4] = matrix
    augmented[:4, 4] = motor * torque + resisting * load
    i = p["ratio"]
    x0 = np.zeros(5) if start is None else np.array([start[0] / i, start[2], start[1] / i, start[3], 0.0])
    x0[4] = 1.0
    x = expm(augmented * t) @ x0
    return np.array([i * x[0], i * x[2], x[1], x[3]])


def torsional_mode(p):
    """(frequency [Hz], decay [1/s]) of the damped torsional mode, from the eigenvalues of the two-mass model."""
    values = np.linalg.eigvals(two_mass_matrix(p)[0])
    oscillating = values[np.argmax(values.imag)]
    return oscillating.imag / (2 * math.pi), -oscillating.real


def inertias(p):
    """J_M (motor seen at the output), J_T (total), J_eff (torsional)."""
    J_M = p["ratio"] ** 2 * p["J_m"]
    J_T = J_M + p["J_l"]
    return J_M, J_T, p["J_l"] * J_M / J_T


def undamped_frequency(p):
    """Free torsional mode [Hz] without damping."""
    return math.sqrt(p["k1"] / inertias(p)[2]) / (2 * math.pi)


def decay_rate(p):
    """First-order formula of the decay rate [1/s] of the free torsional mode."""
    J_M, J_T, J_eff = inertias(p)
    motor = p["ratio"] ** 2 * (p["B_m"] + p["B_ml"]) * (p["J_l"] / J_T) ** 2
    return (motor + p["B_l"] * (J_M / J_T) ** 2 + p["B_sp"]) / (2 * J_eff)


def coast_time_constant(p):
    """tau_rb [s] of the rigid drive."""
    i = p["ratio"]
    return (p["J_m"] + p["J_l"] / i**2) / (p["B_m"] + p["B_ml"] * (1 - p["s"] / i) ** 2 + p["B_l"] / i**2)


def forced_gain(p, omega):
    """|H(j omega)|: order amplitude of the transmission error over A_n with the motor speed held exactly."""
    spring = p["k1"] + 1j * omega * p["B_sp"]
    return abs(spring / (spring - p["J_l"] * omega**2 + 1j * omega * p["B_l"]))


def step_amplitude(p, torque):
    """Case (a): undamped output-speed amplitude [rad/s] of the mode after a step of the motor torque."""
    J_M, J_T, _ = inertias(p)
    return p["ratio"] * torque * math.sqrt(p["J_l"] * J_M) / (J_T**1.5 * math.sqrt(p["k1"]))


def release_amplitude(p, windup):
    """Case (b): the same after releasing an initial windup [rad]."""
    J_M, J_T, _ = inertias(p)
    return abs(windup) * math.sqrt(p["k1"] * J_M / (p["J_l"] * J_T))


def brake_torque_bound(p, omega_m):
    """Case (e): upper bound of the spring torque [N m] when the motor stops at once from omega_m."""
    return omega_m / p["ratio"] * math.sqrt(p["k1"] * p["J_l"])


def rigid_response(p, phasors, t, torque):
    """(theta_m, omega_m) of the rigid gear under constant torque, from its energy T(theta) omega^2/2 (SciPy).

    With the kinetic energy I(theta) omega^2/2: I omega' + I' omega^2/2 + C omega = torque. `phasors` maps order to
    te_cos - j te_sin.
    """
    i = p["ratio"]

    def ratio(theta, derivative=0):
        terms = [((1j * n) ** (derivative + 1) * c * np.exp(1j * n * theta)).real for n, c in phasors.items()]
        return (1.0 / i if derivative == 0 else 0.0) - sum(terms)

    def slope(_, y):
        theta, omega = y
        Y, dY = ratio(theta), ratio(theta, 1)
        inertia, inertia_slope = p["J_m"] + p["J_l"] * Y**2, 2 * p["J_l"] * Y * dY
        loss = p["B_m"] + p["B_ml"] * (1 - p["s"] * Y) ** 2 + p["B_l"] * Y**2
        return [omega, (torque - loss * omega - 0.5 * inertia_slope * omega**2) / inertia]

    start = [p["theta_m0"], 0.0]
    return solve_ivp(slope, (0.0, t), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
