"""The nominal drive of a campaign as a structure with free parameters."""

from __future__ import annotations

import numpy as np

from hdfast.diagnosis.plant import TORQUE_OFFSET, TORQUE_SCALE, Free, Structure
from hdfast.params import params
from hdfast.recordings import Campaign

OFFSET_SHARE = 0.05
SIGNED = ("k2", "k3", "k4", "k5")


def baseline(campaign: Campaign, torque_spread: float) -> Structure:
    """The campaign's model; what its priors leave open is fitted, and so are scale and zero of the motor torque.

    Args:
        campaign: the checked campaign.
        torque_spread: standard deviation of the recorded motor torque [N m].
    """
    free = [
        Free(TORQUE_SCALE, 1.0, max(campaign.channel_sigma["motor_torque"], 1e-6), False, "1", 0.1, 10.0),
        Free(TORQUE_OFFSET, 0.0, OFFSET_SHARE * torque_spread, False, "N m"),
    ]
    fixed = {}
    for row in params(campaign.model):
        prior = campaign.priors[row.name]
        fixed[row.name] = prior.value
        if prior.sigma == 0.0 or not np.isfinite(prior.sigma):
            continue
        positive = prior.value > 0.0 and not row.name.startswith(("te_", *SIGNED)) and "psi" not in row.name
        sigma = prior.sigma / prior.value if positive else prior.sigma
        free.append(Free(row.name, prior.value, float(sigma), positive, row.unit))
    return Structure(campaign.model, fixed, tuple(free))
