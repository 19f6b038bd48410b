"""The article's studies, one per module: `study(drive, threads)` computes, `.report(folder)` writes the page."""

from collections.abc import Callable

from hdfast.studies import (
    damping,
    load_inertia,
    motor_inertia,
    speed,
    stiffness,
    transmission_error,
    validate,
)
from hdfast.studies.study import Study

STUDIES: dict[str, Callable[..., Study]] = {
    "speed": speed.study,
    "load-inertia": load_inertia.study,
    "motor-inertia": motor_inertia.study,
    "stiffness": stiffness.study,
    "damping": damping.study,
    "transmission-error": transmission_error.study,
    "validate": validate.study,
}

__all__ = ["STUDIES", "Study"]
