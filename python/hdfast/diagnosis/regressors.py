"""Shapes that a torque may take over a state variable, or over its past."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.diagnosis.prepare import Unit

KNOTS = 8
HARMONICS = 3
WIDTHS = 6
TIMES = (0.3, 1.0, 3.0, 10.0)
DAMPING = 0.05
STILL = 0.02
EDGES = 24
NOTHING = 1e-12
TURN = 2.0 * math.pi

Variable = Callable[[Unit], Floats]


def splines(units: Sequence[Unit], of: Variable) -> Variable:
    """Cubic B-splines over the quantiles of a variable, constant beyond them; its levels where it has few."""
    together = np.concatenate([of(unit) for unit in units])
    inner = np.unique(np.quantile(together, np.linspace(0.0, 1.0, KNOTS)))
    if len(inner) < 4:
        levels = np.unique(together)[1:]
        return (lambda unit: (of(unit)[:, None] == levels).astype(np.float64)) if len(levels) else _nothing
    return _over(inner, of)


def positions(units: Sequence[Unit], pieces: int) -> Variable:
    """Cubic B-splines in equal pieces over the angles of the output, within one turn."""
    low, high = _range(units)
    if high - low > TURN:
        return _over(np.linspace(0.0, TURN, pieces + 1), lambda unit: np.mod(unit.turned, TURN))
    if high - low <= 0.0:
        return _nothing
    return _over(np.linspace(low, high, pieces + 1), lambda unit: unit.turned)


def ramps(units: Sequence[Unit]) -> list[Variable]:
    """How far the output is beyond an angle, above it or below it, for the inner ends of `EDGES` equal pieces."""
    edges = np.linspace(*_range(units), EDGES + 1)[1:-1]
    return [_ramp(edge, side) for edge in edges.tolist() for side in (1.0, -1.0)]


def bumps(units: Sequence[Unit], pieces: int) -> list[Variable]:
    """Three adjacent cubic B-splines about each end of equal pieces of the output's angles, within one turn."""
    low, high = _range(units)
    turns = high - low > TURN
    low, high = (0.0, TURN) if turns else (low, high)
    return [_bump(centre, (high - low) / pieces, turns) for centre in np.linspace(low, high, pieces + 1).tolist()]


def waves(units: Sequence[Unit], of: Variable) -> Variable:
    """Sines and cosines of the first harmonics of an angle; nothing where no turn is completed."""
    if max(float(np.ptp(of(unit))) for unit in units) < math.pi:
        return _nothing
    return lambda unit: np.stack(
        [wave(k * of(unit)) for k in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)], axis=1
    )


def plays(units: Sequence[Unit]) -> Variable:
    """Distance of the motor angle from play operators of log-spaced widths."""
    largest = max(float(np.ptp(unit.angle)) for unit in units)
    widths = np.geomspace(1e-4 * largest, 0.3 * largest, WIDTHS)
    return lambda unit: np.stack([_play(unit.angle, width) / width for width in widths], axis=1)


def filters(rate: float) -> Variable:
    """First-order low-passes of the motor speed, slow ones: fast ones are its derivative."""
    shares = [-math.expm1(-1.0 / (rate * time)) for time in TIMES]
    return lambda unit: np.stack(
        [scipy.signal.lfilter([share], [1.0, share - 1.0], unit.speed) for share in shares], axis=1
    )


def aged(time: float, rate: float) -> Variable:
    """Direction of motion times what has built up at rest and wears off in motion with a time constant [s]."""
    share = -math.expm1(-1.0 / (rate * time))

    def built(unit: Unit) -> Floats:
        resting = (np.abs(unit.speed) <= STILL * np.max(np.abs(unit.speed))).astype(np.float64)
        level, _ = scipy.signal.lfilter([share], [1.0, share - 1.0], resting, zi=[(1.0 - share) * resting[0]])
        return np.asarray(np.sign(unit.speed) * level)[:, None]

    return built


def warming(time: float) -> Variable:
    """Dry and viscous drag of a drive that is cold at the start, and warms up with a time constant [s]."""

    def cold(unit: Unit) -> Floats:
        left = np.exp(-(unit.before + unit.t) / time)
        return np.stack([np.sign(unit.speed) * left, unit.speed * left], axis=1)

    return cold


def resonances(frequency: float, rate: float) -> Variable:
    """Force and speed of a lightly damped mass that the acceleration shakes, at a natural frequency [Hz]."""
    w = TURN * frequency
    poles = [1.0, 2.0 * DAMPING * w, w**2]
    digital = [scipy.signal.bilinear(zeros, poles, rate) for zeros in ([w**2], [w, 0.0])]
    return lambda unit: np.stack([scipy.signal.lfilter(b, a, unit.acceleration) for b, a in digital], axis=1)


def _range(units: Sequence[Unit]) -> tuple[float, float]:
    """Least and largest angle of the output."""
    return min(float(unit.turned.min()) for unit in units), max(float(unit.turned.max()) for unit in units)


def _ramp(edge: float, side: float) -> Variable:
    return lambda unit: np.maximum(side * (unit.turned - edge), 0.0)[:, None]


def _bump(centre: float, width: float, turns: bool) -> Variable:
    shape = scipy.interpolate.BSpline.basis_element(np.arange(-2.0, 3.0), extrapolate=False)

    def near(unit: Unit) -> Floats:
        away = unit.turned - centre
        x = (np.mod(away + math.pi, TURN) - math.pi if turns else away) / max(width, NOTHING)
        return np.asarray(np.nan_to_num(shape(x[:, None] + np.array([1.0, 0.0, -1.0]))))

    return near


def _nothing(unit: Unit) -> Floats:
    return np.zeros((len(unit.t), 0))


def _over(inner: Floats, of: Variable) -> Variable:
    """Cubic B-splines over knots (k,), constant beyond them."""
    low, high = float(inner[0]), float(inner[-1])
    knots = np.concatenate([[low] * 3, inner, [high] * 3])
    return lambda unit: np.asarray(
        scipy.interpolate.BSpline.design_matrix(np.clip(of(unit), low, high), knots, 3).toarray()
    )


def _play(x: Floats, width: float) -> Floats:
    """The input minus p, where p[k] = min(x[k] + w, max(x[k] - w, p[k-1]))."""
    position = x[0]
    found = np.empty_like(x)
    for k, value in enumerate(x.tolist()):
        position = min(value + width, max(value - width, position))
        found[k] = value - position
    return found
