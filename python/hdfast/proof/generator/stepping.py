"""Time stepping of the four inertias: implicit midpoint for the smooth part, projection for dry friction.

The scheme is of Moreau-Jean type: per step the momentum balance with linearised implicit forces is one tridiagonal
system (rotor - wave generator - ring - payload is a chain); friction enters as an impulse inside its set, found by
projected Gauss-Seidel so that a contact either sticks at zero speed or slides at its full level. Acary, Brogliato
2008, chapters 10 and 12.
"""

from __future__ import annotations

import numpy as np

from hdfast.proof.generator.compiled import compiled
from hdfast.proof.generator.control import MEMORY, Controller, control
from hdfast.proof.generator.hidden import ACTUAL, HIDDEN, REST, WINDUP, mesh, resistance, rest, settle
from hdfast.proof.generator.laws import (
    drag,
    friction_level,
    kinematic_error,
    load_side_torque,
    motor_torque,
    spring,
)
from hdfast.proof.generator.plant import Array, Plant

STEP = 5.0e-5
PER_SAMPLE = 5
GRID = STEP * PER_SAMPLE
HALF = 0.5 * STEP
TRACES = ("motor_angle", "motor_speed", "motor_torque", "load_angle", "load_speed", "output_torque", "windup")
INNER = ("wave_angle", "wave_speed", "payload_angle", "payload_speed")
ROTOR, WAVE, RING, PAYLOAD = range(4)
SWEEPS, CLOSE = 30, 1e-12


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
        `TRACES`, then `INNER`, on the grid, (11, N).
    """
    n = reference.size
    out = np.empty((11, n))
    q, v, fresh, impulses = start.copy(), np.zeros(4), np.zeros(4), np.zeros(2)
    hidden, memory, work = np.zeros(HIDDEN), np.zeros(MEMORY), np.zeros((5, 4))
    settle(p, hidden, q[WAVE], q[RING], q[PAYLOAD], load[0])
    command = 0.0
    for k in range(n):
        write(p, q, v, command, hidden, out[:, k])
        after = min(k + 1, n - 1)
        for part in range(PER_SAMPLE):
            share = (part + 0.5) / PER_SAMPLE
            t = k * GRID + (part + 0.5) * STEP
            tau_load = load[k] + share * (load[after] - load[k])
            asked = reference[k] + share * (reference[after] - reference[k])
            if c.closed == 0:
                command = asked
            elif (k * PER_SAMPLE + part) % c.samples == 0:
                seen = c.step * np.floor((q[ROTOR] + encoder_noise[k]) / c.step + 0.5)
                command = control(c, memory, seen, asked, c.samples * STEP)
            hidden[ACTUAL] += (command - hidden[ACTUAL]) * min(STEP / (p.tau_e + HALF), 1.0)
            level = assemble(p, q, v, hidden, tau_load, temperature[k], t, work)
            rub(p, level, work, impulses, fresh)
            for j in range(4):
                q[j] += HALF * (v[j] + fresh[j])
                v[j] = fresh[j]
            rest(p, hidden, v[WAVE], STEP)
    return out


@compiled
def write(p: Plant, q: Array, v: Array, command: float, hidden: Array, out: Array) -> None:
    """One sample of `TRACES` and `INNER`."""
    out[0], out[1], out[2], out[3], out[4] = q[ROTOR], v[ROTOR], command, q[RING], v[RING]
    out[5] = p.k_c * (q[RING] - q[PAYLOAD]) + p.c_c * (v[RING] - v[PAYLOAD])
    out[6] = hidden[WINDUP]
    out[7], out[8], out[9], out[10] = q[WAVE], v[WAVE], q[PAYLOAD], v[PAYLOAD]


@compiled
def assemble(
    p: Plant, q: Array, v: Array, hidden: Array, tau_load: float, temperature: float, t: float, work: Array
) -> float:
    """Fill the momentum balance of one step (rows of `work`: off-diagonal, diagonal, right side); the friction level.

    Implicit midpoint, linear in the new speeds: forces at the old angles, plus stiffness times half a step and damping
    on the mean of old and new speeds.
    """
    lower, main, right = work[0], work[1], work[2]
    local, elastic, stiff, reaction = mesh(p, hidden, q[WAVE], q[RING], tau_load, t, STEP)
    viscous, power = drag(p, v[WAVE], temperature)
    slide = local * v[WAVE] - v[RING]
    level = friction_level(p, q[WAVE], v[WAVE], elastic + p.B_sp * slide, temperature, hidden[REST])
    ki, kg, kc = HALF * p.k_i + p.c_i, HALF * stiff + p.B_sp, HALF * p.k_c + p.c_c
    main[ROTOR] = p.J_r + HALF * ki
    main[WAVE] = p.J_w + HALF * (ki + viscous + kg * local * local)
    main[RING] = p.J_f + HALF * (kg + kc)
    main[PAYLOAD] = p.J_p + HALF * (kc + p.B_l)
    lower[0], lower[1], lower[2] = -HALF * ki, -HALF * kg * local, -HALF * kc
    twist, stretch = p.k_i * (q[ROTOR] - q[WAVE]), p.k_c * (q[RING] - q[PAYLOAD])
    first, last = HALF * ki * (v[ROTOR] - v[WAVE]), HALF * kc * (v[RING] - v[PAYLOAD])
    middle = HALF * kg * slide
    resisting = tau_load + resistance(p, hidden, q[PAYLOAD], v[PAYLOAD], t, STEP)
    push = motor_torque(p, hidden[ACTUAL], q[ROTOR]) - twist
    right[ROTOR] = p.J_r * v[ROTOR] + STEP * push - first
    push = twist - local * elastic - reaction - power
    right[WAVE] = (p.J_w - HALF * viscous) * v[WAVE] + STEP * push + first - local * middle
    right[RING] = p.J_f * v[RING] + STEP * (elastic - stretch) + middle - last
    right[PAYLOAD] = (p.J_p - HALF * p.B_l) * v[PAYLOAD] + STEP * (stretch - resisting) + last
    return level


@compiled
def rub(p: Plant, level: float, work: Array, impulses: Array, fresh: Array) -> None:
    """New speeds with dry friction at wave generator and payload; `impulses` [N m s] start from the last step's."""
    lower, main, right, by_wave, by_payload = work[0], work[1], work[2], work[3], work[4]
    solve_chain(lower, main, right, fresh)
    bound_w, bound_p = STEP * level, STEP * p.T_cl
    if bound_w + bound_p == 0.0:
        return
    respond(lower, main, WAVE, by_wave)
    respond(lower, main, PAYLOAD, by_payload)
    for _ in range(SWEEPS):
        before = impulses[0]
        left = fresh[WAVE] - by_payload[WAVE] * impulses[1]
        impulses[0] = min(max(left / by_wave[WAVE], -bound_w), bound_w)
        left = fresh[PAYLOAD] - by_wave[PAYLOAD] * impulses[0]
        impulses[1] = min(max(left / by_payload[PAYLOAD], -bound_p), bound_p)
        if abs(impulses[0] - before) <= CLOSE * (bound_w + bound_p):
            break
    for j in range(4):
        fresh[j] -= by_wave[j] * impulses[0] + by_payload[j] * impulses[1]


