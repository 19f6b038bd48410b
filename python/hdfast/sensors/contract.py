"""What a sensor effect says of itself, and the five places in the order in which a signal passes them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.sensors.channels import ANGLES
from hdfast.sensors.curve import Course, Curve
from hdfast.sensors.dual import Number
from hdfast.sensors.ripple import Ripple
from hdfast.terms import Term, TermParameter

CHANNEL_UNIT = "unit of the channel"
Values = Mapping[str, Number]
Counts = NDArray[np.int64]
Draw = Callable[[Counts], Floats]


@dataclass(frozen=True)
class SensorParameter(TermParameter):
    """A parameter of a sensor effect.

    Attributes:
        on_torque: default, low and high on a torque channel, where they differ from those on an angle.
    """

    on_torque: tuple[float, float, float] | None = None


def phase(name: str, meaning: str) -> SensorParameter:
    """A phase angle."""
    return SensorParameter(name, name, "rad", 0.0, -np.pi, np.pi, meaning)


@dataclass(frozen=True)
class Instants:
    """When a channel is read.

    Attributes:
        s: times at which the quantity is looked at [s], shape (M, K).
        index: number of the reading behind each sample, shape (M, K); a held value repeats it.
        interval: usual time between two readings [s], shape (M, 1).
    """

    s: Number
    index: Counts
    interval: Number


class SensorEffect(ABC):
    """One effect between a quantity and its record; values arrive as (M, 1) by parameter name.

    Quantities, values and times may be dual numbers: an effect is written once, in operations that `dual` knows.
    """

    info: ClassVar[Term]

    def parameter(self, name: str) -> SensorParameter:
        """A parameter by its own name."""
        return next(cast(SensorParameter, item) for item in self.info.parameters if item.name == name)


class Geometry(SensorEffect):
    """Where the scale sits on its shaft: a function of the quantity alone."""

    @abstractmethod
    def reading(self, x: Number, p: Values) -> Number:
        """What the scale shows at x, shape (M, T)."""


class Graduation(Geometry):
    """Geometry that repeats with every line of the scale: as fast a sine as the shaft is, whatever the samples."""

    @abstractmethod
    def line(self, x: Number, p: Values) -> tuple[Number, Number]:
        """Amplitude (M, 1) and phase [rad], shape (M, T), of the sine that it adds at x."""

    def reading(self, x: Number, p: Values) -> Number:
        """What the scale shows at x, shape (M, T)."""
        amplitude, phase = self.line(x, p)
        return x + amplitude * np.sin(phase)


class Filter(SensorEffect):
    """Continuous dynamics before sampling, linear; a channel has one at most."""

    @abstractmethod
    def response(self, curve: Curve, p: Values) -> Number:
        """The filtered quantity at the knots of the curve, shape (M, T)."""

    @abstractmethod
    def remainder(self, ripple: Ripple, p: Values) -> Course:
        """What is left of a ripple behind the filter."""


class Clock(SensorEffect):
    """When the quantity is looked at."""

    @abstractmethod
    def instants(self, instants: Instants, p: Values, draw: Draw) -> Instants:
        """The instants as this effect leaves them."""


class Sampling(SensorEffect):
    """How one number is taken from the quantity around an instant."""

    @abstractmethod
    def sample(self, course: Course, instants: Instants, p: Values) -> Number:
        """The numbers, shape (M, K)."""


class Readout(SensorEffect):
    """What electronics add to the number and how they round it."""

    @abstractmethod
    def readout(self, y: Number, instants: Instants, p: Values, draw: Draw) -> Number:
        """What is written down, shape (M, K)."""


def sensor_term(
    name: str,
    *,
    description: str,
    equation: str,
    source: str,
    parameters: tuple[SensorParameter, ...],
    channels: tuple[str, ...] = ANGLES,
    states: tuple[tuple[str, str], ...] = (),
) -> Term:
    """The catalogue entry of a sensor effect; its first parameter is its amplitude."""
    return Term(
        id=name,
        place="sensor",
        description=description,
        equation=equation,
        source=source,
        amplitude=parameters[0].name,
        parameters=parameters,
        states=states,
        channels=channels,
    )
