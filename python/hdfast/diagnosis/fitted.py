"""A fitted structure, and how certain its parameters are."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.evidence import Layout, Weights
from hdfast.diagnosis.stir import Stir, information
from hdfast.diagnosis.structure import Structure
from hdfast.diagnosis.whiten import Whitener

#: By how much a law that is not quite the drive's widens an interval: on 110 opened blind cases those of the covariance
#: alone held 79 % of the effects' sizes and 67 % of the drive's parameters where 90 % are meant.
FORM = 1.5
LOOSE = 30.0


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted structure.

    Attributes:
        structure: what was fitted.
        coordinates: estimate, shape (P,).
        mismatch: measured minus simulated at the estimate, in the channels' units, shape (N,).
        slopes: derivative of the simulated signals with respect to the coordinates, shape (N, P).
        rough: noise of the acceleration in those derivatives, left out of `slopes`, shape (N, P).
        weights: scale and colour of the mismatch.
        white: filter to independent samples of unit variance.
        stir: what the noise of the angle adds on the load side, nothing where that hardly counts.
    """

    structure: Structure
    coordinates: Floats
    mismatch: Floats = field(repr=False)
    slopes: Floats = field(repr=False)
    rough: Floats = field(repr=False)
    weights: Weights
    white: Whitener = field(repr=False)
    stir: Stir = field(repr=False)

    def value(self, name: str) -> float:
        """A parameter's estimate; a fixed parameter's value."""
        if name in self.structure.names:
            return float(self.structure.values(self.coordinates)[name])
        return float(self.structure.fixed[name])

    def beside(self, other: Fit) -> Floats:
        """Coordinates (P,), of what another fit has as well those that it has."""
        theirs = dict(zip(other.structure.names, other.coordinates.tolist(), strict=True))
        own = zip(self.structure.names, self.coordinates.tolist(), strict=True)
        return np.array([theirs.get(name, at) for name, at in own])

    @property
    def stiffness(self) -> float:
        """Of the mesh at small windup [N m/rad]."""
        return self.value("K1" if self.structure.model.spring == "piecewise" else "k1")

    @property
    def pulls(self) -> Floats:
        """How far each coordinate is from its prior centre, in prior standard deviations, shape (P,)."""
        return np.asarray(np.abs(self.coordinates - self.structure.start) / self.structure.sigma)

    def covariance(self, layout: Layout) -> Floats:
        """Covariance of the coordinates (P, P): block sandwich, never below the Fisher information's."""
        A, r = self.white(layout, self.slopes), self.white(layout, self.mismatch)
        stir = self.stir.whitened(layout, self.white)
        bread = np.linalg.inv(information(self.structure, A, stir))
        scores = layout.sums(A * r[:, None] - stir.slopes * stir.noise[:, None])
        correction = layout.blocks / max(1, layout.blocks - 1)
        prior = np.diag(self.structure.sigma**-2)
        sandwich = bread @ (correction * scores.T @ scores + prior) @ bread
        larger = np.sqrt(np.maximum(np.diag(sandwich) / np.diag(bread), 1.0))
        covariance: Floats = bread * np.outer(larger, larger)
        return covariance

    def sigma_of(self, layout: Layout) -> dict[str, float]:
        """Standard deviation of each free parameter in its own unit, for laws that are not quite the drive's.

        Never beyond the prior's, where the fit's own is not.
        """
        names, covariance = self.structure.names, self.covariance(layout)
        found = {}
        for j, free in enumerate(self.structure.free):
            parts = [j] if free.times is None else [j, names.index(free.times)]
            own = float(np.sqrt(covariance[np.ix_(parts, parts)].sum()))
            deviation = min(FORM * own, max(own, float(np.linalg.norm(self.structure.sigma[parts]))))
            found[free.name] = deviation * (self.value(free.name) if free.positive else 1.0)
        return found

    def sigma_without_priors(self, layout: Layout, name: str) -> float:
        """Standard deviation of a coordinate that the recordings alone leave, at most `LOOSE` times its prior's."""
        loose = replace(
            self.structure, free=tuple(replace(one, sigma=LOOSE * one.sigma) for one in self.structure.free)
        )
        A, stir = self.white(layout, self.slopes), self.stir.whitened(layout, self.white)
        covariance = np.linalg.inv(information(loose, A, stir))
        return FORM * float(np.sqrt(np.diag(covariance)[self.structure.names.index(name)]))
