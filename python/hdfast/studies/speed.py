"""Study: speed. Frequencies of the mode and of the lines, crossings, time-frequency map, phase planes, jumps."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import scipy

from hdfast.checks import Floats
from hdfast.params import params
from hdfast.scenario import Scenario
from hdfast.simulate import Trajectory, simulate
from hdfast.studies import cases, trends
from hdfast.studies.cases import LOADS, RTOL, Grid
from hdfast.studies.claims import DOWN, MIXED, SAME, Finding, Verdict, decide, trend, word
from hdfast.studies.jump import rise_and_fall
from hdfast.studies.study import TIMES, Study, marked_table

POINTS = (90.0, 150.0, 300.0, 450.0, 600.0)
SPEEDS = tuple(np.linspace(20.0, 700.0, 69).tolist())
ORDERS = tuple(range(1, 16))
MAP_SPEED = 300.0
STOP, LATER = 3.0, 1.5  # s, begin of the stop and how long after it nothing but a fluctuation should be left


def study(drive: Mapping[str, float] | None = None, threads: int | None = None) -> Study:
    """Sweep over the set speed in all cases; `drive` holds what differs from the defaults."""
    grid = cases.run(
        "speed_rpm",
        SPEEDS,
        POINTS,
        drive=drive,
        orders=ORDERS,
        signals=("omega_m", "omega_l"),
        t_eval=TIMES,
        threads=threads,
    )
    p = {row.name: row.default for row in params()} | dict(drive or {})
    scenario = Scenario.start_stop(speed_rpm=MAP_SPEED)
    run = simulate(dict(drive or {}), scenario=scenario, t_eval=TIMES)
    stops = {
        load: simulate({**(drive or {}), "J_l": load}, scenario=scenario, rtol=RTOL, t_eval=TIMES) for load in LOADS
    }
    lines = np.array([grid.of(f"speed_order_{n}", "c") for n in ORDERS])
    mode = trends.free_frequency(p) / (2.0 * math.pi)
    curves = {"run": run, "lines": lines, "jump": rise_and_fall(drive), "mode": mode, "p": p}
    claims = [*decide("speed", {"speed_rpm": grid}), _forced_lines(grid), _tail(stops)]
    return Study(
        "speed",
        "Speed",
        "Set speed from 20 to 700 r/min; mode and lines apart, start, run and stop apart.",
        {"speed_rpm": grid},
        claims,
        curves,
        {"Article's points, speed [r/min]": marked_table(grid)},
    )


def time_frequency(run: Trajectory) -> tuple[Floats, Floats, Floats]:
    """Short-time Fourier transform of the load speed less the motor's share: (time [s], frequency [Hz], amplitude)."""
    return _short_time(run.t, run["omega_l"] - run["omega_m"] / run.parameters["ratio"], 0.5)


def order_map(run: Trajectory) -> tuple[Floats, Floats, Floats]:
    """The same against the motor angle: (motor revolutions, order, amplitude)."""
    turns = run["theta_m"] / (2.0 * math.pi)
    ahead = np.concatenate([[True], np.diff(np.maximum.accumulate(turns)) > 1e-9])
    grid = np.arange(0.0, turns[ahead][-1], 1.0 / 90.0)
    twist = run["omega_l"] - run["omega_m"] / run.parameters["ratio"]
    return _short_time(grid, np.interp(grid, turns[ahead], twist[ahead]), 2.0)


def _short_time(x: Floats, signal: Floats, window: float) -> tuple[Floats, Floats, Floats]:
    step = float(x[1] - x[0])
    size = round(window / step)
    frequency, at, values = scipy.signal.stft(
        signal, 1.0 / step, "hann", size, int(0.9 * size), boundary=None, padded=False
    )
    return at, frequency, 2.0 * np.abs(values)


def _forced_lines(grid: Grid) -> Verdict:
    """The strongest line of the run stands at an order, so its frequency follows the speed."""
    marks = grid.values[grid.marked]
    lines = np.array([grid.of(f"speed_order_{n}", "c")[grid.marked] for n in ORDERS])
    frequency = (np.argmax(lines, axis=0) + 1) * marks / 60.0
    mode = grid.of("mode_frequency_start", "a")[grid.marked]
    line, own = _constant("strongest line of the run", frequency), _constant("mode after the start", mode)
    listed = ", ".join(f"{f:.3g}" for f in frequency)
    apart = "only the mode is constant" if own.agrees else "the mode is not constant either"
    return Verdict(
        "S11 lines",
        "frequency constant over speed, forced part",
        word([line]),
        [line, own],
        f"the strongest line stands at {listed} Hz; {apart}",
    )


def _constant(where: str, values: Floats) -> Finding:
    sign, change = trend(values)
    return Finding(where, sign, change, sign == SAME)


def _tail(stops: Mapping[float, Trajectory]) -> Verdict:
    """Speed 1 s after the begin of the stop, as a share of the speed before, and whether what is left later fluctuates.

    Of runs by load inertia [kg m^2]. A windup that only relaxes with the coast goes one way; one that fluctuates goes
    both ways, by more than what the solver resolves: its tolerance of the load speed before.
    """
    first = next(iter(stops.values()))
    share = float(np.interp(STOP + 1.0, first.t, first["omega_m"]) / np.interp(STOP, first.t, first["omega_m"]))
    findings = [Finding("speed 1 s after the stop, share of the speed before", DOWN, share - 1.0, share < 0.05)]
    for load, run in stops.items():
        rate = run["windup_rate"][run.t > STOP + LATER] / abs(np.interp(STOP, run.t, run["omega_l"]))
        sign = MIXED if min(np.max(rate), -np.min(rate)) > RTOL else DOWN
        where = f"J_l {load:g}, windup rate {LATER:g} s after the stop, share of the load speed before"
        findings.append(Finding(where, sign, float(np.max(np.abs(rate))) - 1.0, sign == MIXED))
    left = ", ".join(f"{run.metrics['residual_ring']:.3g}" for run in stops.values())
    swinging = [f"{load:g}" for load, item in zip(stops, findings[1:], strict=True) if item.agrees]
    return Verdict(
        "S12",
        "near zero within 1 s after the stop, a small fluctuation decays long after",
        word(findings),
        findings,
        f"windup rate left after {LATER:g} s at J_l {', '.join(f'{load:g}' for load in stops)}: {left} rad/s rms; "
        f"it fluctuates at {', '.join(swinging) or 'none'}, else it is the tail of the coast",
    )
