"""What noise of the motor angle adds to the load side of a model that is replayed on it, and what that feigns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, inner, limited
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.whiten import Whitener

#: The largest share of what slopes tell that is taken for noise.
MOST_FEIGNED = 0.5


@dataclass(frozen=True, eq=False)
class Stir:
    """What noise of the motor angle adds to what a model shows on the load side, of one more such noise.

    Attributes:
        noise: on the mismatch, shape (N,).
        slopes: change of minus that per coordinate, shape (N, P).
        firmness: how many times as much a coordinate's prior weighs, shape (P,). What is left of a slope without the
            noise tells of the coordinate; the noise of the whole disturbs that.
    """

    noise: Floats = field(repr=False)
    slopes: Floats = field(repr=False)
    firmness: Floats = field(repr=False)

    @classmethod
    def none(cls, slopes: Floats) -> Stir:
        """Nothing, for a model with slopes (N, P)."""
        return cls(np.zeros(len(slopes)), np.zeros_like(slopes), np.ones(slopes.shape[-1]))

    def through(self, seen: Callable[[Floats], Floats]) -> Stir:
        """The same as a filter of (N,) or (N, P) sees it, no sample counted for more than one of a mismatch is.

        A resonance without damping shakes beyond any limit: less all of that, its mismatch would cost less than none.
        """
        if not self.loud:
            return self
        noise = seen(self.noise)
        root = np.sqrt(limited(noise)[1])
        return replace(self, noise=root * noise, slopes=root[:, None] * seen(self.slopes))

    def whitened(self, layout: Layout, white: Whitener) -> Stir:
        """The same through a whitening filter."""
        return self.through(partial(white, layout))

    @property
    def loud(self) -> bool:
        """Whether it adds anything that counts."""
        return bool(self.noise.any())


def information(structure: Structure, A: Floats, stir: Stir | None = None) -> Floats:
    """Of the coordinates (P, P), from weighted slopes (N, P) and the prior, less what the noise of the angle feigns."""
    firmness = np.ones(A.shape[1]) if stir is None else stir.firmness
    whole = inner(A, A) + np.diag(firmness * structure.sigma**-2)
    return whole if stir is None or not stir.loud else told(whole, inner(stir.slopes, stir.slopes))


def told(whole: Floats, feigned: Floats) -> Floats:
    """What noise does not feign (P, P) of information (P, P): in every direction at least a share of it.

    Where noise feigns all of it or more, nothing would hold a refit.
    """
    if not feigned.any() or not np.isfinite(whole + feigned).all():
        return whole
    try:
        root = np.linalg.cholesky(whole)
    except np.linalg.LinAlgError:
        return whole
    shares, ways = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, feigned).T))
    along = root @ ways
    less: Floats = whole - (along * np.minimum(shares, MOST_FEIGNED)) @ along.T
    return less
