"""The adaptive integration of one row from start to end, kept whole as a trajectory."""

import math
from dataclasses import dataclass, field

from .drive import Drive
from .inputs import MOTION, NOTHING, SPEED, Segment, read_segments
from .methods import METHODS
from .problem import Problem
from .stepper import Attempt, Dense, Slope, Vector, attempt, dense_output, error_norm, position

FLOORS = {"theta_m": 0.1, "omega_m": 0.1, "te": 1e-5, "omega_l": 0.1, "z": 0.01}
SAFETY, SHRINK, GROW = 0.9, 0.2, 6.0


@dataclass
class Trajectory:
    """Accepted steps of one row and how it ended."""

    problem: Problem
    drive: Drive
    start: Vector
    first_segment: Segment
    steps: list[Dense] = field(default_factory=list)
    segments: list[Segment] = field(default_factory=list)
    end: Vector = field(default_factory=list)
    time: float = 0.0
    status: str = "finished"
    rejected: int = 0
    starts: list[float] = field(default_factory=list)

    def at(self, t: float) -> tuple[Vector, Segment]:
        """State and active input at `t`; at a jump of the input, the values before it."""
        if not self.steps or t <= 0.0:
            return self.start, self.first_segment
        k = position(self.starts, t)
        return self.steps[k].at(t), self.segments[k]


class Tolerance:
    """Scales of the local error, one per state.

    The motor angle grows without bound and counts absolutely; the transmission error counts by the size of the windup.
    """

    def __init__(self, drive: Drive, rtol: float, atol: float) -> None:
        scaled = {**FLOORS, "omega_l": FLOORS["omega_l"] / abs(drive.ratio)}
        names = ["theta_m", "omega_m", "z"] if drive.rigid else list(FLOORS)
        self.drive, self.rtol = drive, rtol
        self.floors = [atol * scaled[name] for name in names]

    def sizes(self, y: Vector) -> Vector:
        sizes = [0.0, *map(abs, y[1:])]
        if not self.drive.rigid:
            sizes[2] = abs(y[2] - self.drive.kinematic_error(y[0])[0])
        return sizes

    def scales(self, a: Vector, b: Vector) -> Vector:
        pairs = zip(self.floors, self.sizes(a), self.sizes(b), strict=True)
        return [self.rtol * (floor + max(x, y)) for floor, x, y in pairs]


def holding_torque(problem: Problem, drive: Drive, theta: float, segment: Segment) -> float:
    """Motor torque [N m] that holds the load torque of the start there; a start from zero angles holds nothing."""
    if problem.initial_state is None and problem.initial == "zero_angle":
        return 0.0
    return drive.local_ratio(theta) * segment.load_at(0.0)


def initial_state(problem: Problem, drive: Drive, segment: Segment) -> Vector:
    """State at t = 0; a drive that starts with a prescribed motion starts moving as a rigid gear."""
    if problem.initial_state is not None:
        return given_state(drive, problem.initial_state)
    zero_angle = problem.initial == "zero_angle"
    theta, omega = 0.0 if zero_angle else problem.parameters["theta_m0"], 0.0
    if segment.kind == MOTION:
        theta, omega, _ = segment.motion_at(0.0)
    z = 0.0
    if segment.kind == SPEED and drive.controller.K_i:
        z = holding_torque(problem, drive, theta, segment) / drive.controller.K_i
    if drive.rigid:
        return [theta, omega, z]
    te = 0.0 if zero_angle else drive.kinematic_error(theta)[0] + drive.windup_under(segment.load_at(0.0))
    return [theta, omega, te, drive.local_ratio(theta) * omega, z]


def given_state(drive: Drive, given: Vector) -> Vector:
    """State from (theta_m, omega_m, theta_l, omega_l[, z]), or (theta_m, omega_m[, z]) with one inertia."""
    if drive.rigid:
        theta, omega, *z = given
        return [theta, omega, *(z or [0.0])]
    theta, omega, theta_l, omega_l, *z = given
    return [theta, omega, theta / drive.ratio - theta_l, omega_l, *(z or [0.0])]


def enter(drive: Drive, y: Vector, t: float, segment: Segment, before: Segment | None) -> Vector:
    """State after a new input at `t`: an imposed motion takes the motor over, a bumpless controller its torque."""
    y = list(y)
    if segment.kind == MOTION:
        theta, omega, _ = segment.motion_at(t)
        if not drive.rigid:
            y[2] += (theta - y[0]) / drive.ratio
        y[0], y[1] = theta, omega
    if segment.kind == SPEED and segment.bumpless and before is not None:
        tau, _ = drive.motor_torque(t, y, before)
        y[-1] = drive.controller.bumpless(segment.reference_at(t) - y[1], tau, y[-1])
    return y


