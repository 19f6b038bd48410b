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
from hdfast.studies.cases import Grid
from hdfast.studies.claims import CONTRADICTORY, REPRODUCED, Finding, Verdict, decide
from hdfast.studies.jump import rise_and_fall
from hdfast.studies.study import TIMES, Study, marked_table

POINTS = (90.0, 150.0, 300.0, 450.0, 600.0)
SPEEDS = tuple(np.linspace(20.0, 700.0, 69).tolist())
ORDERS = tuple(range(1, 16))
MAP_SPEED = 300.0


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
    run = simulate(dict(drive or {}), scenario=Scenario.start_stop(speed_rpm=MAP_SPEED), t_eval=TIMES)
    lines = np.array([grid.of(f"speed_order_{n}", "c") for n in ORDERS])
    mode = trends.free_frequency(p) / (2.0 * math.pi)
    curves = {"run": run, "lines": lines, "jump": rise_and_fall(drive), "mode": mode, "p": p}
    claims = [*decide("speed", {"speed_rpm": grid}), _forced_lines(grid), _tail(grid)]
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
    change = float(frequency[-1] / frequency[0] - 1.0)
    mode = grid.of("mode_frequency_start", "a")[grid.marked]
    findings = [
        Finding("strongest line of the run", "up" if change > 0 else "down", change, abs(change) < 0.02),
        Finding("mode after the start", "const", float(np.ptp(mode) / mode[0]), True),
    ]
    listed = ", ".join(f"{f:.3g}" for f in frequency)
    return Verdict(
        "S11 lines",
        "frequency constant over speed, forced part",
        CONTRADICTORY if not findings[0].agrees else REPRODUCED,
        findings,
        f"the strongest line stands at {listed} Hz; only the mode is constant",
    )


def _tail(grid: Grid) -> Verdict:
    """Speed 1 s after the begin of the stop, as a share of the speed before, and what still rings after 1.5 s."""
    row = grid.rows("d")[int(np.flatnonzero(grid.values == MAP_SPEED)[0])]
    speed = grid.result.samples["omega_m"][row]
    t = grid.result.t_eval[0]
    share = float(np.interp(4.0, t, speed) / np.interp(3.0, t, speed))
    ring = float(grid.result["residual_ring"][row])
    return Verdict(
        "S12",
        "near zero within 1 s after the stop, a small fluctuation decays long after",
        REPRODUCED if share < 0.05 and ring > 0.0 else CONTRADICTORY,
        [Finding("speed 1 s after the stop, share of the speed before", "down", share - 1.0, share < 0.05)],
        f"exponential tails: residual ring {ring:.3g} rad/s rms",
    )
