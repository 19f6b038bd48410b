"""The sensor stage: from what a drive did to what a recording says."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from hdfast import checks
from hdfast.checks import Floats
from hdfast.errors import InputError, choose, shorten
from hdfast.params import ParameterTable
from hdfast.sensors import draws, dual, passage
from hdfast.sensors.catalogue import EFFECTS
from hdfast.sensors.channels import ANGLES, CHANNELS
from hdfast.sensors.contract import Clock, Counts, Filter, Sampling
from hdfast.sensors.dual import Dual, Number
from hdfast.sensors.names import Key, table
from hdfast.sensors.passage import Step

FINE_STEP = 1e-3  # s; samples further apart than this are simulated in between for effects that look between them
BLOCK = 2**20  # numbers of one signal handled at once


@dataclass(frozen=True, eq=False)
class SensorStage:
    """Sensor effects on the channels of a recording.

    Whatever the order of the list, a signal passes them as in a test rig: geometry of the scale, filter, clock (skew,
    conversion, jitter, delay), averaging, drift, noise, rounding. Between samples a signal is its cubic spline, and a
    torque that jumps goes straight; before the first sample an angle moves on at its first speed and a torque holds
    its value. What the lines of an encoder add may be faster than the samples. A stage without effects changes no bit.

    Args:
        effects: pairs (effect id, channel); see `hdfast.terms()` and `hdfast.sensors.CHANNELS`.
        values: parameters that differ from their defaults, named as in `parameters`.
        rate: readings per second of `times` [Hz].
        seed: of noise and jitter; a number or a sequence of numbers. The same seed gives the same bits, row by row.

    Raises:
        InputError: naming the argument, its value and what is allowed.
    """

    effects: Sequence[tuple[str, str]] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    rate: float = 1000.0
    seed: int | Sequence[int] = 0
    parameters: ParameterTable = field(init=False, repr=False)
    _key: tuple[int, ...] = field(init=False, repr=False)
    _behind: Mapping[str, Key] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if isinstance(self.effects, str) or not isinstance(self.effects, Iterable):
            raise InputError(f"effects = {shorten(self.effects)} is not a list of pairs of effect id and channel")
        pairs = [_pair(entry) for entry in self.effects]
        twice = [pair for pair in pairs if pairs.count(pair) > 1]
        if twice:
            raise InputError(f"effects names {twice[0][0]} on {twice[0][1]} twice (allowed: once per channel)")
        pairs.sort(key=lambda pair: list(EFFECTS).index(pair[0]))
        checks.positive("rate", self.rate, 1e9, "Hz")
        object.__setattr__(self, "effects", tuple(pairs))
        object.__setattr__(self, "_key", _seed(self.seed))
        parameters, behind = table(pairs)
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "_behind", behind)
        values = self.checked(self.values)
        for name, value in values.items():
            checks.finite(name, value)
        object.__setattr__(self, "values", values)

    @property
    def channels(self) -> list[str]:
        """Channels with at least one effect."""
        return [name for name in CHANNELS if any(channel == name for _, channel in self.effects)]

    @property
    def resolution(self) -> dict[str, float]:
        """Smallest step by channel, where readings are rounded."""
        rounded = [channel for effect, channel in self.effects if effect == "quantisation"]
        found = {channel: self.value(f"{channel}_quantisation_resolution") for channel in rounded}
        return {channel: step for channel, step in found.items() if step > 0.0}

    def named(self, taken: Container[str]) -> ParameterTable:
        """`parameters`, with longer names for those whose name is `taken`."""
        return table(self.effects, taken)[0]

    def value(self, name: str) -> float:
        """The value of a parameter that rows do not override."""
        row = self.parameters[name]
        return self.values.get(row.name, row.default)

    def times(self, end: float) -> Floats:
        """Times of the readings from 0 to `end` [s]."""
        end = checks.finite("end", end, 0.0, unit="s")
        return np.arange(math.floor(end * self.rate * (1.0 + 1e-12)) + 1) / self.rate

    def grid(self, at: Floats) -> Floats:
        """Times at which to simulate [s], for readings at the times `at`: they and, where needed, times between."""
        if not any(isinstance(EFFECTS[effect], Filter | Clock | Sampling) for effect, _ in self.effects):
            return np.unique(at)
        knots = np.unique([0.0, *at])
        gaps = np.diff(knots)
        parts = np.maximum(np.ceil(gaps / FINE_STEP - 1e-6), 1.0).astype(np.int64)
        shares = [np.arange(n) / n for n in parts.tolist()]
        between = [a + share * gap for a, share, gap in zip(knots.tolist(), shares, gaps.tolist(), strict=False)]
        return np.concatenate([*between, knots[-1:]])

    def apply(
        self,
        t: Any,
        signals: Mapping[str, Any],
        parameters: Mapping[str, Any] | None = None,
        *,
        at: Any = None,
        rows: Any = None,
    ) -> dict[str, Floats]:
        """Read the signals through the sensors.

        Args:
            t: times of the signals [s], shape (T,), strictly increasing; see `grid`.
            signals: channels by name, shape (M, T) or (T,); what has no sensor keeps its values.
            parameters: values by name, a number or (M,), before those of the stage.
            at: times of the readings [s], shape (K,); default t.
            rows: (M,) whole numbers that key the random draws; default 0 to M - 1.

        Returns:
            Readings by channel, shape (M, K) or (K,).

        Raises:
            InputError: a shape, a time or a value that cannot be.
        """
        return self.linearise(t, signals, parameters=parameters, at=at, rows=rows)[0]

    def linearise(
        self,
        t: Any,
        signals: Mapping[str, Any],
        slopes: Mapping[str, Any] | None = None,
        parameters: Mapping[str, Any] | None = None,
        *,
        wrt: Sequence[str] = (),
        at: Any = None,
        rows: Any = None,
    ) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """Read the signals through the sensors, and differentiate the readings.

        The derivatives are exact, with the random numbers held: noise and jitter are these times a standard deviation.
        Rounding alone is left out: the derivatives are those of the unrounded reading, which is the mean over all
        places where the steps may lie. The steps themselves then change nothing.

        Args:
            t, signals, parameters, at, rows: as in `apply`.
            slopes: derivatives of the signals along D directions by channel, shape (M, T, D) or (T, D); what is left
                out does not change.
            wrt: names of W parameters of this stage.

        Returns:
            The readings, and by channel their derivatives (M, K, D + W) or (K, D + W), in the channel's unit: along
            the directions of `slopes`, then with respect to the parameters.

        Raises:
            InputError: a name, a shape, a time or a value that cannot be.
        """
        t = checks.rising("t", t)
        at = t if at is None else checks.table("at", at)
        given = self.checked({} if parameters is None else parameters)
        directions = _directions(slopes or {})
        names = [self.parameters[name].name for name in checks.listed("wrt", wrt)]
        if len(set(names)) < len(names):
            raise InputError(f"wrt = {shorten(wrt)} contains a parameter twice")
        units = np.eye(directions + len(names))[..., None, None]
        own = {name: units[directions + j] for j, name in enumerate(names)}
        read, derived = {}, {}
        for name, signal in signals.items():
            x = checks.as_floats(f"signals[{name!r}]", signal)
            if x.ndim not in (1, 2) or x.shape[-1] != len(t):
                raise InputError(f"signals[{name!r}] has shape {x.shape}, t has {t.shape} (allowed: (M, T) or (T,))")
            every = np.atleast_2d(x)
            moving = _padded(name, (slopes or {}).get(name), x.shape, len(units)).reshape(*every.shape, len(units))
            keys = np.arange(len(every)) if rows is None else np.asarray(rows)
            if keys.shape != (len(every),) or keys.dtype.kind not in "iu":
                raise InputError(
                    f"rows has shape {keys.shape} and dtype {keys.dtype}, allowed: integers of shape ({len(every)},)"
                )
            y, dy = self._channel(name, t, every, moving, at, given, own, keys.astype(np.int64))
            read[name], derived[name] = (y, dy) if x.ndim == 2 else (y[0], dy[0])
        return read, derived

    def drawn(self, seed: int | Sequence[int]) -> SensorStage:
        """This stage as one rig of many: another seed, and steps that fall at random where no `step_share` is given."""
        keys, first = _seed(seed), np.zeros((1, 1), dtype=np.int64)
        shares = {}
        for channel in self.resolution:
            written = self.parameters.canonical(f"{channel}_quantisation_step_share")
            if written not in self.values:
                shares[written] = float(draws.uniform(keys, f"{channel} step_share", first, first)[0, 0])
        return SensorStage(self.effects, {**self.values, **shares}, self.rate, keys)

    def _channel(
        self,
        channel: str,
        t: Floats,
        x: Floats,
        moving: Floats,
        at: Floats,
        given: Mapping[str, Any],
        own: Mapping[str, Floats],
        keys: Counts,
    ) -> tuple[Floats, Floats]:
        effects = [effect for effect, name in self.effects if name == channel]
        directions = moving.shape[-1]
        size = max(1, BLOCK // (max(len(t), len(at)) * (1 + directions)))
        read = np.empty((len(x), len(at)))
        derived = np.empty((*read.shape, directions))
        for start in range(0, len(x), size):
            part = slice(start, start + size)
            steps = [
                Step(
                    EFFECTS[effect],
                    self._values(channel, effect, given, own, len(x), part),
                    partial(draws.normal, self._key, f"{channel} {effect}", keys[part, None]),
                )
                for effect in effects
            ]
            source = Dual(x[part], np.moveaxis(moving[part], -1, 0)) if directions else x[part]
            y = passage.read(steps, t, source, at, moving=channel in ANGLES)
            read[part] = dual.value(y)
            derived[part] = np.moveaxis(np.broadcast_to(dual.slopes(y), (directions, *read[part].shape)), 0, -1)
        return read, derived

    def _values(
        self,
        channel: str,
        effect: str,
        given: Mapping[str, Any],
        own: Mapping[str, Floats],
        rows: int,
        part: slice,
    ) -> dict[str, Number]:
        found: dict[str, Number] = {}
        for name, key in self._behind.items():
            if key[:2] == (channel, effect):
                number = np.asarray(given.get(name, self.value(name)))
                if number.ndim == 1 and len(number) != rows:
                    raise InputError(f"{name} has shape {number.shape}, allowed: a number or ({rows},)")
                column = np.broadcast_to(number, (rows,))[part, None]
                found[key[2]] = Dual(column, own[name]) if name in own else column
        return found

    def checked(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Values by canonical name, inside their allowed range."""
        found = {}
        for written, value in values.items():
            row = self.parameters[written]
            _, effect, own = self._behind[row.name]
            low, high = EFFECTS[effect].parameter(own).allowed
            array = checks.as_floats(row.name, value)
            wrong = ~((array >= low) & (array <= high))
            if array.ndim > 1 or wrong.any():
                shown = f"{array[wrong].flat[0]:g}" if wrong.any() else shorten(value)
                raise InputError(f"{row.name} = {shown} is not usable (allowed: {low:g} to {high:g} {row.unit})")
            found[row.name] = float(array) if array.ndim == 0 else array
        return found


