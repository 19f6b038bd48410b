"""A slow rise and fall of the speed: where the two differ, the motion jumps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hdfast.checks import Floats
from hdfast.scenario import Scenario
from hdfast.scenario_parts import RPM
from hdfast.simulate import simulate

RAMP = (30.0, 700.0, 20.0)  # r/min, r/min, s


def rise_and_fall(drive: Mapping[str, float] | None) -> dict[str, Floats]:
    """Ripple of the load speed [rad/s] while the speed rises and falls slowly, in bins of motor speed [r/min]."""
    low, high, duration = RAMP
    t = np.array([0.0, 1.0, 1.0 + duration, 1.0 + 2.0 * duration])
    scenario = Scenario.speed_profile(t, speed_rpm=[0.0, low, high, low])
    run = simulate(
        dict(drive or {}),
        scenario=scenario,
        t_eval=np.arange(0.0, t[-1], 1e-3),
        signals=["omega_m", "omega_l"],
        metrics=[],
    )
    edges = np.linspace(low + 30.0, high - 30.0, 21)
    twist = run["omega_l"] - run["omega_m"] / run.parameters["ratio"]
    found = {}
    for name, begin, end in (("up", 1.0, 1.0 + duration), ("down", 1.0 + duration, t[-1])):
        inside = (run.t > begin) & (run.t < end)
        bins = np.digitize(run["omega_m"][inside] / RPM, edges)
        found[name] = np.array([np.std(twist[inside][bins == b]) for b in range(1, len(edges))])
    return {"speed": 0.5 * (edges[1:] + edges[:-1]), **found}


def gap(jump: Mapping[str, Floats]) -> float:
    """Largest difference of the ripple with rising and with falling speed, as a share of the larger."""
    up, down = jump["up"], jump["down"]
    larger = np.maximum(up, down)
    return float(np.max(np.abs(up - down)[larger > 0.0] / larger[larger > 0.0], initial=0.0))
