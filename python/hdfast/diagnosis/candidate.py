"""One hypothesis of left-out physics: what to add to the structure, and how large it might be."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from hdfast.checks import Floats
from hdfast.diagnosis.structure import Free, Structure
from hdfast.errors import InputError

NOTHING = 1e-6
LEAST = 0.1


@dataclass(frozen=True)
class Candidate:
    """An effect with one choice of shape.

    Attributes:
        effect: id of the catalogue.
        place: motor, mesh, load, actuator, sensor or structure.
        terms: terms to switch on.
        orders: orders to add to the kinematic error.
        sensors: (effect, channel) pairs to add to the sensor stage.
        fixed: values of its parameters that are not fitted.
        free: fitted parameters, their values a typical size.
        amplitude: name of the parameter that says how large the effect is.
        waves: (cosine, sine) parameters, or (amplitude, phase), of an effect with a phase.
        spans: parameters that each have a signature of their own, for an effect without a phase.
        contains: effects that are special cases of this one.
        needs: at least one of these effects has to be there already.
        shape: what distinguishes it from other candidates of the same effect, for reports.
        size: in a word, where its signature is not taken at the typical amplitude.
        order: per motor revolution at which it acts, if at one.
        stiffness: whether the amplitude is a stiffness, which makes the effect smaller the larger it is.
        unseen: parameters of what is too small to be seen by itself, and decides how the effect acts.
        assumed: parameters that are fixed while the effect is weighed, and fitted once it is accepted.
    """

    effect: str
    place: str
    terms: tuple[str, ...]
    free: tuple[Free, ...]
    amplitude: str
    orders: tuple[str, ...] = ()
    sensors: tuple[tuple[str, str], ...] = ()
    fixed: Mapping[str, float] = field(default_factory=dict)
    waves: tuple[str, str] | None = None
    spans: tuple[str, ...] = ()
    contains: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    shape: str = ""
    size: str = ""
    order: float | None = None
    stiffness: bool = False
    unseen: tuple[str, ...] = ()
    assumed: tuple[Free, ...] = ()

    @property
    def label(self) -> str:
        """Effect, shape and size, unique within a screen."""
        return f"{self.effect} {', '.join(filter(None, (self.shape, self.size)))}".strip()

    @property
    def law(self) -> str:
        """The term of the catalogue that models it: there may be several for one effect."""
        return self.terms[0] if self.terms else self.effect

    @property
    def form(self) -> Hashable:
        """What it adds to a structure, whatever the sizes of its parameters."""
        bounds = tuple((one.name, one.positive, one.low, one.high) for one in self.free)
        return self.terms, self.orders, self.sensors, tuple(sorted(self.fixed.items())), bounds

    @property
    def variety(self) -> Hashable:
        """What is assumed of it besides its amplitude, and what is unseen."""
        told = {*self.sizes, *self.unseen}
        assumed = tuple((one.name, one.value) for one in self.free if one.name not in told)
        return self.form, assumed

    @property
    def refines(self) -> bool:
        """Whether it only frees parameters of an effect that is there."""
        return not (self.terms or self.orders or self.sensors)

    @property
    def names(self) -> list[str]:
        """Names of the fitted parameters."""
        return [free.name for free in self.free]

    def added_to(self, structure: Structure) -> Structure:
        """The structure with this effect."""
        return structure.with_terms(self.terms, self.orders, self.sensors, self.fixed, self.free)

    def settled_in(self, structure: Structure) -> Structure:
        """A structure that has this effect, with what was assumed of it free."""
        return structure.with_terms((), (), (), {}, self.assumed)

    def fits_into(self, structure: Structure) -> bool:
        """Whether a model has room for it: hidden states and orders are limited."""
        try:
            self.added_to(structure)
        except InputError:
            return False
        return True

    def settings(self) -> list[dict[str, float]]:
        """Values of its parameters at which its signatures are taken, one per column."""
        typical = {free.name: free.value for free in self.free}
        if self.waves is None:
            if self.bends:
                return [typical]
            return [
                typical | {other: NOTHING * typical[other] for other in self.spans if other != one}
                for one in self.spans
            ]
        first, second = self.waves
        if self._cartesian:
            size = math.hypot(typical[first], typical[second])
            return [typical | {first: size, second: 0.0}, typical | {first: 0.0, second: size}]
        return [typical | {second: 0.0}, typical | {second: math.pi / 2.0}]

    def possible(self, shares: Floats) -> Floats:
        """The shares (d,) of its signatures that are nearest to the given ones and that its parameters can have."""
        if self.waves is not None:
            return shares
        positive = {free.name: free.positive for free in self.free}
        bounded = [positive[name] for name in ((self.amplitude,) if self.bends else self.spans)]
        return np.where(bounded, np.maximum(shares, LEAST), shares)

    def started(self, shares: Floats) -> Candidate:
        """The candidate with its amplitude at possible shares (d,) of its typical size, one per signature."""
        changed: dict[str, float] = {}
        typical = {free.name: free.value for free in self.free}
        if self.bends:
            return self.scaled(float(shares[0]))
        if self.waves is None:
            changed = {name: typical[name] * share for name, share in zip(self.spans, shares.tolist(), strict=True)}
        elif self._cartesian:
            size = math.hypot(typical[self.waves[0]], typical[self.waves[1]])
            changed = dict(zip(self.waves, (size * shares).tolist(), strict=True))
        else:
            changed[self.waves[0]] = typical[self.waves[0]] * max(float(np.hypot(*shares)), LEAST)
            changed[self.waves[1]] = float(math.atan2(shares[1], shares[0]))
        free = tuple(replace(one, value=changed.get(one.name, one.value)) for one in self.free)
        return replace(self, free=free)

    @property
    def bends(self) -> bool:
        """Whether its signature may change its form with the amplitude, and is one column."""
        return self.waves is None and not self.spans

    @property
    def one_sided(self) -> bool:
        """Whether its only signature cannot turn its sign."""
        return self.bends and next(one.positive for one in self.free if one.name == self.amplitude)

    @property
    def sizes(self) -> tuple[str, ...]:
        """Parameters of which at least one has to differ from zero."""
        if self.waves is not None:
            return self.waves if self._cartesian else self.waves[:1]
        return self.spans or (self.amplitude,)

    def scaled(self, times: float) -> Candidate:
        """The candidate with its effect at a multiple of its typical size."""
        factor = 1.0 / times if self.stiffness else times
        free = tuple(replace(one, value=factor * one.value) if one.name in self.sizes else one for one in self.free)
        return replace(self, free=free)

    @property
    def unbounded(self) -> Candidate:
        """The candidate without the bounds of its amplitude: to first order it acts beyond them as well."""
        free = tuple(replace(one, low=-math.inf, high=math.inf) if one.name in self.sizes else one for one in self.free)
        return replace(self, free=free)

    @property
    def _cartesian(self) -> bool:
        return self.waves is not None and "psi" not in self.waves[1]
