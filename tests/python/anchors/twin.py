"""The simulated twin of a campaign: what its baseline would have recorded, with noise like the real one's.

The baseline is what the campaign states: inertia, viscous friction, declared Coulomb friction, and a spring where the
output is locked; their values come from the recordings, kept within the stated tolerances. The noise is the residual of
a linear model that also has the effects that are looked for (offset, friction both ways, gravity, orders 1, 2 and 4,
memory where the output is locked), with random phases. Where the motion repeats, what such a model leaves has lines at
the motion's own frequencies: they are a law of the motion and no noise, and are spread over a band.

Without a controller the recorded motion is kept, smoothed, and the torque is the one that the baseline needs for it,
plus the noise: for torques at the motor that is exact. With a controller the closed loop is simulated, with the noise
as a disturbance of the motor torque and the angle quantised as the sensor does.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from anchors.oracle import Record, fitted, low_pass, play, read_folder

PLAYS = 12
GRAIN = 20
HELD = 5


def twin(campaign: Path, out: Path, seed: int, corner: float, spread: float = 0.0) -> Path:
    """Write the twin of a campaign folder; returns the path of its campaign.toml.

    Args:
        campaign: campaign.toml of the real recordings.
        out: folder of the twin.
        seed: of the noise.
        corner: low-pass on the recorded motion [Hz]; what moves faster is taken for noise of the angle sensor and
            returns with random phases.
        spread: width over which the torque noise loses its lines [Hz]; 0 keeps them.
    """
    sections, records = read_folder(campaign)
    moves = [_Motion(record, sections, corner) for record in records]
    known = [move for move in moves if move.record.role == "fit"]
    torque = np.concatenate([move.torque for move in known])
    full = fitted(np.concatenate([move.full() for move in known], 1), torque)
    stated = _stated(sections, locked=moves[0].locked)
    found = fitted(np.concatenate([move.baseline() for move in known], 1), torque) if moves[0].locked else full
    baseline = np.array([np.clip(factor, *span) for factor, span in zip(found, stated, strict=False)])
    random = np.random.default_rng(seed)
    out.mkdir(parents=True, exist_ok=True)
    for move, entry in zip(moves, sections["recording"], strict=True):
        left = move.torque - np.stack(move.full(), 1) @ full
        width = round(spread * float(np.ptp(move.record["t"])))
        noise = levelled(left, width, random) if width else shuffled(left, random)
        columns = dict(move.record.columns)
        if "controller" in sections:
            columns |= _closed_loop(move, sections, baseline, noise)
        else:
            columns |= _kept_motion(move, baseline, noise, random)
        if "output_torque" in columns:
            columns["output_torque"] = _output_torque(move, columns["motor_torque"], random)
        columns |= {name: held_like(own, columns[name]) for name, own in move.record.columns.items() if name != "t"}
        for standard, where in sections.get("columns", {}).items():
            columns[where["name"]] = columns.pop(standard) / where["scale"]
        np.savez_compressed(out / entry["file"], **columns)
    return Path(shutil.copy(campaign, out / "campaign.toml"))


def shuffled(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """The same amplitude at every frequency, random phases."""
    spectrum = np.fft.rfft(values - values.mean())
    turned = np.abs(spectrum) * np.exp(2j * np.pi * random.uniform(size=len(spectrum)))
    return np.fft.irfft(turned, len(values))


def levelled(values: np.ndarray, width: int, random: np.random.Generator) -> np.ndarray:
    """Normal noise of the same spectrum but for its lines: powers are means over so many frequencies."""
    power = uniform_filter1d(np.abs(np.fft.rfft(values - values.mean())) ** 2, width, mode="nearest")
    draws = random.standard_normal((2, len(power)))
    spectrum = np.sqrt(0.5 * power) * (draws[0] + 1j * draws[1])
    spectrum[0] = 0.0
    return np.fft.irfft(spectrum, len(values))


def _stated(sections: dict[str, Any], *, locked: bool) -> list[tuple[float, float]]:
    """Range of inertia, viscous friction, and spring or declared Coulomb friction: one relative sigma either way.

    The inertia is that of motor and load together, unless the output is locked.
    """
    drive = sections["drive"]
    facts = [drive[name] for name in ("J_m", "B_m", *["k1"] * locked)]
    facts += [term["parameters"]["T_c"] for term in sections.get("terms", [])]
    spans = [(fact["value"] * max(1.0 - fact["sigma"], 0.1), fact["value"] * (1.0 + fact["sigma"])) for fact in facts]
    load = drive["J_l"]
    behind = load["value"] / drive["ratio"] ** 2 if isinstance(load, dict) and not locked else 0.0
    return [(spans[0][0] + behind, spans[0][1] + behind), *spans[1:]]


class _Motion:
    """Regressors of one recording on its smoothed motion."""

    def __init__(self, record: Record, sections: dict[str, Any], corner: float) -> None:
        self.record = record
        self.ratio = sections["drive"]["ratio"]
        self.locked = "load_angle" in record.columns and not record["load_angle"].any()
        self.declared = bool(sections.get("terms"))
        self.resolution = sections.get("sensors", {}).get("motor_angle", {}).get("resolution", 0.0)
        self.torque = record["motor_torque"]
        seen = unheld(record["t"], record["motor_angle"])
        self.angle = low_pass(seen, record["t"], corner)
        self.fast = seen - self.angle
        spline = CubicSpline(record["t"], self.angle)
        self.speed = spline(record["t"], 1)
        self.acceleration = spline(record["t"], 2)
        self.direction = np.tanh(self.speed / (0.02 * np.abs(self.speed).max()))

    def baseline(self) -> list[np.ndarray]:
        columns = [self.acceleration, self.speed]
        return columns + [self.angle] * self.locked + [self.direction] * self.declared

    def full(self) -> list[np.ndarray]:
        columns = [self.acceleration, self.speed, self.direction, np.ones_like(self.speed), np.abs(self.speed)]
        if self.locked:
            widths = 0.5 * np.ptp(self.angle) * np.linspace(0.0, 0.95, PLAYS)
            return columns + [play(self.angle, width) for width in widths]
        load = self.angle / self.ratio
        orders = [wave(order * self.angle) for order in (1.0, 2.0, 4.0) for wave in (np.cos, np.sin)]
        return [*columns, np.sin(load), np.cos(load), *orders]


def renewals(values: np.ndarray) -> np.ndarray:
    """Samples at which values that are held for several samples are renewed; all where they are not held."""
    renewed = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    return np.arange(len(values)) if np.median(np.diff(renewed, prepend=0)) < HELD else renewed


def unheld(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Straight lines between the renewals of values that are held for several samples."""
    renewed = renewals(values)
    return np.interp(t, t[renewed], values[renewed])


