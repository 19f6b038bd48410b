"""Phases of motion are those of the motion, not of the noise of its angle."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import pytest
from hdfast.checks import Floats
from hdfast.diagnosis.locate import PHASES, RAMP_S, phases

RATE = 500.0


def phases_of(marks: Sequence[float], speeds: Sequence[float], noise: float) -> tuple[Floats, list[str]]:
    """Times [s] and phases of a motion of straight lines between marks [s], with noise of its speed [rad/s]."""
    t = np.arange(0.0, marks[-1], 1.0 / RATE)
    speed = np.interp(t, marks, speeds) + noise * np.random.default_rng(0).standard_normal(len(t))
    unit = SimpleNamespace(t=t, speed=speed, acceleration=np.gradient(speed, t))
    return t, [PHASES[index] for index in phases(unit)]  # type: ignore[arg-type]


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_exact_a_start_and_a_stop_without_a_reversal(noise: float) -> None:
    t, found = phases_of([0.0, 0.6, 0.9, 2.6, 2.9, 4.0], [0.0, 0.0, 30.0, 30.0, 0.0, 0.0], noise)
    wanted = np.select([(t < 0.6) | (t > 2.9), t < 0.9, t > 2.6], ["standstill", "start", "stop"], default="run")
    away = np.min([np.abs(t - mark) for mark in (0.6, 0.9, 2.6, 2.9)], axis=0) > 0.5 * RAMP_S
    assert np.array(found)[away].tolist() == wanted[away].tolist()
    assert "reversal" not in found


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
def test_exact_a_constant_speed_neither_starts_nor_stops(noise: float) -> None:
    _, found = phases_of([0.0, 4.0], [20.3, 20.3], noise)
    assert set(found) == {"run"}


def test_exact_a_reversal_moves_both_ways() -> None:
    t, found = phases_of([0.0, 1.0, 1.5, 3.0], [20.0, 20.0, -20.0, -20.0], 0.02)
    assert {one for one, own in zip(found, t, strict=True) if abs(own - 1.25) < 0.09} == {"reversal"}
    assert {one for one, own in zip(found, t, strict=True) if abs(own - 1.25) > 0.4} == {"run"}
