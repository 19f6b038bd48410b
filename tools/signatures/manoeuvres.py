"""The manoeuvres of the pictures; a case is a list of terms with their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from hdfast import Model, Scenario, simulate
from hdfast.checks import Floats
from hdfast.simulate import Trajectory

from signatures.picture import WITH, WITHOUT, Curve

RPM = 2.0 * np.pi / 60.0
Curves = Callable[[], Mapping[str, Curve]]
SMOOTH = {"te_scale": 0.0}


@dataclass(frozen=True)
class Case:
    """Terms that act and parameters that differ from the defaults."""

    terms: tuple[str, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)

    def run(self, scenario: Scenario, t: Floats, signals: Sequence[str], **options: Any) -> Trajectory:
        """Simulate it."""
        row = {**SMOOTH, **self.values}
        run = simulate(
            row,
            model=Model(terms=self.terms),
            scenario=scenario,
            t_eval=t,
            signals=list(signals),
            metrics=[],
            **{"rtol": 1e-8, **options},
        )
        if run.status != "finished":
            raise RuntimeError(run.message)
        return run


def both(term: str, values: Mapping[str, float], company: Case | None = None) -> dict[str, Case]:
    """The same drive without and with a term; `company` is what the term needs to show."""
    without = company or Case()
    return {WITHOUT: without, WITH: Case((*without.terms, term), {**without.values, **values})}


def compare(
    measure: Callable[[Case], Curve], term: str, values: Mapping[str, float], company: Case | None = None
) -> Curves:
    """What a manoeuvre measures without and with a term, computed when it is drawn."""
    return lambda: {name: measure(case) for name, case in both(term, values, company).items()}


def held_speed(case: Case, rpm: float, turns: int, signal: str, points: int = 2048, load: Any = 0.0) -> Curve:
    """A signal over whole motor turns at imposed constant speed: motor angle in turns, signal."""
    lead = 1.0
    end = lead + turns / abs(rpm) * 60.0
    knots = np.linspace(0.0, end, 64)
    scenario = Scenario.motion(knots, rpm * RPM * knots, load=load)
    t = np.minimum(lead + (end - lead) * np.arange(turns * points) / (turns * points), end)
    run = case.run(scenario, t, [signal])
    return (t - lead) * rpm / 60.0, run[signal]


def orders(case: Case, rpm: float, turns: int, signal: str, keep: Sequence[float], **options: Any) -> Curve:
    """Amplitude of a signal at the orders `keep` (range of cycles per motor turn), at imposed constant speed."""
    _, y = held_speed(case, rpm, turns, signal, **options)
    amplitude = 2.0 * np.abs(np.fft.rfft(y)) / len(y)
    order = np.arange(len(amplitude)) / turns
    chosen = (order >= keep[0]) & (order <= keep[1]) & (amplitude > 1e-4 * np.max(amplitude[1:]))
    return order[chosen], amplitude[chosen]


def ladder(case: Case, speeds_rpm: Sequence[float]) -> Curve:
    """Mean motor torque [mN m] at imposed constant speeds [r/min]."""
    torque = [np.mean(held_speed(case, rpm, 1, "tau_m", 256)[1]) for rpm in speeds_rpm]
    return np.asarray(speeds_rpm), 1e3 * np.array(torque)


def loop(case: Case, top: float, duration: float, loops: int = 1) -> Curve:
    """Windup [µrad] and torque [N m] with the input locked, torque up, down and up again; the last loop."""
    corners = np.array([0.0, top, *[-top, top] * loops])
    moments = duration * np.arange(len(corners))
    moments[1:] -= 0.5 * duration
    held = np.linspace(0.0, moments[-1], 9)
    scenario = Scenario.motion(held, 0.0 * held, load=(moments, corners))
    t = np.linspace(0.0, moments[-1], 400 * (2 * loops + 1))
    run = case.run(scenario, t, ["te"], max_steps=20_000_000)
    torque = np.interp(t, moments, corners)
    last = t >= moments[-3]
    return 1e6 * run["te"][last], torque[last]


def ring(case: Case, torque: float, duration: float, signal: str = "te") -> Curve:
    """A signal after the load torque falls away at t = 0 [ms], input locked."""
    lead = 1.0
    held = np.linspace(0.0, lead + duration, 9)
    scenario = Scenario.motion(held, 0.0 * held, load=([0.0, lead, lead, lead + duration], [torque, torque, 0.0, 0.0]))
    t = lead + np.linspace(-0.1 * duration, duration, 1200)
    return 1e3 * (t - lead), case.run(scenario, t, [signal])[signal]
