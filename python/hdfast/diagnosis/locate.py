"""Where a mismatch is: time windows, phases of motion, orders and frequencies, state of the drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.lines import Line, order_lines, several, snapped, tone_lines, torque_lines
from hdfast.diagnosis.prepare import Unit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.swings import Swing, swings

PHASES = ("standstill", "start", "run", "stop", "reversal")
LOUD = 3.0
FAINT, CLEAR = 0.03, 0.5
SILENT = 1e-3
CELL_S, JOIN_S = 0.05, 0.25
RAMP_S = 0.25
NAMED_SHARE = 0.8
AROUND_REVERSAL_S = 0.1
SLOW_SHARE, STEADY_SHARE = 0.01, 0.05


@dataclass(frozen=True)
class Where:
    """Location of a mismatch.

    Attributes:
        windows: (begin [s], end [s], file) in the recordings' own time.
        phase: the phase of motion with most of it, or "all".
        shares: share of the mismatch energy by phase.
        orders: of its lines per motor revolution, and of those of the motor torque above the band of the motion.
        frequencies: its lines in Hz that no order explains, and those of the swings.
        swings: what keeps its frequency at several speeds in the recorded signals, which a replay of them explains.
        channels: share of the mismatch above the noise by channel.
    """

    windows: tuple[tuple[float, float, str], ...]
    phase: str
    shares: dict[str, float]
    orders: tuple[float, ...]
    frequencies: tuple[float, ...]
    swings: tuple[Swing, ...]
    channels: dict[str, float]


def phases(unit: Unit) -> Floats:
    """Index into `PHASES` of every sample (n,).

    It starts or stops where the speed changes by a share of the top within the time of a ramp: of single samples the
    noise of the angle changes it more. It turns where it moves both ways soon before and after: at rest noise turns it.
    """
    t, speed = unit.t, unit.speed
    top = float(np.max(np.abs(speed)))
    ends = [np.clip(t + side * 0.5 * RAMP_S, t[0], t[-1]) for side in (-1.0, 1.0)]
    first, last = (np.interp(end, t, speed) for end in ends)
    gained = np.sign(speed) * (last - first) * RAMP_S / (ends[1] - ends[0])
    found = np.full(len(t), PHASES.index("run"))
    found[gained > STEADY_SHARE * top] = PHASES.index("start")
    found[gained < -STEADY_SHARE * top] = PHASES.index("stop")
    found[np.abs(speed) < SLOW_SHARE * top] = PHASES.index("standstill")
    for j in np.flatnonzero(np.diff(np.sign(speed)) != 0):
        around = np.abs(t - t[j]) < AROUND_REVERSAL_S
        if np.min(speed[around]) < -SLOW_SHARE * top and np.max(speed[around]) > SLOW_SHARE * top:
            found[around] = PHASES.index("reversal")
    return found


def locate(replay: Replay, held: Replay | None, before: Fit, after: Fit, named: Sequence[float]) -> Where:
    """Where the mismatch of `before` is that `after` explains; all of it where `after` explains nothing.

    Args:
        replay: recordings.
        held: those that are held out, whose motion is looked at with that of the others, or None.
        before: the lesser fit.
        after: the better fit.
        named: orders of the effects that make the difference; lines at other orders are listed after them.
    """
    layout = replay.layout
    scale = np.maximum(replay.floor, SILENT * before.weights.scale)[layout.channel]
    explained = before.mismatch - after.mismatch
    if after is not before and np.any(explained):
        missing, telling = explained / scale, after.white(layout, explained)
    else:
        missing = before.mismatch / scale
        telling = np.where(np.abs(missing) > LOUD, missing, 0.0)
    energy = np.zeros(len(PHASES))
    share: dict[str, float] = {}
    for unit_index, channel, where in layout.pieces:
        own = missing[where]
        energy += np.bincount(
            phases(replay.plant.units[unit_index])[layout.sample[where]], own**2, minlength=len(PHASES)
        )
        share[channel] = share.get(channel, 0.0) + float(np.sum(own**2))
    total, whole = float(energy.sum()), sum(share.values())
    shares = {phase: float(value / total) if total else 0.0 for phase, value in zip(PHASES, energy, strict=True)}
    top = max(shares, key=lambda phase: shares[phase])
    orders, tones = _sorted_out(replay, before)
    known = [*named, *_apart(orders, named)]
    swinging = swings([one.plant for one in (replay, held) if one is not None])
    more = [one for one in swinging if all(abs(one.frequency - own.position) > one.resolution for own in tones)]
    return Where(
        windows=_windows(replay, telling),
        phase=top if shares[top] >= NAMED_SHARE else "all",
        shares=shares,
        orders=tuple(round(position, 4) for position in [*known, *_apart(_beyond(replay), known)]),
        frequencies=tuple(
            round(own, 3) for own in [*(line.position for line in tones), *(one.frequency for one in more)]
        ),
        swings=tuple(swinging),
        channels={channel: value / whole if whole else 0.0 for channel, value in share.items()},
    )


def _apart(lines: Sequence[Line], named: Sequence[float]) -> list[float]:
    """Positions of the lines that are none of the named ones."""
    return [line.position for line in lines if snapped(line, named) not in named]


def _beyond(replay: Replay) -> list[Line]:
    """The strongest lines of the motor torque above the band of the motion: they are seen, not simulated."""
    lines = [line for line in torque_lines(replay) if line.recordings >= several(replay)]
    return [line for line in lines if line.prominence >= CLEAR * lines[0].prominence]


def _sorted_out(replay: Replay, before: Fit) -> tuple[list[Line], list[Line]]:
    """Lines that keep their order, and lines that keep their frequency, over recordings of different speed.

    With one recording of constant speed the two cannot be told apart, and a line is listed as an order.
    """
    least = several(replay)
    orders = [line for line in order_lines(replay, before.mismatch) if line.recordings >= least]
    speeds = [float(np.median(np.abs(unit.speed))) / (2.0 * np.pi) for unit in replay.plant.units]

    def geared(tone: Line) -> bool:
        width = max(2.0 * tone.resolution, 0.02 * tone.position)
        return any(abs(line.position * speed - tone.position) < width for line in orders for speed in speeds)

    tones = [line for line in tone_lines(replay, before.mismatch) if line.recordings >= least and not geared(line)]
    strong = [line for line in orders if line.prominence >= FAINT * orders[0].prominence]
    return strong, [line for line in tones if line.prominence >= FAINT * tones[0].prominence]


def _windows(replay: Replay, telling: Floats) -> tuple[tuple[float, float, str], ...]:
    """The fewest cells of time that hold most of a signal's (N,) energy, joined where they nearly touch."""
    layout = replay.layout
    loud: dict[tuple[int, int], float] = {}
    for number, _, where in layout.pieces:
        cell = (replay.plant.units[number].t[layout.sample[where]] / CELL_S).astype(np.int64)
        for index, energy in enumerate(np.bincount(cell, telling[where] ** 2)):
            if energy > 0.0:
                loud[number, index] = loud.get((number, index), 0.0) + float(energy)
    wanted, kept = NAMED_SHARE * sum(loud.values()), 0.0
    chosen = []
    for place in sorted(loud, key=lambda one: -loud[one]):
        if kept >= wanted:
            break
        kept += loud[place]
        chosen.append(place)
    found: list[tuple[int, float, float]] = []
    for number, index in sorted(chosen):
        unit = replay.plant.units[number]
        begin, end = unit.offset + index * CELL_S, unit.offset + (index + 1) * CELL_S
        if found and found[-1][0] == number and begin - found[-1][2] <= JOIN_S:
            begin = found.pop()[1]
        found.append((number, round(begin, 4), round(end, 4)))
    named = [(begin, end, replay.plant.units[number].name) for number, begin, end in found]
    return tuple(sorted(named, key=lambda window: (window[2], window[0])))
