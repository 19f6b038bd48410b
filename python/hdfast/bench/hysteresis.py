"""A bench fixture: slip elements beside the spring, loaded quasi-statically.

The engine's hysteresis is Bouc-Wen. This Maxwell-slip loop (a row of springs that slip at equal forces) is another law
on purpose: the virtual stiffness test does not assume what is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hdfast import checks
from hdfast.checks import Floats

ELEMENTS = 8


@dataclass(frozen=True)
class SlipLoop:
    """Slip elements in parallel to the gear spring.

    Attributes:
        torque: torque of all elements when every one slips [N m].
        windup: windup from rest at which the last one begins to slip [rad].
    """

    torque: float = 2.0
    windup: float = 8e-5

    def __post_init__(self) -> None:
        checks.finite("hysteresis torque", self.torque, 0.0, 1e4, "N m")
        checks.positive("hysteresis windup", self.windup, 1.0, "rad")

    def along(self, path: Floats, stretch: Floats) -> tuple[Floats, Floats]:
        """Torque (n,) while the windup moves monotonically along `path` (n,), and the stretch at its end.

        Args:
            path: windup [rad].
            stretch: extension of each element at path[0] [rad], shape (ELEMENTS,).
        """
        yields = self.windup * np.arange(1, ELEMENTS + 1) / ELEMENTS
        force = self.torque / ELEMENTS
        extension = np.clip(stretch + (path - path[0])[:, None], -yields, yields)
        return np.asarray((extension / yields).sum(axis=1) * force), extension[-1]


def relaxed() -> Floats:
    """Elements without extension, shape (ELEMENTS,)."""
    return np.zeros(ELEMENTS)
