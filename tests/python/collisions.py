"""A rigid drive under speed control that meets an obstacle for a moment, integrated here step by step."""

from __future__ import annotations

import numpy as np

J, B, T_C, K_P, K_I = 3.3e-4, 1.2e-3, 0.02, 0.02, 0.1
RATE = 1000.0


def collided(begin=1.2, length=0.08, torque=0.5, seed=3):
    """Columns of a recording with a collision at `begin` [s], and that time."""
    t = np.arange(4000) / RATE
    reference = 40.0 * np.interp(t, [0.0, 0.4, 2.0, 2.6, 3.6, 4.0], [0.0, 1.0, 1.0, -1.0, -1.0, 0.0])
    angle, motor = np.zeros(t.size), np.zeros(t.size)
    speed = integral = position = 0.0
    inner = 10
    h = 1.0 / RATE / inner
    for k in range(t.size):
        for _ in range(inner):
            error = reference[k] - speed
            integral += error * h
            motor[k] = K_P * error + K_I * integral
            outside = -torque if begin <= t[k] < begin + length else 0.0
            speed += h * (motor[k] + outside - B * speed - T_C * np.tanh(speed / 0.2)) / J
            position += h * speed
        angle[k] = position
    rng = np.random.default_rng(seed)
    step = 2.0 * np.pi / 2**17
    return {
        "t": t,
        "motor_angle": step * np.round(angle / step),
        "motor_torque": motor + 1e-3 * rng.standard_normal(t.size),
    }, begin
