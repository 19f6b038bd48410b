"""A recording of a campaign, and the samples of it that health checks left usable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.recordings.clock import period

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Source:
    """Columns of a recording, its part in the campaign, and the samples that health checks left usable.

    Attributes:
        name: file name.
        recording: columns by name.
        role: "fit" or "heldout".
        group: label shared by recordings of one rig, day and temperature.
        good: which samples are usable.
        start: first time of the whole recording [s], of which these columns may be a part.
        news: new values per second of each column that holds its values for several samples.
        steps: smallest step by column, the larger of what is stated and what the values show.
    """

    name: str
    recording: Mapping[str, Floats]
    role: str
    group: str
    good: Mask
    start: float = 0.0
    news: Mapping[str, float] = field(default_factory=dict)
    steps: Mapping[str, float] = field(default_factory=dict)

    @property
    def rate(self) -> float:
        """How many samples per second say something new [Hz]."""
        return min([1.0 / period(self.recording["t"]), *self.news.values()])

    def numbers(self, column: str) -> tuple[Floats, Floats]:
        """Times [s] and values of the numbers of a column, each once where it holds them for several samples."""
        known = np.isfinite(self.recording[column])
        t, values = self.recording["t"][known], self.recording[column][known]
        held = max(1, round(1.0 / (period(t) * self.news[column]))) if column in self.news else 1
        return t[::held], values[::held]


def fitted(sources: Sequence[Source]) -> list[Source]:
    """Those that are not held out."""
    return [source for source in sources if source.role == "fit"]
