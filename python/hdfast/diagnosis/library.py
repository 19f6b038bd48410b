"""The hypotheses: every effect of the catalogue with the shapes worth trying on these recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from hdfast.diagnosis.candidate import Candidate
from hdfast.diagnosis.shapes import in_drive, in_every_sensor, in_sensor, multiple, phase, positive, signed

FRICTION = ("coulomb_friction", "stribeck_friction", "presliding_friction")
SLOWEST = 10.0
SLOTS, MOST_DETENTS = (12.0, 24.0, 36.0), 9
HIGHEST_INTEGER = 16
STIFFEST, STIFFEST_BASE, MOST_DAMPED = 15.0, 10.0, 100.0
PAYLOAD = 0.9
#: Weights that hold the load in a gap, in those that are looked for by themselves.
UNSEEN_WEIGHTS = (0.05, 0.15, 0.45)
#: Windup over which a loop builds up at least [rad], a tenth of what drives show: sharper ones take ever smaller steps.
SHARPEST = 1e-5
MOST_LINES = 26
#: Effects that a drive without windup does not have, and that the motor's side alone does not show.
OF_THE_WINDUP = (
    "hysteresis",
    "viscoelastic",
    "backlash",
    "soft_windup",
    "mesh_stiffness_variation",
    "te_load_dependence",
    "load_side_friction",
    "load_compliance",
    "base_compliance",
)
#: Effects of the sensor of the load angle.
OF_THE_LOAD_ANGLE = ("encoder_eccentricity", "clock_skew", "ratio_error")


@dataclass(frozen=True)
class Sizes:
    """What is large on these recordings.

    Attributes:
        motor_torque: spread of the motor torque [N m].
        speed: largest motor speed [rad/s].
        stiffness: K1 or k1 [N m/rad].
        ratio: reduction ratio, negative where the load turns against the motor.
        corner: band of the replayed motion [Hz].
        elastic: whether the gear's windup is simulated.
        loaded: whether a load torque is recorded.
        warm: whether temperatures are recorded.
        orders: orders the baseline already has.
        detents: order of a cogging torque that is there, or None.
        turns: motor revolutions of the longest recording.
        lines: orders per motor revolution at which the mismatch has lines.
        tones: frequencies at which it has lines [Hz].
        channels: recorded channels that are compared.
    """

    motor_torque: float
    speed: float
    stiffness: float
    ratio: float
    corner: float
    elastic: bool
    loaded: bool
    warm: bool
    orders: tuple[float, ...]
    detents: float | None
    turns: float
    lines: tuple[float, ...]
    tones: tuple[float, ...]
    channels: tuple[str, ...]

    @property
    def load_side(self) -> bool:
        """Whether a signal of the load side is compared."""
        return bool(set(self.channels) - {"motor_torque"})

    @property
    def output_torque(self) -> float:
        """The spread of the torque behind the gear [N m]."""
        return self.motor_torque * abs(self.ratio)

    @property
    def output_effect(self) -> float:
        """A typical torque of an effect behind the gear [N m]."""
        return 0.2 * self.output_torque

    @property
    def windup(self) -> float:
        """Windup under the spread of the torque [rad]."""
        return self.output_torque / self.stiffness

    @property
    def load_turn(self) -> float:
        """Order of a load turn per motor revolution, whichever way the load turns."""
        return 1.0 / abs(self.ratio)


def library(sizes: Sizes) -> list[Candidate]:
    """All candidates for recordings of these sizes.

    The motor's side alone shows a resonance and what rubs behind it; what else the windup does would be read from what
    a line or a drag at the motor does as well.
    """
    found = [*_friction(sizes), *_load(sizes), *_actuator(sizes), *_lines(sizes)]
    if sizes.elastic and sizes.load_side:
        found += _mesh(sizes)
    return found + _sensors(sizes)


def _friction(s: Sizes) -> list[Candidate]:
    level = 0.2 * s.motor_torque
    found = [
        in_drive("coulomb_friction", [positive("T_c", level, "N m")]),
        *(
            in_drive(
                "stribeck_friction",
                [
                    positive("T_c", level, "N m"),
                    positive("breakaway_ratio", 1.5, "1", sigma=0.3, low=1.0, high=5.0),
                    positive("omega_s", share * s.speed, "rad/s", sigma=0.7),
                ],
                shape=f"omega_s = {share:g} of the top speed",
                contains=("coulomb_friction",),
                assumed=[positive("stribeck_shape", 1.0, "1", sigma=0.5, low=0.25, high=4.0)],
            )
            for share in (0.03, 0.1, 0.3)
        ),
        *(
            in_drive(
                "presliding_friction",
                [positive("T_c", level, "N m"), positive("sigma_0", level / angle, "N m/rad", sigma=1.0)],
                fixed={"breakaway_ratio": 1.0, "sigma_1": 0.0},
                shape=f"{angle:g} rad of presliding",
                contains=("coulomb_friction",),
            )
            for angle in (0.01, 0.1, 0.5)
        ),
        in_drive(
            "asymmetric_friction",
            [signed("eps_c", 0.1, 0.5, "1"), signed("eps_B", 0.1, 0.3, "1")],
            spans=("eps_c", "eps_B"),
            needs=FRICTION,
        ),
        in_drive(
            "load_dependent_friction",
            [positive("c_drive", 0.1, "1", high=1.0), multiple("c_back", "c_drive", "1", sigma=0.5)],
        ),
        *(
            in_drive(
                "nonlinear_viscous",
                [positive("drag_torque", level * (100.0 / s.speed) ** power, "N m")],
                fixed={"drag_power": power},
                shape=f"power {power:.3g}",
            )
            for power in (2.0 / 3.0, 2.0, 3.0)
        ),
        *(
            in_drive(
                "position_dependent_friction",
                [signed("friction_ripple", 0.15, 0.5, "1", low=0.0, high=1.5), phase("psi")],
                fixed={"order": order},
                waves=("friction_ripple", "psi"),
                needs=FRICTION,
                shape=f"order {order:.4g}",
            )
            for order in _distinct([1.0, 2.0, 4.0, s.load_turn, 2.0 * s.load_turn, *s.lines], 5)
            if order * s.turns > 1.0
        ),
    ]
    if s.warm:
        found.append(in_drive("thermal_viscous", [signed("beta", 0.03, 0.05, "1/K")]))
    return found


def _load(s: Sizes) -> list[Candidate]:
    torque = s.output_effect
    found = [
        in_drive(
            "gravity_unbalance",
            [positive("T_gravity", torque, "N m"), phase("psi")],
            waves=("T_gravity", "psi"),
        ),
        *(
            in_drive(
                "external_periodic_torque",
                [positive("T_external", torque, "N m"), phase("psi")],
                fixed={"f_external": tone},
                waves=("T_external", "psi"),
                shape=f"{tone:.4g} Hz",
            )
            for tone in _distinct(s.tones, len(s.tones))
        ),
    ]
    if s.elastic:
        found.append(in_drive("load_side_friction", [positive("T_cl", torque, "N m")]))
    if s.elastic and s.load_side:
        found += [
            *(
                in_drive(
                    "load_compliance",
                    [
                        positive("K_c", s.stiffness * times, "N m/rad", high=STIFFEST * s.stiffness),
                        positive("payload_share", PAYLOAD, "1", sigma=0.1, ends=True),
                        positive("c_c", 10.0, "N m s/rad", high=MOST_DAMPED),
                    ],
                    stiffness=True,
                    shape=f"{times:g} times the gear's stiffness",
                )
                for times in (0.5, 2.0, 8.0)
            ),
            *(
                in_drive(
                    "base_compliance",
                    [positive("k_b", s.stiffness * times, "N m/rad", high=STIFFEST_BASE * s.stiffness)],
                    stiffness=True,
                    shape=f"{times:g} times the gear's stiffness",
                )
                for times in (3.0, 10.0)
            ),
        ]
    return found


def _actuator(s: Sizes) -> list[Candidate]:
    return [
        in_drive("actuator_lag", [positive("tau_e", 0.05 / s.corner, "s", sigma=1.5)]),
        in_drive("delay", [positive("tau_d", 0.05 / s.corner, "s", sigma=1.5)]),
        *(
            in_drive(
                "torque_ripple",
                [positive(name, size, "1" if name.startswith("r_") else "N m", sigma=1.5), phase(lag)],
                amplitude=name,
                fixed={
                    "pole_pairs": float(pairs),
                    **{other: 0.0 for other in ("r_2", "r_6", "tau_off") if other != name},
                },
                waves=(name, lag),
                shape=f"order {order * pairs}",
                order=float(order * pairs),
            )
            for pairs in (4, 5)
            for name, lag, order, size in (
                ("r_2", "psi_2", 2, 0.02),
                ("r_6", "psi_6", 6, 0.02),
                ("tau_off", "psi_1", 1, 0.02 * s.motor_torque),
            )
        ),
    ]


def _lines(s: Sizes) -> list[Candidate]:
    """Lines in the motor angle: kinematic error where it is seen, detent torque."""
    found = []
    relative = 1.0 - 1.0 / s.ratio
    expected = [s.load_turn, 2.0 * s.load_turn, relative, 2.0 * relative]
    expected += [float(order) for order in range(1, HIGHEST_INTEGER + 1)]
    wanted = [order for order in [*s.lines, *expected] if order * s.turns > 1.0 and _new(order, s.orders)]
    for order in _distinct(wanted, MOST_LINES):
        label = str(Fraction(order).limit_denominator(2000))
        size = 0.05 * s.windup if s.elastic else 2e-5
        found.append(
            Candidate(
                effect="te_harmonic",
                place="mesh",
                terms=(),
                orders=(label,),
                free=(
                    signed(f"te_cos_{label}", size, 20.0 * size, "rad"),
                    signed(f"te_sin_{label}", 0.0, 20.0 * size, "rad"),
                ),
                amplitude=f"te_cos_{label}",
                waves=(f"te_cos_{label}", f"te_sin_{label}"),
                shape=f"order {order:.4g}",
                order=order,
            )
        )
    size = 0.05 * s.motor_torque
    if s.detents is not None:
        free = [positive("T_cog_2", size, "N m"), phase("psi_2")]
        twice = in_drive("cogging", free, amplitude="T_cog_2", waves=("T_cog_2", "psi_2"), order=2.0 * s.detents)
        found.append(replace(twice, terms=(), fixed={}, shape=f"order {2.0 * s.detents:.4g} beside its own"))
    return found + [
        in_drive(
            "cogging",
            [positive("T_cog", size, "N m"), phase("psi_1")],
            fixed={"order": order, "T_cog_2": 0.0},
            waves=("T_cog", "psi_1"),
            shape=f"order {order:.4g}",
        )
        for order in _distinct(
            [*(line for line in s.lines if line > 0.9), *(() if s.load_side else (1.0, 2.0)), *SLOTS], MOST_DETENTS
        )
        if order * s.turns > 1.0
    ]


def _mesh(s: Sizes) -> list[Candidate]:
    torque = s.output_effect
    found = [
        *(
            in_drive(
                law,
                [positive("T_h", torque, "N m"), positive("phi_h", angle, "rad", sigma=0.7, low=SHARPEST)],
                shape=f"{shape} {angle:g} rad",
            )
            for law, shape in (("hysteresis", "over"), ("maxwell_slip", "slips at"))
            for angle in (5e-5, 2e-4, 8e-4)
        ),
        *(
            in_drive(
                "viscoelastic",
                [positive("K_v", 0.1 * s.stiffness, "N m/rad")],
                fixed={"tau_short": time, "tau_long": 100.0 * time},
                shape=f"{time:g} s",
            )
            for time in (0.03, 0.3)
        ),
        *_gaps(s),
        in_drive("soft_windup", [positive("delta_K", 0.3 * s.stiffness, "N m/rad", high=0.95 * s.stiffness)]),
        *(
            in_drive(
                "mesh_stiffness_variation",
                [positive(size, 0.05, "1", sigma=1.5, high=0.9), phase(lag)],
                amplitude=size,
                fixed={other: 0.0 for other in ("eps_2", "eps_o") if other != size},
                waves=(size, lag),
                shape=shape,
                order=order,
            )
            for size, lag, shape, order in (
                ("eps_2", "psi_2", "order 2", 2.0),
                ("eps_o", "psi_o", "once per load turn", s.load_turn),
            )
        ),
    ]
    if s.loaded:
        found += [
            in_drive(
                "te_load_dependence",
                [signed("A_cos", 3e-7, 3e-6, "rad/(N m)"), signed("A_sin", 0.0, 3e-6, "rad/(N m)")],
                fixed={"order": order},
                waves=("A_cos", "A_sin"),
                shape=f"order {order:.4g}",
            )
            for order in (1.0, 2.0)
        ]
    return found


def _gaps(s: Sizes) -> list[Candidate]:
    """Gaps in which drag alone holds the load, and those in which a weight that is too small to be seen does.

    Where little torque is carried, that weight decides on which side of the gap the load lies.
    """
    free = [
        in_drive("backlash", [positive("half_gap", gap, "rad")], shape=f"gap of {2.0 * gap:.3g} rad")
        for gap in (share * max(s.windup, 5e-6) for share in (0.02, 0.06, 0.2))
    ]
    most = s.output_effect
    weights = [
        in_drive("gravity_unbalance", [positive("T_gravity", share * most, "N m", high=most), phase("psi", angle)])
        for share in UNSEEN_WEIGHTS
        for angle in (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)
    ]
    return free + [_held(gap, weight) for gap in free for weight in weights]


def _held(gap: Candidate, weight: Candidate) -> Candidate:
    size, angle = weight.free
    return replace(
        gap,
        terms=gap.terms + weight.terms,
        free=gap.free + weight.free,
        fixed={**gap.fixed, **weight.fixed},
        unseen=tuple(weight.names),
        shape=f"{gap.shape}, held by {size.value:.3g} N m at {math.degrees(angle.value):.0f} deg",
    )


def _sensors(s: Sizes) -> list[Candidate]:
    """Effects of the sensors on each compared channel; on the motor angle alone they are motion."""
    time = 0.1 / s.corner
    found = []
    if s.load_side:
        every = ("motor_angle", *s.channels)
        found.append(in_every_sensor("sensor_lowpass", every, positive("tau_s", time, "s", sigma=1.5, high=SLOWEST)))
    for channel in s.channels:
        found += [
            in_sensor("sensor_delay", channel, [positive("tau_y", time, "s", sigma=1.5)]),
            in_sensor("sensor_lowpass", channel, [positive("tau_s", time, "s", sigma=1.5)]),
        ]
    if "load_angle" in s.channels:
        found += [
            in_sensor(
                "encoder_eccentricity",
                "load_angle",
                [positive("eccentricity", 2e-6, "m", sigma=1.5), phase("psi")],
                waves=("eccentricity", "psi"),
            ),
            in_sensor("clock_skew", "load_angle", [signed("skew", 5e-5, 2e-4, "1")]),
            in_sensor("ratio_error", "load_angle", [signed("ratio_error", 1e-4, 1e-3, "1")]),
            in_sensor("sensor_offset_drift", "load_angle", [signed("drift", 0.1 * s.windup, s.windup, "rad/s")]),
        ]
    for channel, spread in (("motor_torque", s.motor_torque), ("output_torque", s.output_torque)):
        if channel in s.channels:
            found.append(in_sensor("sensor_offset_drift", channel, [signed("drift", 0.01 * spread, spread, "N m/s")]))
    return found


def _distinct(values: Sequence[float], most: int) -> list[float]:
    """The first `most` values that differ by more than 0.5 %."""
    kept: list[float] = []
    for value in values:
        if _new(value, kept) and len(kept) < most:
            kept.append(value)
    return kept


def _new(value: float, known: Sequence[float]) -> bool:
    return all(abs(value - other) > 0.005 * other for other in known)
