"""Closed forms of the five cases, for two inertias on a linear spring."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np


def inertias(p: Mapping[str, float]) -> tuple[float, float, float]:
    """J_M = i^2 J_m, J_T = J_M + J_l, J_eff = J_l J_M/J_T [kg m^2], at the output."""
    J_M = p["ratio"] ** 2 * p["J_m"]
    return J_M, J_M + p["J_l"], p["J_l"] * J_M / (J_M + p["J_l"])


def free_frequency(p: Mapping[str, float]) -> float:
    """Frequency of the free torsional mode [rad/s], undamped."""
    return math.sqrt(p["k1"] / inertias(p)[2])


def decay(p: Mapping[str, float]) -> float:
    """Decay rate of the free mode [1/s], to first order in the damping."""
    J_M, J_T, J_eff = inertias(p)
    motor = p["ratio"] ** 2 * (p["B_m"] + p["B_ml"]) * (p["J_l"] / J_T) ** 2
    return (motor + p["B_l"] * (J_M / J_T) ** 2 + p["B_sp"]) / (2.0 * J_eff)


def rigid_time_constant(p: Mapping[str, float]) -> float:
    """Time constant of start and coast as one inertia [s]."""
    i2 = p["ratio"] ** 2
    return (p["J_m"] + p["J_l"] / i2) / (p["B_m"] + p["B_ml"] + p["B_l"] / i2)


def sustaining_torque(p: Mapping[str, float], omega: float) -> float:
    """Motor torque that holds a speed [N m]."""
    return float((p["B_m"] + p["B_ml"] + p["B_l"] / p["ratio"] ** 2) * omega)


def torque_step(p: Mapping[str, float], torque: float) -> float:
    """(a) Ripple of the load speed [rad/s] after a step of the motor torque [N m], undamped."""
    J_M, J_T, _ = inertias(p)
    return float(p["ratio"] * torque * math.sqrt(p["J_l"] * J_M) / (J_T**1.5 * math.sqrt(p["k1"])))


def released_error(p: Mapping[str, float], windup: float) -> float:
    """(b) Ripple of the load speed [rad/s] when a windup [rad] is let go, undamped."""
    J_M, J_T, _ = inertias(p)
    return abs(windup) * math.sqrt(p["k1"] * J_M / (p["J_l"] * J_T))


def held_gain(p: Mapping[str, float], omega: float) -> complex:
    """(c) Transmission error over kinematic error at the angular frequency omega [rad/s], motor speed held."""
    damper = 1j * omega * p["B_sp"]
    return complex((p["k1"] + damper) / (p["k1"] - p["J_l"] * omega**2 + damper + 1j * omega * p["B_l"]))


def held_ripple(p: Mapping[str, float], amplitude: float, order: float, motor_speed: float) -> float:
    """(c) Ripple of the load speed [rad/s] from one order of the kinematic error [rad]."""
    omega = order * motor_speed
    return amplitude * omega * abs(held_gain(p, omega))


def brake_torque(p: Mapping[str, float], load_speed: float) -> float:
    """(e) Spring torque [N m] when the motor stops at once; an upper bound for any slower brake."""
    return load_speed * math.sqrt(p["k1"] * p["J_l"])


def controlled_mode(p: Mapping[str, float], K_p: float, K_i: float) -> complex:
    """(e) Eigenvalue [1/s] of the torsional mode while a PI controller holds the motor."""
    i = p["ratio"]
    J_M = inertias(p)[0]
    k, b = p["k1"], p["B_sp"]
    motor = i**2 * (p["B_m"] + p["B_ml"] + K_p)
    # states: x_M = theta_m/i, x_l, their speeds, integral of the speed error in output units
    matrix = np.array(
        [
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
            [-k / J_M, k / J_M, -(motor + b) / J_M, b / J_M, i**2 * K_i / J_M],
            [k / p["J_l"], -k / p["J_l"], b / p["J_l"], -(b + p["B_l"]) / p["J_l"], 0.0],
            [0.0, 0.0, -1.0, 0.0, 0.0],
        ]
    )
    values = np.linalg.eigvals(matrix)
    return complex(values[np.argmax(values.imag)])
