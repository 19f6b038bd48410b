"""The generator's own linear statistics: what an effect leaves after the baseline has been refitted.

All signatures are differences of `imposed.impose` on the true motion, as torque, load angle and output torque at
the recorded rate, at most `RATE` samples per second. Noise is whitened per channel by an autoregression fitted to realisations of that noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy import linalg, signal

from hdfast.proof.generator import sensors
from hdfast.proof.generator.effects import Drive, Effect, Shape
from hdfast.proof.generator.imposed import impose
from hdfast.proof.generator.plant import Array
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.stepping import GRID

RATE = 250.0
ORDER = 16
SLOW = 0.1
THRESHOLD = 3.66 + 0.84  # two-sided 1 % over 40 candidates, and 80 % power


@dataclass(frozen=True)
class Motion:
    """The true motion of one recording on the grid, (N,) each; `start` holds ring and payload angle."""

    angle: Array
    speed: Array
    pull: Array
    load: Array
    temperature: Array
    start: Array


@dataclass(frozen=True)
class Linearisation:
    """Whitened statistics of one campaign.

    Attributes:
        rig: its rig.
        drive: the truth without the effect.
        motions: of the recordings used.
        filters: whitening filter and noise level per channel.
        columns: whitened baseline columns, scaled to their prior (rows, P).
        names: of the columns.
        raw: the same columns unwhitened.
        noise: whitened noise realisations (rows, R).
        level: raw noise rms per channel.
        basis: Cholesky factor of columns' columns + 1, the prior being 1 in these units.
    """

    rig: Rig
    drive: Drive
    motions: list[Motion]
    filters: list[tuple[Array, float]]
    columns: Array
    names: list[str]
    raw: Array
    noise: Array
    level: list[float]
    basis: Array

    def signature(self, drive: Drive) -> tuple[Array, Array]:
        """Whitened and raw difference that `drive` makes against the truth without the effect."""
        raw = [
            [a - b for a, b in zip(new, old, strict=True)]
            for new, old in zip(_responses(self.rig, drive, self.motions), _responses(self.rig, self.drive, self.motions), strict=True)
        ]
        return whiten(self, raw), np.concatenate([x for recording in raw for x in recording])

    def left(self, whitened: Array) -> Array:
        """What a refit of the baseline, held by its priors, leaves."""
        return np.asarray(whitened - self.columns @ self.refit(whitened))

    def refit(self, whitened: Array) -> Array:
        """Shift of the baseline parameters in prior sigma."""
        return np.asarray(linalg.cho_solve((self.basis, True), self.columns.T @ whitened))

    def inflation(self, left: Array) -> float:
        """Variance of the noise along a direction, in units of white noise."""
        along = self.noise.T @ left / np.linalg.norm(left)
        return float(max(np.mean(along**2), 0.5))


def channels(rig: Rig) -> tuple[str, ...]:
    """Channels of the linear statistics."""
    names = ["torque"]
    if not rig.motor_only:
        names.append("load_angle")
    if rig.has_output_torque:
        names.append("output_torque")
    return tuple(names)


def _every(rig: Rig) -> int:
    return round(1.0 / (min(RATE, rig.chain.rate) * GRID))


def _thin(x: Array, every: int) -> Array:
    whole = x[: x.size // every * every].reshape(-1, every)
    return np.asarray(whole.mean(axis=1))


def _sampled(rig: Rig, x: Array) -> Array:
    """What the recorded samples leave of a noise on the grid, thinned."""
    width = round(1.0 / (rig.chain.rate * GRID))
    if not rig.chain.averaged:
        x = x[np.minimum(np.arange(x.size) // width * width + width // 2, x.size - 1)]
    return _thin(x, _every(rig))


def _second(x: Array, inertia: float, step: float) -> Array:
    """Torque that an error of the motor angle looks like."""
    return np.asarray(inertia * np.gradient(np.gradient(x, step), step))


def _responses(rig: Rig, drive: Drive, motions: list[Motion]) -> Iterator[list[Array]]:
    inertia = drive.plant.J_r + drive.plant.J_w
    every = _every(rig)
    for m in motions:
        traces = impose(drive.plant, m.angle, m.speed, m.pull, m.load, m.temperature, m.start)
        seen = {name: _thin(x, every) for name, x in sensors.clean(traces, drive.faults).items()}
        wrong = seen["motor_angle"] - _thin(m.angle, every)
        out = [seen["motor_torque"] - (_second(wrong, inertia, every * GRID) if wrong.any() else 0.0)]
        if not rig.motor_only:
            out.append(seen["load_angle"] - wrong / drive.plant.ratio)
        if rig.has_output_torque:
            out.append(seen["output_torque"])
        yield out


def _noise(rig: Rig, motions: list[Motion], rng: Generator, inertia: float) -> list[list[Array]]:
    out = []
    for m in motions:
        still = 0.0 * m.angle
        true = {
            "motor_angle": m.angle, "load_angle": m.angle / rig.plant.ratio, "motor_torque": still, "output_torque": still,
        }  # fmt: skip
        grid = sensors.disturb(true, rig.chain, rng)
        off = {name: _sampled(rig, noisy - true[name]) for name, noisy in grid.items()}
        row = [off["motor_torque"] - _second(off["motor_angle"], inertia, _every(rig) * GRID)]
        if not rig.motor_only:
            row.append(off["load_angle"] - off["motor_angle"] / rig.plant.ratio)
        if rig.has_output_torque:
            row.append(off["output_torque"])
        out.append(row)
    return out


def whiten(lin: Linearisation, raw: list[list[Array]]) -> Array:
    """Whiten each channel of each recording; standstill is left out of the torque."""
    rows = []
    for recording, m in zip(raw, lin.motions, strict=True):
        for index, values in enumerate(recording):
            taps, sigma = lin.filters[index]
            white = signal.lfilter(taps, [1.0], values) / sigma
            white[:ORDER] = 0.0
            if index == 0:
                white *= _moving(lin.rig, m)
            rows.append(white)
    return np.concatenate(rows)


def _moving(rig: Rig, m: Motion) -> Array:
    return np.asarray(_thin((np.abs(m.speed) > SLOW).astype(float), _every(rig)) >= 1.0, dtype=float)


def _filters(noise: list[list[Array]]) -> list[tuple[Array, float]]:
    """Autoregression per channel by Yule-Walker on all recordings."""
    out = []
    for index in range(len(noise[0])):
        lags = np.zeros(ORDER + 1)
        count = 0
        for recording in noise:
            x = recording[index] - recording[index].mean()
            lags += np.array([x[k:] @ x[: x.size - k] for k in range(ORDER + 1)])
            count += x.size
        lags /= count
        lags[0] *= 1.0 + 1e-9
        taps = np.append(1.0, -linalg.solve_toeplitz(lags[:-1], lags[1:]))
        out.append((taps, float(np.sqrt(max(taps @ lags, 1e-30)))))
    return out


def linearise(rig: Rig, drive: Drive, motions: list[Motion], rng: Generator) -> Linearisation:
    """Baseline columns, whitening and noise realisations for one campaign."""
    inertia = drive.plant.J_r + drive.plant.J_w
    realisations = [_noise(rig, motions, rng, inertia) for _ in range(12)]
    filters = _filters([row for realisation in realisations[:4] for row in realisation])
    level = [float(np.sqrt(np.mean(np.concatenate([row[k] for row in realisations[0]]) ** 2))) for k in range(len(filters))]
    empty = np.empty((0, 0))
    lin = Linearisation(rig, drive, motions, filters, empty, [], empty, empty, level, empty)
    names, white, raw = [], [], []
    for name, column in _columns(rig, drive, motions):
        names.append(name)
        white.append(whiten(lin, column))
        raw.append(np.concatenate([x for recording in column for x in recording]))
    columns = np.column_stack(white)
    noise = np.column_stack([whiten(lin, realisation) for realisation in realisations])
    basis = linalg.cholesky(columns.T @ columns + np.eye(columns.shape[1]), lower=True)
    return Linearisation(rig, drive, motions, filters, columns, names, np.column_stack(raw), noise, level, basis)


def _columns(rig: Rig, drive: Drive, motions: list[Motion]) -> Iterator[tuple[str, list[list[Array]]]]:
    """Change of the channels by one prior sigma of each baseline quantity."""
    base = list(_responses(rig, drive, motions))

    def change(plant_change: dict[str, object], scale: float) -> list[list[Array]]:
        moved = drive._replace(plant=drive.plant._replace(**plant_change))
        new = _responses(rig, moved, motions)
        return [[(a - b) * scale for a, b in zip(x, y, strict=True)] for x, y in zip(new, base, strict=True)]

    p, small = drive.plant, 0.01
    fields = {"J_m": ("J_r", "J_w"), "J_l": ("J_f", "J_p")}
    for name, sigma in rig.sigma.items():
        group = fields.get(name, (name,))
        yield name, change({f: getattr(p, f) * (1 + small) for f in group}, sigma / small)
    for n, order in enumerate(p.te_order):
        for part, quarter in (("cos", 0.0), ("sin", np.pi / 2)):
            vector = p.te_amplitude[n] * np.exp(1j * p.te_phase[n]) + rig.error_sigma * np.exp(-1j * quarter)
            amplitude, phase = p.te_amplitude.copy(), p.te_phase.copy()
            amplitude[n], phase[n] = abs(vector), np.angle(vector)
            yield f"te_{part}_{order:g}", change({"te_amplitude": amplitude, "te_phase": phase}, 1.0)
    scaled = [[rig.torque_sigma * x[0]] + [0 * y for y in x[1:]] for x in base]
    yield "torque_scale", scaled
    wide = (0.01, 1e-3, 1.0)
    for index, name in enumerate(channels(rig)):
        for k in range(len(motions)):
            yield f"offset_{name}_{k}", [
                [np.full_like(y, wide[j]) if j == index and r == k else 0 * y for j, y in enumerate(x)]
                for r, x in enumerate(base)
            ]


def detectable(lin: Linearisation, effect: Effect, shape: Shape) -> tuple[float, float]:
    """Smallest detectable amplitude after refit, and the share of the signature that is left there (visibility).

    The signature at a finite amplitude is used, as play and stiction have no derivative at zero; the search is a
    secant in the logarithm of the amplitude.
    """
    amplitude = effect.typical
    share = 0.0
    for _ in range(8):
        whitened, _ = lin.signature(effect.on(lin.drive, amplitude, shape))
        left = lin.left(whitened)
        size = np.linalg.norm(left)
        if not np.isfinite(size) or size == 0.0:
            amplitude *= 10.0
            continue
        share = float(size**2 / (whitened @ whitened))
        ratio = THRESHOLD * np.sqrt(lin.inflation(left)) / size
        amplitude *= float(np.clip(ratio, 0.03, 30.0))
        if abs(np.log(ratio)) < 0.03:
            break
        if amplitude > 1e3 * effect.typical:
            break
    return amplitude, share
