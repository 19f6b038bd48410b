"""How late columns are, as a campaign states it: a replay begins with the motor's motion, whose delay shifts all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hdfast.diagnosis.source import Source
from hdfast.errors import InputError
from hdfast.printing import enumerated
from hdfast.recordings import Campaign
from hdfast.recordings.campaign import DELAY, LOAD_SIDE
from hdfast.recordings.clock import period
from hdfast.sensors import SensorFacts

MOTOR, TORQUE, LOAD = "motor_angle", "motor_torque", "load_torque"
#: What a replay is made with, and read as much earlier as it is late.
PRESCRIBED = (MOTOR, LOAD)
LEAST = 1e-3


def lateness(campaign: Campaign, interval: float) -> dict[str, float]:
    """Delay of the motor angle and of each column that is recorded [s], the least of those that are compared 0.

    What all share is no delay to a replay, but one to a load torque that is known at once. A mean over the interval
    before is half an interval late; of the motor torque the fit finds that by itself.

    Args:
        campaign: the checked campaign.
        interval: between samples [s].
    """
    known = campaign.delays
    recorded = _recorded(campaign, (TORQUE, *LOAD_SIDE))
    found = {name: known.get(name, 0.0) for name in (MOTOR, *recorded)}
    sign = -1.0 if _averaged(campaign, MOTOR) else 1.0
    for name in apart(campaign).intersection(recorded):
        found[name] += sign * 0.5 * interval
    least = min(found.values())
    found |= {name: known.get(name, 0.0) for name in _recorded(campaign, (LOAD,))}
    return {name: late - least for name, late in found.items()}


def apart(campaign: Campaign) -> set[str]:
    """Channels of the load's side that are averaged where the motor angle is not, or the other way round."""
    return {name for name in LOAD_SIDE if _averaged(campaign, name) != _averaged(campaign, MOTOR)}


def _recorded(campaign: Campaign, names: Sequence[str]) -> list[str]:
    return [name for name in names if any(name in one for one in campaign.recordings)]


def _averaged(campaign: Campaign, name: str) -> bool:
    return name in campaign.sensors and bool(campaign.sensors[name].averaged)


def means(campaign: Campaign) -> bool:
    """Whether all that is recorded of the load's side is averaged."""
    load = _recorded(campaign, LOAD_SIDE)
    return bool(load) and all(_averaged(campaign, name) for name in load)


def on_time(campaign: Campaign, sources: Sequence[Source]) -> list[Source]:
    """The recordings with what is prescribed read as much earlier as it is late, the rest as late as in the slowest.

    A mean is half an interval late, and intervals may differ from recording to recording.

    Raises:
        InputError: a column is later than its recording is long.
    """
    periods = [period(one.recording["t"]) for one in sources]
    usual = {**lateness(campaign, max(periods)), **dict.fromkeys(PRESCRIBED, 0.0)}
    return [
        _earlier(one, lateness(campaign, own), usual, LEAST * own) for one, own in zip(sources, periods, strict=True)
    ]


def neglected(campaign: Campaign) -> list[str]:
    """What is stated and not used: of a recorded load torque's sensor all but the delay, of other scales the error."""
    return [*_of_the_load(campaign), *_of_scales(campaign)]


def _of_scales(campaign: Campaign) -> list[str]:
    return [
        f"columns.{name}.sigma is not used: only the scale of motor_torque is fitted, others count as right"
        for name, column in campaign.columns.items()
        if column.sigma and name != "motor_torque" and _recorded(campaign, (name,))
    ]


def _of_the_load(campaign: Campaign) -> list[str]:
    facts = campaign.sensors.get(LOAD, SensorFacts())
    more = [key for key in ("lowpass_hz", "averaged") if getattr(facts, key)]
    more += [one.effect for one in campaign.drive.effects if one.channel == LOAD and one.effect != DELAY]
    if not more or not _recorded(campaign, (LOAD,)):
        return []
    return [
        f"{LOAD} is replayed as it was recorded: of its sensor the delay is taken back, {enumerated(more)} not; "
        "record it with a faster one, or correct the column"
    ]


def _earlier(source: Source, late: Mapping[str, float], usual: Mapping[str, float], least: float) -> Source:
    """A recording, its columns read earlier that are later than usual by more than the least [s], and the other way.

    What they then lack at an end has no number: a motion that stops dead there is none of the drive's.
    """
    found, t = dict(source.recording), source.recording["t"]
    for name, own in late.items():
        known = np.isfinite(found.get(name, np.nan))
        if known.any() and abs(own - usual[name]) > least:
            earlier = t[known] - (own - usual[name])
            moved = np.interp(t, earlier, found[name][known], left=np.nan, right=np.nan)
            found[name] = np.where(known, moved, np.nan)
            if not np.isfinite(found[name]).any():
                raise InputError(
                    f"{source.name}: {name} is stated to be {own:.3g} s later than another channel, which leaves "
                    f"nothing of a recording of {np.ptp(t):.3g} s; delays are in seconds"
                )
    return replace(source, recording=found)
