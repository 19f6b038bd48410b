"""The drive under an imposed motor motion: what torque it would need, and where its output would be.

The generator's linearisation is built from differences of this function. It follows the recorded motion whatever
the parameters, so a difference never drifts away and no controller takes part.
"""

from __future__ import annotations

from math import sin, tanh

import numpy as np

from hdfast.proof.generator.laws import (
    compiled,
    drag,
    friction_level,
    kinematic_error,
    load_side_torque,
    slip,
    spring,
    stiffness_factor,
)
from hdfast.proof.generator.plant import SLIP_ELEMENTS, Array, Plant
from hdfast.proof.generator.stepping import GRID

CREEP = 0.02


@compiled
def impose(p: Plant, angle: Array, speed: Array, pull: Array, load: Array, temperature: Array, start: Array) -> Array:
    """Torque and output for a given motion of the motor.

    Args:
        p: the plant.
        angle: of the motor [rad], (N,).
        speed: [rad/s], (N,).
        pull: acceleration [rad/s^2], (N,).
        load: known torque on the payload [N m], (N,).
        temperature: [degC], (N,).
        start: angle of ring and payload [rad], (2,).

    Returns:
        The traces of `stepping.TRACES`, (7, N); dry friction is a steep function of speed here.
    """
    n = angle.size
    out = np.empty((7, n))
    ring, payload = start[0], start[1]
    w, u = 0.0, 0.0
    elements = np.zeros(SLIP_ELEMENTS)
    creep = 0.0
    bristle = 0.0
    rest = 1.0
    bob, bob_speed = 0.0, 0.0
    held = 0.0
    windup = angle[0] / p.ratio - kinematic_error(p, angle[0], load[0], 0.0)[0] - ring
    h = GRID
    half = 0.5 * h
    drive = 0.0
    for k in range(n):
        t = k * h
        error, slope = kinematic_error(p, angle[k], load[k], t)
        local = 1.0 / p.ratio - slope
        fresh = angle[k] / p.ratio - error - ring
        torque, tangent, energy = spring(p, fresh)
        factor, factor_slope = stiffness_factor(p, angle[k], ring)
        memory_torque = slip(p, elements, fresh - windup) if p.T_h != 0.0 else 0.0
        windup = fresh
        if p.K_v > 0.0:
            creep += h * (windup - creep) / p.tau_v
            memory_torque += p.K_v * (windup - creep)
        elastic = factor * torque + memory_torque
        gear = elastic + p.B_sp * (local * speed[k] - w)
        viscous, power = drag(p, speed[k], temperature[k])
        level = friction_level(p, angle[k], speed[k], gear, temperature[k], rest)
        if p.bristle > 0.0:
            bristle = (bristle + h * speed[k]) / (1.0 + h * p.bristle * abs(speed[k]) / max(level, 1e-6))
            dry = p.bristle * bristle
        else:
            dry = level * tanh(speed[k] / CREEP)
        need = (
            (p.J_r + p.J_w) * pull[k] + viscous * speed[k] + power + dry + local * gear + factor_slope * energy
            - p.T_cog * sin(p.cog_order * angle[k] + p.psi_cog)
        )  # fmt: skip
        need /= (1.0 + p.gain_error) * (1.0 + p.r_2 * np.cos(2.0 * p.pole_pairs * angle[k] + p.psi_r))
        drive = need if k == 0 else drive
        rate = (need - drive) / h
        drive = need
        out[0, k] = angle[k]
        out[1, k] = speed[k]
        out[2, k] = need + p.tau_e * rate
        out[3, k] = ring
        out[4, k] = w
        out[5, k] = p.k_c * (ring - payload) + p.c_c * (w - u)
        out[6, k] = windup
        kg, kc = half * factor * tangent + p.B_sp, half * p.k_c + p.c_c
        a, b, d = p.J_f + half * (kg + kc), -half * kc, p.J_p + half * (kc + p.B_l)
        push_f = elastic - p.k_c * (ring - payload)
        push_p = p.k_c * (ring - payload) - load[k] - load_side_torque(p, payload, t)
        if p.slosh_inertia > 0.0:
            f = 6.283185307179586 * p.slosh_frequency
            swing = p.slosh_inertia * (f * f * sin(bob - payload) + 2.0 * p.slosh_damping * f * (bob_speed - u))
            push_p += swing
            bob_speed -= h * swing / p.slosh_inertia
            bob += h * bob_speed
        following = min(k + 1, n - 1)
        toward = local * (speed[k] + speed[following])
        r1 = p.J_f * w + h * push_f + half * kg * (toward - w) - half * kc * (w - u)
        r2 = p.J_p * u + h * push_p + half * kc * (w - u) - half * p.B_l * u
        det = a * d - b * b
        free_w, free_u = (d * r1 - b * r2) / det, (a * r2 - b * r1) / det
        if p.T_cl > 0.0:
            gain_w, gain_u = -b / det, a / det
            held = min(max(free_u / gain_u, -h * p.T_cl), h * p.T_cl)
            free_w -= gain_w * held
            free_u -= gain_u * held
        ring += half * (w + free_w)
        payload += half * (u + free_u)
        w, u = free_w, free_u
        if p.thixotropy != 0.0:
            rest += h * ((1.0 - rest) / (3.0 * p.thixotropy_time) - rest * min(abs(speed[k]), 5.0) / p.thixotropy_time)
    return out
