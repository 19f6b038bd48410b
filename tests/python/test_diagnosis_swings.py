"""Swings of the recorded signals: told from orders by speeds that differ, found in no noise."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hdfast.diagnosis.band import Band
from hdfast.diagnosis.peaks import RATIOS, Spectrum, _tail
from hdfast.diagnosis.steady import stretches
from hdfast.diagnosis.swings import swings
from scipy.signal import lfilter

RATE, SECONDS = 500.0, 4.0
TIMES = np.arange(0.0, SECONDS, 1.0 / RATE)
SPEEDS = (3.1, 8.2, 14.6, 24.0)
NOISES = {"white": [1.0], "red": [1.0, -0.98], "smooth": [1.0, -1.97, 0.9702]}


def recorded(speeds: tuple[float, ...], seed: int, taps: list[float], order: float = 0.0, tone: float = 0.0) -> object:
    """Recordings at constant speeds [rev/s] with coloured noise, a line of an order and a swing of a frequency [Hz]."""
    rng = np.random.default_rng(seed)
    units = []
    for speed in speeds:
        noise, torque = (lfilter([1.0], taps, rng.standard_normal(2 * len(TIMES)))[len(TIMES) :] for _ in range(2))
        swing = (
            lfilter([1.0], resonant(tone), rng.standard_normal(2 * len(TIMES)))[len(TIMES) :] if tone else 0.0 * noise
        )
        line = np.sin(2.0 * np.pi * order * speed * TIMES + rng.uniform(0.0, 6.0)) * bool(order)
        added = noise / noise.std() + 3.0 * line + 2.0 * swing / max(swing.std(), 1e-9)
        turning = 2.0 * np.pi * speed
        units.append(
            SimpleNamespace(
                t=TIMES, angle=turning * TIMES, speed=turning + added, measured={"motor_torque": torque + added}
            )
        )
    return SimpleNamespace(units=units, band=Band(RATE, 40.0, 40.0))


def resonant(frequency: float, quality: float = 10.0) -> list[float]:
    """Denominator of a mode."""
    radius = np.exp(-np.pi * frequency / (quality * RATE))
    return [1.0, -2.0 * radius * np.cos(2.0 * np.pi * frequency / RATE), radius**2]


@pytest.mark.parametrize("seed", range(5))
def test_exact_a_mode_is_fixed_in_time(seed: int) -> None:
    found = swings([recorded(SPEEDS, seed, NOISES["red"], tone=5.5)])
    assert found[0].frequency == pytest.approx(5.5, abs=0.5 * found[0].resolution)
    assert all(other.frequency == pytest.approx(5.5, abs=1.0) for other in found)


@pytest.mark.parametrize("order", [2.0, 0.7, 1.37])
def test_exact_an_order_is_not(order: float) -> None:
    assert not swings([recorded(SPEEDS, 1, NOISES["red"], order=order)])
    assert not swings([recorded((5.0, 10.0, 20.0), 1, NOISES["red"], order=order)])


@pytest.mark.parametrize("speeds", [(8.2,), (8.2, 8.4, 8.6)])
def test_exact_one_speed_does_not_tell(speeds: tuple[float, ...]) -> None:
    assert not swings([recorded(speeds, 1, NOISES["red"], tone=5.5)])


@pytest.mark.parametrize("noise", NOISES)
def test_exact_noise_does_not_swing(noise: str) -> None:
    assert not any(swings([recorded(SPEEDS, seed, NOISES[noise])]) for seed in range(10))


@pytest.mark.parametrize("side", [2, 7])
def test_exact_tail_against_order_statistics_of_exponentials(side: int) -> None:
    """A power of one taper is exponential; the k-th of n such is smaller than x by a product."""
    below = np.arange(side + 1)
    exact = np.prod((2 * side - below) / (2 * side - below + RATIOS[:, None]), axis=1)
    likely = exact > 1e-14
    assert _tail(side, 1)[likely] == pytest.approx(np.log(exact[likely]), abs=1e-6)


def test_exact_noise_is_as_unlikely_as_it_says() -> None:
    rng = np.random.default_rng(3)
    places = np.arange(5.0, 35.0, 1.0)
    p = [Spectrum(TIMES, rng.standard_normal(len(TIMES)), 1).unlikely(places, 40.0) for _ in range(200)]
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=0.01)


def test_exact_a_stretch_ends_where_the_speed_changes() -> None:
    speed = np.concatenate([np.full(1500, 10.0), np.linspace(10.0, 30.0, 200), np.full(2000, 30.0), np.zeros(1000)])
    t = np.arange(len(speed)) / RATE
    angle = np.concatenate([[0.0], np.cumsum(speed[:-1])]) / RATE
    found = stretches(SimpleNamespace(t=t, angle=angle, speed=speed, measured={}))
    assert [one.speed * 2.0 * np.pi for one in found] == pytest.approx([10.0, 30.0], rel=0.05)
    assert [one.t[-1] for one in found] == pytest.approx([3.0, 4.0], abs=0.75)