def guess_step(
    slope: Slope, t: float, y: Vector, first: Vector, tolerance: Tolerance, order: int, longest: float
) -> float:
    """First step size from the size of the first two derivatives (Hairer, Norsett, Wanner, section II.4)."""
    scales = tolerance.scales(y, y)

    def norm(v: Vector) -> float:
        scaled = [x / s for x, s in zip(v, scales, strict=True)]
        return math.sqrt(sum(x * x for x in scaled) / len(v))

    d0, d1 = norm(y), norm(first)
    h0 = 1e-6 if d0 < 1e-5 or d1 < 1e-5 else 0.01 * d0 / d1
    h0 = min(h0, longest)
    ahead = slope(t + h0, [a + h0 * b for a, b in zip(y, first, strict=True)])
    d2 = norm([b - a for a, b in zip(first, ahead, strict=True)]) / h0
    steepest = max(d1, d2)
    h1 = max(1e-6, 1e-3 * h0) if steepest <= 1e-15 else (0.01 / steepest) ** (1.0 / order)
    return min(100.0 * h0, h1, longest)


def looking_step(drive: Drive, y: Vector, segment: Segment) -> float:
    """Longest step [s] that sees the kinematic error of a rigid gear under imposed motion: no state depends on it."""
    if not drive.rigid or segment.kind != MOTION or not drive.series or y[1] == 0.0:
        return math.inf
    return 2.0 * math.pi / (8.0 * abs(y[1]) * max(order for order, _, _ in drive.series))


def finite(step: Attempt) -> bool:
    return all(map(math.isfinite, step.end)) and all(map(math.isfinite, step.slopes[-1]))


def advance(
    problem: Problem,
    method: str = "dop853",
    rtol: float = 1e-6,
    atol: float = 1.0,
    max_steps: int = 1_000_000,
    max_step: float = math.inf,
) -> Trajectory:
    """Integrate one row. Every mark of the problem is hit exactly; the local error per step stays below the scales."""
    pair = METHODS[method]
    drive = Drive(problem)
    if problem.impossible():
        state = [math.nan] * (3 if drive.rigid else 5)
        return Trajectory(problem, drive, state, NOTHING, end=state, status="bad_parameters")
    beginning = read_segments(problem.segments[:1], problem.parameters)[0]
    y = initial_state(problem, drive, beginning)
    segments = read_segments(problem.segments, problem.parameters, holding_torque(problem, drive, y[0], beginning))
    tolerance = Tolerance(drive, rtol, atol)
    alpha, beta = 0.7 / (pair.error_order + 1), 0.4 / (pair.error_order + 1)

    active = segments[0]
    y = enter(drive, y, 0.0, active, None)
    run = Trajectory(problem, drive, y, active, end=y)
    t, h, last_error = 0.0, math.nan, 1.0
    entered: Segment | None = None
    first: Vector = []

    for mark in problem.marks():
        following = [segment for segment in segments if segment.start <= t][-1]
        if following is not entered:
            if entered is not None:
                y = enter(drive, y, t, following, entered)
            entered = active = following

            def slope(time: float, state: Vector, segment: Segment = active) -> Vector:
                return drive.slope(time, state, segment)

            first = slope(t, y)
            h = guess_step(slope, t, y, first, tolerance, pair.order, min(mark - t, max_step))
            if not all(map(math.isfinite, first)) or not math.isfinite(h):
                run.status = "not_finite"
                return run
            last_error = 1.0

        rejected_before = False
        while t < mark:
            if len(run.steps) + run.rejected >= max_steps:
                run.status = "max_steps"
                return run
            if h < 16 * math.ulp(max(t, mark - t)):
                run.status = "step_too_small"
                return run
            wanted = min(h, max_step, looking_step(drive, y, active))
            reaches = t + 1.01 * wanted >= mark
            taken = mark - t if reaches else wanted
            step = attempt(pair, slope, t, y, first, taken)
            error = error_norm(pair, step, tolerance.scales(y, step.end)) if finite(step) else math.inf
            if not error <= 1.0:
                run.rejected += 1
                rejected_before = True
                h = taken * max(SHRINK, SAFETY * error ** -(1.0 / (pair.error_order + 1)))
                continue
            error = max(error, 1e-4)
            factor = min(GROW, max(SHRINK, SAFETY * error**-alpha * last_error**beta))
            h = taken * (min(factor, 1.0) if rejected_before else factor)
            if reaches and not rejected_before:
                h = max(h, wanted)
            last_error, rejected_before = error, False
            run.steps.append(dense_output(pair, slope, step))
            run.starts.append(t)
            run.segments.append(active)
            t = mark if reaches else t + taken
            y, first = step.end, step.slopes[-1]
            run.end, run.time = y, t
    return run
