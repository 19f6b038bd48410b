"""A real machine as its recordings and the best model known of it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis import diagnose
from hdfast.diagnosis.prepare import Unit
from hdfast.diagnosis.session import Session
from hdfast.diagnosis.structure import TORQUE_SCALE
from hdfast.errors import InputError
from hdfast.health import Health
from hdfast.recordings import Recording, load_campaign

KEPT = ("title", "drive", "kinematic_error", "terms", "controller", "sensors")
DRY = ("coulomb_friction", "stribeck_friction", "presliding_friction")
REST_OF = {"motor_torque": "motor_torque", "load_angle": "te", "output_torque": "output_torque"}


@dataclass(frozen=True, eq=False)
class Recorded:
    """One recording of a machine.

    Attributes:
        columns: by standard name, SI units, (n,).
        role: "fit" or "heldout".
        group: as in the campaign.
        started_at_s: as in the campaign [s].
        angle, speed, acceleration: smoothed motion of the motor [rad, rad/s, rad/s^2], (n,).
        rest: recorded minus what the model says, by channel, (n,).
    """

    columns: Mapping[str, Floats] = field(repr=False)
    role: str
    group: str
    started_at_s: float
    angle: Floats = field(repr=False)
    speed: Floats = field(repr=False)
    acceleration: Floats = field(repr=False)
    rest: Mapping[str, Floats] = field(repr=False)

    @property
    def t(self) -> Floats:
        """Times [s], (n,)."""
        return self.columns["t"]


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine with the model that the diagnosis ends with.

    Attributes:
        sections: of a campaign with that model, without recordings.
        recordings: with the torque in the unit that the model needs.
        terms: effects of the model.
        sensors: (effect, channel) pairs of its sensors.
        ratio: reduction ratio.
        corner: band in which the model was compared with the recordings [Hz].
    """

    sections: Mapping[str, Any] = field(repr=False)
    recordings: tuple[Recorded, ...] = field(repr=False)
    terms: tuple[str, ...]
    sensors: tuple[tuple[str, str], ...]
    ratio: float
    corner: float

    @property
    def sliding_torque(self) -> float:
        """Sliding friction torque of the motor in a model that has dry friction [N m]."""
        stated = next(one["parameters"]["T_c"] for one in self.sections["terms"] if one["effect"] in DRY)
        return float(stated["value"] if isinstance(stated, Mapping) else stated)

    @property
    def fitted(self) -> list[Recorded]:
        """The recordings that a tool may fit."""
        return [one for one in self.recordings if one.role == "fit"]


def calibrated(path: Path) -> Machine:
    """Diagnose a campaign; the model it ends with becomes the one that its cases state.

    Raises:
        InputError: the campaign holds nothing out, or its recordings cannot be used.
    """
    campaign = load_campaign(path)
    if not any(one.role == "heldout" for one in campaign.recordings):
        raise InputError(f"{path}: no recording has the role heldout")
    found = diagnose(campaign)
    if found.evidence is None:
        raise InputError(f"{path}: {found.health.complaint}")
    session = found.evidence.session
    final = session.search.final
    scale = final.value(TORQUE_SCALE)
    sections = {key: value for key, value in tomllib.loads(found.model).items() if key in KEPT}
    sigma = final.sigma_of(session.replay.layout)[TORQUE_SCALE] / scale
    sections["columns"] = {"motor_torque": {"name": "motor_torque", "scale": 1.0, "sigma": float(sigma)}}
    return Machine(
        sections | {"title": "recorded drive"},
        _recordings(found.health, session, scale),
        tuple(final.structure.model.terms),
        final.structure.sensors,
        final.value("ratio"),
        session.replay.plant.band.motion,
    )


def _recordings(health: Health, session: Session, scale: float) -> tuple[Recorded, ...]:
    found = []
    begun = {item.name: item.source.started_at_s for item in health}
    checked = {item.name: item.recording for item in health if item.recording is not None}
    final = session.search.final
    for replay in (session.replay, session.held):
        if replay is None:
            continue
        rests = replay.plant.mismatch(final.structure, final.coordinates[None])
        for unit, rest in zip(replay.plant.units, rests, strict=True):
            left = {name: own[0] for name, own in rest.items()}
            found.append(_recorded(checked[unit.name], begun[unit.name], unit, left, scale))
    return tuple(found)


def _recorded(
    recording: Recording, started_at_s: float, unit: Unit, rest: Mapping[str, Floats], scale: float
) -> Recorded:
    columns = {name: np.array(values) for name, values in recording.columns.items()}
    columns["motor_torque"] = scale * columns["motor_torque"]
    clock = columns["t"] - unit.offset
    columns["t"] -= columns["t"][0]
    spline = scipy.interpolate.CubicSpline(unit.t, unit.angle)
    known = {name: np.interp(clock, unit.t, rest[own]) for name, own in REST_OF.items() if own in rest}
    known["motor_torque"] = scale * known["motor_torque"]
    if "load_angle" in known:
        known["load_angle"] = -known["load_angle"]
    within = np.clip(clock, unit.t[0], unit.t[-1])
    return Recorded(
        columns, unit.role, unit.group, started_at_s, spline(within), spline(within, 1), spline(within, 2),
        known,
    )  # fmt: skip
