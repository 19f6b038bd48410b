"""Figures of the identifications show every run, every coast and every load that the fit has used."""

from __future__ import annotations

import numpy as np
import pytest
from hdfast import identify
from hdfast.identify.estimate import Estimates
from hdfast.identify.fit import Fit
from hdfast.identify.friction import law_torque
from hdfast.identify.plateaus import Plateaus
from hdfast.report import identify_plots
from hdfast.scenario_parts import PER_RPM
from test_identify_kinematic_error import smooth

LAW = {"T_c_forward": 0.03, "T_c_backward": 0.03, "B": 1e-3, "c_L": 0.1}
RATIO = 50.0


def entries(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def ladder(*loads):
    """The figure of a ladder at some loads, with the spread that a torque cell leaves in each."""
    speed = np.tile(np.array([-60.0, -10.0, 10.0, 60.0]), len(loads))
    load = np.repeat(loads, 4) + np.tile([-1e-3, 1e-3, 0.0, -2e-3], len(loads))
    warm = np.full_like(speed, np.nan)
    means = Plateaus(speed, law_torque(LAW, speed, load, warm, RATIO), np.full_like(speed, 1e-4), load, warm, speed)
    curves = {"means": means, "law": LAW, "ratio": RATIO}
    return identify_plots.friction_ladder(Fit("friction", "", Estimates([]), {}, [], {}, {}, curves)).axes[0]


@pytest.mark.parametrize(
    ("loads", "names"),
    [
        ((0.0,), ["0"]),
        ((0.0, 0.3, -0.3, 0.45), ["-0.3", "0", "0.3", "0.45"]),
        (range(-40, 50, 10), [str(load) for load in range(-40, 50, 10)]),
        (range(20), [f"{low} to {low + 1}" for low in range(0, 20, 2)]),
    ],
)
def test_exact_every_load_of_a_ladder_is_drawn_where_it_is(loads, names):
    axes = ladder(*loads)
    assert entries(axes) == [f"load {name} N m" for name in names]
    points = [line for line in axes.lines if line.get_marker() != "None"]
    assert sum(len(line.get_xdata()) for line in points) == 4 * len(loads)
    curves = [line for line in axes.lines if line.get_marker() == "None"]
    width = 0.5 if "to" in names[0] else 0.0
    for line, forward in zip(points, curves[::2], strict=True):
        at = np.interp(line.get_xdata()[-1], forward.get_xdata(), forward.get_ydata())
        assert at == pytest.approx(line.get_ydata()[-1], abs=1e3 * LAW["c_L"] * (width + 2e-3) / RATIO)


def test_exact_every_coast_is_drawn():
    speeds = np.linspace(10.0, 60.0, 12)
    t = np.linspace(0.0, 0.1, 20)
    curves = {"runs": [(t, speed * t) for speed in speeds], "starts": [(0.0, speed) for speed in speeds]}
    curves["laws"] = [(1.0, 0.1, 0.0)] * 12
    axes = identify_plots.coasts(Fit("coastdown", "", Estimates([]), {}, [], {}, {}, curves))
    assert entries(axes.axes[0]) == [f"from {speed * PER_RPM:.0f} r/min" for speed in speeds]
    assert len(axes.axes[1].lines) == 12


def test_exact_every_run_of_a_kinematic_error_is_drawn():
    made = [smooth([1, 2], [50e-6, 20e-6], [0.0, 1.0], 1e-6, seed=seed) for seed in range(2)]
    found = identify.kinematic_error([*made[0], made[1][0]], ratio=121.0, orders=[1, 2])
    names = ["forward 1", "backward", "forward 2"]
    assert entries(identify_plots.error_series(found).axes[0]) == [*names, "series"]
    assert entries(identify_plots.residual_spectrum(found).axes[0]) == names
