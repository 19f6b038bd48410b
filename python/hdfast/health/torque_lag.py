"""Motor torque against motor angle: a torque makes its motion, and neither follows it nor is far ahead of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from hdfast.checks import Floats
from hdfast.health.alignment import FEWEST, LARGEST_LAG, PER_WINDOW
from hdfast.health.finding import REJECT, WARNING
from hdfast.health.motion import Motion
from hdfast.health.rigid import laws
from hdfast.health.subject import Subject

NAME = "torque_lag"
LATE, LEAST = 0.05, 0.01
SPACING = 2.5e-3
LONGEST_SHARE = 6
#: Shares of the torque's variance: left at once at least, left at the lag at most, the second of the first at most.
UNEXPLAINED, EXPLAINED, FALL = 5e-3, 0.1, 0.2
NOTHING = 1e-12
AGAINST = float(np.log(2.0))


@dataclass(frozen=True)
class Torque:
    """A motor torque that a rigid drive is held against.

    Attributes:
        motion: the recording.
        used: (m,) samples that are compared.
        explained: (m, p) orthonormal columns of what a rigid drive explains.
        power: variance of the torque at once [N^2 m^2].
        reach: the largest lag that the recording is long enough for [s].
    """

    motion: Motion
    used: NDArray[np.intp]
    explained: Floats
    power: float
    reach: float

    @classmethod
    def of(cls, motion: Motion, ratio: float | None) -> Torque | None:
        """None where there is too little motion."""
        samples = len(motion.t)
        reach = min(round(LARGEST_LAG / motion.step), samples // LONGEST_SHARE)
        thin = max(1, round(motion.width / motion.step / PER_WINDOW))
        used = reach + np.flatnonzero(motion.valid[reach : samples - reach])[::thin]
        power = float(np.var(motion.torque[used])) if len(used) else 0.0
        if motion.moving.sum() < FEWEST or len(used) < FEWEST or not power > 0.0:
            return None
        explained, _ = np.linalg.qr(laws(motion, ratio)[used])
        return cls(motion, used, explained, power, reach * motion.step)

    def read(self, late: float) -> Floats:
        """The torque (m,) so much later, at most by `reach` [s]."""
        late = min(max(late, -self.reach), self.reach)
        return np.interp(self.motion.t[self.used] + late, self.motion.t, self.motion.torque)

    def left(self, late: float) -> float:
        """Variance of the torque so much later that is not explained [N^2 m^2]."""
        torque = self.read(late)
        return NOTHING * self.power + float(np.var(torque - self.explained @ (self.explained.T @ torque)))

    @cached_property
    def now(self) -> float:
        """What is not explained at once [N^2 m^2]."""
        return self.left(0.0)

    @property
    def elsewhere(self) -> bool:
        """Whether the torque is explained at some lag and far less at once."""
        if self.now <= UNEXPLAINED * self.power:
            return False
        return any(
            self.left(late) < min(FALL * self.now, EXPLAINED * float(np.var(self.read(late)))) for late in lags()
        )

    def change(self, late: float) -> float:
        """Logarithm of what a lag leaves over what is unexplained at once; at most AGAINST, which refuses the lag."""
        return min(float(np.log(self.left(late) / self.now)), AGAINST)


def lags() -> Floats:
    """The lags that are tried [s]."""
    return np.arange(-LARGEST_LAG, LARGEST_LAG, SPACING)


def check(subjects: Sequence[Subject]) -> None:
    """Reject where torque and motion are further apart than any actuator is late, and warn of a torque that follows.

    One recorder writes all recordings: where some of them show a lag, which it is is asked of all, and it is told of
    each that does not speak against it.
    """
    torques = [Torque.of(subject.motion, subject.ratio) for subject in subjects]
    seen = [torque for torque in torques if torque is not None]
    if not any(torque.elsewhere for torque in seen):
        return
    late = _shared(seen)
    for subject, torque in zip(subjects, torques, strict=True):
        if torque is None or torque.change(late) < AGAINST:
            _tell(subject, late)


def _shared(torques: Sequence[Torque]) -> float:
    """The lag [s] that explains all torques together best."""

    def change(late: float) -> float:
        return sum(torque.change(late) for torque in torques)

    best = min(lags(), key=change)
    bounds = (best - SPACING, best + SPACING)
    return float(scipy.optimize.minimize_scalar(change, bounds=bounds, method="bounded").x)


def _tell(subject: Subject, seen: float) -> None:
    late = seen - subject.stated_lag("motor_torque")
    apart = f"the motion that it makes by {1e3 * abs(seen):.3g} ms"
    if late >= max(LEAST, 2.0 / subject.facts.rate_hz):
        sentence = f"motor_torque follows {apart}; state delay_s = {seen:.3g} in [sensors] motor_torque"
    elif late < -LATE:
        sentence = (
            f"motor_torque precedes {apart}, further than an actuator is late; "
            f"state delay_s = {-seen:.3g} in [sensors] motor_angle, and of what was recorded with it"
        )
    else:
        return
    remedy = f"{sentence}, or record both on one clock"
    subject.find(NAME, REJECT if abs(late) > LATE else WARNING, remedy, value=late, limit=LATE)
