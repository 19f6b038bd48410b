"""Coast-downs that begin before the motor is switched off, go both ways or do not follow the law."""

from __future__ import annotations

import numpy as np
import pytest
from hdfast import identify
from hdfast.bench import FrictionLaw, coastdown, rig
from hdfast.identify.coast_law import coast

J = 3e-4 + 0.5 / 121.0**2
UNEVEN = {"terms": [{"effect": "asymmetric_friction"}]}


def led(made, seconds):
    """A coast with a constant speed before it, at which the motor is still on."""
    t, angle = made["t"], made["motor_angle"]
    lead = np.arange(0.0, seconds, t[1] - t[0])
    speed = np.polyfit(t[:40], angle[:40], 2)[1]
    return {"t": np.r_[lead, seconds + t - t[0]], "motor_angle": np.r_[angle[0] + speed * (lead - seconds), angle]}


def backward(law):
    return [{**made, "motor_angle": -made["motor_angle"]} for made in coastdown(law, seed=2)]


@pytest.mark.parametrize("seconds", [0.02, 0.1, 1.0, 20.0])
def test_regress_constant_speed_before_the_motor_is_switched_off_is_left_out(seconds):
    fit = identify.coastdown([led(made, seconds) for made in coastdown(FrictionLaw(), sensors=rig(1000.0))], inertia=J)
    for name, value in (("T_c", 0.03), ("B", 1.2e-3)):
        assert fit.estimates.named(name).value == pytest.approx(value, rel=2e-3)
    text = "before the coast is left out: the motor was not yet switched off"
    cuts = [float(note.split(" for ")[1].split()[0]) for note in fit.notes if text in note]
    assert cuts == pytest.approx([seconds] * 3, abs=2e-3)
    assert not any("does not hold" in note for note in fit.notes)


def test_exact_a_coast_of_few_samples_is_not_searched_for_a_lead():
    """They lie closer and closer, so that the first part of the time holds hardly any."""
    for samples in range(8, 30):
        t = 0.1 * np.linspace(0.0, 1.0, samples) ** 0.5
        fit = identify.coastdown({"t": t, "motor_angle": coast(t, 60.0, (90.0, 3.0, 0.0))})
        assert fit.estimates.named("T_c_over_J").value == pytest.approx(90.0, rel=1e-3)
        assert not any("left out" in note for note in fit.notes)


def test_exact_coasts_in_both_directions_have_a_dry_friction_each():
    there = coastdown(FrictionLaw(T_c=0.03))
    back = backward(FrictionLaw(T_c=0.036))
    fit = identify.coastdown([*there, *back], inertia=J, ratio=121.0, base=UNEVEN)
    for name, value in (("T_c_forward", 0.03), ("T_c_backward", 0.036), ("B", 1.2e-3)):
        assert fit.estimates.named(name).value == pytest.approx(value, rel=1e-3)
    dry, uneven = fit.model["terms"]
    assert dry["parameters"]["T_c"] == pytest.approx(0.033, rel=1e-3)
    assert uneven["parameters"]["eps_c"] == pytest.approx(-1.0 / 11.0, rel=0.01)
    one_way = identify.coastdown(there, inertia=J, base=UNEVEN)
    assert [item["effect"] for item in one_way.model["terms"]] == ["asymmetric_friction", "coulomb_friction"]
    neither = identify.coastdown([*there, *backward(FrictionLaw())], inertia=J, base=UNEVEN)
    assert [item["effect"] for item in neither.model["terms"]] == ["coulomb_friction"]


def test_exact_dry_friction_of_one_direction_alone_decides_nothing():
    runs = [*coastdown(FrictionLaw()), *backward(FrictionLaw(T_c=0.0))]
    fit = identify.coastdown(runs, inertia=J, base=UNEVEN)
    assert [item["effect"] for item in fit.model["terms"]] == ["asymmetric_friction"]
    assert any("no dry friction: it is not surely above zero" in note for note in fit.notes)


def test_regress_a_coast_that_does_not_follow_the_law_is_told():
    sound = coastdown(FrictionLaw(), sensors=rig(1000.0))
    coarse = [{**made, "motor_angle": np.round(made["motor_angle"] / 6e-3) * 6e-3} for made in sound]
    for runs in (sound, coarse, coastdown(FrictionLaw(), sensors=rig(100.0))):
        assert not any("does not hold" in note for note in identify.coastdown(runs).notes)
    for samples in (30, 100):
        angle = sound[1]["motor_angle"].copy()
        angle[:samples] -= 0.05
        fit = identify.coastdown([sound[0], {**sound[1], "motor_angle": angle}, sound[2]])
        note = next(note for note in fit.notes if "does not hold" in note)
        assert "of 3 coasts: recording 1 misses it by 0.0" in note
        assert "Else fit cubic as well" in note


def test_regress_friction_over_inertia_that_is_negative_is_named():
    t = np.arange(0.0, 1.0, 1e-3)
    notes = identify.coastdown({"t": t, "motor_angle": 50.0 * t**2 + t}).notes
    assert any("T_c_over_J is negative (90 %: " in note and "was the motor driven?" in note for note in notes)
    driven = {"t": t, "motor_angle": coast(t, 60.0, (200.0, -2.0, 0.0))}
    assert any("no viscous damping: B is negative" in note for note in identify.coastdown(driven, inertia=J).notes)
