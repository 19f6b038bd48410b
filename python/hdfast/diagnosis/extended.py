"""The extended model as a drive file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hdfast.diagnosis.plant import TORQUE
from hdfast.diagnosis.structure import NUISANCE, TORQUE_SCALE, Structure
from hdfast.drive_file import UNKNOWN
from hdfast.params import params
from hdfast.recordings import Campaign
from hdfast.recordings.campaign import DELAY
from hdfast.recordings.columns import ColumnMap
from hdfast.recordings.priors import EXACT
from hdfast.sensors import stage_of
from hdfast.sensors.contract import CHANNEL_UNIT
from hdfast.terms import terms
from hdfast.toml_write import dump

KEPT = ("controller", "sensors")
ERROR = ("te_cos_", "te_sin_")


def extended_model(
    campaign: Campaign,
    structure: Structure,
    values: Mapping[str, float],
    sigma: Mapping[str, float],
    word: str = "extended",
    unnamed: Mapping[str, Any] | None = None,
) -> str:
    """TOML text: the campaign's sections with refitted values and the terms that were found, no recordings.

    The fitted scale of the motor torque goes into its column, so that the model is compared as it was fitted, and into
    what its sensor adds. A clock of the torque that is off by less than a sample has no place in the file.

    Args:
        campaign: where the sections come from.
        structure: the final equations.
        values: value of each free parameter.
        sigma: its standard deviation.
        word: what is added to the title.
        unnamed: parameters of a torque without a name, kept as they are.
    """
    everything = _scaled({**structure.fixed, **values}, structure, values[TORQUE_SCALE])
    sections: dict[str, Any] = {"title": f"{campaign.title}, {word}"}
    drive: dict[str, Any] = {"base": structure.model.base}
    sigma = {**_unfitted(campaign, structure), **_scaled(sigma, structure, values[TORQUE_SCALE])}
    for row in params(structure.model):
        if row.name in everything and _of_the_drive(row.name, structure):
            drive[row.name] = _stated(everything[row.name], sigma.get(row.name))
    sections["drive"] = drive
    sections["kinematic_error"] = _error(structure.model.order_labels, everything, sigma)
    listed = [_term(term, everything, sigma) for term in structure.model.terms]
    declared = {(one.effect, one.channel) for one in campaign.drive.effects}
    facts = set(stage_of(campaign.sensors).effects) - declared
    listed += [
        _term(effect, everything, sigma, channel)
        for effect, channel in structure.sensors
        if (effect, channel) not in facts and effect != DELAY
    ]
    listed += _delays(campaign, structure, values, sigma)
    listed += [{"effect": UNKNOWN, "parameters": dict(unnamed)}] if unnamed else []
    if listed:
        sections["terms"] = listed
    sections |= {name: dict(campaign.data[name]) for name in KEPT if name in campaign.data}
    return dump(sections | {"columns": {**campaign.data.get("columns", {}), TORQUE: _torque(campaign, values, sigma)}})


def _scaled(numbers: Mapping[str, float], structure: Structure, scale: float) -> dict[str, float]:
    """Numbers by name, what the sensor of the motor torque adds to it by as much larger as its column becomes."""
    added = {
        f"{TORQUE}_{effect}_{own.name}"
        for effect, channel in structure.sensors
        if channel == TORQUE
        for own in terms()[effect].parameters
        if own.unit.startswith(CHANNEL_UNIT)
    }
    return {name: number * scale if name in added else number for name, number in numbers.items()}


def _error(labels: Sequence[str], values: Mapping[str, float], sigma: Mapping[str, float]) -> dict[str, list[Any]]:
    """Section of the kinematic error; the larger standard deviation of cosine and sine is that of the order."""
    parts = [(f"te_cos_{label}", f"te_sin_{label}") for label in labels]
    spread = [max(sigma.get(name, math.inf) for name in both) for both in parts]
    return {
        "orders": [_order(label) for label in labels],
        "cos": [float(values[cos]) for cos, _ in parts],
        "sin": [float(values[sin]) for _, sin in parts],
    } | ({"sigma": [float(one) for one in spread]} if spread and np.isfinite(spread).all() else {})


def _unfitted(campaign: Campaign, structure: Structure) -> dict[str, float]:
    """Standard deviations of what no fit moves: as stated, and 0 of what found terms hold fixed; else a bare number."""
    stated = campaign.drive.sigma
    table = params(campaign.model)
    own = [f"{term}_{p.name}" for term in campaign.model.terms for p in terms()[term].parameters]
    names = {row.name: row.name for row in table} | {table.canonical(name): name for name in own}
    found = [term for term in structure.model.terms if term not in campaign.model.terms]
    held = [f"{term}_{p.name}" for term in found for p in terms()[term].parameters if p.name not in EXACT]
    return {name: stated[row] for row, name in names.items() if row in stated} | dict.fromkeys(held, 0.0)


def _delays(
    campaign: Campaign, structure: Structure, values: Mapping[str, float], sigma: Mapping[str, float]
) -> list[dict[str, Any]]:
    """Delays that are declared, and those that were fitted: the structure holds them less what all channels share."""
    declared = [one.channel for one in campaign.drive.effects if one.channel and one.effect == DELAY]
    known, found = campaign.delays, []
    for channel in dict.fromkeys([*declared, *(channel for effect, channel in structure.sensors if effect == DELAY)]):
        name, own = f"{channel}_{DELAY}_tau_y", known.get(channel, 0.0)
        if name in structure.names:
            shared = own - structure.fixed.get(name, 0.0)
            found.append(_term(DELAY, {name: values[name] + shared}, sigma, channel))
        elif channel in declared:
            found.append(_term(DELAY, {name: own}, {}, channel))
    return found


def _torque(campaign: Campaign, values: Mapping[str, float], sigma: Mapping[str, float]) -> dict[str, Any]:
    """Entry of the column of the motor torque."""
    stated, scale = campaign.columns.get(TORQUE, ColumnMap(TORQUE)), values[TORQUE_SCALE]
    return {"name": stated.name, "scale": stated.factor * scale, "sigma": float(sigma[TORQUE_SCALE] / scale)}


def _of_the_drive(name: str, structure: Structure) -> bool:
    if name in NUISANCE or name.startswith(ERROR):
        return False
    return not any(
        name in (p.name, f"{term}_{p.name}") for term in structure.model.terms for p in terms()[term].parameters
    )


def _term(
    term: str, values: Mapping[str, float], sigma: Mapping[str, float], channel: str | None = None
) -> dict[str, Any]:
    parameters = {}
    for parameter in terms()[term].parameters:
        long = f"{term}_{parameter.name}" if channel is None else f"{channel}_{term}_{parameter.name}"
        name = long if long in values else parameter.name
        parameters[parameter.name] = _stated(values.get(name, parameter.default), sigma.get(name))
    return {"effect": term} | ({"channel": channel} if channel else {}) | {"parameters": parameters}


def _stated(value: float, sigma: float | None) -> Any:
    if sigma is None or value == 0.0 or not math.isfinite(sigma):
        return float(value)
    return {"value": float(value), "sigma": float(sigma / abs(value))}


def _order(label: str) -> Any:
    return label if "/" in label else float(label)
