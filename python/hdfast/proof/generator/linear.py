"""The generator's own linear statistics: what an effect leaves after the baseline has been refitted.

All signatures are differences of `imposed.impose` on the true motion, whitened by the noise of their channel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy import linalg

from hdfast.proof.generator.effects import EFFECTS, Drive, Shape
from hdfast.proof.generator.plant import Array, Plant
from hdfast.proof.generator.responses import Motion, channels, noises, responses
from hdfast.proof.generator.rig import Rig
from hdfast.proof.generator.whitening import Channels, fit_filters, whiten

REALISATIONS = 8
QUIET = 1e-12
UNDETECTABLE = 1e6
THRESHOLD = 3.66 + 0.84  # two-sided 1 % over 40 candidates, and 80 % power


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
        base: channels of each recording without the effect.
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
    base: Channels

    def signature(self, drive: Drive) -> tuple[Array, Array]:
        """Whitened and raw difference that `drive` makes against the truth without the effect."""
        raw = [
            [a - b for a, b in zip(new, old, strict=True)]
            for new, old in zip(responses(self.rig, drive, self.motions), self.base, strict=True)
        ]
        return whiten(self.rig, self.motions, self.filters, raw), np.concatenate(
            [x for recording in raw for x in recording]
        )

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


def linearise(rig: Rig, drive: Drive, motions: list[Motion], rng: Generator) -> Linearisation:
    """Baseline columns, whitening and noise realisations for one campaign."""
    inertia = drive.plant.J_r + drive.plant.J_w
    realisations = [noises(rig, motions, rng, inertia) for _ in range(REALISATIONS)]
    filters = fit_filters([row for realisation in realisations[:4] for row in realisation])
    level = [
        float(np.sqrt(np.mean(np.concatenate([row[k] for row in realisations[0]]) ** 2))) for k in range(len(filters))
    ]
    empty = np.empty((0, 0))
    base = list(responses(rig, drive, motions))
    lin = Linearisation(rig, drive, motions, filters, empty, [], empty, empty, level, empty, base)
    names, white, raw = [], [], []
    for name, column in _columns(rig, drive, motions, base):
        names.append(name)
        white.append(whiten(rig, motions, filters, column))
        raw.append(np.concatenate([x for recording in column for x in recording]))
    columns = np.column_stack(white)
    noise = np.column_stack([whiten(rig, motions, filters, realisation) for realisation in realisations])
    basis = linalg.cholesky(columns.T @ columns + np.eye(columns.shape[1]), lower=True)
    return replace(lin, columns=columns, names=names, raw=np.column_stack(raw), noise=noise, basis=basis)


def _columns(rig: Rig, drive: Drive, motions: list[Motion], base: Channels) -> Iterator[tuple[str, Channels]]:
    """Change of the channels by one prior sigma of each baseline quantity."""

    def change(plant: Plant, scale: float) -> Channels:
        new = responses(rig, drive._replace(plant=plant), motions)
        return [[(a - b) * scale for a, b in zip(x, y, strict=True)] for x, y in zip(new, base, strict=True)]

    p, small = drive.plant, 0.01
    fields = {"J_m": ("J_r", "J_w"), "J_l": ("J_f", "J_p")}
    for name, sigma in rig.sigma.items():
        group = fields.get(name, (name,))
        yield name, change(p._replace(**{f: getattr(p, f) * (1 + small) for f in group}), sigma / small)
    for n, order in enumerate(p.te_order):
        for part, quarter in (("cos", 0.0), ("sin", np.pi / 2)):
            vector = p.te_amplitude[n] * np.exp(1j * p.te_phase[n]) + rig.error_sigma * np.exp(-1j * quarter)
            amplitude, phase = p.te_amplitude.copy(), p.te_phase.copy()
            amplitude[n], phase[n] = abs(vector), np.angle(vector)
            yield f"te_{part}_{order:g}", change(p._replace(te_amplitude=amplitude, te_phase=phase), 1.0)
    scaled = [[rig.torque_sigma * x[0]] + [0 * y for y in x[1:]] for x in base]
    yield "torque_scale", scaled
    wide = (0.01, 1e-3, 1.0)
    for index, name in enumerate(channels(rig)):
        for k in range(len(motions)):
            yield (
                f"offset_{name}_{k}",
                [
                    [np.full_like(y, wide[j]) if j == index and r == k else 0 * y for j, y in enumerate(x)]
                    for r, x in enumerate(base)
                ],
            )


@dataclass(frozen=True)
class Sized:
    """An effect at its amplitude.

    Attributes:
        id: of the effect.
        amplitude: in its own unit.
        detectable: smallest detectable amplitude.
        visibility: share of the signature's energy that a refit leaves, at the detectable amplitude.
        shape: its other fields.
    """

    id: str
    amplitude: float
    detectable: float
    visibility: float
    shape: Shape

    def on(self, drive: Drive) -> Drive:
        """The drive with this effect."""
        return EFFECTS[self.id].on(drive, self.amplitude, self.shape)


def size(lin: Linearisation, effect_id: str, multiple: float, rng: Generator) -> Sized:
    """Draw the shape of an effect and give it a multiple of its detectable amplitude, whatever its physical limit.

    The detectable amplitude is that whose signature, after a refit, has the length `THRESHOLD` in the noise along it.
    It is sought by secants in the logarithm, as play and stiction have no derivative at zero.
    """
    effect = EFFECTS[effect_id]
    shape = effect.shape(rng)
    amplitude, visible = effect.typical, 0.0
    for _ in range(8):
        whitened, _ = lin.signature(effect.on(lin.drive, amplitude, shape))
        left = lin.left(whitened)
        length = float(np.linalg.norm(left))
        if not length > QUIET:
            amplitude *= 30.0
            continue
        visible = float(length**2 / (whitened @ whitened))
        ratio = THRESHOLD * np.sqrt(lin.inflation(left)) / length
        amplitude *= float(np.clip(ratio, 0.03, 30.0))
        if abs(np.log(ratio)) < 0.03 or amplitude > 100.0 * effect.limit:
            break
    else:
        amplitude = amplitude if visible > 0.0 else UNDETECTABLE
    return Sized(effect_id, float(multiple * amplitude), float(amplitude), visible, shape)
