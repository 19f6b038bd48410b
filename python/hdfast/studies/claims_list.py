"""The article's statements on the influence of one parameter, and where each could show."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Look:
    """A metric under a case and a load inertia [kg m^2]."""

    case: str
    metric: str
    load: float = 0.5


@dataclass(frozen=True)
class Claim:
    """A statement: raising the parameter over the article's range moves the metrics of `looks` by `sign`."""

    item: str
    study: str
    parameter: str
    text: str
    sign: str
    looks: tuple[Look, ...]
    reason: str = ""


def _looks(case: str, metric: str, *loads: float) -> tuple[Look, ...]:
    return tuple(Look(case, metric, load) for load in loads or (0.5,))


_START_F = tuple(Look(case, "mode_frequency_start", load) for case in "ab" for load in (0.5, 12.0))
_STOP_F = (*_looks("d0", "mode_frequency_stop", 0.5, 2.0), *_looks("e0", "brake_frequency", 0.5, 2.0))
_START_A = (*_looks("a", "mode_amplitude_start", 0.5, 12.0), *_looks("b", "mode_amplitude_start", 0.5, 12.0))
_STOP_A = (
    *_looks("d0", "mode_amplitude_stop", 0.5, 2.0),
    *_looks("d", "residual_ring", 2.0, 12.0),
    *_looks("e", "residual_ring", 0.5, 2.0),
    *_looks("e", "spring_torque", 0.5, 2.0),
)


def _one(looks: tuple[Look, ...]) -> tuple[Look, ...]:
    """The same with the default load inertia, for a study of the load inertia itself."""
    return tuple(dict.fromkeys(Look(look.case, look.metric) for look in looks))