def held_like(real: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values held between the renewals of the real ones."""
    renewed = renewals(real)
    return values[renewed[np.searchsorted(renewed, np.arange(len(values)), "right") - 1]]


def _quantised(values: np.ndarray, step: float) -> np.ndarray:
    return step * np.round(values / step) if step else values


def _kept_motion(
    move: _Motion, baseline: np.ndarray, noise: np.ndarray, random: np.random.Generator
) -> dict[str, np.ndarray]:
    angle = move.angle + shuffled(move.fast, random)
    torque = np.stack(move.baseline(), 1) @ baseline
    return {"motor_angle": _quantised(angle, move.resolution), "motor_torque": torque + noise}


def _output_torque(move: _Motion, torque: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """At a locked output the motor torque; else what follows the motion of the real reading, and its noise."""
    if move.locked:
        return torque
    reading = move.record["output_torque"]
    orders = [wave(order * move.angle) for order in (2.0, 4.0, 7.0) for wave in (np.cos, np.sin)]
    columns = [np.ones_like(reading), move.acceleration, move.speed, *orders]
    factors = fitted(columns, reading)
    kept = np.stack(columns[:3], 1) @ factors[:3]
    return kept + shuffled(reading - np.stack(columns, 1) @ factors, random)


def _closed_loop(
    move: _Motion, sections: dict[str, Any], baseline: np.ndarray, noise: np.ndarray
) -> dict[str, np.ndarray]:
    """PI control at its period, speed from the last two quantised angles, held between the samples."""
    control = sections["controller"]
    inertia, viscous = baseline.tolist()
    period, step = control["period"], move.resolution
    fine = period / GRAIN
    start = float(move.record["motor_angle"][0])
    angle, speed, asked = start, float(move.speed[0]), 0.0
    last = start - speed * period
    angles, torques = [], []
    reference = move.record["speed_reference"].tolist()
    before = reference[0]
    for wanted, disturbance in zip(reference, noise.tolist(), strict=True):
        seen = step * round(angle / step)
        asked += 0.5 * period * (wanted + before) if angles else 0.0
        before = wanted
        torque = control["kp"] * (wanted - (seen - last) / period) + control["ki"] * (asked - (seen - start))
        torque = min(max(torque, -control["limit"]), control["limit"])
        angles.append(seen)
        torques.append(torque)
        last = seen
        for _ in range(GRAIN):
            speed += fine * (torque - disturbance - viscous * speed) / inertia
            angle += fine * speed
    return {"motor_angle": np.array(angles), "motor_torque": np.array(torques)}
