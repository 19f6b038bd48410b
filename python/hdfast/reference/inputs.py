"""Inputs: motor torque, speed reference or motor motion, and load torque, all piecewise polynomials of time."""

import math
from dataclasses import dataclass

TORQUE, SPEED, MOTION = 0, 1, 2


@dataclass(frozen=True)
class Segment:
    """One row of the input table with this row's multipliers already applied; s = t - start.

    tau [N m], reference [rad/s] and load [N m] are value + slope * s; the imposed motion is
    theta_m = c0 + c1 s + c2 s^2 + c3 s^3 [rad].
    """

    start: float
    kind: int
    bumpless: bool
    tau: tuple[float, float]
    reference: tuple[float, float]
    load: tuple[float, float]
    motion: tuple[float, float, float, float]

    def tau_at(self, t: float) -> float:
        return self.tau[0] + self.tau[1] * (t - self.start)

    def reference_at(self, t: float) -> float:
        return self.reference[0] + self.reference[1] * (t - self.start)

    def load_at(self, t: float) -> float:
        return self.load[0] + self.load[1] * (t - self.start)

    def motion_at(self, t: float) -> tuple[float, float, float]:
        """Motor angle [rad], speed [rad/s] and acceleration [rad/s^2]."""
        s = t - self.start
        c0, c1, c2, c3 = self.motion
        return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + s * 3 * c3), 2 * c2 + 6 * c3 * s


ZERO = (0.0, 0.0)
NOTHING = Segment(0.0, TORQUE, False, ZERO, ZERO, ZERO, (0.0, 0.0, 0.0, 0.0))


def sustaining_torque(p: dict[str, float]) -> float:
    """Motor torque [N m] that holds the set speed against the viscous losses and the load."""
    i = p["ratio"]
    damping = p["B_m"] + p["B_ml"] * (1 - p["s"] / i) ** 2 + p["B_l"] / i**2
    return damping * p["omega_set"] + p["tau_load"] / i


def read_segments(rows: list[list[float]], p: dict[str, float], holding: float = 0.0) -> list[Segment]:
    """Segments of one row: absolute values plus multiples of sustaining and holding torque, set speed and load."""
    u0 = sustaining_torque(p)
    segments = []
    for (
        t0,
        kind,
        bumpless,
        tau,
        dtau,
        sus,
        dsus,
        hold,
        dhold,
        ref,
        dref,
        rel,
        drel,
        load,
        dload,
        loads,
        dloads,
        c0,
        c1,
        c2,
        c3,
    ) in rows:
        segments.append(
            Segment(
                start=t0,
                kind=int(kind),
                bumpless=bumpless != 0,
                tau=(tau + sus * u0 + hold * holding, dtau + dsus * u0 + dhold * holding),
                reference=(ref + rel * p["omega_set"], dref + drel * p["omega_set"]),
                load=(load + loads * p["tau_load"], dload + dloads * p["tau_load"]),
                motion=(c0, c1, c2, c3),
            )
        )
    return segments


@dataclass(frozen=True)
class Controller:
    """PI speed control with clipped torque and back-calculation into the integrator."""

    K_p: float
    K_i: float
    tau_max: float

    def torque(self, error: float, z: float) -> tuple[float, float]:
        """Motor torque [N m] and rate of the integrator [rad/s]."""
        wanted = self.K_p * error + self.K_i * z
        tau = min(max(wanted, -self.tau_max), self.tau_max)
        if self.K_p == 0.0 or math.isinf(self.tau_max):
            return tau, error
        return tau, error + (tau - wanted) / self.K_p

    def bumpless(self, error: float, tau: float, z: float) -> float:
        """Integrator state that makes the controller start at the torque `tau`."""
        return (tau - self.K_p * error) / self.K_i if self.K_i else z
