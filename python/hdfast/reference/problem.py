"""One row to simulate, spelled out in plain numbers."""

import math
from dataclasses import dataclass

POLYNOMIAL = ["k1", "k2", "k3", "k4", "k5", "phi_max"]
PIECEWISE = ["K1", "K2", "K3", "T1", "T2"]
POSITIVE = ["J_m", "J_l", "tau_max"]
MAX_ANGLE = 1e9
ROUNDING = 1e-12  # revolutions fill a motion that is shorter by no more than this share
GAINS = ["K_p", "K_i"]
NOT_NEGATIVE = ["B_m", "B_l", "B_ml", "B_sp", "s", *GAINS]
SMALLEST_GAIN = 1e-12


@dataclass(frozen=True)
class Problem:
    """Everything that decides one trajectory; SI units throughout.

    Attributes:
        parameters: every parameter of the drive and the scenario columns by name.
        orders: orders of the kinematic error in cycles per motor revolution.
        labels: the names by which parameters carry them ("2", "120/121").
        segments: rows of 21 numbers, see `inputs.read_segments`.
        t_end: end of the run [s].
        t_on: start of the motion [s].
        t_off: start of the stop [s].
        t_run: start of the run phase [s]; NaN takes whole revolutions of the set speed.
        ring_delay: from t_off to the window of the residual ring [s].
        ring_width: length of that window [s].
        ring_on_load: read the ring on the output speed instead of the windup rate.
        base: "two_inertia" or "one_inertia".
        spring: "polynomial" or "piecewise".
        initial: "relaxed" or "zero_angle".
        initial_state: (theta_m, omega_m, theta_l, omega_l[, z]) instead; (theta_m, omega_m[, z]) with one inertia.
    """

    parameters: dict[str, float]
    orders: list[float]
    labels: list[str]
    segments: list[list[float]]
    t_end: float
    t_on: float = 0.0
    t_off: float = math.nan
    t_run: float = math.nan
    ring_delay: float = 1.5
    ring_width: float = 1.4
    ring_on_load: bool = False
    base: str = "two_inertia"
    spring: str = "polynomial"
    initial: str = "relaxed"
    initial_state: list[float] | None = None

    def run_start(self) -> float:
        """Start of the run phase [s]: the last whole revolutions at set speed before t_off that last 0.5 s or more."""
        if not math.isnan(self.t_run):
            return self.t_run
        revolution = 2 * math.pi / abs(self.parameters["omega_set"]) if self.parameters["omega_set"] else math.inf
        whole = math.ceil(0.5 / revolution) * revolution if revolution < math.inf else math.inf
        if whole * (1.0 - ROUNDING) <= self.t_off - self.t_on:
            return max(self.t_on, self.t_off - whole)
        return 0.5 * (self.t_on + self.t_off)

    def marks(self) -> list[float]:
        """Times [s] a step must end at: segment starts and the ends of all phases and windows."""
        ring = self.t_off + self.ring_delay
        times = [segment[0] for segment in self.segments]
        times += [self.t_on, self.t_on + 0.5, self.run_start(), self.t_off, ring, ring + self.ring_width, self.t_end]
        return sorted({t for t in times if 0.0 < t <= self.t_end})

    def impossible(self) -> str:
        """Name of a parameter that makes the row meaningless; empty where there is none."""
        p = self.parameters
        for name, value in p.items():
            if not math.isfinite(value) and not (name == "tau_max" and value == math.inf):
                return name
        if p["ratio"] == 0.0:
            return "ratio"
        massless = {"J_l"} if self.base == "one_inertia" else set()
        for name in POSITIVE:
            if p[name] < 0.0 or (p[name] == 0.0 and name not in massless):
                return name
        for name in NOT_NEGATIVE:
            if p[name] < 0.0 or (name in GAINS and 0.0 < p[name] < SMALLEST_GAIN):
                return name
        if abs(p["theta_m0"]) > MAX_ANGLE:
            return "theta_m0"
        return "" if self.base == "one_inertia" else self._impossible_spring()

    def _impossible_spring(self) -> str:
        p = self.parameters
        if self.spring == "piecewise":
            for name in PIECEWISE:
                if p[name] <= (p["T1"] if name == "T2" else 0.0):
                    return name
            return ""
        if p["phi_max"] <= 0.0:
            return "phi_max"
        if p["k1"] <= 0.0:
            return "k1"
        for look in range(-512, 513):
            x = p["phi_max"] * look / 512
            if sum(n * p[f"k{n}"] * x ** (n - 1) for n in range(1, 6)) <= 0.0:
                return "phi_max"
        return ""
