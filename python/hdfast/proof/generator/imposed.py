"""The drive under an imposed motor motion: what torque it would need, and where its output would be.

The generator's linearisation is built from differences of this function. It follows the recorded motion whatever
the parameters, so a difference never drifts away and no controller takes part.
"""

from __future__ import annotations

from math import cos, sin, tanh

import numpy as np

from hdfast.proof.generator.compiled import compiled
from hdfast.proof.generator.hidden import BRISTLE, HIDDEN, REST, WINDUP, mesh, resistance, rest, settle
from hdfast.proof.generator.laws import drag, friction_level
from hdfast.proof.generator.plant import Array, Plant
from hdfast.proof.generator.stepping import GRID

STICK = 0.02  # speed over which dry friction builds up here [rad/s]
SKIP = 2
COARSE = SKIP * GRID
HALF = 0.5 * COARSE


@compiled
def impose(p: Plant, angle: Array, speed: Array, pull: Array, load: Array, temperature: Array, start: Array) -> Array:
    """Torque and output for a given motion of the motor, in steps of `COARSE` seconds.

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
    q, v, hidden = start.copy(), np.zeros(2), np.zeros(HIDDEN)
    settle(p, hidden, angle[0], q[0], q[1], load[0])
    before = 0.0
    for k in range(n):
        t = k * COARSE
        local, elastic, stiff, reaction = mesh(p, hidden, angle[k], q[0], load[k], t, COARSE)
        gear = elastic + p.B_sp * (local * speed[k] - v[0])
        dry = rubbing(p, hidden, angle[k], speed[k], gear, temperature[k])
        viscous, power = drag(p, speed[k], temperature[k])
        shaft = (p.J_r + p.J_w) * pull[k] + viscous * speed[k] + power + dry + local * gear + reaction
        need = commanded(p, shaft, angle[k])
        before = need if k == 0 else before
        out[0, k], out[1, k], out[2, k] = angle[k], speed[k], need + p.tau_e * (need - before) / COARSE
        out[3, k], out[4, k] = q[0], v[0]
        out[5, k] = p.k_c * (q[0] - q[1]) + p.c_c * (v[0] - v[1])
        out[6, k] = hidden[WINDUP]
        before = need
        resisting = load[k] + resistance(p, hidden, q[1], v[1], t, COARSE)
        toward = local * (speed[k] + speed[min(k + 1, n - 1)])
        move(p, q, v, elastic, stiff, toward, resisting)
        rest(p, hidden, speed[k], COARSE)
    return out


@compiled
def rubbing(p: Plant, hidden: Array, angle: float, speed: float, gear: float, temperature: float) -> float:
    """Dry friction at the wave generator [N m]."""
    level = friction_level(p, angle, speed, gear, temperature, hidden[REST])
    if p.bristle > 0.0:
        spread = 1.0 + COARSE * p.bristle * abs(speed) / max(level, 1e-6)
        hidden[BRISTLE] = (hidden[BRISTLE] + COARSE * speed) / spread
        return float(p.bristle * hidden[BRISTLE])
    return level * tanh(speed / STICK)


@compiled
def commanded(p: Plant, shaft: float, angle: float) -> float:
    """Command that gives this torque on the shaft [N m]: cogging, ripple and gain undone."""
    ripple = 1.0 + p.r_2 * cos(2.0 * p.pole_pairs * angle + p.psi_r)
    return (shaft - p.T_cog * sin(p.cog_order * angle + p.psi_cog)) / ((1.0 + p.gain_error) * ripple)


@compiled
def move(p: Plant, q: Array, v: Array, elastic: float, stiff: float, toward: float, resisting: float) -> None:
    """One implicit step of ring and payload; `toward` is the sum of old and new speed of the rigid output [rad/s]."""
    kg, kc = HALF * stiff + p.B_sp, HALF * p.k_c + p.c_c
    a, b, d = p.J_f + HALF * (kg + kc), -HALF * kc, p.J_p + HALF * (kc + p.B_l)
    stretch, last = p.k_c * (q[0] - q[1]), HALF * kc * (v[0] - v[1])
    first = p.J_f * v[0] + COARSE * (elastic - stretch) + HALF * kg * (toward - v[0]) - last
    second = (p.J_p - HALF * p.B_l) * v[1] + COARSE * (stretch - resisting) + last
    det = a * d - b * b
    ring, payload = (d * first - b * second) / det, (a * second - b * first) / det
    if p.T_cl > 0.0:
        held = min(max(payload * det / a, -COARSE * p.T_cl), COARSE * p.T_cl)
        ring += b / det * held
        payload -= a / det * held
    q[0] += HALF * (v[0] + ring)
    q[1] += HALF * (v[1] + payload)
    v[0], v[1] = ring, payload
