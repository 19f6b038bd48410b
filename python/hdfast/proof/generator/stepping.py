"""Time stepping of the four inertias: implicit midpoint for the smooth part, projection for dry friction.

The scheme is of Moreau-Jean type: per step the momentum balance with linearised implicit forces is one tridiagonal
system (rotor - wave generator - ring - payload is a chain); friction enters as an impulse inside its set, found by
projected Gauss-Seidel so that a contact either sticks at zero speed or slides at its full level. Acary, Brogliato
2008, chapters 10 and 12.
"""

from __future__ import annotations

from math import sin

import numpy as np

from hdfast.proof.generator.control import Controller, control
from hdfast.proof.generator.laws import (
    compiled,
    drag,
    friction_level,
    kinematic_error,
    load_side_torque,
    motor_torque,
    slip,
    spring,
    stiffness_factor,
)
from hdfast.proof.generator.plant import SLIP_ELEMENTS, Array, Plant

STEP = 5.0e-5
PER_SAMPLE = 5
GRID = STEP * PER_SAMPLE
TRACES = ("motor_angle", "motor_speed", "motor_torque", "load_angle", "load_speed", "output_torque", "windup")


@compiled
def solve_chain(lower: Array, main: Array, right: Array, out: Array) -> None:
    """Solve a symmetric tridiagonal system of four; `lower` holds the three off-diagonal entries."""
    d = main[0]
    out[0] = right[0]
    pivots = np.empty(4)
    pivots[0] = d
    for k in range(1, 4):
        factor = lower[k - 1] / pivots[k - 1]
        pivots[k] = main[k] - factor * lower[k - 1]
        out[k] = right[k] - factor * out[k - 1]
    out[3] /= pivots[3]
    for k in range(2, -1, -1):
        out[k] = (out[k] - lower[k] * out[k + 1]) / pivots[k]


