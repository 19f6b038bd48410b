"""How large an effect has to be to be detected, and effects at a multiple of that.

A linear refit says it in a few signatures. It swallows too little of what moves a resonance, so a named effect is then
followed by a refit of the moved plant, whose minimum of small amplitudes is kept on the way to large ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from hdfast.proof.generator.effects import EFFECTS, Drive, Shape
from hdfast.proof.generator.linear import Linearisation, Refit
from hdfast.proof.generator.plant import Array

QUIET = 1e-12
UNDETECTABLE = 1e6
TRIES, LONGEST, CLOSE, NEAR = 12, 30.0, 0.03, 0.1
STRIDE, SWALLOWED, LOST = 2.0, 0.5, 1.5
GROWTHS = (0.4, 0.7, 1.0)  # of the shift with the amplitude
QUIETEST = 0.15  # least factor on the noise of a bench that gets other sensors
THRESHOLD = 3.66 + 0.84  # two-sided 1 % over 40 candidates, and 80 % power


@dataclass(frozen=True)
class Sized:
    """An effect at its amplitude.

    Attributes:
        id: of the effect.
        multiple: its amplitude in detectable amplitudes.
        detectable: smallest detectable amplitude, in its own unit.
        visibility: share of the signature's energy that a refit leaves, at the detectable amplitude.
        shape: its other fields.
        shift: of the baseline that takes up a detectable amplitude, in prior sigma (P,).
    """

    id: str
    multiple: float
    detectable: float
    visibility: float
    shape: Shape
    shift: Array

    @property
    def amplitude(self) -> float:
        """In its own unit."""
        return self.multiple * self.detectable

    def on(self, drive: Drive, share: float = 1.0) -> Drive:
        """The drive with this effect, or with a share of it."""
        return EFFECTS[self.id].on(drive, share * self.amplitude, self.shape)


def sketch(lin: Linearisation, effect_id: str, multiple: float, rng: Generator, at: float = 1.0) -> Sized:
    """Draw the shape of an effect and give it a multiple of its detectable amplitude, whatever its physical limit.

    The detectable amplitude is that whose signature, after a linear refit `at` so many of them, has the length
    `THRESHOLD` in the noise along it. It is sought by secants in the logarithm, as play and stiction have no derivative
    at zero.
    """
    effect = EFFECTS[effect_id]
    shape = effect.shape(rng)
    amplitude, visible, shift = effect.typical, 0.0, np.zeros(len(lin.names))
    for _ in range(TRIES):
        signature, _ = lin.signature(effect.on(lin.drive, amplitude, shape))
        left = lin.left(signature)
        seen = length(lin, left) / at
        if not seen > 0.0:
            amplitude *= LONGEST
            continue
        visible, shift = float(left @ left / (signature @ signature)), lin.shift(signature)
        amplitude *= float(np.clip(1.0 / seen, 1.0 / LONGEST, LONGEST))
        if abs(np.log(seen)) < CLOSE or amplitude > 100.0 * effect.limit:
            break
    detectable = amplitude / at if visible > 0.0 else UNDETECTABLE
    return Sized(effect_id, multiple, float(detectable), visible, shape, shift)


def follow(lin: Linearisation, sized: Sized, least: float = 0.0) -> Sized:
    """The same multiple of the amplitude that is detectable after a refit of the moved plant.

    A refit of a large effect has minima that swallow little; that which swallows most is reached from small amplitudes
    on, so every refit starts from the largest one before that left too little. The search ends early where the effect
    leaves its physical range, and where less than the share `least` of the signature's energy is left.
    """
    farthest = EFFECTS[sized.id].limit / (sized.multiple * sized.amplitude)
    share = base = 1.0 / sized.multiple
    low, high = 0.0, np.inf
    found = last = lin.refit(sized.on(lin.drive, share))
    for _ in range(TRIES):
        seen = max(length(lin, found.left), 1.0 / LONGEST)
        if abs(np.log(seen)) < NEAR or (seen < 1.0 and share > farthest) or found.visibility < least:
            break
        if seen < 1.0:
            last, low, base = found, share, share
        else:
            high = share
        aim = base * _stride(last, share / seen / base)
        share = aim if low < aim < high else float(np.sqrt(low * high))
        found = _further(lin, sized.on(lin.drive, share), last, share / base)
    else:
        return replace(sized, detectable=UNDETECTABLE)
    detectable = float(share / seen * sized.amplitude)
    return replace(sized, detectable=detectable, visibility=found.visibility, shift=found.shift / seen)


def swallowed(lin: Linearisation, named: list[Sized]) -> Refit:
    """Refit of the baseline to a drive with these effects, followed from what is detectable of the largest."""
    share = min([1.0, *(1.0 / s.multiple for s in named)])
    start = sum((share * s.multiple * s.shift for s in named), np.zeros(len(lin.names)))
    found = lin.refit(together(lin.drive, named, share), [start])
    while share < 1.0:
        taken = _stride(found, 1.0 / share)
        share *= taken
        found = _further(lin, together(lin.drive, named, share), found, taken)
    return found


def together(drive: Drive, named: Sequence[Sized], shares: Array | float = 1.0) -> Drive:
    """The drive with all of these effects, each at a share of its amplitude."""
    for effect, share in zip(named, np.broadcast_to(shares, len(named)).tolist(), strict=True):
        drive = effect.on(drive, share)
    return drive


def length(lin: Linearisation, left: Array) -> float:
    """Length of what is left in the noise along it, in that of a detectable amplitude."""
    size = float(np.linalg.norm(left))
    return size / (THRESHOLD * float(np.sqrt(lin.inflation(left)))) if size > QUIET else 0.0


def _further(lin: Linearisation, drive: Drive, last: Refit, taken: float) -> Refit:
    """Refit where the effects are `taken` times larger; new slopes where it leaves more than the growth explains."""
    starts = [taken**power * last.shift for power in GROWTHS]
    found = lin.refit(drive, starts, last.slopes)
    return found if found.cost <= LOST * taken**2 * last.cost else lin.refit(drive, starts)


def _stride(found: Refit, factor: float) -> float:
    """How much of a growth of the amplitude a refit can follow."""
    return min(factor, STRIDE) if found.visibility < SWALLOWED else factor
