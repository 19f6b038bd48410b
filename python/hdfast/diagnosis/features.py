"""State variables a missing torque may depend on, as regressors on the recorded motion; no equation of a term."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.signal import lfilter

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout
from hdfast.diagnosis.fit import Bench
from hdfast.diagnosis.prepare import Unit

KNOTS = 8
HARMONICS = 3
WIDTHS = 6
NOTHING = 1e-12
TIMES = (0.01, 0.03, 0.1, 0.3, 1.0, 10.0)

Variable = Callable[[Unit], Floats]


@dataclass(frozen=True)
class Feature:
    """A group of regressors of a torque at the motor.

    Attributes:
        name: in the vocabulary of `where.depends_on`.
        memory: "none", "rate_independent" or "fading".
        regressors: of a recording's slow motion, shape (n, d).
        size: root mean square of each on the recordings that are fitted, shape (d,).
    """

    name: str
    memory: str
    regressors: Variable
    size: Floats

    def columns(self, layout: Layout, slow: Sequence[Unit]) -> Floats:
        """Scaled regressors on the stacked samples of the motor torque, zero on every other channel, shape (N, d')."""
        return _stacked(layout, slow, self.regressors)[:, self._kept] / self.size[self._kept]

    @property
    def width(self) -> int:
        """Number of regressors that are not always zero."""
        return int(self._kept.sum())

    @property
    def _kept(self) -> NDArray[np.bool_]:
        return self.size > NOTHING


def features(bench: Bench, ratio: float, inertia: float) -> list[Feature]:
    """Instantaneous, rate-independent and fading regressors.

    The acceleration is not among them: whatever torque is missing has accelerated the drive.

    Args:
        bench: recordings.
        ratio: reduction ratio.
        inertia: load inertia [kg m^2], for the transmitted torque.
    """
    slow = slowed(bench)

    def transmitted(unit: Unit) -> Floats:
        return np.asarray(inertia * unit.acceleration / ratio + unit.load_torque)

    smooth: dict[str, Variable] = {
        "motor_speed": lambda unit: unit.speed,
        "abs_transmitted_torque": lambda unit: np.sign(unit.speed) * np.abs(transmitted(unit)),
        "time_since_start": lambda unit: unit.offset + unit.t,
        "direction": lambda unit: np.sign(unit.speed),
    }
    if any(np.any(unit.load_torque != 0.0) for unit in slow):
        smooth["transmitted_torque"] = transmitted
    circular: dict[str, Variable] = {
        "motor_phase": lambda unit: unit.angle,
        "load_phase": lambda unit: unit.angle / ratio,
        "lobe_phase": lambda unit: unit.angle * (1.0 - 1.0 / ratio),
    }
    named = [(name, "none", _splines(slow, of)) for name, of in smooth.items()]
    named += [(name, "none", _waves(slow, of)) for name, of in circular.items()]
    named.append(("motor_phase", "rate_independent", _plays(slow)))
    named.append(("motor_speed", "fading", _filters(bench.plant.band.rate)))
    found = [
        Feature(name, memory, of, np.sqrt(np.mean(_stacked(bench.layout, slow, of) ** 2, axis=0)))
        for name, memory, of in named
    ]
    return [one for one in found if one.width]


def slowed(bench: Bench) -> list[Unit]:
    """The recordings' slow motion: the noise of an acceleration would explain itself in the torque."""
    slow = bench.plant.band.slow
    return [
        replace(
            unit,
            angle=slow(unit.angle),
            speed=np.where(unit.speed == 0.0, 0.0, slow(unit.speed)),
            acceleration=slow(unit.acceleration),
        )
        for unit in bench.plant.units
    ]


def _nothing(unit: Unit) -> Floats:
    return np.zeros((len(unit.t), 0))


def _splines(units: Sequence[Unit], of: Variable) -> Variable:
    """Cubic B-splines over the quantiles of a variable, constant beyond them; its levels where it has few."""
    together = np.concatenate([of(unit) for unit in units])
    inner = np.unique(np.quantile(together, np.linspace(0.0, 1.0, KNOTS)))
    if len(inner) < 4:
        levels = np.unique(together)[1:]
        return (lambda unit: (of(unit)[:, None] == levels).astype(np.float64)) if len(levels) else _nothing
    knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
    return lambda unit: np.asarray(BSpline.design_matrix(np.clip(of(unit), inner[0], inner[-1]), knots, 3).toarray())


def _waves(units: Sequence[Unit], of: Variable) -> Variable:
    """Sines and cosines of the first harmonics of an angle; nothing where no turn is completed."""
    if max(float(np.ptp(of(unit))) for unit in units) < math.pi:
        return _nothing
    return lambda unit: np.stack(
        [wave(k * of(unit)) for k in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)], axis=1
    )


def _plays(units: Sequence[Unit]) -> Variable:
    """Distance of the motor angle from play operators of log-spaced widths."""
    largest = max(float(np.ptp(unit.angle)) for unit in units)
    widths = np.geomspace(1e-4 * largest, 0.3 * largest, WIDTHS)
    return lambda unit: np.stack([_play(unit.angle, width) / width for width in widths], axis=1)


def _play(x: Floats, width: float) -> Floats:
    """The input minus p, where p[k] = min(x[k] + w, max(x[k] - w, p[k-1]))."""
    position = x[0]
    found = np.empty_like(x)
    for k, value in enumerate(x.tolist()):
        position = min(value + width, max(value - width, position))
        found[k] = value - position
    return found


def _filters(rate: float) -> Variable:
    """First-order low-passes of the motor speed."""
    shares = [-math.expm1(-1.0 / (rate * time)) for time in TIMES]
    return lambda unit: np.stack([lfilter([share], [1.0, share - 1.0], unit.speed) for share in shares], axis=1)


def _stacked(layout: Layout, slow: Sequence[Unit], of: Variable) -> Floats:
    """Regressors on the stacked samples of the motor torque, zero on every other channel, shape (N, d)."""
    columns = [of(unit) for unit in slow]
    stacked = np.zeros((layout.size, columns[0].shape[1]))
    for unit, channel, where in layout.pieces:
        if channel == "motor_torque":
            stacked[where] = columns[unit][layout.sample[where]]
    return stacked
