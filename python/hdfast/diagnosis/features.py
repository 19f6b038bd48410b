"""State variables a missing torque may depend on, as regressors on the recorded motion; no equation of a term."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BSpline

from hdfast.checks import Floats
from hdfast.diagnosis.fit import Bench
from hdfast.diagnosis.prepare import Unit

KNOTS = 8
HARMONICS = 3
WIDTHS = 6
TIMES = (0.01, 0.03, 0.1, 0.3, 1.0, 10.0)

Variable = Callable[[Unit, float], Floats]


@dataclass(frozen=True)
class Feature:
    """A group of regressors.

    Attributes:
        name: in the vocabulary of `where.depends_on`.
        memory: "none", "rate_independent" or "fading".
        columns: regressors per stacked sample, zero on every channel but the motor torque, shape (N, d).
    """

    name: str
    memory: str
    columns: Floats


def features(bench: Bench, ratio: float, inertia: float) -> list[Feature]:
    """Instantaneous, rate-independent and fading regressors of a torque at the motor.

    Args:
        bench: recordings.
        ratio: reduction ratio.
        inertia: load inertia [kg m^2], for the transmitted torque.
    """
    slow = _slow(bench)
    smooth: dict[str, Variable] = {
        "motor_speed": lambda unit, _: unit.speed,
        "motor_acceleration": lambda unit, _: unit.acceleration,
        "transmitted_torque": lambda unit, ratio: inertia * unit.acceleration / ratio + unit.load_torque,
        "abs_transmitted_torque": lambda unit, ratio: (
            np.sign(unit.speed) * np.abs(inertia * unit.acceleration / ratio + unit.load_torque)
        ),
        "time_since_start": lambda unit, _: unit.offset + unit.t,
        "direction": lambda unit, _: np.sign(unit.speed),
    }
    circular: dict[str, Variable] = {
        "motor_phase": lambda unit, _: unit.angle,
        "load_phase": lambda unit, ratio: unit.angle / ratio,
        "lobe_phase": lambda unit, ratio: unit.angle * (1.0 - 1.0 / ratio),
    }
    found = [Feature(name, "none", _spread(bench, _splines(slow, of, ratio))) for name, of in smooth.items()]
    found += [Feature(name, "none", _spread(bench, _waves(slow, of, ratio))) for name, of in circular.items()]
    found.append(Feature("motor_phase", "rate_independent", _spread(bench, _plays(slow))))
    found.append(Feature("motor_speed", "fading", _spread(bench, _filters(slow, bench.plant.band.rate))))
    return [one for one in found if one.columns.shape[1]]


def _slow(bench: Bench) -> list[Unit]:
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


def _splines(units: Sequence[Unit], of: Variable, ratio: float) -> list[Floats]:
    """Cubic B-splines over the quantiles of a variable, per unit (n, d)."""
    values = [of(unit, ratio) for unit in units]
    together = np.concatenate(values)
    inner = np.unique(np.quantile(together, np.linspace(0.0, 1.0, KNOTS)))
    if len(inner) < 4:
        levels = np.unique(together)[1:]
        if not len(levels):
            return [np.zeros((len(value), 0)) for value in values]
        return [np.stack([(value == level).astype(float) for level in levels], axis=1) for value in values]
    knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
    return [np.asarray(BSpline.design_matrix(value, knots, 3).toarray()) for value in values]


def _waves(units: Sequence[Unit], of: Variable, ratio: float) -> list[Floats]:
    """Sines and cosines of the first harmonics of an angle, per unit (n, d); nothing where no turn is completed."""
    angles = [of(unit, ratio) for unit in units]
    if max(float(np.ptp(angle)) for angle in angles) < math.pi:
        return [np.zeros((len(angle), 0)) for angle in angles]
    return [
        np.stack([wave(k * angle) for k in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)], axis=1)
        for angle in angles
    ]


def _plays(units: Sequence[Unit]) -> list[Floats]:
    """Play operators of log-spaced widths on the motor angle: its distance from each, per unit (n, d)."""
    largest = max(float(np.ptp(unit.angle)) for unit in units)
    widths = np.geomspace(1e-4 * largest, 0.3 * largest, WIDTHS)
    return [np.stack([_play(unit.angle, width) / width for width in widths], axis=1) for unit in units]


def _play(x: Floats, width: float) -> Floats:
    """The input minus p, where p[k] = min(x[k] + w, max(x[k] - w, p[k-1]))."""
    position = x[0]
    found = np.empty_like(x)
    for k, value in enumerate(x.tolist()):
        position = min(value + width, max(value - width, position))
        found[k] = value - position
    return found


def _filters(units: Sequence[Unit], rate: float) -> list[Floats]:
    """First-order low-passes of the motor speed, per unit (n, d)."""
    from scipy.signal import lfilter

    shares = [-math.expm1(-1.0 / (rate * time)) for time in TIMES]
    return [np.stack([lfilter([share], [1.0, share - 1.0], unit.speed) for share in shares], axis=1) for unit in units]


def _spread(bench: Bench, columns: list[Floats]) -> Floats:
    """Columns per unit (n, d) on the stacked samples of the motor torque (N, d), scaled to a root mean square of 1."""
    layout = bench.layout
    stacked = np.zeros((layout.size, columns[0].shape[1]))
    for unit, channel, where in layout.pieces:
        if channel == "motor_torque":
            stacked[where] = columns[unit][layout.sample[where]]
    size = np.sqrt(np.mean(stacked**2, axis=0))
    kept = size > 1e-12
    scaled: Floats = stacked[:, kept] / size[kept]
    return scaled
