"""What the figures of a diagnosis show: signals of every recording, the most telling window, spectra, levels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.lines import fourier_sums
from hdfast.diagnosis.prepare import Unit
from hdfast.diagnosis.replay import Replay
from hdfast.diagnosis.verdict import Verdict

WINDOW_SHARE, SHORTEST, LONGEST = 0.3, 0.6, 2.0
CELLS = 420
FEWEST_CYCLES = 2.0


@dataclass(frozen=True, eq=False)
class Trace:
    """One channel of one recording; signals are NaN where the diagnosis does not judge them.

    Attributes:
        unit: the recording at the samples that the channel's band holds.
        channel: motor_torque [N m], te [rad] or output_torque [N m].
        measured, baseline, extended: as the sensor reads and as the two models predict, each (n,).
        missing, left: measured minus baseline and measured minus extended, each (n,).
        floor: standard deviation of the sensor noise.
        models: names of the two models; the second is empty where there is only one.
    """

    unit: Unit
    channel: str
    measured: Floats = field(repr=False)
    baseline: Floats = field(repr=False)
    extended: Floats = field(repr=False)
    floor: float
    models: tuple[str, str]

    @property
    def missing(self) -> Floats:
        """What the calibrated nominal model leaves unexplained (n,)."""
        return self.measured - self.baseline

    @property
    def left(self) -> Floats:
        """What the extended model leaves unexplained (n,)."""
        return self.measured - self.extended

    def error(self, signal: Floats) -> float:
        """Root mean square of a signal as a share of the measured channel's standard deviation, NaN without samples."""
        if not np.isfinite(signal).any():
            return math.nan
        return float(np.sqrt(np.nanmean(signal**2))) / max(float(np.nanstd(self.measured)), 1e-300)

    @property
    def t(self) -> Floats:
        """Times on the recording's own clock [s], (n,)."""
        return self.unit.offset + self.unit.t


def traces(verdict: Verdict) -> list[Trace]:
    """Every judged channel of every recording, the held-out ones first."""
    session, extended = verdict.session, verdict.extended
    models = ("nominal", "" if extended is None else "extended")
    after = session.search.final if extended is None else extended
    found = traces_of(session.replay, (session.baseline.mismatch, after.mismatch), models)
    if session.held is not None and verdict.proof is not None:
        found = traces_of(session.held, verdict.proof.mismatch, models) + found
    return found


def traces_of(replay: Replay, mismatches: tuple[Floats, Floats], models: tuple[str, str]) -> list[Trace]:
    """The channels of a replay with the stacked mismatches (N,) of two models, at the samples that their bands hold."""
    layout = replay.layout
    found = []
    for index, channel, where in layout.pieces:
        stride = replay.plant.band.stride(channel)
        unit = replay.plant.units[index].thinned(stride)
        sample = layout.sample[where] // stride
        measured = np.full(len(unit.t), np.nan)
        measured[sample] = unit.measured[channel][sample]
        before, after = measured.copy(), measured.copy()
        before[sample] -= mismatches[0][where]
        after[sample] -= mismatches[1][where]
        floor = float(replay.floor[layout.channels.index(channel)])
        found.append(Trace(unit, channel, measured, before, after, floor, models))
    return found


def telling(found: Sequence[Trace]) -> tuple[Trace, tuple[float, float]]:
    """The trace and the window [s] where the extended model explains most; without one, where the mismatch is largest.

    Held-out recordings go first where there are any.
    """
    held = [trace for trace in found if trace.unit.role == "heldout"] or list(found)
    best = max(held, key=lambda trace: float(np.nansum(_worth(trace))))
    t = best.t
    length = min(float(np.ptp(t)), max(SHORTEST, min(LONGEST, WINDOW_SHARE * float(np.ptp(t)))))
    width = max(1, round(length / float(np.median(np.diff(t)))))
    sums = np.concatenate([[0.0], np.cumsum(np.nan_to_num(_worth(best)))])
    begin = int(np.argmax(sums[width:] - sums[:-width])) if len(sums) > width else 0
    return best, (float(t[begin]), float(t[min(begin + width, len(t) - 1)]))


