"""Manoeuvres as a test bench runs them: speed references and load torques on the generator's grid."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.stepping import GRID

RPM = np.pi / 30.0


def _through(times: Array, values: Array, t: Array) -> Array:
    return np.interp(t, times, values)


def start_stop(rng: Generator, t: Array, top: float) -> Array:
    """Start, run, stop and rest, once or twice, in one or both directions."""
    end = t[-1]
    ramp = rng.uniform(0.1, 0.4)
    first = top * rng.choice([-1.0, 1.0])
    second = first * rng.choice([-1.0, 0.5, 1.0])
    marks = np.array([0.3, 0.3 + ramp, 0.42 * end, 0.42 * end + ramp, 0.55 * end, 0.55 * end + ramp, 0.85 * end])
    levels = np.array([0.0, first, first, 0.0, 0.0, second, second])
    return _through(np.append(marks, 0.85 * end + ramp), np.append(levels, 0.0), t)


def ladder(rng: Generator, t: Array, top: float) -> Array:
    """Plateaus of different speed in random order, both directions."""
    count = int(rng.integers(4, 8))
    levels = top * np.geomspace(0.08, 1.0, count) * rng.choice([-1.0, 1.0], count)
    rng.shuffle(levels)
    edges = np.linspace(0.2, t[-1], count + 1)
    ramp = rng.uniform(0.06, 0.15)
    times = np.ravel(np.column_stack([edges[:-1], edges[:-1] + ramp]))
    values = np.ravel(np.column_stack([np.append(0.0, levels[:-1]), levels]))
    return _through(times, values, t)


def reversals(rng: Generator, t: Array, top: float) -> Array:
    """Triangles in speed through zero with changing slope."""
    count = int(rng.integers(3, 7))
    edges = np.sort(rng.uniform(0.3, t[-1], count - 1))
    times = np.concatenate([[0.0, 0.2], edges, [t[-1] + 0.2]])
    values = np.concatenate(
        [[0.0, 0.0], top * rng.uniform(0.3, 1.0, count - 1) * (-1.0) ** np.arange(count - 1), [0.0]]
    )
    return _through(times, values, t)


def sine(rng: Generator, t: Array, top: float) -> Array:
    """One frequency with a soft start."""
    frequency = rng.uniform(0.3, 1.6)
    return top * np.sin(2 * np.pi * frequency * t) * np.clip(t / 0.3, 0.0, 1.0)


def multisine(rng: Generator, t: Array, top: float) -> Array:
    """Six to ten frequencies from 0.2 to 12 Hz with falling amplitude."""
    count = int(rng.integers(6, 11))
    frequencies = np.geomspace(0.2, rng.uniform(5.0, 12.0), count) * rng.uniform(0.93, 1.07, count)
    phases = rng.uniform(0, 2 * np.pi, count)
    wave = sum(np.sin(2 * np.pi * f * t + a) / (1.0 + f) for f, a in zip(frequencies, phases, strict=True)) * np.clip(
        t / 0.3, 0.0, 1.0
    )
    return np.asarray(top * wave / np.max(np.abs(wave)))


def slow_ramp(rng: Generator, t: Array, top: float) -> Array:
    """From one direction slowly through zero to the other."""
    low = top * rng.uniform(0.1, 0.3) * rng.choice([-1.0, 1.0])
    return _through(np.array([0.1, 0.4, t[-1] - 0.3, t[-1]]), np.array([0.0, -low, low, 0.0]), t)


def hold(rng: Generator, t: Array, top: float) -> Array:
    """Standstill between two short moves; the load may work meanwhile."""
    step = top * rng.uniform(0.1, 0.4) * rng.choice([-1.0, 1.0])
    end = t[-1]
    return _through(
        np.array([0.2, 0.3, 0.5, 0.6, 0.8 * end, 0.8 * end + 0.1, 0.8 * end + 0.4, 0.8 * end + 0.5]),
        np.array([0.0, step, step, 0.0, 0.0, -step, -step, 0.0]),
        t,
    )


def constant(rng: Generator, t: Array, top: float) -> Array:
    """One long plateau."""
    level = top * rng.uniform(0.2, 1.0) * rng.choice([-1.0, 1.0])
    return _through(np.array([0.1, 0.35]), np.array([0.0, level]), t)


def coast(rng: Generator, t: Array, top: float) -> Array:
    """Torque on, torque off and coast, in two directions."""
    end = t[-1]
    first = top * rng.uniform(0.7, 1.3) * rng.choice([-1.0, 1.0])
    second = -top * rng.uniform(0.7, 1.3) * np.sign(first)
    marks = np.array([0.2, 0.22, 0.3 * end, 0.3 * end + 0.02, 0.5 * end, 0.5 * end + 0.02, 0.8 * end])
    levels = np.array([0.0, first, first, 0.0, 0.0, second, second])
    return _through(np.append(marks, 0.8 * end + 0.02), np.append(levels, 0.0), t)


TORQUES = ("coast",)
SPEEDS: dict[str, Callable[[Generator, Array, float], Array]] = {
    "start_stop": start_stop,
    "ladder": ladder,
    "reversals": reversals,
    "sine": sine,
    "multisine": multisine,
    "slow_ramp": slow_ramp,
    "hold": hold,
    "constant": constant,
    "coast": coast,
}


def time_grid(duration: float) -> Array:
    """Times of the generator's grid up to `duration` [s]."""
    return np.asarray(np.arange(round(duration / GRID)) * GRID)


def load_profile(rng: Generator, t: Array, size: float, kind: str) -> Array:
    """Load torque [N m] up to `size`: constant, or with kind "any" also none, steps, a slow sine or a triangle."""
    if kind == "any":
        kind = str(rng.choice(["none", "constant", "steps", "sine", "triangle"], p=[0.2, 0.15, 0.35, 0.15, 0.15]))
    end = t[-1]
    if kind == "none" or size == 0.0:
        return np.zeros_like(t)
    if kind == "constant":
        return np.asarray(np.interp(t, [0.05, 0.25], [0.0, size * rng.uniform(0.3, 1.0) * rng.choice([-1.0, 1.0])]))
    if kind == "sine":
        shape = np.sin(2 * np.pi * rng.uniform(0.2, 0.8) * t + rng.uniform(0, 6.28))
        return np.asarray(size * shape * np.clip(t / 0.3, 0, 1))
    if kind == "triangle":
        return np.asarray(np.interp(t, np.array([0.1, 0.3, 0.7, 0.95]) * end, [0.0, size, -size, 0.0]))
    edges = np.sort(rng.uniform(0.1, 0.9, 3)) * end
    levels = size * rng.uniform(-1, 1, 3)
    times = np.ravel(np.column_stack([edges, edges + 0.03]))
    return np.asarray(np.interp(t, times, np.ravel(np.column_stack([np.append(0.0, levels[:-1]), levels]))))
