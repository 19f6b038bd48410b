"""Where a mismatch is and what it follows: phases of the motion, not of the noise of its angle, and of a turn."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np
import pytest
from hdfast.checks import Floats
from hdfast.diagnosis.facts import FACTS, facts_of
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


@pytest.mark.parametrize("ratio", [121.0, -100.0, 50.0])
@pytest.mark.parametrize(
    ("effect", "turn", "phase"),
    [
        ("mesh_stiffness_variation", "motor", "motor_phase"),
        ("mesh_stiffness_variation", "load", "load_phase"),
        ("te_harmonic", "load", "load_phase"),
        ("te_harmonic", "lobe", "lobe_phase"),
        ("position_dependent_friction", "load", "load_phase"),
        ("position_dependent_friction", "motor", "motor_phase"),
    ],
)
def test_exact_what_repeats_with_a_turn_depends_on_its_phase(effect: str, turn: str, phase: str, ratio: float) -> None:
    """Also where the ratio was refitted since the order was derived from it."""
    once = {"motor": 1.0, "lobe": 1.0 - 1.0 / ratio, "load": 1.0 / abs(ratio)}[turn]
    for order in (once, 2.0 * once):
        depends_on = facts_of(effect, order, ratio * 1.0002).depends_on
        assert [name for name in depends_on if name.endswith("_phase")] == [phase]
        assert [name for name in depends_on if name != phase] == [
            name for name in FACTS[effect].depends_on if not name.endswith("_phase")
        ]


def test_exact_an_order_of_no_turn_leaves_the_phase_it_is_known_for() -> None:
    assert facts_of("cogging", 3.37, 121.0) == FACTS["cogging"]
    assert facts_of("gravity_unbalance", None, 121.0) == FACTS["gravity_unbalance"]
    assert facts_of("torque_ripple", 24.0, 121.0) == FACTS["torque_ripple"]


@pytest.mark.parametrize("ratio", [1.0, -1.0])
def test_exact_without_a_gear_an_order_is_that_of_the_motor(ratio: float) -> None:
    for order in (1.0, 2.0):
        assert facts_of("torque_ripple", order, ratio) == FACTS["torque_ripple"]
