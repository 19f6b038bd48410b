"""Known drive, virtual bench, sensors, identification: errors and coverage over many seeds."""

from __future__ import annotations

import functools
from collections import defaultdict
from dataclasses import dataclass

import drives
import numpy as np
from hdfast import Model, identify
from hdfast.bench import record, rig, stiffness
from hdfast.bench.kinematic_error import motion
from hdfast.sensors import encoder

GAIN = {name: {**drives.DRIVE, **drives.POLYNOMIAL}[name] for name in ("J_l", "k1", "B_sp", "B_l")}
ANGLES = ("motor_angle", "load_angle")
SENSORS = [(17, 100.0), (17, 1000.0), (20, 100.0), (20, 1000.0)]  # load encoder [bit], rate [Hz]
# Motor revolutions in each direction and speed [r/min] that each sensor needs for the smallest order, 1.03e-6 rad. The
# speed is no simple ratio of the rate, or every output revolution would repeat the rounding errors of the one before.
RUNS = {(17, 100.0): (484, 2.987), (17, 1000.0): (242, 14.93), (20, 100.0): (363, 14.93), (20, 1000.0): (121, 14.93)}


@dataclass
class Tally:
    """Relative errors and whether the stated 90 % interval holds the truth, by seed."""

    errors: list[float]
    held: list[bool]

    @property
    def worst(self) -> float:
        return float(np.max(np.abs(self.errors)))

    @property
    def coverage(self) -> float:
        return float(np.mean(self.held))


def _tallies():
    return defaultdict(lambda: Tally([], []))


def _count(tallies, fit, truth):
    for item in fit.estimates:
        if item.name in truth:
            tallies[item.name].errors.append(item.value / truth[item.name] - 1.0)
            tallies[item.name].held.append(item.covers(truth[item.name]))


def springs(spring, bits, rate, seeds):
    """Tally of each coefficient, of the hysteresis torque and of the energy of a cycle."""
    tallies = _tallies()
    sensors = rig(rate, load_angle=encoder(bits, noise=1e-6))
    law = "odd" if spring == "polynomial" else "piecewise"
    for seed in range(seeds):
        made = stiffness(model=Model(spring=spring), sensors=sensors, seed=seed)
        _count(tallies, identify.stiffness(made.recording, ratio=121.0, law=law), made.truth)
    return dict(tallies)


def orders(bits, rate, seeds, revolutions=None):
    """Tally of each amplitude and coefficient, and the pairs (knee, suggested) found; default revolutions of `RUNS`."""
    needed, speed = RUNS[bits, rate]
    amplitudes = {f"te_{n}": amplitude for n, amplitude in enumerate(drives.AMPLITUDES, 1)}
    tallies, counts = _tallies(), set()
    sensors = rig(rate, load_angle=encoder(bits, noise=1e-6))
    for seed in range(seeds):
        recordings = [
            record(sensors, f"run {j}", found["t"], {name: found[name] for name in ANGLES}, [seed, j])
            for j, found in enumerate(_signals(rate, revolutions or needed, speed))
        ]
        fit = identify.kinematic_error(recordings, ratio=121.0, gain=GAIN)
        counts.add((fit.numbers["knee"], fit.numbers["suggested"]))
        _count(tallies, fit, drives.kinematic_error() | amplitudes)
    return dict(tallies), counts


@functools.lru_cache(maxsize=2)
def _signals(rate, revolutions, speed):
    duration = 60.0 / speed * (revolutions + 0.02)
    t = rig(rate).times(duration)
    return [{"t": t, **motion(None, Model(), sign * speed, duration, t)} for sign in (1.0, -1.0)]
