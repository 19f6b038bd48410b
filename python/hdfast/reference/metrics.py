"""Metrics of one trajectory, straight from their definitions (the model's section on metrics)."""

import math
from collections.abc import Callable
from fractions import Fraction
from functools import cached_property, partial
from itertools import pairwise

from .fit import solve
from .integrate import FLOORS, Trajectory
from .mode import fit_mode
from .search import Scan, integrals, peak, root
from .signals import output_speed, transmission_error, windup_rate
from .stepper import Vector

PHASES = ["start", "run", "stop"]
TURN = 1.0 - 1e-9  # a whole turn, but for rounding
STANDING = 1e-6  # a mean speed up to this share of the largest one plus its floor is rounding
LOSSES = ["loss_motor", "loss_wave_generator", "loss_load", "loss_mesh"]


class Metrics:
    """Every metric of a trajectory by name, `metrics[name]`; NaN where the definition has no value."""

    def __init__(self, run: Trajectory) -> None:
        self.run, self.problem, self.drive = run, run.problem, run.drive
        self.scan = Scan(run)
        p = self.problem
        self.table: dict[str, Callable[[], float]] = {
            "steady_speed": lambda: self.steady["omega_m"],
            "rise_time": lambda: span(*self.rise("omega_m")[::2]),
            "rise_time_load": lambda: span(*self.rise("omega_l")[::2]),
            "dead_time": lambda: self.rise("omega_m")[0] - p.t_on,
            "rise_shape": lambda: shape(self.rise("omega_m")),
            "stop_time": lambda: span(*self.stop("omega_m")[::2]),
            "stop_time_load": lambda: span(*self.stop("omega_l")[::2]),
            "stop_shape": lambda: shape(self.stop("omega_m")),
            "peak_windup": lambda: self.scan.largest_size("windup", 0.0, p.t_end),
            "initial_te_peak": lambda: self.scan.largest_size("windup", p.t_on, min(p.t_on + 0.5, p.t_end)),
            "speed_ripple": lambda: self.peak_to_peak("omega_l", "run"),
            "speed_ripple_rms": lambda: self.deviation("run", 1),
            "residual_ring": self.residual_ring,
            "loss_terms": lambda: 0.0,
            "energy_residual": self.energy_residual,
            "time_outside_range": self.time_outside_range,
            "upsilon_min": self.upsilon_min,
        }
        for phase in PHASES:
            suffix = "" if phase == "run" else f"_{phase}"
            self.table[f"te_mean{suffix}"] = partial(self.mean, phase, 0)
            self.table[f"te_peak{suffix}"] = partial(self.te_peak, phase)
            self.table[f"te_pp{suffix}"] = partial(self.peak_to_peak, "te", phase)
            self.table[f"te_rms{suffix}"] = partial(self.deviation, phase, 0)
        for k, name in enumerate(["energy_in", *LOSSES]):
            for phase in ["all", *PHASES]:
                self.table[name if phase == "all" else f"{name}_{phase}"] = partial(self.work, phase, k)
        for k, name in enumerate(["mode_frequency", "mode_decay", "mode_amplitude"]):
            for event in ("start", "stop"):
                self.table[f"{name}_{event}"] = partial(self.mode, event, k)

    def __getitem__(self, name: str) -> float:
        if self.run.status != "finished":
            return math.nan
        for prefix, k in (("speed_order_", 1), ("order_", 0)):
            if name.startswith(prefix):
                return self.order_amplitude(name.removeprefix(prefix), k)
        if name not in self.table:
            raise ValueError(
                f"metric must be one of {', '.join(self.table)}, order_<o> or speed_order_<o>, got {name!r}"
            )
        return self.table[name]()

    @cached_property
    def phases(self) -> dict[str, tuple[float, float]]:
        """Start and end [s] of every phase."""
        p = self.problem
        return {"start": (p.t_on, p.run_start()), "run": (p.run_start(), p.t_off), "stop": (p.t_off, p.t_end)}

    @cached_property
    def moments(self) -> dict[str, Vector]:
        """Per phase: duration, then mean and mean square deviation of transmission error and output speed."""
        table = {}
        for phase, (a, b) in self.phases.items():
            base = self.read(0.5 * (a + b))
            sums = self.integrals(lambda t, base=base: offsets(self.read(t), base), a, b)  # type: ignore[misc]
            table[phase] = [b - a, *base, *sums] if sums else []
        return table

    def read(self, t: float) -> Vector:
        y = self.run.at(t)[0]
        return [transmission_error(self.drive, y), output_speed(self.drive, y)]

    def integrals(self, integrand: Callable[[float], Vector], a: float, b: float) -> Vector:
        return integrals(self.run, integrand, a, b)

    def mean(self, phase: str, signal: int) -> float:
        m = self.moments[phase]
        return m[1 + signal] + m[3 + signal] / m[0] if m else math.nan

    def deviation(self, phase: str, signal: int) -> float:
        """Root mean square about the mean."""
        m = self.moments[phase]
        if not m:
            return math.nan
        return math.sqrt(max(0.0, m[5 + signal] / m[0] - (m[3 + signal] / m[0]) ** 2))

    def te_peak(self, phase: str) -> float:
        a, b = self.phases[phase]
        return self.scan.largest_size("te", a, b) if b > a else math.nan

    def peak_to_peak(self, name: str, phase: str) -> float:
        a, b = self.phases[phase]
        return self.scan.largest(name, a, b) - self.scan.smallest(name, a, b) if b > a else math.nan

    @cached_property
    def whole_revolutions(self) -> tuple[float, float] | None:
        """The shortest window ending at t_off that holds whole input revolutions and lasts 0.5 s or more."""
        t_on, t_off = self.problem.t_on, self.problem.t_off
        if not t_off > t_on:
            return None
        angle = self.run.at(t_off)[0][0]
        latest = t_off - 0.5
        if latest < t_on:
            return None
        turns = math.ceil(abs(angle - self.run.at(latest)[0][0]) / (2 * math.pi) - 1e-12)
        wanted = 2 * math.pi * max(turns, 1)

        def missing(t: float) -> float:
            return wanted - abs(angle - self.run.at(t)[0][0])

        times = [latest] + [t for t in reversed(self.scan.times) if t_on <= t < latest]
        for late, early in pairwise(times):
            if missing(early) <= 0.0:
                return root(missing, early, late), t_off
        return None

    @cached_property
    def steady(self) -> dict[str, float]:
        """Means of both speeds over whole revolutions, or over the run phase where there are none."""
        a, b = self.whole_revolutions or self.phases["run"]
        if not b > a:
            return {"omega_m": math.nan, "omega_l": math.nan}

        def speeds(t: float) -> Vector:
            y = self.run.at(t)[0]
            return [y[1], output_speed(self.drive, y)]

        motor, load = self.integrals(speeds, a, b)
        return {"omega_m": motor / (b - a), "omega_l": load / (b - a)}

    def rise(self, name: str) -> Vector:
        """First times after t_on at which the speed passes 5, 50 and 95 % of its steady mean."""
        return self.passages(name, self.problem.t_on, self.problem.t_off, upward=True)

    def stop(self, name: str) -> Vector:
        """Times after t_off of the first fall below 95 % and 50 % and the last fall below 5 % of the steady mean."""
        return self.passages(name, self.problem.t_off, self.problem.t_end, upward=False)

    def passages(self, name: str, a: float, b: float, upward: bool) -> Vector:
        level = self.steady[name]
        if not b > a or math.isnan(level) or self.stands(name):
            return [math.nan] * 3
        shares = (0.05, 0.5, 0.95) if upward else (0.95, 0.5, 0.05)
        found = [self.scan.crossings(name, share * level, a, b, upward == (level > 0.0)) for share in shares]
        ends = [0, 0, 0 if upward else -1]
        return [times[end] if times else math.nan for times, end in zip(found, ends, strict=True)]

    def stands(self, name: str) -> bool:
        """Whether the steady mean of a speed is no more than rounding."""
        gear = 1.0 if name == "omega_m" else abs(self.drive.ratio)
        size = max(map(abs, self.scan.columns[name])) + FLOORS["omega_m"] / gear
        return abs(self.steady[name]) <= STANDING * size

    def residual_ring(self) -> float:
        """Root mean square over the ring window, or the part of it before the end."""
        p = self.problem
        a = p.t_off + p.ring_delay
        b = min(a + p.ring_width, p.t_end)
        if not a < b:
            return math.nan

        def square(t: float) -> Vector:
            y = self.run.at(t)[0]
            return [(output_speed(self.drive, y) if p.ring_on_load else windup_rate(self.drive, y)) ** 2]

        return math.sqrt(self.integrals(square, a, b)[0] / (b - a))

    def powers(self, t: float) -> Vector:
        """Power put in, then lost in motor, wave generator, load and mesh [W]."""
        drive, (y, segment) = self.drive, self.run.at(t)
        tau, (motor, load) = drive.motor_torque(t, y, segment)[0], (y[1], output_speed(drive, y))
        return [
            tau * motor - segment.load_at(t) * load,
            drive.B_m * motor**2,
            drive.B_ml * (motor - drive.s * load) ** 2,
            drive.B_l * load**2,
            drive.B_sp * windup_rate(drive, y) ** 2,
        ]

    @cached_property
    def works(self) -> dict[str, Vector]:
        """Integrals of `powers` over every phase, from t_on to the end, and before t_on [J]."""
        windows = {**self.phases, "before": (0.0, self.problem.t_on)}
        table = {phase: self.integrals(self.powers, a, b) or [0.0] * 5 for phase, (a, b) in windows.items()}
        table["all"] = [sum(values) for values in zip(*(table[phase] for phase in PHASES), strict=True)]
        return table

    def work(self, phase: str, which: int) -> float:
        return self.works[phase][which]

    def energy_residual(self) -> float:
        put_in, *lost = map(sum, zip(self.works["before"], self.works["all"], strict=True))
        before, after = self.drive.energy(self.run.start), self.drive.energy(self.run.end)
        exchanged = max(abs(put_in), sum(lost), before, after)
        return abs(after - before - put_in + sum(lost)) / exchanged if exchanged else 0.0

    def time_outside_range(self) -> float:
        if self.drive.rigid or self.problem.spring != "polynomial":
            return 0.0
        return self.scan.time_above("windup", self.problem.parameters["phi_max"], 0.0, self.problem.t_end)

    def upsilon_min(self) -> float:
        """Smallest local ratio over one period of the kinematic error."""
        turns = math.lcm(*(Fraction(o).limit_denominator(1000).denominator for o in self.problem.orders))
        looks = 24 * turns * max(1, math.ceil(max(self.problem.orders, default=1.0)))
        grid = [2 * math.pi * turns * k / looks for k in range(-1, looks + 1)]
        values = [-self.drive.local_ratio(theta) for theta in grid]
        best = max(values)
        margin = 0.02 * (best - min(values))
        for a, v, b in zip(range(looks), range(1, looks + 1), range(2, looks + 2), strict=True):
            if values[v] >= best - margin and values[v] >= values[a] and values[v] >= values[b]:
                best = max(best, peak(lambda theta: -self.drive.local_ratio(theta), grid[a], grid[b]))
        return -best

    def order_amplitude(self, label: str, signal: int) -> float:
        """Least-squares amplitude of one order against the motor angle over whole revolutions.

        The orders of the kinematic error that turn at least once in the window are fitted along: they do not leak.
        NaN where the wanted order does not turn once, or not once more or less than another of these.
        """
        if self.whole_revolutions is None:
            return math.nan
        numerator, _, denominator = label.partition("/")
        wanted = float(numerator) / float(denominator or 1)
        a, b = self.whole_revolutions
        revolutions = round(abs(self.run.at(b)[0][0] - self.run.at(a)[0][0]) / (2 * math.pi))
        others = [order for order in self.problem.orders if order != wanted]
        if any(abs(order - wanted) * revolutions < TURN for order in [0.0, *others]):
            return math.nan
        known = [order for order in others if order * revolutions >= TURN]
        size = 2 * len(known) + 3

        def products(t: float) -> Vector:
            y = self.run.at(t)[0]
            waves = [(math.cos(order * y[0]), math.sin(order * y[0])) for order in (wanted, *known)]
            columns = [1.0, *(value for wave in waves for value in wave), self.read(t)[signal]]
            return [abs(y[1]) * u * v for u in columns for v in columns]

        sums = self.integrals(products, a, b)
        rows = [sums[k * (size + 1) : (k + 1) * (size + 1)] for k in range(size)]
        _, cosine, sine, *_ = solve([row[:size] for row in rows], [row[size] for row in rows])
        return math.hypot(cosine, sine)

    @cached_property
    def modes(self) -> dict[str, tuple[float, float, float]]:
        """Frequency [Hz], decay [1/s] and output-speed amplitude [rad/s] of the mode after t_on and after t_off."""
        p = self.problem
        return {"start": fit_mode(self.run, p.t_on, p.t_off), "stop": fit_mode(self.run, p.t_off, p.t_end)}

    def mode(self, event: str, part: int) -> float:
        return self.modes[event][part]


def offsets(values: Vector, base: Vector) -> Vector:
    """Deviations from `base` and their squares, which keeps the variance free of cancellation."""
    steps = [value - b for value, b in zip(values, base, strict=True)]
    return steps + [step * step for step in steps]


def shape(passages: Vector) -> float:
    """First part over second part: 0.28 for an exponential, 1 for a straight line."""
    first, middle, last = passages
    return span(first, middle) / span(middle, last)


def span(start: float, end: float) -> float:
    """Time from one to another; NaN where that comes first: a speed that goes up and down has no rise and no fall."""
    return math.nan if end < start else end - start
