"""What there is to know of a file before it is run."""

from __future__ import annotations

from hdfast.config import Config
from hdfast.simulate import simulate

EQUAL_ROWS = (
    "hdfast: note: the file has no [tolerance.<name>], so all rows are the same drive; "
    "sigma in [drive] is prior knowledge for fits, not a spread"
)
STILL = (
    "hdfast: note: the nominal drive never moves: its friction holds the motor torque of the start; "
    '[scenario] start = "speed_ramp", or a larger torque, moves it'
)


def notes_on_rows(settings: Config) -> list[str]:
    """Lines about a file whose drives are to vary."""
    return [*([] if settings.tolerances else [EQUAL_ROWS]), *notes_on_drive(settings)]


def notes_on_drive(settings: Config) -> list[str]:
    """Lines about the nominal drive of a file: whether a torque that is to start it does."""
    if not settings.scenario.name.startswith("start_stop(torque_step") or settings.scenario.values["omega_set"] == 0.0:
        return []
    found = simulate(settings.drive, model=settings.model, scenario=settings.scenario)
    return [STILL] if found.metrics["steady_speed"] == 0.0 else []
