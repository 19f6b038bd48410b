"""State variables a missing torque may depend on, as regressors on the recorded motion; no equation of a term."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.plant import TORQUE
from hdfast.diagnosis.prepare import Unit, imposed
from hdfast.diagnosis.regressors import (
    NOTHING,
    Variable,
    aged,
    bumps,
    filters,
    plays,
    positions,
    ramps,
    resonances,
    splines,
    warming,
    waves,
)
from hdfast.diagnosis.replay import Replay

PUSH = 0.1
POSITIONS = (6, 12, 24)
LOCAL = (24, 48, 96)
RESONANCES = np.geomspace(0.7, 6.0, 16)
AGES = (0.15, 0.5, 1.5)
WARM_AFTER = (0.1, 0.3, 1.0)  # of the longest recording

Group = tuple[tuple[str, str, str], Variable | None, Variable]


@dataclass(frozen=True)
class Feature:
    """A group of regressors of a torque.

    Attributes:
        name: in the vocabulary of `where.depends_on`.
        memory: "none", "rate_independent" or "fading".
        place: where the torque acts, "motor" or "load".
        variable: the state variable of a law without memory, shape (n,); None with memory.
        regressors: of a recording's slow motion, shape (n, d).
        size: root mean square of each on the recordings that are fitted, shape (d,).
    """

    name: str
    memory: str
    place: str
    variable: Variable | None = field(repr=False)
    regressors: Variable = field(repr=False)
    size: Floats = field(repr=False)

    def columns(self, replay: Replay, slow: Sequence[Unit], fitted: Fit) -> Floats:
        """What 1 N m of each at the motor, or as much behind the gear, changes in the simulated signals, (N, d').

        Args:
            replay: recordings.
            slow: their slow motion.
            fitted: the model through which a torque on the load is felt.
        """
        if self.place == "load":
            return _behind_the_gear(replay, fitted, self._torques(slow))
        return self.sketch(replay, slow, fitted)

    def sketch(self, replay: Replay, slow: Sequence[Unit], fitted: Fit) -> Floats:
        """The same well below the resonance, where a torque on the load is felt everywhere at once."""
        shares = {TORQUE: 1.0}
        if self.place == "load" and fitted.structure.model.base == "two_inertia":
            ratio = fitted.value("ratio")
            shares |= {"te": ratio / fitted.stiffness, "output_torque": ratio}
        smooth = replay.plant.band.smooth
        found = [
            {
                channel: shares.get(channel, 0.0) * smooth(np.ascontiguousarray(torque.T), channel)
                for channel in unit.measured
            }
            for unit, torque in zip(replay.plant.units, self._torques(slow), strict=True)
        ]
        return replay.layout.stack(found).T

    def torque(self, unit: Unit, coordinates: Floats) -> Floats:
        """What acts for coordinates (d',) in slow motion, in N m at the motor, (n,)."""
        return np.asarray(self._torques([unit])[0] @ coordinates)

    @property
    def label(self) -> tuple[str, str, str]:
        """Variable, memory and place, whatever the shape."""
        return self.name, self.memory, self.place

    @property
    def width(self) -> int:
        """Number of regressors that are not always zero."""
        return int(self._kept.sum())

    def _torques(self, slow: Sequence[Unit]) -> list[Floats]:
        """1 N m of each regressor, (n, d') per recording."""
        return [self.regressors(unit)[:, self._kept] / self.size[self._kept] for unit in slow]

    @property
    def _kept(self) -> NDArray[np.bool_]:
        return self.size > NOTHING


def features(replay: Replay, slow: Sequence[Unit], fitted: Fit) -> list[Feature]:
    """Instantaneous, rate-independent and fading regressors.

    The acceleration itself is not among them: whatever torque is missing has accelerated the drive. What a mass on a
    spring makes of it is.

    Args:
        replay: recordings.
        slow: their slow motion.
        fitted: the model, for the transmitted torque; where a load side is seen, a torque may act on that.
    """
    band = replay.plant.band
    ratio, inertia = fitted.value("ratio"), fitted.value("J_l")

    def transmitted(unit: Unit) -> Floats:
        return np.asarray(inertia * unit.acceleration / ratio + unit.load_torque)

    def transmitted_size(unit: Unit) -> Floats:
        return np.asarray(np.sign(unit.speed) * np.abs(transmitted(unit)))

    smooth: dict[str, Variable] = {
        "motor_speed": lambda unit: unit.speed,
        "abs_transmitted_torque": transmitted_size,
        "time_since_start": lambda unit: unit.before + unit.t,
        "direction": lambda unit: np.sign(unit.speed),
    }
    if any(np.any(unit.load_torque != 0.0) for unit in slow):
        smooth["transmitted_torque"] = transmitted
    turning: dict[str, Variable] = {
        "motor_phase": lambda unit: unit.angle,
        "load_phase": lambda unit: unit.turned,
        "lobe_phase": lambda unit: unit.angle - unit.turned,
    }
    places = ("motor", "load") if replay.plant.load_side else ("motor",)
    groups: list[Group] = [
        ((name, "none", place), of, splines(slow, of)) for name, of in smooth.items() for place in places
    ]
    groups += [((name, "none", "motor"), of, waves(slow, of)) for name, of in turning.items()]
    groups += [(("load_phase", "none", "load"), turning["load_phase"], positions(slow, pieces)) for pieces in POSITIONS]
    local = [*ramps(slow), *(bump for pieces in LOCAL for bump in bumps(slow, pieces))]
    groups += [(("load_phase", "none", "load"), turning["load_phase"], shape) for shape in local]
    groups.append((("motor_phase", "rate_independent", "motor"), None, plays(slow)))
    groups.append((("motor_speed", "fading", "motor"), None, filters(band.rate)))
    longest = max(float(unit.t[-1]) for unit in slow)
    groups += [(("time_since_start", "fading", "motor"), None, warming(share * longest)) for share in WARM_AFTER]
    groups += [(("direction", "fading", place), None, aged(time, band.rate)) for time in AGES for place in places]
    groups += [
        (("motor_acceleration", "fading", "load"), None, resonances(frequency, band.rate))
        for frequency in RESONANCES.tolist()
        if frequency < band.motion
    ]
    found = [Feature(*labels, of, shapes, _size([shapes(unit) for unit in slow])) for labels, of, shapes in groups]
    return [one for one in found if one.width]


def slowed(replay: Replay) -> list[Unit]:
    """The recordings' slow motion: the noise of an acceleration would explain itself in the torque."""
    slow = replay.plant.band.slow
    return [
        replace(
            unit,
            angle=slow(unit.angle),
            speed=np.where(unit.speed == 0.0, 0.0, slow(unit.speed)),
            acceleration=slow(unit.acceleration),
        )
        for unit in replay.plant.units
    ]


def _size(columns: Sequence[Floats]) -> Floats:
    """Root mean square of regressors (n, d) over recordings, shape (d,)."""
    return np.asarray(np.sqrt(np.mean(np.concatenate(columns) ** 2, axis=0)))


def _behind_the_gear(replay: Replay, fitted: Fit, torques: Sequence[Floats]) -> Floats:
    """Change of the simulated signals by torques (n, d) that resist the load, in N m at the motor, shape (N, d)."""
    plant, count = replay.plant, torques[0].shape[1]
    push = PUSH * plant.torque_spread
    behind = push * fitted.value("ratio")
    pushed = [
        _pushed(unit, behind * torque[:, column])
        for column in range(count)
        for unit, torque in zip(plant.units, torques, strict=True)
    ]
    every = replace(plant, units=[*plant.units, *pushed])
    found = every.mismatch(fitted.structure, fitted.coordinates[None])
    size = len(plant.units)
    rows = [replay.layout.stack(found[k : k + size])[0] for k in range(0, len(found), size)]
    return np.asarray(rows[0][:, None] - np.transpose(rows[1:])) / push


def _pushed(unit: Unit, torque: Floats) -> Unit:
    """A recording with more torque on its load [N m], (n,)."""
    load = unit.load_torque + torque
    return replace(unit, load_torque=load, scenario=imposed(unit.t, unit.angle, unit.command, load))
