"""Whether the recordings resolve what a fitted effect claims to see near standstill, or to repeat."""

from __future__ import annotations

import math

import numpy as np

from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.fitted import Fit
from hdfast.diagnosis.replay import Replay
from hdfast.terms import terms

SAMPLES = 3.0
REPEATED = 2.0
NEAR_STANDSTILL = 0.1
#: Of the narrowest gap that the catalogue calls plausible, so much is the narrowest that is one.
NARROWEST = 0.3


def unresolved(candidate: Candidate, fitted: Fit, replay: Replay) -> bool:
    """True where a filter of the recording's band, or a slow curve, would look the same as the effect.

    A bristle has to take longer to bend than the band's slowest rise, and to give way within the motion, or it is a
    spring; a falling friction law has to reach beyond the speeds whose direction is uncertain; a ripple of the torque
    has to be seen to repeat. A gap of a fraction of an arc second is a bend of the spring that every drive has, and
    within one step of the motor's angle is where rounding leaves the load.
    """
    effect = candidate.effect
    if effect == "backlash":
        plausible = next(one.low for one in terms()[effect].parameters if one.name == "half_gap")
        coarsest = max(unit.step / abs(unit.ratio) for unit in replay.plant.units)
        return fitted.value("backlash_half_gap") < max(NARROWEST * plausible, coarsest)
    travel = max(float(np.ptp(unit.angle)) for unit in replay.plant.units)
    if effect == "torque_ripple" and candidate.order is not None:
        return candidate.order * travel < REPEATED * 2.0 * math.pi
    if effect == "presliding_friction":
        angle = fitted.value(f"{effect}_T_c") / fitted.value(f"{effect}_sigma_0")
        return angle > travel or math.sqrt(2.0 * angle / _acceleration(replay)) < SAMPLES / replay.plant.band.motion
    if effect == "stribeck_friction":
        slow = [
            float(np.min(np.abs(unit.speed[unit.judged["motor_torque"]]), initial=np.inf))
            for unit in replay.plant.units
        ]
        return fitted.value(f"{effect}_omega_s") < min(slow)
    return False


def _acceleration(replay: Replay) -> float:
    """Typical acceleration of the motor where it is slow [rad/s^2]."""
    found = []
    for unit in replay.plant.units:
        slow = np.abs(unit.speed) < NEAR_STANDSTILL * float(np.max(np.abs(unit.speed)))
        found.append(np.abs(unit.acceleration[slow]))
    together = np.concatenate(found)
    return max(float(np.quantile(together, 0.75)), 1e-9) if together.size else 1e-9
