"""The nominal drive of a campaign as a structure with free parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hdfast.diagnosis.lateness import PRESCRIBED, apart, lateness
from hdfast.diagnosis.structure import REVERSAL, TORQUE_LEAD, TORQUE_SCALE, Free, Structure
from hdfast.params import params
from hdfast.recordings import Campaign
from hdfast.recordings.campaign import DELAY
from hdfast.sensors import SensorFacts, stage_of
from hdfast.spring import COEFFICIENTS
from hdfast.terms import terms

NO_SPREAD = 1e-6  # of the scale of a torque that is stated as exact
LEAD_SHARE = 0.5
REVERSAL_LAG = 1e-3
VISIBLE = 2.0
#: Of the delay of a mean: it may be of the samples that a reader has, not of all time since the one before.
MEAN_SIGMA = 0.2
SIGNED = ("k2", "k3", "k4", "k5")


def baseline(campaign: Campaign, torque_spread: float, period: float) -> Structure:
    """The campaign's model; what its priors leave open is fitted, and so are scale and clock of the torque.

    A command that is held from one sample to the next, and sensors that average, shift the torque against the motion
    by up to a sample; more is physics. Where the motion is smoothed or the wheel stands behind a coupling, dry friction
    reverses a fraction of a millisecond beside the encoder: an impulse at each reversal. A term's parameter goes by its
    long name, with the term's id before it, and stays within its allowed range.

    Args:
        campaign: the checked campaign.
        torque_spread: standard deviation of the recorded motor torque [N m].
        period: of the slowest recording's samples [s].
    """
    shift = max(period, campaign.controller.period if campaign.controller else 0.0)
    free = [
        Free(TORQUE_SCALE, 1.0, max(campaign.channel_sigma["motor_torque"], NO_SPREAD), True, "1", 0.1, 10.0),
        Free(TORQUE_LEAD, 0.0, LEAD_SHARE * shift, False, "s", -shift, shift),
        Free(REVERSAL, 0.0, REVERSAL_LAG * torque_spread, False, "N m s"),
    ]
    fixed = {}
    table = params(campaign.model)
    own = {
        table.canonical(f"{term}_{parameter.name}"): (f"{term}_{parameter.name}", parameter.allowed)
        for term in campaign.model.terms
        for parameter in terms()[term].parameters
    }
    for row in table:
        prior = campaign.priors[row.name]
        name, (low, high) = own.get(row.name, (row.name, (-np.inf, np.inf)))
        fixed[name] = prior.value
        if prior.sigma == 0.0 or not np.isfinite(prior.sigma):
            continue
        positive = prior.value > 0.0 and not row.name.startswith(("te_", *SIGNED)) and "psi" not in row.name
        sigma = prior.sigma / prior.value if positive else prior.sigma
        free.append(Free(name, prior.value, float(sigma), positive, row.unit, low, high))
    sensors, read = _sensors(campaign, period)
    fixed |= read
    return Structure(campaign.model, fixed, (*free, *_open(campaign, read)), tuple(sensors))


def with_resonance(campaign: Campaign, corner: float) -> Campaign:
    """The campaign with its windup where recordings of the motor's side alone show the load's resonance.

    A rigid drive would be wrong by as much as the load's inertial torque there. Stiffness and inertia have to be
    stated, and no base.

    Args:
        campaign: the checked campaign.
        corner: band of the motor torque [Hz].
    """
    if campaign.drive.base is not None or campaign.base != "one_inertia" or unstated_of_resonance(campaign):
        return campaign
    first = COEFFICIENTS[campaign.drive.spring][0]
    resonance = math.sqrt(campaign.priors[first].value / campaign.priors["J_l"].value) / (2.0 * math.pi)
    if resonance > VISIBLE * corner:
        return campaign
    return replace(campaign, drive=replace(campaign.drive, base="two_inertia"))


def unstated_of_resonance(campaign: Campaign) -> list[str]:
    """What a campaign does not state of the load's resonance: its stiffness, its inertia."""
    return [name for name in (COEFFICIENTS[campaign.drive.spring][0], "J_l") if not campaign.priors[name].stated]


def _sensors(campaign: Campaign, period: float) -> tuple[list[tuple[str, str]], dict[str, float]]:
    """Effects of sensors that a replay passes through, and their parameters by long name; delays as `lateness` says."""
    stage = stage_of({name: _lasting(facts) for name, facts in campaign.sensors.items()}, campaign.drive.effects)
    effects = [pair for pair in stage.effects if pair[0] != DELAY]
    found = {
        name: float(stage.value(name))
        for effect, channel in effects
        for name in (f"{channel}_{effect}_{parameter.name}" for parameter in terms()[effect].parameters)
    }
    known = lateness(campaign, period)
    late = {channel: own for channel, own in known.items() if own > 0.0 and channel not in PRESCRIBED}
    found |= {f"{channel}_{DELAY}_tau_y": own for channel, own in late.items()}
    return [*((DELAY, channel) for channel in late), *effects], found


def _open(campaign: Campaign, read: Mapping[str, float]) -> list[Free]:
    """The parameters of declared effects of sensors that a sigma is stated of, and the delay of what is averaged."""
    means = [f"{channel}_{DELAY}_tau_y" for channel in sorted(apart(campaign))]
    found = [Free(name, read[name], MEAN_SIGMA, True, "s", 0.0, 1.0) for name in means if name in read]
    for declared in campaign.drive.effects:
        if declared.channel is None:
            continue
        for parameter in terms()[declared.effect].parameters:
            name = f"{declared.channel}_{declared.effect}_{parameter.name}"
            value, sigma = read.get(name, 0.0), declared.sigma.get(parameter.name, 0.0)
            if value != 0.0 and sigma > 0.0 and name not in means:
                own = sigma / value if value > 0.0 else sigma
                found.append(Free(name, value, float(own), value > 0.0, parameter.unit, *parameter.allowed))
    return found


def _lasting(facts: SensorFacts) -> SensorFacts:
    """What a sensor does to the signal beyond noise and rounding, which the weights stand for."""
    return replace(facts, resolution=None, noise=None, averaged=None, delay_s=None)
