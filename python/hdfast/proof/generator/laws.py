"""The laws of the generator's drive, one compiled function each; the names are those of `plant.Plant`."""

from __future__ import annotations

from math import cos, exp, log, sin, tanh
from typing import TYPE_CHECKING

from hdfast.proof.generator.compiled import compiled
from hdfast.proof.generator.plant import SLIP_ELEMENTS

if TYPE_CHECKING:
    from hdfast.proof.generator.plant import Array, Plant


@compiled
def kinematic_error(p: Plant, angle: float, load_torque: float, t: float) -> tuple[float, float]:
    """Angle by which the rigid output lags [rad], and its slope over the motor angle."""
    error = 0.0
    slope = 0.0
    for n in range(p.te_order.size):
        order = p.te_order[n]
        phase = order * angle + p.te_phase[n] + p.te_wander * p.te_drift[n] * t
        error += p.te_amplitude[n] * cos(phase)
        slope -= p.te_amplitude[n] * order * sin(phase)
    if p.te_extra != 0.0:
        phase = p.te_extra_order * angle + p.te_extra_phase
        error += p.te_extra * cos(phase)
        slope -= p.te_extra * p.te_extra_order * sin(phase)
    if p.tooth != 0.0:
        teeth = 2.0 * (p.ratio - 1.0)
        phase = teeth * angle + p.tooth_phase
        error += p.tooth * cos(phase)
        slope -= p.tooth * teeth * sin(phase)
    if p.te_load != 0.0:
        phase = 2.0 * angle + p.te_load_phase
        error += p.te_load * load_torque * cos(phase)
        slope -= 2.0 * p.te_load * load_torque * sin(phase)
    return error, slope


@compiled
def spring(p: Plant, windup: float) -> tuple[float, float, float]:
    """Torque [N m], tangent stiffness and stored energy of the gear spring, gap and soft windup included."""
    x = windup
    open_gap = 1.0
    if p.half_gap > 0.0:
        if x > p.half_gap:
            x -= p.half_gap
        elif x < -p.half_gap:
            x += p.half_gap
        else:
            x = 0.0
            open_gap = 0.0
    torque = p.k1 * x + p.k3 * x * x * x
    tangent = open_gap * (p.k1 + 3.0 * p.k3 * x * x)
    energy = 0.5 * p.k1 * x * x + 0.25 * p.k3 * x**4
    if p.delta_K != 0.0:
        bend = tanh(x / p.phi_0)
        torque -= p.delta_K * p.phi_0 * bend
        tangent -= open_gap * p.delta_K * (1.0 - bend * bend)
        bent = abs(x / p.phi_0)
        energy -= p.delta_K * p.phi_0 * p.phi_0 * (bent + log(0.5 + 0.5 * exp(-2.0 * bent)))
    return torque, tangent, energy


@compiled
def stiffness_factor(p: Plant, angle: float) -> tuple[float, float]:
    """Factor on the spring torque, and its slope over the motor angle."""
    phase = 2.0 * angle + p.psi_2
    return 1.0 + p.eps_2 * cos(phase), -2.0 * p.eps_2 * sin(phase)


@compiled
def slip(p: Plant, elements: Array, change: float) -> tuple[float, float]:
    """Move ten Maxwell-slip elements by a change of windup: their torque [N m], and the stiffness of those that hold.

    Element j yields at the windup d_j = phi_h (j + 1/2) / 5 and carries a tenth of T_h then, so the virgin curve
    bends from its initial slope to T_h over about 2 phi_h.
    """
    torque = 0.0
    tangent = 0.0
    for j in range(SLIP_ELEMENTS):
        yield_at = p.phi_h * (j + 0.5) / (0.5 * SLIP_ELEMENTS)
        stiffness = p.T_h / SLIP_ELEMENTS / yield_at
        moved = elements[j] + change
        elements[j] = min(max(moved, -yield_at), yield_at)
        torque += stiffness * elements[j]
        if elements[j] == moved:
            tangent += stiffness
    return torque, tangent


@compiled
def friction_level(p: Plant, angle: float, speed: float, gear_torque: float, temperature: float, rest: float) -> float:
    """Largest dry friction torque at the wave generator [N m], at this speed.

    Args:
        p: the plant.
        angle: of the motor [rad].
        speed: of the motor [rad/s].
        gear_torque: at the output [N m].
        temperature: [degC].
        rest: share of the thixotropic build-up still in force, 0 to 1.
    """
    pace = abs(speed)
    level = p.T_c * (1.0 + p.thixotropy * rest)
    if p.T_excess != 0.0:
        level += p.T_excess * exp(-pace / p.omega_s)
    level += p.load_share / p.ratio * abs(gear_torque)
    level *= 1.0 + p.ripple * cos(p.ripple_order * angle + p.ripple_phase)
    direction = tanh(speed / 0.05)
    level += p.asymmetry * p.T_c * direction
    if p.field != 0.0:
        scale = log(1.0 + pace)
        for n in range(p.field_weight.size):
            level += (
                p.field
                * p.field_weight[n]
                * cos(p.field_speed[n] * scale + p.field_temperature[n] * (temperature - 20.0) + p.field_phase[n])
            )
    return max(level, 0.0)


@compiled
def drag(p: Plant, speed: float, temperature: float) -> tuple[float, float]:
    """Viscous torque at the motor [N m] divided by speed, and the torque of the power law [N m]."""
    viscous = p.B_m * exp(-p.beta * (temperature - 20.0))
    power = 0.0
    if p.b_power != 0.0:
        power = p.b_power * abs(speed) ** p.power * (1.0 if speed > 0.0 else -1.0)
    return viscous, power


@compiled
def motor_torque(p: Plant, command: float, angle: float) -> float:
    """Torque on the rotor [N m] from the commanded one: gain, ripple, cogging."""
    torque = (1.0 + p.gain_error) * command
    if p.r_2 != 0.0:
        torque *= 1.0 + p.r_2 * cos(2.0 * p.pole_pairs * angle + p.psi_r)
    if p.T_cog != 0.0:
        torque += p.T_cog * sin(p.cog_order * angle + p.psi_cog)
    return torque


@compiled
def load_side_torque(p: Plant, angle: float, t: float) -> float:
    """Torque on the payload that resists forward motion [N m], without friction and the known load."""
    torque = 0.0
    if p.T_gravity != 0.0:
        torque += p.T_gravity * sin(angle + p.psi_gravity)
    if p.T_external != 0.0:
        torque += p.T_external * sin(6.283185307179586 * p.f_external * t)
    if p.detent != 0.0:
        x = (angle - p.detent_angle) / p.detent_width
        torque += p.detent * x * exp(0.5 - 0.5 * x * x)
    if angle > p.stop_angle:
        torque += p.stop_stiffness * (angle - p.stop_angle)
    return torque
