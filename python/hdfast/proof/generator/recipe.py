"""What a case is to hold, and the bench it is recorded on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Bench:
    """Conditions of the recordings.

    Attributes:
        motor_only: without a load side.
        programme: "varied", "poor" (one manoeuvre only, which lets a refit swallow much), "one_way" (never reversed)
            or "steady" (plateaus).
        load: "any", "constant" or "none".
        warm: True when the temperature must vary between recordings.
        noise: factor on the noise of every sensor.
        stiff: True with a fast position loop.
        fast: True for speeds at which lines pass half the sampling rate.
        seconds: shortest and longest recording.
        recordings: fewest and most of them.
    """

    motor_only: bool = False
    programme: str = "varied"
    load: str = "any"
    warm: bool = False
    noise: float = 1.0
    stiff: bool = False
    fast: bool = False
    seconds: tuple[float, float] = (3.0, 8.0)
    recordings: tuple[int, int] = (4, 8)


@dataclass(frozen=True)
class Recipe:
    """What a case is to hold.

    Attributes:
        kinds: stratum, then ways of concealment.
        effects: effect id -> amplitude in detectable amplitudes.
        seed: of every draw.
        bench: conditions of the recordings.
        like: the recipe of a case with effects that everything but these is drawn for, of a case without any: neither
            the bench nor the sensors may say which of the two it is.
    """

    kinds: tuple[str, ...]
    effects: Mapping[str, float]
    seed: int
    bench: Bench = field(default_factory=Bench)
    like: Recipe | None = None

    @property
    def model(self) -> Recipe:
        """The recipe that bench, sensors and motion are drawn for."""
        return self.like or self