@compiled
def respond(lower: Array, main: Array, where: int, out: Array) -> None:
    """Speeds after a unit impulse at one inertia."""
    unit = np.zeros(4)
    unit[where] = 1.0
    solve_chain(lower, main, unit, out)


@compiled
def solve_chain(lower: Array, main: Array, right: Array, out: Array) -> None:
    """Solve a symmetric tridiagonal system of four; `lower` holds the three off-diagonal entries."""
    pivots = np.empty(4)
    pivots[0] = main[0]
    out[0] = right[0]
    for k in range(1, 4):
        factor = lower[k - 1] / pivots[k - 1]
        pivots[k] = main[k] - factor * lower[k - 1]
        out[k] = right[k] - factor * out[k - 1]
    out[3] /= pivots[3]
    for k in range(2, -1, -1):
        out[k] = (out[k] - lower[k] * out[k + 1]) / pivots[k]


@compiled
def start_at_rest(p: Plant, angle: float, load_torque: float) -> Array:
    """Angles of the four inertias at rest [rad], the spring in balance with the load, the rotor at `angle`."""
    windup, resisting, ring = 0.0, load_torque, 0.0
    error = kinematic_error(p, angle, load_torque, 0.0)[0]
    for _ in range(50):
        ring = angle / p.ratio - error - windup
        resisting = load_torque + load_side_torque(p, ring - resisting / p.k_c, 0.0)
        torque, tangent, _ = spring(p, windup)
        windup += 0.7 * (resisting - torque) / max(tangent, 0.2 * p.k1)
    return np.array([angle, angle, ring, ring - resisting / p.k_c])
