"""Coloured noise: white, 1/f and hum, from one random stream."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.plant import Array


class Noise(NamedTuple):
    """Noise of one channel, in the channel's unit.

    Attributes:
        white: standard deviation of the white part per sample of the grid.
        pink: standard deviation of the 1/f part between 0.1 Hz and `corner`.
        corner: highest frequency of the 1/f part [Hz].
    """

    white: float
    pink: float
    corner: float


def draw(noise: Noise, rng: Generator, count: int, step: float) -> Array:
    """A realisation of `count` samples, `step` [s] apart."""
    wave = noise.white * rng.standard_normal(count)
    if noise.pink > 0.0:
        frequency = np.fft.rfftfreq(count, step)
        shape = np.zeros_like(frequency)
        inside = (frequency > 0.1) & (frequency < noise.corner)
        shape[inside] = frequency[inside] ** -0.5
        spectrum = shape * (rng.standard_normal(shape.size) + 1j * rng.standard_normal(shape.size))
        pink = np.fft.irfft(spectrum, count)
        power = np.sqrt(np.sum(shape**2)) * 2.0 / count
        wave += noise.pink * pink / power
    return np.asarray(wave)