@compiled
def run(
    p: Plant, c: Controller, reference: Array, load: Array, temperature: Array, encoder_noise: Array, start: Array
) -> Array:
    """Simulate one recording.

    Args:
        p: the plant.
        c: the controller.
        reference: speed [rad/s] (or torque [N m] without loop) on the grid of `GRID` seconds, (N,).
        load: known torque on the payload, positive resists [N m], (N,).
        temperature: of the gear [degC], (N,).
        encoder_noise: error of the controller's encoder [rad], (N,).
        start: rotor, wave generator, ring and payload angle at rest [rad], (4,).

    Returns:
        `TRACES` on the grid, (7, N).
    """
    n = reference.size
    out = np.empty((7, n))
    q = start.copy()
    v = np.zeros(4)
    elements = np.zeros(SLIP_ELEMENTS)
    memory = np.zeros(8)
    main, lower, right = np.empty(4), np.empty(3), np.empty(4)
    free, by_motor, by_load, unit = np.empty(4), np.empty(4), np.empty(4), np.zeros(4)
    command = 0.0
    actual = 0.0
    creep = 0.0
    bristle = 0.0
    rest = 1.0
    bob, bob_speed = 0.0, 0.0
    impulse_m, impulse_l = 0.0, 0.0
    windup = q[1] / p.ratio - kinematic_error(p, q[1], load[0], 0.0)[0] - q[2]
    h = STEP
    half = 0.5 * h
    count = 0
    for k in range(n):
        out[0, k] = q[0]
        out[1, k] = v[0]
        out[2, k] = command
        out[3, k] = q[2]
        out[4, k] = v[2]
        out[5, k] = p.k_c * (q[2] - q[3]) + p.c_c * (v[2] - v[3])
        out[6, k] = windup
        following = min(k + 1, n - 1)
        for part in range(PER_SAMPLE):
            share = (part + 0.5) / PER_SAMPLE
            t = k * GRID + (part + 0.5) * h
            tau_load = load[k] + share * (load[following] - load[k])
            asked = reference[k] + share * (reference[following] - reference[k])
            if c.closed == 0:
                command = asked
            elif count % c.samples == 0:
                seen = c.step * np.floor((q[0] + encoder_noise[k]) / c.step + 0.5)
                command = control(c, memory, seen, asked, c.samples * h)
            count += 1
            if p.tau_e > 0.0:
                actual += (command - actual) * min(h / (p.tau_e + half), 1.0)
            else:
                actual = command
            error, slope = kinematic_error(p, q[1], tau_load, t)
            local = 1.0 / p.ratio - slope
            fresh = q[1] / p.ratio - error - q[2]
            torque, tangent, energy = spring(p, fresh)
            factor, factor_slope = stiffness_factor(p, q[1], q[2])
            memory_torque = slip(p, elements, fresh - windup) if p.T_h != 0.0 else 0.0
            windup = fresh
            if p.K_v > 0.0:
                creep += h * (windup - creep) / p.tau_v
                memory_torque += p.K_v * (windup - creep)
            elastic = factor * torque + memory_torque
            stiff = factor * tangent
            viscous, power = drag(p, v[1], temperature[k])
            gear = elastic + p.B_sp * (local * v[1] - v[2])
            # implicit midpoint: M (v1 - v0) = h [f(q0, 0) + (half K + C) (v0 + v1) / 2 ...], linear in v1
            ki, kg, kc = half * p.k_i + p.c_i, half * stiff + p.B_sp, half * p.k_c + p.c_c
            main[0] = p.J_r + half * ki
            main[1] = p.J_w + half * (ki + viscous + kg * local * local)
            main[2] = p.J_f + half * (kg + kc)
            main[3] = p.J_p + half * (kc + p.B_l)
            lower[0] = -half * ki
            lower[1] = -half * kg * local
            lower[2] = -half * kc
            push_r = motor_torque(p, actual, q[0]) - p.k_i * (q[0] - q[1])
            push_w = p.k_i * (q[0] - q[1]) - local * elastic - factor_slope * energy - power
            push_f = elastic - p.k_c * (q[2] - q[3])
            push_p = p.k_c * (q[2] - q[3]) - tau_load - load_side_torque(p, q[3], t)
            if p.slosh_inertia > 0.0:
                w = 6.283185307179586 * p.slosh_frequency
                pull = p.slosh_inertia * (w * w * sin(bob - q[3]) + 2.0 * p.slosh_damping * w * (bob_speed - v[3]))
                push_p += pull
                bob_speed -= h * pull / p.slosh_inertia
                bob += h * bob_speed
            right[0] = p.J_r * v[0] + h * push_r - half * ki * (v[0] - v[1])
            right[1] = (
                p.J_w * v[1] + h * push_w + half * ki * (v[0] - v[1])
                - half * viscous * v[1] - half * kg * local * (local * v[1] - v[2])
            )  # fmt: skip
            right[2] = p.J_f * v[2] + h * push_f + half * kg * (local * v[1] - v[2]) - half * kc * (v[2] - v[3])
            right[3] = p.J_p * v[3] + h * push_p + half * kc * (v[2] - v[3]) - half * p.B_l * v[3]
            level = friction_level(p, q[1], v[1], gear, temperature[k], rest)
            if p.bristle > 0.0 and level > 0.0:
                spread = 1.0 + h * p.bristle * abs(v[1]) / level
                right[1] -= h * p.bristle * bristle / spread
                main[1] += h * (p.bristle * h / spread + p.bristle_damping)
                solve_chain(lower, main, right, free)
                bristle = (bristle + h * free[1]) / spread
                level = 0.0
            else:
                solve_chain(lower, main, right, free)
            if level > 0.0 or p.T_cl > 0.0:
                unit[1] = 1.0
                solve_chain(lower, main, unit, by_motor)
                unit[1] = 0.0
                unit[3] = 1.0
                solve_chain(lower, main, unit, by_load)
                unit[3] = 0.0
                bound_m, bound_l = h * level, h * p.T_cl
                for _ in range(30):
                    before_m, before_l = impulse_m, impulse_l
                    speed = free[1] - by_motor[1] * impulse_m - by_load[1] * impulse_l
                    impulse_m = min(max(impulse_m + speed / by_motor[1], -bound_m), bound_m)
                    speed = free[3] - by_motor[3] * impulse_m - by_load[3] * impulse_l
                    impulse_l = min(max(impulse_l + speed / by_load[3], -bound_l), bound_l)
                    if abs(impulse_m - before_m) + abs(impulse_l - before_l) <= 1e-12 * (bound_m + bound_l):
                        break
                for j in range(4):
                    free[j] -= by_motor[j] * impulse_m + by_load[j] * impulse_l
            for j in range(4):
                q[j] += half * (v[j] + free[j])
                v[j] = free[j]
            if p.thixotropy != 0.0:
                rest += h * ((1.0 - rest) / (3.0 * p.thixotropy_time) - rest * min(abs(v[1]), 5.0) / p.thixotropy_time)
    return out


def start_at_rest(p: Plant, angle: float, load_torque: float) -> Array:
    """Angles of the four inertias at rest [rad], the spring in balance with the load, the rotor at `angle`."""
    windup = 0.0
    resisting = load_torque
    error = float(kinematic_error(p, angle, load_torque, 0.0)[0])
    for _ in range(50):
        ring = angle / p.ratio - error - windup
        resisting = load_torque + float(load_side_torque(p, ring, 0.0))
        torque, tangent, _ = spring(p, windup)
        windup += 0.7 * (resisting - torque) / max(tangent, 0.2 * p.k1)
    ring = angle / p.ratio - error - windup
    return np.array([angle, angle, ring, ring - resisting / p.k_c])