CLAIMS = (
    Claim(
        "S13 start f",
        "load-inertia",
        "J_l",
        "J_l up: frequency at start falls",
        "down",
        _one(_START_F),
        "two inertias on a spring: f falls as either grows",
    ),
    Claim(
        "S13 start A",
        "load-inertia",
        "J_l",
        "J_l up: amplitude at start falls",
        "down",
        _one(_START_A),
        "holds for a released error; a torque step raises A until J_l = J_M/2",
    ),
    Claim(
        "S13 stop f",
        "load-inertia",
        "J_l",
        "J_l up: frequency at stop falls",
        "down",
        _one(_STOP_F),
        "f falls with the load inertia, coasting or held by the controller",
    ),
    Claim(
        "S13 stop A",
        "load-inertia",
        "J_l",
        "J_l up: amplitude at stop rises",
        "up",
        _one(_STOP_A),
        "start and stop need different excitations; the abstract's fall means the start",
    ),
    Claim(
        "S14 start f",
        "motor-inertia",
        "J_m",
        "J_m up: frequency at start falls",
        "down",
        _START_F,
        "the conclusion calls it unchanged: the fall is 6 % at J_l 0.5 and 30 % at 12",
    ),
    Claim(
        "S14 start A",
        "motor-inertia",
        "J_m",
        "J_m up: amplitude at start rises",
        "up",
        _START_A,
        "holds for a released error, and for a torque step only if J_M < J_l/2",
    ),
    Claim(
        "S14 stop f",
        "motor-inertia",
        "J_m",
        "J_m up: frequency at stop rises",
        "up",
        _STOP_F,
        "impossible in a free coast; a motor still under speed control shows it for J_l from 1 to 5",
    ),
    Claim(
        "S14 stop A",
        "motor-inertia",
        "J_m",
        "J_m up: amplitude at stop rises",
        "up",
        _STOP_A,
        "what rings after a fixed delay grows, as coast and mode decay more slowly; at the event itself A falls",
    ),
    Claim(
        "S15 start f",
        "stiffness",
        "K",
        "K up: frequency at start rises",
        "up",
        _START_F,
        "f goes with the root of K",
    ),
    Claim(
        "S15 start A",
        "stiffness",
        "K",
        "K up: amplitude at start rises",
        "up",
        _START_A,
        "A goes with the root of K for a given windup, with its inverse for a given torque",
    ),
    Claim(
        "S15 stop f",
        "stiffness",
        "K",
        "K up: frequency at stop rises",
        "up",
        _STOP_F,
        "f goes with the root of K, coasting or held by the controller",
    ),
    Claim(
        "S15 stop A",
        "stiffness",
        "K",
        "K up: amplitude at stop rises",
        "up",
        _STOP_A,
        "only the spring torque of a brake with a large load inertia can rise",
    ),
    Claim(
        "S16 text",
        "damping",
        "B_sp",
        "B_sp up: amplitude rises (text of the section)",
        "up",
        (*_looks("c", "speed_ripple", 0.5, 2.0, 12.0), *_looks("d", "residual_ring", 2.0, 12.0)),
        "the opposite sign appears only for lines above 1.4 times the locked frequency",
    ),
    Claim(
        "S16 abstract",
        "damping",
        "B_sp",
        "B_sp up: amplitude falls (abstract, conclusion)",
        "down",
        (*_looks("c", "speed_ripple", 0.5, 2.0, 12.0), *_looks("d", "residual_ring", 2.0, 12.0)),
        "falls near resonance and in the ring once it outlasts the tail of the coast",
    ),
    Claim(
        "S16 f",
        "damping",
        "B_sp",
        "B_sp up: frequency rises",
        "up",
        _looks("a", "mode_frequency_start", 0.5, 12.0),
        "it falls by half a percent over the sweep",
    ),
    Claim(
        "S17 start A",
        "damping",
        "B_ml",
        "B_ml up: amplitude at start falls",
        "down",
        _START_A,
        "at held set speed the starting torque grows with B_ml; the mode itself hardly sees B_ml",
    ),
    Claim(
        "S17 stop A",
        "damping",
        "B_ml",
        "B_ml up: amplitude at stop falls",
        "down",
        _looks("d", "residual_ring", 2.0, 12.0),
        "the coast is shorter, so that less is left after a fixed delay",
    ),
    Claim(
        "S17 f",
        "damping",
        "B_ml",
        "B_ml up: frequency constant",
        "const",
        _START_F,
        "B_ml is almost invisible in the mode unless J_l is several times J_M",
    ),
    Claim(
        "S17 energy",
        "damping",
        "B_ml",
        "B_ml up: more energy used",
        "up",
        _looks("d", "energy_lost", 0.5, 2.0),
        "at held set speed the motor supplies what the damper takes",
    ),
    Claim(
        "S17 kept torque",
        "damping",
        "B_ml",
        "B_ml up at constant torque: amplitude falls",
        "down",
        (*_looks("t", "steady_speed"), *_looks("t", "speed_ripple", 0.5)),
        "an open-loop sweep lowers the speed, and the lines of the kinematic error with it",
    ),
    Claim(
        "S18 mode",
        "damping",
        "B_m",
        "B_m has little effect: frequency and decay of the mode",
        "const",
        (*_looks("a", "mode_frequency_start"), *_looks("a", "mode_decay_start")),
        "B_m has less than a percent of the decay at the default load inertia",
    ),
    Claim(
        "S18 rise time",
        "damping",
        "B_m",
        "B_m has little effect: start and stop times",
        "const",
        (*_looks("d", "rise_time"), *_looks("d", "stop_time")),
        "true for the mode, false for start and stop times",
    ),
    Claim(
        "S18 mode, B_l",
        "damping",
        "B_l",
        "B_l has little effect on the mode",
        "const",
        _looks("a", "mode_frequency_start"),
        "B_l has two percent of the decay and none of the frequency",
    ),
    Claim(
        "S19 start A",
        "transmission-error",
        "te_scale",
        "transmission error up: amplitude at start rises",
        "up",
        _looks("b", "mode_amplitude_start", 0.5, 12.0),
        "a released error is the windup that is let go",
    ),
    Claim(
        "S19 run A",
        "transmission-error",
        "te_scale",
        "transmission error up: amplitude in the run rises",
        "up",
        (*_looks("c", "speed_ripple", 0.5, 2.0, 12.0), *_looks("c", "te_pp", 0.5, 12.0)),
        "the lines are proportional to the error",
    ),
    Claim(
        "S19 stop A",
        "transmission-error",
        "te_scale",
        "transmission error up: amplitude at stop rises",
        "up",
        (*_looks("d", "residual_ring", 0.5, 2.0, 12.0), *_looks("e", "residual_ring", 0.5, 2.0)),
        "the ring of a stop comes from the torque that is taken away; only lines that pass the mode add to it",
    ),
    Claim(
        "S19 f",
        "transmission-error",
        "te_scale",
        "transmission error up: frequency constant",
        "const",
        _looks("b", "mode_frequency_start", 0.5, 12.0),
        "over the windup of an error the spring is almost linear",
    ),
    Claim(
        "S11 start A",
        "speed",
        "speed_rpm",
        "speed up: amplitude at start rises",
        "up",
        _looks("a", "mode_amplitude_start", 0.5, 12.0),
        "the torque that sustains a speed is proportional to it",
    ),
    Claim(
        "S11 start A, released",
        "speed",
        "speed_rpm",
        "speed up: amplitude of a released error rises",
        "up",
        _looks("b", "mode_amplitude_start", 0.5),
        "a released error does not know the speed",
    ),
    Claim(
        "S11 f",
        "speed",
        "speed_rpm",
        "speed up: frequency of the mode constant",
        "const",
        _looks("a", "mode_frequency_start", 0.5, 12.0),
        "the spring stiffens with the step: by two percent at 12 kg m², less at smaller load inertias",
    ),
    Claim(
        "S11 run A",
        "speed",
        "speed_rpm",
        "speed up: amplitude in the run rises",
        "up",
        _looks("c", "speed_ripple", 0.5, 2.0, 12.0),
        "ripple follows speed times the gain at each order: peaks where an order crosses the mode",
    ),
    Claim(
        "S11 stop A",
        "speed",
        "speed_rpm",
        "speed up: amplitude at stop rises",
        "up",
        (*_looks("d0", "mode_amplitude_stop", 0.5, 2.0), *_looks("d", "residual_ring", 0.5, 2.0, 12.0)),
        "the torque taken away grows; at 12 kg m² lines that pass the mode while coasting add to the ring or cancel it",
    ),
)
