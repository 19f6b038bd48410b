"""Single readings that no motion makes, in recordings of known drives: every identification leaves them out."""

from __future__ import annotations

import numpy as np
import pytest
from hdfast import identify
from hdfast.bench import coastdown, friction, kinematic_error, rig, starting_torque, stiffness
from hdfast.errors import InputError


@pytest.mark.parametrize(
    ("kind", "bench", "column", "size"),
    [
        (identify.kinematic_error, lambda: kinematic_error(revolutions=121, sensors=rig(100.0)), "load_angle", 0.01),
        (identify.friction, lambda: friction(sensors=rig(200.0)), "motor_angle", 10.0),
        (identify.starting_torque, lambda: starting_torque(seed=4).recordings, "motor_angle", 1.0),
        (identify.coastdown, lambda: coastdown(seed=1), "motor_angle", 5.0),
    ],
)
def test_exact_one_spike_of_an_angle_is_left_out(kind, bench, column, size):
    made = bench()
    options = {} if kind is identify.starting_torque else {"ratio": 121.0}
    clean = kind(made, **options)
    row = made[0].samples // 3
    columns = {name: values.copy() for name, values in made[0].items()}
    columns[column][row] += size
    spoilt = type(made[0])(made[0].name, columns, made[0].resolution)
    fit = kind([spoilt, *made[1:]], **options)
    assert [item.name for item in fit.estimates] == [item.name for item in clean.estimates]
    for found, known in zip(fit.estimates, clean.estimates, strict=True):
        assert known.low <= found.value <= known.high, found.name
    told = f"{made[0].name}: {column} has spikes in 1 samples, 1 times, first in sample {row} at "
    assert sum(told in note for note in fit.notes) == 1


@pytest.mark.parametrize(("column", "size"), [("load_angle", 0.1), ("load_torque", 1e4)])
@pytest.mark.parametrize("rate", [2.0, 200.0])
def test_regress_one_spike_of_a_loop_is_left_out(column, size, rate):
    """At 2 N m/s and 100 Hz, and at 2 N m from one reading to the next, 1 s apart."""
    made = stiffness(rate=rate, sensors=rig(100.0), seed=1).recording
    columns = {name: values.copy() for name, values in made.items()}
    columns["t"] *= 1.0 if rate < 100.0 else 100.0
    clean = identify.stiffness(columns, ratio=121.0).estimates.named("loop_energy")
    columns[column][made.samples // 3] += size
    fit = identify.stiffness(columns, ratio=121.0)
    told = f"recording 0: {column} has spikes in 1 samples, 1 times, first in sample {made.samples // 3} at "
    assert sum(told in note for note in fit.notes) == 1
    assert fit.estimates.named("loop_energy").value == pytest.approx(clean.value, rel=2e-3)


def test_regress_a_jump_that_lasts_is_no_loop():
    columns = dict(stiffness(sensors=rig(100.0), seed=1).recording.columns)
    columns["load_angle"] = columns["load_angle"] + 0.1 * ((columns["t"] > 60.0) & (columns["t"] < 61.0))
    with pytest.raises(InputError, match=r"share . levels .* take a finer load_angle without jumps"):
        identify.stiffness(columns, ratio=121.0)


def test_exact_an_angle_that_often_drops_out_is_refused():
    columns = dict(stiffness(rate=20.0, sensors=rig(100.0)).recording.columns)
    columns["load_angle"] = np.where(columns["t"] % 0.8 < 0.2, 0.0, columns["load_angle"] + 1.0)
    with pytest.raises(InputError, match=r"recording 0: load_angle drops out in .* mend the sensor"):
        identify.stiffness(columns, ratio=121.0)