def _worth(trace: Trace) -> Floats:
    """Explained squares, in squares of the signal's spread; plain squares where nothing was added."""
    squares: Floats = trace.missing**2
    explained = squares - trace.left**2
    spread = max(float(np.nanvar(trace.measured)), 1e-300)
    return (explained if np.nanmax(np.abs(explained), initial=0.0) > 0.0 else squares) / spread


def level(trace: Trace, signal: Floats, edges: Floats) -> Floats:
    """Root mean square of a signal between the edges [s], in standard deviations of the noise; NaN where unjudged."""
    cell = np.clip(np.searchsorted(edges, trace.t, side="right") - 1, 0, len(edges) - 2)
    known = np.isfinite(signal)
    sums = np.bincount(cell[known], signal[known] ** 2, minlength=len(edges) - 1)
    counts = np.bincount(cell[known], minlength=len(edges) - 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean: Floats = np.sqrt(sums / counts) / max(trace.floor, 1e-300)
    return mean


def spectrum(x: Sequence[Floats], signals: Sequence[Floats], highest: float) -> tuple[Floats, Floats]:
    """Amplitude per cycle of x, up to a highest number of cycles: largest in each of `CELLS` cells, over recordings.

    Args:
        x: positions in cycles' units (revolutions or seconds) per recording, not necessarily equally spaced.
        signals: values at them, NaN where unknown.
        highest: end of the axis.

    Returns:
        Middles of the cells and amplitudes, NaN where no recording is long enough.
    """
    edges = np.linspace(0.0, highest, CELLS + 1)
    largest = np.zeros(CELLS)
    for position, signal in zip(x, signals, strict=True):
        known = np.isfinite(signal)
        span = float(np.ptp(position[known])) if known.sum() > 8 else 0.0
        if span * highest < 2.0 * FEWEST_CYCLES:
            continue
        cycles, sums = fourier_sums(position[known], signal[known], highest, fewest=2 * CELLS)
        size = 2.0 / known.sum() * sums
        used = (cycles < highest) & (cycles * span >= FEWEST_CYCLES)
        np.maximum.at(largest, np.searchsorted(edges, cycles[used], side="right") - 1, size[used])
    return 0.5 * (edges[1:] + edges[:-1]), np.where(largest > 0.0, largest, np.nan)


def middle(x: Floats, y: Floats, bins: int) -> tuple[Floats, Floats]:
    """Medians of y in equally wide bins of x; NaN where a bin holds too few points."""
    known = np.isfinite(x) & np.isfinite(y)
    if known.sum() < bins:
        return np.empty(0), np.empty(0)
    x, y = x[known], y[known]
    edges = np.linspace(x.min(), x.max(), bins + 1)
    cell = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    fewest = max(5, len(x) // (20 * bins))
    medians = [float(np.median(y[cell == k])) if np.sum(cell == k) >= fewest else np.nan for k in range(bins)]
    return 0.5 * (edges[:-1] + edges[1:]), np.array(medians)


def states(unit: Unit, ratio: float, inertia: float) -> dict[str, tuple[str, Floats]]:
    """State variables of a recording, by name of `where.depends_on`: axis label and values (n,)."""
    transmitted = inertia * unit.acceleration / ratio + unit.load_torque
    return {
        "motor_speed": ("motor speed [r/min]", unit.speed * 30.0 / math.pi),
        "transmitted_torque": ("torque through the gear [N m]", transmitted),
        "motor_phase": ("motor angle in its turn [rad]", unit.angle % (2.0 * math.pi)),
        "load_phase": ("load angle in its turn [rad]", (unit.angle / ratio + math.pi) % (2.0 * math.pi) - math.pi),
        "motor_acceleration": ("motor acceleration [rad/s²]", unit.acceleration),
        "time_since_start": ("time since the start [s]", unit.before + unit.t),
    }
