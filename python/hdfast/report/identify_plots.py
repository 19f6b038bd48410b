"""Figures of the identifications."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure

from hdfast import spring
from hdfast.checks import Floats
from hdfast.identify.coast_law import coast
from hdfast.identify.fit import Fit
from hdfast.identify.friction import LOAD_SHARE, law_torque
from hdfast.identify.orders import Run
from hdfast.identify.starting_torque import ORDER
from hdfast.report.look import DASHES, GREEN, SERIES, label, legend
from hdfast.report.plots import BLUE, GREY, INK, ORANGE, RED, styled
from hdfast.report.speed_plots import draw_rmse
from hdfast.scenario_parts import PER_RPM

TURN = 2.0 * np.pi
NEAR = 0.01  # loads this close, as a share of the largest, are one series
MOST_LOADS = 12
ROW, COLUMNS, ROWS = 0.17, 3, 3  # height [in] of a row of a legend, entries in it, rows that any figure has room for


@styled
def stiffness_loop(fit: Fit) -> Figure:
    """The loops with the spring through their middle, the distance of the branches, and the residual of each."""
    law, points = fit.curves["fits"][fit.numbers["law"]], fit.curves["points"]
    figure = Figure(figsize=(9.6, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(3, 2))
    left = figure.add_subplot(grid[:, 0])
    upper, lower = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    branches = ((1.0, BLUE, "loading"), (-1.0, ORANGE, "unloading"))
    for j, (loop, zero) in enumerate(zip(fit.curves["loops"], law.zeros, strict=True)):
        found, pair = loop.found, loop.pair
        for direction, color, name in branches:
            chosen = found.direction == direction
            text = "" if j else name
            left.plot((found.windup[chosen] - zero) * 1e3, found.torque[chosen], ".", ms=2.5, color=color, label=text)
        upper.plot((pair.windup - zero) * 1e3, pair.rising - pair.falling, ".", ms=2.5, color=GREEN)
    for direction, color, _ in branches:
        used = points.direction == direction
        windup = points.windup[used] - law.zeros[points.loop[used]]
        lower.plot(windup * 1e3, law.residual[used], ".", ms=2.0, color=color)
    x = np.linspace(-1.0, 1.0, 401) * fit.numbers["range"]
    drive = fit.sections["drive"]
    left.plot(x * 1e3, spring.torque(drive["spring"], drive, x), color=INK, label=f"spring, {law.law}")
    label(left, "windup [mrad]", "torque [N m]")
    legend(left)
    upper.axhline(2.0 * law.halves[0], color=INK, linewidth=0.9, linestyle="--")
    label(upper, "windup [mrad]", "distance [N m]", "distance of the branches")
    label(lower, "windup [mrad]", "residual [N m]", "torque minus fit")
    return figure


@styled
def stiffness_slope(fit: Fit) -> Figure:
    """Tangent of every spring law over torque."""
    from hdfast.identify.stiffness import law_parameters

    figure = Figure(figsize=(9.6, 3.0), layout="constrained")
    axes = figure.add_subplot()
    x = np.linspace(0.0, fit.numbers["range"], 2001)
    for (name, law), color, dash in zip(fit.curves["fits"].items(), SERIES, DASHES, strict=False):
        k = law_parameters(law, fit.numbers["range"], fit.curves["corners"])
        held = spring.torque(k["spring"], k, x)
        axes.plot(held, np.gradient(held, x) * 1e-3, dash, color=color, label=name)
    axes.axvline(fit.curves["rated"], color=RED, linewidth=0.8, linestyle=":", label="rated torque")
    axes.set_ylim(bottom=0.0)
    label(axes, "torque [N m]", "stiffness [kN m/rad]")
    legend(axes, 4)
    return figure


@styled
def order_selection(fit: Fit) -> Figure:
    """Error of the series over the number of orders, and BIC."""
    selection = fit.curves["selection"]
    figure = Figure(figsize=(9.6, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    draw_rmse(left, selection)
    numbers = np.arange(1, len(selection.bic) + 1)
    right.plot(numbers, (selection.bic - np.min(selection.bic)) * 1e-3, "o-", ms=3.5, color=GREEN)
    right.axvline(selection.best_bic, color=GREY, linewidth=0.9, linestyle=":")
    label(right, "number of orders", "BIC above its least, thousands", f"smallest BIC at {selection.best_bic}")
    return figure


@styled
def error_series(fit: Fit) -> Figure:
    """Measured transmission error over a motor revolution with the series, and the amplitudes with intervals."""
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for (run, color, name), offset in zip(_runs(fit), _offsets(fit), strict=True):
        every = max(1, len(run.angle) // 6000)
        values = (run.error - offset)[::every]
        left.plot((run.angle % TURN)[::every], values * 1e6, ".", ms=1.2, color=color, label=name, rasterized=True)
    orders = [order for order in fit.curves["orders"] if order.denominator == 1]
    angle = np.linspace(0.0, TURN, 721)
    wave = np.zeros_like(angle) + sum(
        fit.estimates.named(f"te_cos_{n}").value * np.cos(int(n) * angle)
        + fit.estimates.named(f"te_sin_{n}").value * np.sin(int(n) * angle)
        for n in orders
    )
    left.plot(angle, wave * 1e6, color=INK, label="series")
    label(left, "motor angle [rad], one revolution", "transmission error [µrad]")
    legend(left, markers=6.0)
    found = [fit.estimates.named(f"te_{order}") for order in fit.curves["orders"]]
    place = np.arange(len(found))
    size = np.array([item.value for item in found]) * 1e6
    half = np.array([item.high - item.value for item in found]) * 1e6
    right.bar(place, size, color=BLUE, width=0.7)
    right.errorbar(place, size, half, fmt="none", ecolor=INK, elinewidth=0.9, capsize=1.5)
    right.set_xticks(place, [str(order) for order in fit.curves["orders"]], fontsize=7.0, rotation=45)
    right.set_yscale("log")
    right.set_ylim(bottom=max(0.3 * float(np.min(size)), 1e-4))
    label(right, "order [per motor revolution]", "amplitude [µrad], 90 % intervals")
    return figure


def _runs(fit: Fit) -> Iterator[tuple[Run, str, str]]:
    """Every run with its colour and its name, numbered within a direction that has several."""
    names = ["forward" if run.direction > 0 else "backward" for run in fit.curves["runs"]]
    for j, (run, color) in enumerate(zip(fit.curves["runs"], cycle(SERIES), strict=False)):
        number = f" {names[: j + 1].count(names[j])}" if names.count(names[j]) > 1 else ""
        yield run, color, names[j] + number


def _offsets(fit: Fit) -> list[float]:
    nuisances = fit.curves["found"].nuisances
    return [nuisances[f"offset_{i}"] for i in range(len(fit.curves["runs"]))]


@styled
def residual_spectrum(fit: Fit) -> Figure:
    """What the series leaves, over order."""
    figure = Figure(figsize=(9.6, 2.8), layout="constrained")
    axes = figure.add_subplot()
    for (run, color, name), residual in zip(_runs(fit), fit.curves["found"].residuals, strict=True):
        size = 2.0 * np.abs(np.fft.rfft(residual)) / len(residual)
        orders = np.arange(len(size)) / run.revolutions
        shown = (orders > 0) & (orders < 25)
        axes.plot(orders[shown], size[shown] * 1e6, color=color, linewidth=0.7, label=name)
    axes.set_yscale("log")
    label(axes, "order [per motor revolution]", "residual amplitude [µrad]")
    legend(axes)
    return figure


@styled
def friction_ladder(fit: Fit) -> Figure:
    """Torque over speed with the fitted law, both directions, and the residual."""
    means, law, ratio = fit.curves["means"], fit.curves["law"], fit.curves["ratio"]
    loads = _loads(means.load, LOAD_SHARE * ratio * float(np.max(np.abs(means.torque))))
    figure = Figure(figsize=(9.6, _height(3.8, len(loads))), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    fitted = law_torque(law, means.speed, means.load, means.temperature, ratio)
    fast = float(np.max(np.abs(means.speed)))
    warm = np.array([float(np.nanmean(means.temperature)) if np.isfinite(means.temperature).any() else np.nan])
    for (low, high, name), color, mark in zip(loads, cycle(SERIES), cycle("os^v"), strict=False):
        chosen = (means.load >= low) & (means.load <= high)
        load = float(np.mean(means.load[chosen]))
        left.plot(means.speed[chosen] * PER_RPM, means.torque[chosen] * 1e3, mark, ms=3.0, color=color, label=name)
        for sign in (1.0, -1.0):
            speed = sign * np.geomspace(1e-3 * fast, fast, 200)
            torque = law_torque(law, speed, np.full_like(speed, load), warm.repeat(200), ratio)
            left.plot(speed * PER_RPM, torque * 1e3, color=color, linewidth=0.9)
    right.errorbar(
        means.speed * PER_RPM,
        (means.torque - fitted) * 1e3,
        means.noise * 1e3,
        fmt="o",
        ms=2.5,
        color=BLUE,
        elinewidth=0.8,
    )
    right.axhline(0.0, color=INK, linewidth=0.7)
    label(left, "motor speed [r/min]", "friction torque [mN m]")
    label(right, "motor speed [r/min]", "residual [mN m]")
    legend(left)
    return figure


def _loads(load: Floats, least: float) -> list[tuple[float, float, str]]:
    """Lowest and highest [N m] of loads that are one series, and its name; wider series where they would be too many.

    Args:
        load: of every constant speed (n,) [N m].
        least: difference [N m] below which no load counts as another one.
    """
    apart = same = max(least, NEAR * float(np.max(np.abs(load))))
    while True:
        found: list[tuple[float, float]] = []
        for value in np.unique(load).tolist():
            if found and value - found[-1][0] <= apart:
                found[-1] = (found[-1][0], value)
            else:
                found.append((value, value))
        if len(found) <= MOST_LOADS:
            return [(low, high, f"load {_load_text(low, high, same)} N m") for low, high in found]
        apart *= 2.0


def _load_text(low: float, high: float, same: float) -> str:
    """The one load of a series or its ends, to the decimal that tells loads apart."""
    ends = (low, high) if high - low > same else (0.5 * (low + high),)
    digits = max(0, math.ceil(-math.log10(same)))
    return " to ".join(f"{round(end, digits) + 0.0:g}" for end in ends)


def _height(least: float, entries: int) -> float:
    """Height [in] of a figure whose legend must not take the room of its axes."""
    return least + ROW * max(0, -(-entries // COLUMNS) - ROWS)


@styled
def starts(fit: Fit) -> Figure:
    """Starting torque over the motor angle with what the starts share, and its distribution in each direction."""
    found, line = fit.curves["starts"], fit.curves["line"]
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    angle = np.linspace(0.0, TURN, 361)
    share = line[-2] * np.cos(ORDER * angle) + line[-1] * np.sin(ORDER * angle) if fit.curves["waves"] else 0.0 * angle
    for j, ((name, sign), color, mark) in enumerate(zip(fit.curves["sides"], SERIES, "os", strict=False)):
        chosen = found.direction == sign
        torque = np.sort(found.torque[chosen]) * 1e3
        left.plot(found.angle[chosen] % TURN, found.torque[chosen] * 1e3, mark, ms=4.0, color=color, label=name)
        left.plot(angle, line[j] * (1.0 + share) * 1e3, DASHES[j], color=color, linewidth=0.9)
        below = np.arange(1, len(torque) + 1) / len(torque)
        right.step(torque, below, DASHES[j], where="post", color=color, label=name)
    label(left, "motor angle [rad], one revolution", "starting torque [mN m]")
    label(right, "starting torque [mN m]", "share of the starts below [1]")
    right.set_ylim(0.0, 1.05)
    legend(left)
    return figure


@styled
def coasts(fit: Fit) -> Figure:
    """Angle over time of every coast, and the residual."""
    figure = Figure(figsize=(9.6, _height(3.4, len(fit.curves["runs"]))), layout="constrained")
    left, right = figure.subplots(1, 2)
    runs, starts, laws = (fit.curves[name] for name in ("runs", "starts", "laws"))
    for (t, angle), start, law, color in zip(runs, starts, laws, cycle(SERIES), strict=False):
        fitted = start[0] + coast(t, float(start[1]), law)
        left.plot(t, angle, ".", ms=2.5, color=color, label=f"from {start[1] * PER_RPM:.0f} r/min")
        left.plot(t, fitted, color=INK, linewidth=0.8)
        right.plot(t, (angle - fitted) * 1e6, color=color, linewidth=0.8)
    label(left, "time [s]", "motor angle travelled [rad]")
    label(right, "time [s]", "residual [µrad]")
    legend(left)
    return figure


FIGURES = {
    "stiffness": (
        (
            stiffness_loop,
            "Torque against windup, one point for each step of the angle sensor; the spring law lies in the middle of "
            "the branches. Right: distance of the branches (dashed: twice the hysteresis torque), residual of the fit.",
        ),
        (stiffness_slope, "Tangent stiffness of every fitted law."),
    ),
    "kinematic_error": (
        (
            error_series,
            "Transmission error against the motor angle with the fitted series, and the amplitude of every order.",
        ),
        (order_selection, "Error of the fit and of left-out revolutions over the number of orders, and BIC."),
        (residual_spectrum, "What is left: a line standing out is an order that is missing from the list."),
    ),
    "friction": (
        (
            friction_ladder,
            "Friction torque at constant speeds, less the share of the load; lines: fitted law at the mean load of the "
            "points of their colour.",
        ),
    ),
    "starting_torque": (
        (starts, "Torque at which the motor left rest, over its angle and as a distribution; lines: mean and ripple."),
    ),
    "coastdown": ((coasts, "Angle while coasting; black: fitted law."),),
}