def _pair(entry: Any) -> tuple[str, str]:
    if not isinstance(entry, (tuple, list)) or len(entry) != 2:
        raise InputError(f"effects contains {shorten(entry)} (allowed: pairs of effect id and channel)")
    effect = choose("sensor effect", entry[0], EFFECTS)
    return effect, choose(f"channel of {effect}", entry[1], EFFECTS[effect].info.channels)


def _seed(seed: Any) -> tuple[int, ...]:
    listed: Iterable[Any] = seed if isinstance(seed, (tuple, list)) else [seed]
    return tuple(checks.whole("seed", item, 0, checks.MAX_SEED) for item in listed)


def _padded(channel: str, slopes: Any, shape: tuple[int, ...], directions: int) -> Floats:
    """Slopes of a signal along all directions; 0 along those that are not given."""
    padded = np.zeros((*shape, directions))
    if slopes is not None:
        along = checks.as_floats(f"slopes[{channel!r}]", slopes)
        if along.shape[:-1] != shape:
            raise InputError(f"slopes[{channel!r}] has shape {along.shape}, allowed: {shape} and the directions")
        padded[..., : along.shape[-1]] = along
    return padded


def _directions(slopes: Mapping[str, Any]) -> int:
    counts = {np.shape(along)[-1:] for along in slopes.values()}
    if len(counts) > 1:
        raise InputError(f"slopes run along {sorted(n for (n,) in counts)} directions (allowed: one number of them)")
    return max((n for (n,) in counts), default=0)
