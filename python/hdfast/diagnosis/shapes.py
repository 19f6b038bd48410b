"""How a hypothesis is made from a term of the catalogue: its free parameters, the others at their defaults."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.structure import Free
from hdfast.terms import Term, terms

EFFECTS = {"maxwell_slip": "hysteresis"}
ALIKE, MOST_UNLIKE = 0.1, 10.0


def effect_of(law: str) -> str:
    """The effect that a term of the catalogue models: mostly the one of its own name."""
    return EFFECTS.get(law, law)


def in_drive(
    law: str,
    free: Iterable[Free],
    *,
    amplitude: str | None = None,
    shape: str = "",
    fixed: dict[str, float] | None = None,
    waves: tuple[str, str] | None = None,
    spans: tuple[str, ...] = (),
    contains: tuple[str, ...] = (),
    needs: tuple[str, ...] = (),
    order: float | None = None,
    stiffness: bool = False,
    assumed: Iterable[Free] = (),
) -> Candidate:
    """An effect in the equations of the drive by a term; parameters by their short names, as `Candidate` has them."""
    term = terms()[law]

    def own(name: str) -> str:
        return f"{law}_{name}"

    named = tuple(_allowed(one, term, own(one.name)) for one in free)
    taken = {one.name for one in named}
    values = {p.name: p.default for p in term.parameters} | (fixed or {})
    return Candidate(
        effect=effect_of(law),
        place=term.place,
        terms=(law,),
        free=named,
        amplitude=own(amplitude or term.amplitude),
        fixed={own(name): value for name, value in values.items() if own(name) not in taken},
        waves=None if waves is None else (own(waves[0]), own(waves[1])),
        spans=tuple(own(name) for name in spans),
        contains=contains,
        needs=needs,
        shape=shape,
        order=(fixed or {}).get("order", order),
        stiffness=stiffness,
        assumed=tuple(_allowed(one, term, own(one.name)) for one in assumed),
    )


def positive(
    name: str,
    value: float,
    unit: str,
    *,
    sigma: float = 2.0,
    low: float = 0.0,
    high: float = math.inf,
    ends: bool = False,
) -> Free:
    """A parameter that is fitted in its logarithm."""
    return Free(name, value, sigma, True, unit, low, high, ends=ends)


def signed(name: str, value: float, sigma: float, unit: str, *, low: float = -math.inf, high: float = math.inf) -> Free:
    """A parameter that may have either sign."""
    return Free(name, value, sigma, False, unit, low, high)


def multiple(name: str, of: str, unit: str, *, sigma: float, high: float = math.inf) -> Free:
    """A parameter that is about as large as an earlier one of the same law and unit, at most so many times."""
    return Free(name, 1.0, sigma, True, unit, 0.0, high, times=of)


def phase(name: str, value: float = 0.0) -> Free:
    """An angle."""
    return Free(name, value, 2.0 * math.pi, False, "rad")


def in_sensor(effect: str, channel: str, free: Iterable[Free], *, waves: tuple[str, str] | None = None) -> Candidate:
    """An effect of the sensor of a channel."""
    term = terms()[effect]

    def own(name: str) -> str:
        return f"{channel}_{effect}_{name}"

    named = tuple(_allowed(one, term, own(one.name)) for one in free)
    amplitude = term.amplitude if own(term.amplitude) in {one.name for one in named} else "drift"
    fixed = {own(p.name): 0.0 if p.name in ("offset", "clock_offset", "psi") else p.default for p in term.parameters}
    return Candidate(
        effect=effect,
        place=term.place,
        terms=(),
        sensors=((effect, channel),),
        free=named,
        amplitude=own(amplitude),
        fixed={name: value for name, value in fixed.items() if name not in {one.name for one in named}},
        waves=None if waves is None else (own(waves[0]), own(waves[1])),
        shape=f"on {channel}",
    )


def in_every_sensor(effect: str, channels: Iterable[str], free: Free) -> Candidate:
    """An effect on the sensors of several channels that are of one make: to a tenth of the same size."""
    first, *others = [in_sensor(effect, channel, [free]) for channel in channels]
    tied = [multiple(one.names[0], first.names[0], free.unit, sigma=ALIKE, high=MOST_UNLIKE) for one in others]
    fixed = {name: value for one in (first, *others) for name, value in one.fixed.items()}
    sensors = tuple(pair for one in (first, *others) for pair in one.sensors)
    return replace(first, sensors=sensors, free=(*first.free, *tied), fixed=fixed, shape="on every channel")


def _allowed(free: Free, term: Term, name: str) -> Free:
    """A parameter of a term under its long name, within its allowed range."""
    low, high = next(one.allowed for one in term.parameters if one.name == free.name)
    if free.times is not None:
        return replace(free, name=name, times=name.removesuffix(free.name) + free.times)
    return replace(free, name=name, low=max(low, free.low), high=min(high, free.high))
