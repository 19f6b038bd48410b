"""Flexible robot arm of the DaISy collection: reaction torque to acceleration at unit sample rate.

Not representable as a campaign: there is no angle, the torque is the reaction of the structure on the ground, and the
motor does not appear. It serves the oracle only.

B. De Moor et al., DaISy: Database for the Identification of Systems, KU Leuven, data set 96-009.
"""

from __future__ import annotations

import numpy as np

from anchors.source import read


def modes(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [cycles/sample] and damping ratios of an ARX model of the given order by least squares."""
    raw = read("daisy_robot_arm_first512")
    u, y = raw["u_torque"], raw["y_acc"]
    past = [-y[order - k : -k] for k in range(1, order + 1)]
    driving = [u[order - k : len(u) - k] for k in range(order + 1)]
    factors = np.linalg.lstsq(np.stack(past + driving, 1), y[order:], rcond=None)[0]
    poles = np.log(np.roots(np.concatenate([[1.0], factors[:order]])))
    poles = poles[poles.imag > 0.0]
    poles = poles[np.argsort(poles.imag)]
    return poles.imag / (2.0 * np.pi), -poles.real / np.abs(poles)
