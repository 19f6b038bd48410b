"""Hidden states of the drive, and the laws that move them: shared by time stepping and imposed motion."""

from __future__ import annotations

from math import sin

from hdfast.proof.generator.compiled import compiled
from hdfast.proof.generator.laws import (
    kinematic_error,
    load_side_torque,
    slip,
    spring,
    stiffness_factor,
)
from hdfast.proof.generator.plant import SLIP_ELEMENTS, Array, Plant

WINDUP, CREEP, BRISTLE, REST, BOB, BOB_SPEED, ACTUAL, SLIDERS = range(8)
HIDDEN = SLIDERS + SLIP_ELEMENTS
TURN = 6.283185307179586
FULL_WEAR = 5.0  # speed from which on thixotropic structure wears at its full rate [rad/s]


@compiled
def settle(p: Plant, hidden: Array, angle: float, ring: float, payload: float, load: float) -> None:
    """Hidden states after a long rest; angles [rad], load torque [N m]. The sloshing mass hangs down in its payload."""
    hidden[:] = 0.0
    hidden[WINDUP] = hidden[CREEP] = angle / p.ratio - kinematic_error(p, angle, load, 0.0)[0] - ring
    hidden[REST] = 1.0
    hidden[BOB] = payload


@compiled
def mesh(
    p: Plant, hidden: Array, angle: float, ring: float, load: float, t: float, step: float
) -> tuple[float, float, float, float]:
    """Local ratio, torque without damper [N m], its tangent [N m/rad], and reaction of a varying stiffness [N m].

    The tangent holds that of what remembers as well: an explicit step of a spring would take damping away.
    """
    error, slope = kinematic_error(p, angle, load, t)
    windup = angle / p.ratio - error - ring
    torque, tangent, energy = spring(p, windup)
    factor, factor_slope = stiffness_factor(p, angle)
    torque, tangent = factor * torque, factor * tangent
    if p.T_h != 0.0:
        held, stiffness = slip(p, hidden[SLIDERS:], windup - hidden[WINDUP])
        torque, tangent = torque + held, tangent + stiffness
    hidden[WINDUP] = windup
    if p.K_v > 0.0:
        hidden[CREEP] += step * (windup - hidden[CREEP]) / p.tau_v
        torque, tangent = torque + p.K_v * (windup - hidden[CREEP]), tangent + p.K_v
    return 1.0 / p.ratio - slope, torque, tangent, factor_slope * energy


@compiled
def resistance(p: Plant, hidden: Array, payload: float, speed: float, t: float, step: float) -> float:
    """Torque that resists the payload [N m], without friction and the known load; moves the sloshing mass."""
    torque = load_side_torque(p, payload, t)
    if p.slosh_inertia > 0.0:
        w = TURN * p.slosh_frequency
        swing = w * w * sin(hidden[BOB] - payload) + 2.0 * p.slosh_damping * w * (hidden[BOB_SPEED] - speed)
        hidden[BOB_SPEED] -= step * swing
        hidden[BOB] += step * hidden[BOB_SPEED]
        torque -= p.slosh_inertia * swing
    return torque


@compiled
def rest(p: Plant, hidden: Array, speed: float, step: float) -> None:
    """Thixotropic structure builds up at rest and wears in motion."""
    if p.thixotropy != 0.0:
        wear = hidden[REST] * min(abs(speed), FULL_WEAR)
        hidden[REST] += step * ((1.0 - hidden[REST]) / 3.0 - wear) / p.thixotropy_time
