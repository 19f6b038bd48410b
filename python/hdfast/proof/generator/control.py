"""The drive's controller: a sampled speed loop around a real encoder, with the habits of industrial drives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hdfast.proof.generator.compiled import compiled
from hdfast.proof.generator.plant import Array


class Controller(NamedTuple):
    """A sampled PI speed controller; without loop the reference is the torque itself.

    Attributes:
        closed: 1 with the speed loop, 0 when the reference is a torque [N m].
        kp: gain [N m s/rad].
        ki: gain [N m/rad].
        stiffness: gain on the angle error [1/s], 0 for a pure speed loop.
        limit: largest torque [N m].
        samples: steps of the integrator per sample of the controller.
        step: resolution of its encoder [rad].
        smoothing: weight of the new speed in the first-order speed filter, 0 to 1.
        friction: feed-forward dry friction [N m].
        viscous: feed-forward viscous friction [N m s/rad].
        notch: coefficients b0, b1, b2, a1, a2 of a biquad.
    """

    closed: int
    kp: float
    ki: float
    stiffness: float
    limit: float
    samples: int
    step: float
    smoothing: float
    friction: float
    viscous: float
    notch: Array


MEMORY = 7
NO_NOTCH = np.array([1.0, 0.0, 0.0, 0.0, 0.0])


def notch(frequency: float, width: float, period: float) -> Array:
    """Biquad b0, b1, b2, a1, a2 of a notch at `frequency` [Hz], relative `width`, by the bilinear transform."""
    w = 2.0 * np.pi * frequency * period
    alpha = np.sin(w) * width / 2.0
    taps = np.array([1.0, -2.0 * np.cos(w), 1.0, -2.0 * np.cos(w), 1.0 - alpha])
    return np.asarray(taps / (1.0 + alpha))


@compiled
def control(c: Controller, memory: Array, angle: float, reference: float, period: float) -> float:
    """One sample of the controller: the torque [N m] for the measured angle [rad] and the reference [rad/s].

    `memory` holds: last angle, filtered speed, integral, integral of the reference, two notch states, started flag.
    """
    if memory[6] == 0.0:
        memory[0] = angle
        memory[3] = angle
        memory[6] = 1.0
    memory[1] += c.smoothing * ((angle - memory[0]) / period - memory[1])
    memory[0] = angle
    error = reference + c.stiffness * (memory[3] - angle) - memory[1]
    memory[3] += period * reference
    torque = c.kp * error + c.ki * memory[2]
    if reference != 0.0:
        torque += (c.friction if reference > 0.0 else -c.friction) + c.viscous * reference
    passed = c.notch[0] * torque + memory[4]
    memory[4] = c.notch[1] * torque - c.notch[3] * passed + memory[5]
    memory[5] = c.notch[2] * torque - c.notch[4] * passed
    limited = float(min(max(passed, -c.limit), c.limit))
    if limited == passed or error * passed < 0.0:
        memory[2] += period * error
    return limited
