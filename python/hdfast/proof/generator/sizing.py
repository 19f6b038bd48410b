"""How large an effect has to be to be detected, and effects at a multiple of that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.effects import EFFECTS, Drive, Shape
from hdfast.proof.generator.linear import Linearisation

QUIET = 1e-12
UNDETECTABLE = 1e6
THRESHOLD = 3.66 + 0.84  # two-sided 1 % over 40 candidates, and 80 % power


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
        found = lin.refit(effect.on(lin.drive, amplitude, shape))
        length = float(np.linalg.norm(found.left))
        if not length > QUIET:
            amplitude *= 30.0
            continue
        visible = found.visibility
        ratio = THRESHOLD * np.sqrt(lin.inflation(found.left)) / length
        amplitude *= float(np.clip(ratio, 0.03, 30.0))
        if abs(np.log(ratio)) < 0.03 or amplitude > 100.0 * effect.limit:
            break
    else:
        amplitude = amplitude if visible > 0.0 else UNDETECTABLE
    return Sized(effect_id, float(multiple * amplitude), float(amplitude), visible, shape)
