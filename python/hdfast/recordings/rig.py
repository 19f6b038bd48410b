"""What a campaign says of the controller of the rig."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from hdfast import checks
from hdfast.errors import choose
from hdfast.sections import Sections

CONTROLLERS = ("pi",)


@dataclass(frozen=True)
class Controller:
    """The speed controller of the motor, tau = kp e + ki integral of e within +-limit.

    Attributes:
        kind: "pi".
        kp: proportional gain [N m s/rad].
        ki: integral gain [N m/rad].
        limit: torque limit [N m].
        period: time between two outputs [s]; 0 is continuous.
    """

    kind: str
    kp: float
    ki: float = 0.0
    limit: float = math.inf
    period: float = 0.0


def read_controller(file: Sections) -> Controller | None:
    """Read [controller]; None when the file has none."""
    section = file.section("controller")
    if not section:
        return None
    path = ("controller",)
    file.known(path, section, [item.name for item in fields(Controller)])
    for key in ("kind", "kp"):
        if key not in section:
            raise file.error(path, f"[controller] needs the key {key!r}")
    kind = file.guard((*path, "kind"), choose, "kind", section["kind"], CONTROLLERS)
    gains = {
        key: file.guard((*path, key), checks.number, key, value, 0.0, math.inf if key == "limit" else 1e9)
        for key, value in section.items()
        if key != "kind"
    }
    return Controller(kind, **gains)
